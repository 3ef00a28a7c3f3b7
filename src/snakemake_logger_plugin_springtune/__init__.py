"""Snakemake logger plugin: a line that moves while a study runs on a terminal, elsewhere a line for each stage.

Snakemake imports all plugins at each start, so the display is imported only by a run with work to do.
"""

import os
import sys
from functools import cached_property
from logging import WARNING, Handler, LogRecord
from typing import TYPE_CHECKING

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

if TYPE_CHECKING:
    from .display import Display


class LogHandler(LogHandlerBase):
    """Handler of Snakemake's records.

    A run shows its progress, warnings, errors and its end; Snakemake's log file has all lines. What comes before is
    held back until a run begins, and written if none does. Runs with ``--dry-run``, ``--printshellcmds``,
    ``--verbose``, ``--debug-dag`` or ``--quiet`` get Snakemake's own lines.
    """

    writes_to_stream = True
    writes_to_file = has_filter = has_formatter = needs_rulegraph = False

    def __post_init__(self) -> None:
        Handler.__init__(self)  # the interface before 2.0 leaves it out
        self.display: Display | None = None
        self.held: list[LogRecord] = []
        asked = self.common_settings
        quiet = {str(getattr(one, "name", one)).lower() for one in asked.quiet or ()}
        otherwise = asked.dryrun or asked.printshellcmds or asked.verbose or asked.debug_dag
        self.wanted = not otherwise and not quiet & {"all", "progress", "rules"}

    def emit(self, record: LogRecord) -> None:
        """Show a record."""
        try:
            self._show(record)
        except Exception:
            # A display that fails must not take what the run has to say with it.
            self.wanted = False
            self._stop()
            self.plain.emit(record)

    def close(self) -> None:
        """Restore the terminal, and write what is held back."""
        self._stop()
        super().close()

    def _show(self, record: LogRecord) -> None:
        work, event = getattr(record, "work", None), getattr(record, "event", None)
        if not self.wanted:
            self.plain.emit(record)
        elif work is not None:
            from .display import Display

            stream = sys.stderr
            stream.write(f"{record.getMessage()}\n")
            self.held.clear()
            moves = stream.isatty() and os.environ.get("TERM", "dumb") != "dumb" and not os.environ.get("CI")
            self.display = Display(work, stream, moves)
        elif getattr(record, "ends", False):
            self.wanted = False  # what Snakemake says after it is shown
            self._stop()
            sys.stderr.write(f"{record.getMessage()}\n")
        elif self.display is not None:
            self._follow(self.display, record)
        elif record.levelno < WARNING and event != LogEvent.JOB_INFO:
            self.held.append(record)
        else:
            # An error, or a job: without the Snakefile's hooks (--no-hooks) there is nothing to display.
            self.wanted = record.levelno >= WARNING
            self._stop()
            self.plain.emit(record)

    def _follow(self, display: "Display", record: LogRecord) -> None:
        numbers = {LogEvent.JOB_INFO: "jobid", LogEvent.JOB_FINISHED: "job_id", LogEvent.JOB_ERROR: "jobid"}
        event = getattr(record, "event", None)
        if event in numbers:
            display.follow(event, getattr(record, numbers[event]))
        if record.levelno >= WARNING:
            display.tell(lambda: self.plain.emit(record))

    def _stop(self) -> None:
        """Remove the display, or write what was held back for want of one."""
        if self.display is not None:
            self.display.stop()
            self.display = None
        held, self.held = self.held, []
        for record in held:
            self.plain.emit(record)

    @cached_property
    def plain(self) -> Handler:
        """Snakemake's own handler."""
        from snakemake.logging import ColorizingTextHandler

        stream = sys.stdout if self.common_settings.stdout else sys.stderr
        return ColorizingTextHandler(self.common_settings.nocolor, stream, self.formatter)
