"""Command line: `springtune COMMAND`."""

import io
import os
import sys
import warnings
from contextlib import redirect_stderr, redirect_stdout
from itertools import groupby
from typing import Any, NamedTuple, TextIO

import click

from .. import __version__
from ..registry import imported
from ..safe_io.escapes import UNSEEN, shown


def examples(*lines: str) -> str:
    r"""Epilog of a command with examples.

    Examples
    --------
    >>> examples("springtune definitions")
    '\x08\nExamples:\n  springtune definitions'
    """
    return "\n".join(["\b", "Examples:", *(f"  {line}" for line in lines)])


WRONG, FAILED = 2, 1
"""Exit codes: an option is wrong; the request cannot be met."""


class WrongCall(click.ClickException):
    """A command was called with wrong options."""

    exit_code = WRONG


class Row(NamedTuple):
    """A command: its heading in the help, module, function and meaning."""

    heading: str
    module: str
    function: str
    meaning: str


STUDIES, RESULTS, HOUSE = "Studies", "Results", "For those who work on springtune"

COMMANDS = {
    "new": Row(STUDIES, "study", "new", "Write a small study to begin with."),
    "run": Row(STUDIES, "run", "run", "Run a study."),
    "scenes": Row(STUDIES, "study", "scenes", "Say what a study asks for, before anything runs."),
    "definitions": Row(STUDIES, "study", "definitions", "List the definitions of spring stiffness."),
    "predict": Row(STUDIES, "predict", "predict", "Recommend a definition for one mesh, or a mesh for one error."),
    "identify": Row(STUDIES, "identify", "identify", "Find a material's constants from measured tests."),
    "springs": Row(STUDIES, "predict", "springs", "Write the springs of one mesh for another program."),
    "browse": Row(RESULTS, "results", "browse", "Open the page of a study in a browser."),
    "info": Row(RESULTS, "results", "info", "Say what a dataset holds, and where it comes from."),
    "diff": Row(RESULTS, "diff", "diff", "Say what changed from one dataset to another, scene by scene."),
    "export": Row(RESULTS, "results", "export", "Write a group of a dataset as CSV or Parquet."),
    "archive": Row(RESULTS, "results", "archive", "Pack the results of a study into one file."),
    "schema": Row(HOUSE, "study", "schema", "Print the JSON schema of studies, for editors."),
}
"""Commands by name, in the order of the help; each is imported when it is called."""


SAID = f"{__name__}.said"
"""Warnings of a command, in its context."""


COMPLETION = "_SPRINGTUNE_COMPLETE"
"""Environment variable by which a shell asks click for completions."""


class Shown(io.TextIOBase):
    """Stream that escapes all control characters except line breaks and tabs."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    @property
    def encoding(self) -> str:  # type: ignore[override]  # typeshed has an attribute
        """Encoding of the stream."""
        return self._stream.encoding

    @property
    def errors(self) -> str | None:  # type: ignore[override]
        """Error handling of the encoding."""
        return self._stream.errors

    def write(self, text: str) -> int:
        """Write a text, and return its length."""
        self._stream.write(UNSEEN.sub(lambda one: one[0] if one[0] in "\n\t" else shown(one[0]), text))
        return len(text)

    def flush(self) -> None:
        """Flush the stream."""
        self._stream.flush()

    def isatty(self) -> bool:
        """Whether the stream is a terminal."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """Number of the stream's file."""
        return self._stream.fileno()


class Commands(click.Group):
    """Group that imports commands when they are called, and sends no control characters to a terminal."""

    def main(self, *arguments: Any, **keywords: Any) -> Any:
        """Run a command."""
        if COMPLETION in os.environ:  # bytes, and for a shell
            return super().main(*arguments, **keywords)
        with redirect_stdout(Shown(sys.stdout)), redirect_stderr(Shown(sys.stderr)):
            return super().main(*arguments, **keywords)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; its refusal is a message, with exit code 1, or 2 for an option."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            raise
        except OSError as error:
            why = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else error
            raise click.ClickException(shown(why)) from None
        except ValueError as error:
            lines = error.args if all(isinstance(one, str) for one in error.args) else (error,)
            refused = WrongCall if getattr(error, "wrong_call", str(error).startswith("--")) else click.ClickException
            raise refused("\n".join(map(shown, lines))) from None

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the commands."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Command of a name; None if there is none."""
        if cmd_name not in COMMANDS:
            return None
        row = COMMANDS[cmd_name]
        found: click.Command = imported(f"cli.{row.module}:{row.function}")
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands under their headings."""
        for heading, rows in groupby(COMMANDS.items(), key=lambda item: item[1].heading):
            with formatter.section(heading):
                formatter.write_dl([(name, row.meaning) for name, row in rows])


@click.group(
    cls=Commands,
    epilog=examples(
        "springtune new my-study",
        "springtune scenes config/paper.yaml",
        "springtune run config/paper.yaml",
        'springtune predict --beam 200x40 --size "2 mm" --material steel',
        "springtune browse results/paper",
    ),
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__)
def main() -> None:
    """Tune the stiffness of 2-D mass-spring models against finite elements.

    Studies are run by Snakemake, which `springtune run` calls. `springtune COMMAND --help` has examples of each. A
    command exits with 0 when it has done what was asked, with 1 when that failed, and with 2 when it was called in a
    wrong way.
    """
    usual, said = warnings.showwarning, click.get_current_context().meta.setdefault(SAID, {})

    def show(message: Warning | str, category: type[Warning], *where: Any, **further: Any) -> None:
        # Not imported, so that --help does not wait for them.
        if category.__name__ in ("AssumptionWarning", "PluginWarning"):
            said[f"warning: {shown(message)}"] = None  # each once, in this order
        else:
            usual(message, category, *where, **further)

    warnings.showwarning = show


@main.result_callback()
def warn(*_: Any, **__: Any) -> None:
    """Print warnings of broken assumptions of the model below an answer."""
    for line in click.get_current_context().meta[SAID]:
        click.echo(line, err=True)
