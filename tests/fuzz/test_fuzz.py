"""The short form of the fuzzing of `make slow`, and what it would find."""

import os
import signal

import fuzz
import pytest


def test_no_input_ends_in_a_traceback_or_in_a_wrong_number(capsys):
    assert fuzz.main(80, 7) == 0, capsys.readouterr().out


READS = {
    "ZeroDivisionError": lambda made: 1 / 0,
    "SystemExit: 3": lambda made: exit(3),
    "MemoryError": lambda made: bytearray(4 * fuzz.BYTES),
    "dies": lambda made: os.kill(os.getpid(), signal.SIGKILL),
}


@pytest.mark.parametrize("fault", READS)
def test_what_is_wrong_is_told_with_the_number_of_its_input(monkeypatch, fault):
    target = (lambda random, folder: random.random()), (lambda made: made < 0.9 or READS[fault](made)), 100
    monkeypatch.setitem(fuzz.TARGETS, "target", target)
    _, faults = fuzz.run(["target"], 30, 1, processes=1)
    assert faults and all("target, input " in one and fault in one for one in faults)
