"""How many scenes a study may have."""

import os
from collections.abc import Callable
from typing import Any, TypeVar

import click

from ..problem.parameters import MOST_SCENES, MOST_SCENES_VARIABLE

Command = TypeVar("Command", bound=Callable[..., Any])


def max_scenes(command: Command) -> Command:
    """Option of a command that reads a study: argument ``most``, for `allow`."""
    option: Callable[[Command], Command] = click.option(
        "--max-scenes",
        "most",
        type=click.IntRange(min=1),
        help=f"A study of more scenes is refused before anything is made of it; {MOST_SCENES} without.",
    )
    return option(command)


def allow(most: int | None) -> None:
    """Let this process and those that it starts read studies of so many scenes."""
    if most is not None:
        os.environ[MOST_SCENES_VARIABLE] = str(most)
