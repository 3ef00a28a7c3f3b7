"""Snakemake logger plugin: a study's progress on terminals, plain lines elsewhere.

Snakemake imports all plugins at each start, so drawing is imported only by a run with work to do.
"""

import os
import sys
from logging import ERROR, WARNING, Handler, LogRecord
from typing import TYPE_CHECKING

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

if TYPE_CHECKING:
    from .display import Display


class LogHandler(LogHandlerBase):
    """Handler of Snakemake's records.

    Terminals get a display. Files, pipes, continuous integration (``CI``), terminals without cursor control and runs
    with ``--dry-run``, ``--printshellcmds``, ``--verbose``, ``--debug-dag`` or ``--quiet`` get Snakemake's own lines.
    """

    writes_to_stream = True
    writes_to_file = has_filter = has_formatter = needs_rulegraph = False

    def __post_init__(self) -> None:
        Handler.__init__(self)  # the interface before 2.0 leaves it out
        self.display: Display | None = None
        self.plain: Handler | None = None
        self.wanted = self._wanted()

    def emit(self, record: LogRecord) -> None:
        """Show a record."""
        try:
            self._show(record)
        except Exception:
            # A display that fails must not take what the run has to say with it.
            self.wanted = False
            self._stop()
            self._plain().emit(record)

    def close(self) -> None:
        """Restore the terminal."""
        self._stop()
        super().close()

    def _wanted(self) -> bool:
        asked = self.common_settings
        quiet = {str(getattr(one, "name", one)).lower() for one in asked.quiet or ()}
        otherwise = asked.dryrun or asked.printshellcmds or asked.verbose or asked.debug_dag
        able = sys.stderr.isatty() and os.environ.get("TERM", "dumb") != "dumb" and not os.environ.get("CI")
        return able and not otherwise and not quiet & {"all", "progress", "rules"}

    def _show(self, record: LogRecord) -> None:
        estimates = getattr(record, "estimates", None)
        if not self.wanted:
            self._plain().emit(record)
        elif estimates is not None:
            from .display import Display

            title, colourless = record.getMessage(), self.common_settings.nocolor
            self.display = Display(estimates, record.cores, title, colourless)  # type: ignore[attr-defined]
        elif getattr(record, "ends", False):
            self._stop()
            sys.stderr.write(record.getMessage() + "\n")
        else:
            self._follow(record)

    def _follow(self, record: LogRecord) -> None:
        event = getattr(record, "event", None)
        if self.display is None:
            # Without the Snakefile's hooks (--no-hooks) there is nothing to display.
            self.wanted = event != LogEvent.JOB_INFO
            self._plain().emit(record)
            return
        if event == LogEvent.JOB_INFO:
            self.display.begin(record.jobid)  # type: ignore[attr-defined]
        elif event == LogEvent.JOB_FINISHED:
            self.display.finish(record.job_id)  # type: ignore[attr-defined]
        elif event == LogEvent.JOB_ERROR:
            self.display.fail(record.jobid)  # type: ignore[attr-defined]
        if record.levelno >= WARNING:
            style = "red" if record.levelno >= ERROR else "yellow"
            self.display.tell(self.format(record), style)

    def _stop(self) -> None:
        if self.display is not None:
            self.display.stop()
            self.display = None

    def _plain(self) -> Handler:
        """Snakemake's own handler."""
        if self.plain is None:
            from snakemake.logging import ColorizingTextHandler

            stream = sys.stdout if self.common_settings.stdout else sys.stderr
            self.plain = ColorizingTextHandler(self.common_settings.nocolor, stream, self.formatter)
        return self.plain
