"""Handling of damaged stored files."""

import sys
from contextlib import suppress
from pathlib import Path

ASIDE = ".damaged"


class DamagedError(Exception):
    """A stored file is damaged or missing."""

    def __init__(self, path: str | Path, why: str, whole: bool = False) -> None:
        super().__init__(f"{path}: {why}")
        self.path, self.whole = Path(path), whole


def rename(path: Path) -> Path:
    """Rename a damaged file so that it is kept."""
    aside = path.with_name(path.name + ASIDE)
    with suppress(FileNotFoundError):  # another job was quicker
        path.replace(aside)
    return aside


def set_aside(error: DamagedError) -> None:
    """Rename a damaged file and report it; a whole file keeps its name and gets what it lacks."""
    told = "computed again"
    if error.path.exists() and not error.whole:
        told = f"set aside as {rename(error.path).name}, and computed again"
    print(f"{error}; {told}", file=sys.stderr)
