"""Stored files that are not what was written."""

import sys
from contextlib import suppress
from pathlib import Path

ASIDE = ".damaged"
"""Ending of the name of a file that is not what was written, after its own."""


class DamagedError(Exception):
    """A stored file is not what was written, or is not there."""

    def __init__(self, path: str | Path, why: str, whole: bool = False) -> None:
        super().__init__(f"{path}: {why}")
        self.path, self.whole = Path(path), whole


def rename(path: Path) -> Path:
    """Give a damaged file the name under which it is kept."""
    aside = path.with_name(path.name + ASIDE)
    with suppress(FileNotFoundError):  # another job was quicker
        path.replace(aside)
    return aside


def set_aside(error: DamagedError) -> None:
    """Give a damaged file another name and say so; what it held is computed again.

    One that is whole keeps its name: it gets what it lacks.
    """
    told = "computed again"
    if error.path.exists() and not error.whole:
        told = f"set aside as {rename(error.path).name}, and computed again"
    print(f"{error}; {told}", file=sys.stderr)
