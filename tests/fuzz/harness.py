"""Inputs by the thousand, each read in a process of its own kind: within limits, and never with a traceback.

A target makes the input of a number and reads it. What it reads is refused with a message, or accepted and then judged:
a `Wrong` is a number that an accepted input should not have given. A worker process reads one input after the other and
tells what became of each; where it dies, that input is to blame and another worker takes up with the next one. Seconds
are those of the processor and bytes those of the process, so that a busy machine decides nothing.
"""

import faulthandler
import os
import pickle
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from os import _exit as leave
from pathlib import Path

from springtune.problem.geometry import AssumptionWarning

MOST_SECONDS = 10
"""Of the processor, for one input."""

SLACK = 2
"""Seconds besides, after which a process is ended that does not come to an end by itself."""

MOST_BYTES = 1_000_000_000
"""Of memory, for one input: what the process has, imports and all."""

BATCH = 400
"""Inputs of a worker: what one of them leaves behind shall not be in the way of all others."""


class Refused(Exception):
    """An input that is refused, with the message that its user reads."""


class Wrong(Exception):
    """An input that is accepted and gives a wrong number."""


@dataclass(frozen=True)
class Target:
    """What is fed.

    Attributes
    ----------
    name : str
    make : callable
        (random number generator, folder) -> path of the input, or what `read` takes besides.
    read : callable
        Reads it: raises `Refused`, or `Wrong`, or returns what became of it in a word.
    share : int
        Inputs of a hundred that are this target's.
    """

    name: str
    make: Callable[[random.Random, Path], object]
    read: Callable[[object], str]
    share: int


@dataclass
class Found:
    """What became of the inputs of a target."""

    outcomes: Counter = field(default_factory=Counter)
    faults: list[tuple[int, str]] = field(default_factory=list)
    seconds: float = 0.0
    slowest: float = 0.0
    largest: int = 0

    def line(self, name):
        told = ", ".join(f"{count} {word}" for word, count in sorted(self.outcomes.items()))
        return (
            f"{name}: {sum(self.outcomes.values())} inputs: {told}; {self.seconds:.0f} s in all, at most "
            f"{self.slowest:.2f} s and {self.largest / 1e6:.0f} MB for one"
        )


def run(target, numbers, seed):
    """Feed a target the inputs of some numbers; the same seed and number make the same input.

    Parameters
    ----------
    target : Target
    numbers : sequence of int
    seed : int

    Returns
    -------
    Found
    """
    found, numbers = Found(), list(numbers)
    while numbers:
        told, died = _batch(target, numbers[:BATCH], seed)
        for number, outcome, message, seconds, peak in told:
            found.outcomes[outcome] += 1
            found.seconds += seconds
            found.slowest, found.largest = max(found.slowest, seconds), max(found.largest, peak)
            if outcome == "broken":
                found.faults.append((number, message))
            if seconds > MOST_SECONDS or peak > MOST_BYTES:
                found.faults.append((number, f"takes {seconds:.1f} s and {peak / 1e6:.0f} MB"))
        numbers = numbers[len(told) :]
        if died:
            found.outcomes["died"] += 1
            found.faults.append((numbers[0], died))
            numbers = numbers[1:]
    return found


def _batch(target, numbers, seed):
    """What became of inputs until all are read or the worker died, and how it died."""
    reading, writing = os.pipe()
    # Nothing of this process is to be written twice.
    sys.stdout.flush()
    sys.stderr.flush()
    child = os.fork()
    if not child:
        os.close(reading)
        try:
            _work(target, numbers, seed, writing)
        except BaseException:
            traceback.print_exc()
            leave(1)
        leave(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        told = []
        while True:
            try:
                told.append(pickle.load(pipe))
            except EOFError:
                break
    status = os.waitpid(child, 0)[1]
    if not status and len(told) == len(numbers):
        return told, ""
    if not os.WIFSIGNALED(status):
        return told, f"ends the program with {os.waitstatus_to_exitcode(status)}"
    name = signal.Signals(os.WTERMSIG(status)).name
    return told, f"takes more than {MOST_SECONDS} s" if name == "SIGXCPU" else f"ends the program by {name}"


def _work(target, numbers, seed, writing):
    """Read inputs in this process, which is at its end then."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    faulthandler.disable()
    said = tempfile.TemporaryFile()  # what libraries write past Python, and Python past us
    os.dup2(said.fileno(), 2)
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (_address_space() + 2 * MOST_BYTES, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (2 * MOST_BYTES, resource.RLIM_INFINITY))
    with os.fdopen(writing, "wb") as pipe, tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        for number in numbers:
            os.chdir("/")
            # In a folder of its own: what a library has not closed is not to be in the way.
            here = Path(folder) / str(number)
            here.mkdir()
            made = target.make(random.Random(f"{target.name} {seed} {number}"), here)
            _forget_peak()
            begin = time.process_time()
            _, most = resource.getrlimit(resource.RLIMIT_CPU)
            resource.setrlimit(resource.RLIMIT_CPU, (int(begin) + MOST_SECONDS + SLACK, most))
            said.truncate(0)
            outcome, message = _read(target, made)
            text = os.pread(said.fileno(), 2000, 0)
            if outcome != "broken" and b"Traceback" in text:
                outcome, message = "broken", f"writes past us: {text.decode(errors='replace')}"
            pickle.dump((number, outcome, message, time.process_time() - begin, _peak()), pipe)
            pipe.flush()
            shutil.rmtree(here)


def _read(target, made):
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", AssumptionWarning)  # words for people, not a fault
            return target.read(made), ""
    except Refused as error:
        message = str(error)
        if len(message) < 20 or "Traceback" in message or len(message) > 4000:
            return "broken", f"is refused by a message that helps nobody: {message[:300]!r}"
        return "refused", ""
    except Wrong as error:
        return "broken", str(error)
    except BaseException:
        return "broken", traceback.format_exc(limit=-4)


def _status(key):
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * int(next(line for line in lines if line.startswith(f"{key}:")).split()[1])


def _address_space():
    return _status("VmSize")


def _peak():
    """Most memory that the process has had since `_forget_peak` [B]."""
    return _status("VmHWM")


def _forget_peak():
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        pass  # then the peak is that of all inputs so far
