"""Display of a run: a line that moves on a terminal, elsewhere a line for each stage."""

import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from springtune.studies.runs.workload import clock as clock_text

if TYPE_CHECKING:
    from springtune.studies.runs.workload import Estimate

LOOKED_AT = 200
"""Most expected files checked at a time."""

PRIOR = 5.0
"""Weight of the expectation [s], so that first jobs change it little."""

OVERDUE = 0.2
"""Share of its run time that an overdue job is expected to need still."""

PAUSE = 0.5
"""Time between two pictures of the line that moves [s]."""

LINE = "\r\x1b[?7l{}\x1b[K\x1b[?7h"
"""Writes over the line of the cursor; the terminal cuts what is too long."""


class Job:
    """A job and its progress."""

    def __init__(self, estimate: "Estimate", clock: Callable[[], float]) -> None:
        self.estimate, self.clock = estimate, clock
        self.begun = self.ended = 0.0
        self.failed = False
        self.waiting = list(estimate.products)
        self.before = 0.0

    def start(self) -> None:
        """Mark as running."""
        self.begun, self.before = self.clock(), time.time()
        # It may be run again after it failed.
        self.ended, self.failed, self.waiting = 0.0, False, list(self.estimate.products)

    def end(self, failed: bool = False) -> None:
        """Mark as done or failed."""
        self.ended, self.failed = self.clock(), failed

    def made(self) -> float:
        """Share of its files made since it started."""
        if self.ended:
            return 0.0 if self.failed else 1.0
        if not self.begun or not self.estimate.products:
            return 0.0
        late = self.waiting[LOOKED_AT:]
        self.waiting = [path for path in self.waiting[:LOOKED_AT] if not _newer(path, self.before)] + late
        return 1 - len(self.waiting) / len(self.estimate.products)

    def left(self, pace: float) -> float:
        """Remaining seconds at a pace of so many for each expected one."""
        if self.ended:
            return 0.0
        expected = pace * self.estimate.seconds
        if not self.begun:
            return expected
        gone = self.clock() - self.begun
        made = self.made()
        rest = max(expected - gone, OVERDUE * gone)
        # The more it has made, the more that says, and the less what was expected.
        return (1 - made) * rest + gone * (1 - made) if made else rest


def _newer(path: Path, than: float) -> bool:
    try:
        return path.stat().st_mtime >= than
    except OSError:
        return False


class Display:
    """Display of a run until `stop`; `slowdown` is how much longer jobs are expected to take than on idle cores."""

    def __init__(
        self,
        estimates: "Mapping[int, Estimate]",
        cores: int,
        stream: TextIO,
        moves: bool,
        slowdown: float = 1.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.jobs = {number: Job(estimate, clock) for number, estimate in estimates.items()}
        self.stages: dict[str, list[Job]] = {}
        for job in self.jobs.values():
            self.stages.setdefault(job.estimate.part, []).append(job)
        self.cores, self.stream, self.moves, self.slowdown, self.clock = cores, stream, moves, slowdown, clock
        self.begun, self.over, self.writing = clock(), threading.Event(), threading.Lock()
        if moves:
            threading.Thread(target=self._move, daemon=True).start()

    def begin(self, number: int) -> None:
        """Mark a job as started."""
        if number in self.jobs:
            self.jobs[number].start()

    def finish(self, number: int) -> None:
        """Mark a job as done; elsewhere than on a terminal, write a line when its stage is."""
        job = self.jobs.get(number)
        if job is None:
            return
        job.end()
        stage = job.estimate.part
        if not self.moves and all(one.ended and not one.failed for one in self.stages[stage]):
            rest = f"; about {clock_text(self.left())} left" if self.left() else ""
            self._write(f"{self._stage_line(self.stages.pop(stage), stage)}{rest}\n")

    def fail(self, number: int) -> None:
        """Mark a job as failed."""
        if number in self.jobs:
            self.jobs[number].end(failed=True)

    def tell(self, write: Callable[[], None]) -> None:
        """Write something else, above the line that moves."""
        with self.writing:
            if self.moves:
                self.stream.write(LINE.format(""))
            write()

    def stop(self) -> None:
        """Stop, and remove the line that moves or tell the stages that are not complete."""
        self.over.set()
        if self.moves:
            self._write(LINE.format(""))
            return
        for stage, jobs in self.stages.items():
            if any(job.begun for job in jobs):
                self._write(f"{self._stage_line(jobs, stage)}\n")

    def left(self) -> float:
        """Estimate the run's remaining seconds from finished jobs."""
        now = self.clock()
        took = [
            (job.estimate.seconds, (job.ended or now) - job.begun, bool(job.ended))
            for job in self.jobs.values()
            if job.begun and not job.failed
        ]
        # A job that runs tells something, too, once it takes longer than expected.
        told = [(expected, gone) for expected, gone, over in took if over or gone > expected]
        pace = (sum(gone for _, gone in told) + PRIOR * self.slowdown) / (sum(expected for expected, _ in told) + PRIOR)
        rest = [(job.left(pace), min(job.estimate.threads, self.cores)) for job in self.jobs.values()]
        shared = sum(seconds * threads for seconds, threads in rest) / self.cores
        return max([shared, *(seconds for seconds, _ in rest)])

    def line(self) -> str:
        """Jobs done, times gone by and left, and the tasks done of stages that run."""
        done = sum(bool(job.ended) and not job.failed for job in self.jobs.values())
        failed = sum(job.failed for job in self.jobs.values())
        running = [
            f"{stage} {sum(int(job.estimate.tasks * job.made()) for job in jobs)}/"
            f"{sum(job.estimate.tasks for job in jobs)}"
            for stage, jobs in self.stages.items()
            if any(job.begun and not job.ended for job in jobs)
        ]
        gone, left = clock_text(self.clock() - self.begun), clock_text(self.left())
        head = f"{done} of {len(self.jobs)} jobs{f', {failed} failed' if failed else ''}, {gone}, about {left} left"
        return ": ".join(filter(None, (head, ", ".join(running))))

    def _stage_line(self, jobs: list[Job], stage: str) -> str:
        done, failed = sum(bool(job.ended) and not job.failed for job in jobs), sum(job.failed for job in jobs)
        many = f"{done} of {len(jobs)} jobs" if done < len(jobs) else f"{done} job{'' if done == 1 else 's'}"
        begun, ended = min(job.begun for job in jobs if job.begun), max(job.ended for job in jobs)
        took = f", {ended - begun:.1f} s" if ended else ""
        return f"{stage}: {many} done{f', {failed} failed' if failed else ''}{took}"

    def _move(self) -> None:
        while not self.over.is_set():
            self._write(LINE.format(self.line()))
            self.over.wait(PAUSE)

    def _write(self, text: str) -> None:
        with self.writing:
            self.stream.write(text)
            self.stream.flush()
