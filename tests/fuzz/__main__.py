"""Feed all targets: ``python tests/fuzz [INPUTS] [SEED]``."""

import os
import sys
import time
from contextlib import redirect_stderr, redirect_stdout
from multiprocessing import get_context

import harness  # noqa: E402
import targets  # noqa: E402

INPUTS, PROCESSES = 20_000, 2


def _part(task):
    number, numbers, seed = task
    return number, harness.run(targets.TARGETS[number], numbers, seed)


def main():
    inputs = int(sys.argv[1]) if len(sys.argv) > 1 else INPUTS
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    with (
        open(os.devnull, "w") as quiet,
        redirect_stdout(quiet),
        redirect_stderr(quiet),
    ):  # meshio warns of what it leaves out
        targets.warm_up()
    begin, tasks = time.monotonic(), []
    for number, target in enumerate(targets.TARGETS):
        count = -(-inputs * target.share // 100)
        firsts = range(0, count, harness.BATCH)
        tasks += [(number, range(first, min(first + harness.BATCH, count)), seed) for first in firsts]
    found = [harness.Found() for _ in targets.TARGETS]
    with get_context("fork").Pool(PROCESSES) as pool:
        for number, part in pool.imap_unordered(_part, tasks):
            one = found[number]
            one.outcomes += part.outcomes
            one.faults += part.faults
            one.seconds += part.seconds
            one.slowest, one.largest = max(one.slowest, part.slowest), max(one.largest, part.largest)
    faults = 0
    for target, one in zip(targets.TARGETS, found):
        print(one.line(target.name))
        for number, message in sorted(one.faults):
            print(f"  input {number} of seed {seed}: {message}")
        faults += len(one.faults)
    total = sum(sum(one.outcomes.values()) for one in found)
    print(f"{total} inputs, seed {seed}, {time.monotonic() - begin:.0f} s; {faults} faults")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
