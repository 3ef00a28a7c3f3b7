"""Feed studies and mesh files that are spoiled: ``python tests/fuzz/fuzz.py [INPUTS] [SEED]``.

Each input is refused with a message, or accepted and then right: no traceback, no crash, no 10 s, no 1 GB.
The same seed and number make the same input again.
"""

import contextlib
import faulthandler
import os
import resource
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from random import Random

import targets
from targets import TARGETS, Refused

from springtune.problem.geometry import AssumptionWarning

SECONDS, BYTES = 10, 1_000_000_000
"""Of the processor and of memory, for one input."""

BATCH = 100
"""Inputs of a process."""


def feed(name, numbers, seed, folder):
    """Outcomes of some inputs of a target, counted, and faults; the file of its first number names the one at work."""
    faulthandler.disable()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # meshio says what it leaves out
    make, read, _ = TARGETS[name]
    outcomes, faults = Counter(), []
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 2 * BYTES, resource.RLIM_INFINITY))
    for number in numbers:
        Path(folder, f"{name} {numbers[0]}").write_text(str(number))
        with tempfile.TemporaryDirectory() as here:
            made = make(Random(f"{name} {seed} {number}"), Path(here))
            begin = time.process_time()
            resource.setrlimit(resource.RLIMIT_CPU, (int(begin) + SECONDS + 2, resource.RLIM_INFINITY))
            outcome, fault = judge(read, made)
        outcomes[outcome] += 1
        seconds = time.process_time() - begin
        fault = fault or (f"takes {seconds:.0f} s" if seconds > SECONDS else "")
        if fault:
            faults.append(f"{name}, input {number} of seed {seed}: {fault}")
    return outcomes, faults


def judge(read, made):
    """What becomes of an input, and what is wrong with that."""
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(None):
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", AssumptionWarning)  # words for people, not a fault
            read(made)
    except Refused as error:
        message = str(error)
        helps = 20 <= len(message) <= 4000 and "Traceback" not in message
        return "refused", "" if helps else f"is refused by a message that helps nobody: {message[:300]!r}"
    except BaseException:
        return "broken", traceback.format_exc(limit=-4)
    return "accepted", ""


def run(names, inputs, seed, processes=2):
    """Counted outcomes of targets, by their shares of a hundred inputs, and the faults."""
    outcomes, faults = {name: Counter() for name in names}, []
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            numbers = range(-(-inputs * TARGETS[name][2] // 100))
            batches = [numbers[first : first + BATCH] for first in range(0, len(numbers), BATCH)]
            with ProcessPoolExecutor(processes, get_context("fork")) as pool:
                done = [pool.submit(feed, name, batch, seed, folder) for batch in batches]
                for batch, future in zip(batches, done):
                    try:
                        counted, found = future.result()
                        outcomes[name] += counted
                        faults += found
                    except BrokenProcessPool:  # one of these
                        at = Path(folder, f"{name} {batch[0]}")
                        faults.append(f"{name}, input {at.read_text() if at.exists() else '?'} of seed {seed}: dies")
    return outcomes, faults


def main(inputs=20_000, seed=1):
    targets.load()
    outcomes, faults = run(list(TARGETS), int(inputs), int(seed))
    for name, counted in outcomes.items():
        print(f"{name}: " + ", ".join(f"{count} {word}" for word, count in sorted(counted.items())))
    print(*faults, f"{sum(map(Counter.total, outcomes.values()))} inputs, seed {seed}; {len(faults)} faults", sep="\n")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
