"""Display of a run: a line that moves on a terminal, elsewhere a line for each stage."""

import threading
import time
from collections.abc import Callable, Mapping
from typing import TextIO

from snakemake_interface_logger_plugins.common import LogEvent

from springtune.studies.runs.workload import clock as clock_text

PAUSE = 0.5
"""Time between two pictures of the line that moves [s]."""

LINE = "\r\x1b[?7l{}\x1b[K\x1b[?7h"
"""Writes over the line of the cursor; the terminal cuts what is too long."""


class Display:
    """Display of a run until `stop`; `work` has the stage and the number of results of each job."""

    def __init__(
        self,
        work: Mapping[int, tuple[str, int]],
        stream: TextIO,
        moves: bool,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.work, self.stream, self.moves, self.clock = work, stream, moves, clock
        self.begun, self.over, self.writing = clock(), threading.Event(), threading.Lock()
        events = LogEvent.JOB_INFO, LogEvent.JOB_FINISHED, LogEvent.JOB_ERROR
        self.jobs = {event: set[int]() for event in events}
        if moves:
            threading.Thread(target=self._move, daemon=True).start()

    def follow(self, event: LogEvent, number: int) -> None:
        """Note what became of a job; elsewhere than on a terminal, write a line when its stage is done."""
        for what, jobs in self.jobs.items():
            (jobs.add if what == event else jobs.discard)(number)
        if event == LogEvent.JOB_FINISHED and not self.moves and number in self.work:
            stage = [other for other, work in self.work.items() if work[0] == self.work[number][0]]
            if self.jobs[event].issuperset(stage):
                self._write(f"{self.work[number][0]}: done; {self.line()}\n")

    def tell(self, write: Callable[[], None]) -> None:
        """Write something else, above the line that moves."""
        with self.writing:
            if self.moves:
                self.stream.write(LINE.format(""))
            write()

    def stop(self) -> None:
        """Stop, and remove the line that moves."""
        self.over.set()
        if self.moves:
            self._write(LINE.format(""))

    def line(self) -> str:
        """Jobs done, times gone by and left at the rate so far, and the stages that run."""
        gone = self.clock() - self.begun
        running, done, failed = self.jobs.values()
        results = sum(count for _, count in self.work.values())
        made = sum(self.work[number][1] for number in done if number in self.work)
        left = f", about {clock_text(gone * (results - made) / made)} left" if 0 < made < results else ""
        lost = f", {len(failed)} failed" if failed else ""
        stages = dict.fromkeys(self.work[number][0] for number in sorted(running) if number in self.work)
        head = f"{len(done)} of {len(self.work)} jobs{lost}, {clock_text(gone)}{left}"
        return ": ".join(filter(None, (head, ", ".join(stages) if self.moves else "")))

    def _move(self) -> None:
        while not self.over.is_set():
            self._write(LINE.format(self.line()))
            self.over.wait(PAUSE)

    def _write(self, text: str) -> None:
        with self.writing:
            self.stream.write(text)
            self.stream.flush()
