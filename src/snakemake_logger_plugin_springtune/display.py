"""Terminal display of stages: finished tasks, elapsed and remaining time."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from springtune.studies.runs.workload import Estimate

LOOKED_AT = 200
"""Most expected files checked at a time."""

PRIOR = 5.0
"""Weight of the expectation [s], so that first jobs change it little."""

OVERDUE = 0.2
"""Share of its run time that an overdue job is expected to need still."""


class Job:
    """A job and its progress."""

    def __init__(self, estimate: "Estimate") -> None:
        self.estimate = estimate
        self.begun = self.ended = 0.0
        self.failed = False
        self.waiting = list(estimate.products)
        self.before = 0.0

    def start(self) -> None:
        """Mark as running."""
        self.begun, self.before = time.monotonic(), time.time()
        # It may be run again after it failed.
        self.ended, self.failed, self.waiting = 0.0, False, list(self.estimate.products)

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
        gone = time.monotonic() - self.begun
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
    """Display of a run until `stop`."""

    def __init__(
        self,
        estimates: "Mapping[int, Estimate]",
        cores: int,
        title: str,
        colourless: bool = False,
        console: Console | None = None,
    ) -> None:
        self.jobs = {number: Job(estimate) for number, estimate in estimates.items()}
        self.cores, self.begun, self.over = cores, time.monotonic(), False
        self.console = console or Console(stderr=True, no_color=colourless, highlight=False)
        self.console.print(Text(title, "bold"))
        self.live = Live(
            console=self.console,
            get_renderable=self.picture,
            refresh_per_second=2,
            redirect_stdout=False,
            redirect_stderr=False,
        )
        self.live.start()

    def begin(self, number: int) -> None:
        """Mark a job as started."""
        if number in self.jobs:
            self.jobs[number].start()

    def finish(self, number: int) -> None:
        """Mark a job as done."""
        if number in self.jobs:
            self.jobs[number].ended = time.monotonic()
            self.jobs[number].failed = False

    def fail(self, number: int) -> None:
        """Mark a job as failed."""
        if number in self.jobs:
            self.jobs[number].ended, self.jobs[number].failed = time.monotonic(), True

    def tell(self, text: str, style: str = "") -> None:
        """Print above the display."""
        self.console.print(Text(text, style), soft_wrap=True)

    def stop(self) -> None:
        """Stop and leave the last picture."""
        self.over = True
        self.live.stop()

    def left(self) -> float:
        """Estimate the run's remaining seconds from finished jobs."""
        now = time.monotonic()
        took = [
            (job.estimate.seconds, (job.ended or now) - job.begun, bool(job.ended))
            for job in self.jobs.values()
            if job.begun and not job.failed
        ]
        # A job that runs tells something, too, once it takes longer than expected.
        told = [(expected, gone) for expected, gone, over in took if over or gone > expected]
        pace = (sum(gone for _, gone in told) + PRIOR) / (sum(expected for expected, _ in told) + PRIOR)
        rest = [(job.left(pace), min(job.estimate.threads, self.cores)) for job in self.jobs.values()]
        shared = sum(seconds * threads for seconds, threads in rest) / self.cores
        return max([shared, *(seconds for seconds, _ in rest)])

    def picture(self) -> Table:
        """Table with one row for each stage and one for the run."""
        table = Table.grid(padding=(0, 2))
        table.add_column(no_wrap=True)
        table.add_column()
        table.add_column(justify="right", no_wrap=True)
        table.add_column(no_wrap=True)
        parts: dict[str, list[Job]] = {}
        for job in self.jobs.values():
            parts.setdefault(job.estimate.part, []).append(job)
        for part, jobs in parts.items():
            table.add_row(*self._row(part, jobs))
        gone, left = time.monotonic() - self.begun, self.left()
        table.add_row(
            Text(f"{_clock(gone)} gone by" if self.over else f"{_clock(gone)}, about {_clock(left)} left", "bold")
        )
        return table

    def _row(self, part: str, jobs: list[Job]) -> tuple[Text, ProgressBar, Text, Text]:
        tasks = sum(job.estimate.tasks for job in jobs)
        done = sum(job.estimate.tasks * job.made() for job in jobs)
        failed, running = any(job.failed for job in jobs), any(job.begun and not job.ended for job in jobs)
        style = "red" if failed else "" if running else "green" if done >= tasks else "dim"
        begun = [job.begun for job in jobs if job.begun]
        ends = time.monotonic() if running else max((job.ended for job in jobs), default=0.0)
        spent = _clock(ends - min(begun)) if begun and ends else ""
        return (
            Text(part, style),
            ProgressBar(total=tasks, completed=done, width=24),
            Text(f"{int(done)}/{tasks}", style),
            Text(f"{spent} failed" if failed else spent, style),
        )


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
