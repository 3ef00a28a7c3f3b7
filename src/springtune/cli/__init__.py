"""Command line: `springtune COMMAND`."""

import os
import re
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, TextIO, cast

import click

from .. import __version__
from ..registry import import_name
from ..safe_io import UNSEEN_PATTERN, shown
from ..studies.runs.source import is_source_tree


def examples(*lines: str) -> str:
    """Epilog of a command with examples, which click shows verbatim."""
    folder = "" if is_source_tree(Path()) else "config/"  # where `springtune new` writes
    return "\n".join(["\b", "Examples:", *(f"  {line.replace(folder, '')}" for line in lines)])


def command(*lines: str, **settings: Any) -> Callable[..., click.Command]:
    """Decorator that makes a command, whose help ends with examples."""
    return click.command(epilog=examples(*lines), **settings)


PATH: click.Path = click.Path(path_type=Path)  # type of options and arguments that are paths


class WrongCall(click.ClickException):
    """A command was called with wrong options."""

    exit_code = 2


@contextmanager
def file_errors(place: str, remedy: str = "give a file that can be written") -> Iterator[None]:
    """Context of writing a file, whose errors name the place and the remedy."""
    try:
        yield
    except OSError as error:
        if not error.errno:  # of a damaged file that is read
            raise
        raise click.ClickException(f"{shown(place)}: {os.strerror(error.errno)}; {remedy}") from None


COMMANDS = {
    "new": ("study", "Write a small study to begin with."),
    "run": ("study", "Run a study."),
    "scenes": ("study", "List a study's scenes and what they share, without running it."),
    "definitions": ("study", "List the definitions of spring stiffness."),
    "predict": ("predict", "Recommend a definition for one mesh, or a mesh for one error."),
    "identify": ("predict", "Find a material's constants from measured tests."),
    "springs": ("predict", "Write the springs of one mesh for another program."),
    "browse": ("results", "Open the page of a study in a browser."),
    "info": ("results", "Show what a dataset holds, and where it comes from."),
    "diff": ("results", "List the values that differ between two datasets."),
    "export": ("results", "Write a group of a dataset as CSV or Parquet."),
    "archive": ("results", "Pack the results of a study into one file."),
    "docs": ("results", "Print where the pages, the manual of studies and the examples are."),
}
"""Modules and meanings of the commands, in the order of the help; each is imported when it is called."""

ARGUMENT_AT_BEGIN = re.compile("(mesh size|mesh types?|Young's modulus|Poisson's ratio|[a-z]+)(?=:| '| of ')")
"""Begin of messages with the name of an argument."""

OPTIONS = {
    "mesh size": "size",
    "mesh type": "mesh",
    "mesh types": "mesh",
    "loads": "load",
    "length": "beam",
    "height": "beam",
    "Young's modulus": "young",
    "Poisson's ratio": "poisson",
}
"""Options of arguments that have another name."""


def name_option(message: str, command: click.Command | None) -> str:
    """Replace the name of an argument at the begin of a message by the option of a command, as ``--force``."""
    if command and (found := ARGUMENT_AT_BEGIN.match(message)):
        option = "--" + OPTIONS.get(found[1], found[1])
        if any(option in one.opts for one in command.params):
            return option + message[found.end() :]
    return message


COMPLETION = "_SPRINGTUNE_COMPLETE"  # environment variable by which a shell asks click for completions


class EscapedStream:
    """Stream that escapes all control characters except line breaks and tabs."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        if name not in ("encoding", "errors", "flush", "isatty", "fileno"):  # others might write past the escapes
            raise AttributeError(name)
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text, and return its length."""
        self._stream.write(UNSEEN_PATTERN.sub(lambda one: one[0] if one[0] in "\n\t" else shown(one[0]), text))
        return len(text)


class Commands(click.Group):
    """Group that imports commands when they are called, and sends no control characters to a terminal."""

    def main(self, *arguments: Any, **keywords: Any) -> Any:
        """Run a command."""
        if COMPLETION in os.environ:  # bytes, and for a shell
            return super().main(*arguments, **keywords)
        out, err = (cast(TextIO, EscapedStream(stream)) for stream in (sys.stdout, sys.stderr))
        with redirect_stdout(out), redirect_stderr(err):
            return super().main(*arguments, **keywords)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; an error is a message with exit code 1, or 2 for a wrong option."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            raise
        except OSError as error:
            why = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else error
            raise click.ClickException(shown(why)) from None
        except ValueError as error:
            lines = error.args if all(isinstance(one, str) for one in error.args) else (str(error),)
            command = self.get_command(ctx, ctx.invoked_subcommand or "")
            message = "\n".join(shown(name_option(line, command)) for line in lines)
            raise (WrongCall if message.startswith("--") else click.ClickException)(message) from None

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the commands."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Command of a name, or None."""
        if cmd_name not in COMMANDS:
            return None
        return cast(click.Command, import_name(f"cli.{COMMANDS[cmd_name][0]}:{cmd_name}"))

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands, without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, meaning) for name, (_, meaning) in COMMANDS.items()])


@click.group(
    cls=Commands,
    epilog=examples(
        "springtune new mine",
        "springtune scenes config/mine.yaml",
        "springtune run config/mine.yaml",
        'springtune predict --beam 200x40 --size "2 mm" --material steel',
        "springtune browse results/mine",
    ),
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__)
def main() -> None:
    """Tune the stiffness of 2-D mass-spring models against finite elements.

    `springtune run` runs a study by Snakemake. `springtune COMMAND --help` ends with examples. Exit codes: 0 done, 1
    failed, 2 wrong options or arguments.
    """
    usual, printed = warnings.showwarning, set[str]()

    def show(message: Warning | str, category: type[Warning], *where: Any, **further: Any) -> None:
        # By name: importing them would let --help wait.
        if category.__name__ not in ("AssumptionWarning", "PluginWarning"):
            usual(message, category, *where, **further)
        elif (line := f"warning: {shown(message)}") not in printed:
            printed.add(line)
            click.echo(line, err=True)

    warnings.showwarning = show
