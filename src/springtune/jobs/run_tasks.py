"""A job of a stage: ``python -m springtune.jobs.run_tasks TASKS DONE DIGEST``.

What is to do is the note ``TASKS``; the module that it names does it, and ``DONE`` records what was done and made. A
stored file that turns out to be damaged is set aside and made again, in the job that needs it.
"""

import os
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

from . import records, sealed
from .damage import DamagedError, set_aside
from .spent import Spent

Made = TypeVar("Made")

TASKS, RECORDS = "tasks", "done"
"""Folders of a study: what each job of a stage is to do, and what each job has done."""


def main(tasks: str, done: str, digest: str) -> None:
    """Do what a note says.

    Parameters
    ----------
    tasks : str
        The note: ``digest``, ``module`` (of the package, with a function ``run(content, spent)``), ``content`` for that
        and ``products``, files that it makes.
    done : str
        Record to write.
    digest : str
        Of what is to do.
    """
    note = sealed.read(tasks)
    if note is None or note["digest"] != digest:
        raise SystemExit(f"{tasks}: not what this job is to do; call the same command again, it writes it anew")
    mended(lambda: _do(note, done), Path(tasks).parents[1])


def _do(note: dict[str, Any], done: str | Path) -> None:
    spent = Spent()
    import_module(f"springtune.{note['module']}").run(note["content"], spent)
    records.write(done, note["digest"], note["products"], **spent.summary())


def mended(function: Callable[[], Made], folder: Path) -> Made:
    """Call a function; stored files that it finds damaged are made again.

    Parameters
    ----------
    function : callable
        May be called more than once.
    folder : Path
        Of the study.

    Returns
    -------
    object
        What it returns.
    """
    again: set[Path] = set()
    while True:
        try:
            return function()
        except DamagedError as error:
            if error.path in again:
                raise SystemExit(f"{error}, and making it again did not help") from None
            again.add(error.path)
            set_aside(error)
            _make_again(error.path, folder)


def _make_again(product: Path, folder: Path) -> None:
    """Let the job that makes a file make it again."""
    for path in sorted((folder / TASKS).glob("*_*.json")):
        note = sealed.read(path)
        if note is not None and str(product) in note["products"]:
            done = folder / RECORDS / path.name
            before = done.stat() if done.exists() else None
            mended(lambda note=note, done=done: _do(note, done), folder)  # type: ignore[misc]
            if before:  # what waited for it has no reason to run again
                os.utime(done, ns=(before.st_atime_ns, before.st_mtime_ns))
            return
    raise SystemExit(f"{product}: no job makes it; call the same command again")


if __name__ == "__main__":
    main(*sys.argv[1:])
