"""Snakemake logger plugin: a moving line of progress on a terminal, elsewhere a line for each rule."""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Mapping
from functools import cached_property
from logging import WARNING, Handler, LogRecord
from typing import TextIO

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

from springtune.safe_io import clock as clock_text

PAUSE = 0.5  # time between two updates of the moving line [s]

LINE = "\r\x1b[?7l{}\x1b[K\x1b[?7h"  # overwrites the line of the cursor; the terminal cuts long lines

NUMBERS = {LogEvent.JOB_INFO: "jobid", LogEvent.JOB_FINISHED: "job_id", LogEvent.JOB_ERROR: "jobid"}
"""Attribute of a record with the job's number, by event: the job runs, is done, or failed."""


STOPPED = "stopped; what is computed is kept: the same command takes up where this one stopped"


def end_quietly(number: int, frame: object) -> None:
    """Say in one line that Ctrl-C stops the run; what Snakemake and its threads print on their way out is dropped."""
    os.write(2, (LINE.format(STOPPED) if os.isatty(2) else STOPPED).encode() + b"\n")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    raise KeyboardInterrupt


class Display:
    """Progress of a run until `over` is set; `counts` has the number of jobs of each rule."""

    def __init__(self, counts: Mapping[str, int], stream: TextIO, moves: bool) -> None:
        self.counts, self.stream, self.moves = counts, stream, moves
        self.begun, self.over, self.writing = time.monotonic(), threading.Event(), threading.Lock()
        self.rules, self.jobs = dict[int, str](), {event: set[int]() for event in NUMBERS}
        if moves:
            threading.Thread(target=self._move, daemon=True).start()

    def record_event(self, event: LogEvent, number: int, rule: str) -> None:
        """Record the event of a job; without a terminal, write a line when its rule is done."""
        if event == LogEvent.JOB_INFO:
            self.rules[number] = rule
        for what, jobs in self.jobs.items():
            (jobs.add if what == event else jobs.discard)(number)
        if event == LogEvent.JOB_FINISHED and not self.moves:
            rule = self.rules.get(number, "")
            if sum(self.rules.get(one) == rule for one in self.jobs[event]) == self.counts.get(rule):
                self.write(f"{rule}: done; {self.line()}\n")

    def write(self, text: str = "", above: Callable[[], object] = lambda: None) -> None:
        """Write a text; without one remove the moving line, and write something else above it."""
        with self.writing:
            self.stream.write(text or LINE.format("") * self.moves)
            above()
            self.stream.flush()

    def line(self) -> str:
        """Numbers of jobs, elapsed and remaining time, and the rules of running jobs."""
        elapsed, count = time.monotonic() - self.begun, self.counts["total"]
        running, done, failed = self.jobs.values()
        left = f", about {clock_text(elapsed * (count - len(done)) / len(done))} left" if 0 < len(done) < count else ""
        lost = f", {len(failed)} failed" if failed else ""
        rules = dict.fromkeys(self.rules[number] for number in sorted(running))
        head = f"{len(done)} of {count} jobs{lost}, {clock_text(elapsed)}{left}"
        return ": ".join(filter(None, (head, ", ".join(rules) if self.moves else "")))

    def _move(self) -> None:
        while not self.over.is_set():
            self.write(LINE.format(self.line()))
            self.over.wait(PAUSE)


class LogHandler(LogHandlerBase):
    """Handler of Snakemake's records.

    A run shows its progress, warnings, errors and summary. Records before a run are held back, and written if no run
    begins. Runs with ``--dry-run``, ``--printshellcmds``, ``--verbose``, ``--debug-dag`` or ``--quiet`` get Snakemake's
    own lines.
    """

    writes_to_stream = True
    writes_to_file = has_filter = has_formatter = needs_rulegraph = False

    def __post_init__(self) -> None:
        Handler.__init__(self)  # the interface before 2.0 leaves it out
        self.display: Display | None = None
        self.held: list[LogRecord] = []
        asked = self.common_settings
        quiet = {str(getattr(one, "name", one)).lower() for one in asked.quiet or ()} & {"all", "progress", "rules"}
        self.enabled = not (quiet or asked.dryrun or asked.printshellcmds or asked.verbose or asked.debug_dag)
        if self.enabled and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, end_quietly)

    def emit(self, record: LogRecord) -> None:
        """Show a record."""
        try:
            event = getattr(record, "event", None)
            if not self.enabled:
                self.plain.emit(record)
            elif event == LogEvent.RUN_INFO and self.display is None:
                self.held.clear()
                stream, counts = sys.stderr, vars(record)["stats"]
                moves = stream.isatty() and os.environ.get("TERM", "dumb") != "dumb" and not os.environ.get("CI")
                stream.write(f"{counts['total']} jobs\n")
                self.display = Display(counts, stream, moves)
            elif getattr(record, "ends", False):
                self.enabled = False  # what Snakemake says after it is shown
                self._stop()
                sys.stderr.write(f"{record.getMessage()}\n")
            elif self.display is None:
                self.held.append(record)
                if record.levelno >= WARNING:  # an error before the run
                    self._stop()
            else:
                if event in NUMBERS:
                    self.display.record_event(event, getattr(record, NUMBERS[event]), getattr(record, "rule_name", ""))
                if record.levelno >= WARNING:
                    self.display.write(above=lambda: self.plain.emit(record))
        except Exception:
            # If the display fails, the messages of the run must still appear.
            self.enabled = False
            self._stop()
            self.plain.emit(record)

    def close(self) -> None:
        """Restore the terminal, and write held-back records."""
        self._stop()
        super().close()

    def _stop(self) -> None:
        """Remove the display, and write held-back records."""
        if self.display is not None:
            self.display.over.set()
            self.display.write()
            self.display = None
        while self.held:
            self.plain.emit(self.held.pop(0))

    @cached_property
    def plain(self) -> Handler:
        """Snakemake's own handler."""
        from snakemake.logging import ColorizingTextHandler

        stream = sys.stdout if self.common_settings.stdout else sys.stderr
        return ColorizingTextHandler(self.common_settings.nocolor, stream, self.formatter)
