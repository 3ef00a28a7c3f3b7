"""The harness itself: what it is to find, it finds."""

import os
import signal
import time

import harness
import pytest
from harness import Refused, Target, Wrong, run


def allocate():
    return len(bytearray(3 * harness.MOST_BYTES))


def spin():
    while True:
        pass


def refuse():
    raise Refused("x.yaml:3: beams: no length; give one such as '200 mm'")


def refuse_badly():
    raise Refused("no")


def lie():
    raise Wrong("is accepted, and has E = 2 for 1")


READS = {
    "good": (lambda: "accepted", ""),
    "refused": (refuse, ""),
    "refused by no message": (refuse_badly, "a message that helps nobody: 'no'"),
    "wrong": (lie, "is accepted, and has E = 2 for 1"),
    "traceback": (lambda: 1 / 0, "ZeroDivisionError"),
    "exit": (lambda: exit(3), "SystemExit: 3"),
    "killed": (lambda: os.kill(os.getpid(), signal.SIGSEGV), "ends the program by SIGSEGV"),
    "memory": (allocate, "MemoryError"),
    "endless": (spin, "takes more than"),
}


@pytest.mark.parametrize("name", READS)
def test_what_is_wrong_is_told_with_the_number_of_its_input(name, monkeypatch):
    monkeypatch.setattr(harness, "MOST_SECONDS", 0)
    monkeypatch.setattr(harness, "SLACK", 1)
    read, fault = READS[name]
    target = Target(name, lambda random, folder: random.random(), lambda made: read() if made < 0.12 else "accepted", 1)
    found = run(target, range(20), seed=1)
    assert sum(found.outcomes.values()) == 20
    # The processor's seconds have no bound here, but for the one that has no end.
    faults = [(number, message) for number, message in found.faults if "s and" not in message]
    assert bool(faults) == bool(fault) and all(fault in message for _, message in faults)


def test_an_input_depends_on_its_number_and_the_seed_alone(tmp_path):
    def made(numbers, seed):
        path = tmp_path / "made"
        target = Target("t", lambda random, folder: random.random(), lambda one: str(path.write_text(repr(one))), 1)
        run(target, numbers, seed)
        return path.read_text()

    assert made((3, 4), 1) == made((4,), 1) != made((4,), 2)


def test_seconds_are_those_of_the_processor():
    target = Target("t", lambda random, folder: None, lambda one: time.sleep(0.3) or "slept", 1)
    assert run(target, range(1), 1).slowest < 0.3
