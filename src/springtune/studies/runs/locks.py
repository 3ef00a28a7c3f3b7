"""Locks of running studies by `flock`, which end with the process, and the study of a folder of results."""

import fcntl
import filecmp
import os
import platform
import shlex
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import TextIO

from springtune.safe_io import write_json

from .source import TASKS, read_note

STUDY_FILE, RUN_FILE = f"{TASKS}/study.json", f"{TASKS}/run.json"
"""Files in a study's folder: the path of the config that was run last, and the process that runs it."""

LOCKED_NOTES: list[TextIO] = []  # notes that this process has locked


class LockedError(ValueError):
    """Another process computes a study, or its folder is another study's; the message has the reason and the remedy."""


def claim(folder: Path, config: Path) -> None:
    """Write into a folder which study it belongs to."""
    place, path = (Path(os.path.abspath(one)) for one in (folder.parent.parent, config))
    note = {"config": str(path.relative_to(place) if path.is_relative_to(place) else path)}
    write_json(folder / STUDY_FILE, note)


def claimed_study(folder: Path) -> Path | None:
    """File of the study that a folder belongs to, or None."""
    path = folder.parent.parent / str(read_note(folder / STUDY_FILE).get("config", ""))
    return path if path.is_file() else None


def check_claim(folder: Path, config: Path) -> None:
    """Refuse a folder of another study of the same name; a file with the same content is the same study."""
    other = claimed_study(folder)
    if other is None or not config.is_file() or filecmp.cmp(other, config, shallow=False):
        return
    remedy = f"rename one of the two, or call: springtune run {shlex.quote(str(config))} --results FOLDER"
    raise LockedError(f"{folder}: holds the results of {other}, another study of the same name; {remedy}")


def lock(folders: Iterable[Path]) -> None:
    """Note that this process computes studies, and lock the notes until its end."""
    since, command = time.strftime("%Y-%m-%d %H:%M:%S"), " ".join(sys.argv)
    owner = f"process {os.getpid()} on {platform.node()} computes it since {since} ({command})"
    for folder in folders:
        (folder / RUN_FILE).parent.mkdir(parents=True, exist_ok=True)
        file = (folder / RUN_FILE).open("a+", encoding="utf-8")
        _lock(file, folder)
        LOCKED_NOTES.append(file)
        file.truncate(0)
        file.write(f"{owner}; wait for its end, or stop it: kill {os.getpid()}")
        file.flush()


def unlock() -> None:
    """Unlock the notes of this process."""
    while LOCKED_NOTES:
        with LOCKED_NOTES.pop() as file:
            file.truncate(0)


def check_idle(folder: Path) -> bool:
    """Return, once, whether a run of a study was killed; raise LockedError while a process computes it."""
    if not (folder / RUN_FILE).is_file():
        return False
    with (folder / RUN_FILE).open("a+", encoding="utf-8") as file:
        killed = _lock(file, folder) and (folder / RUN_FILE).stat().st_size > 0
        if killed:
            file.truncate(0)
        return killed


def _lock(file: TextIO, folder: Path) -> bool:
    """Lock a note; return False where the file system has no locks."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise LockedError(f"{folder}: {(folder / RUN_FILE).read_text() or 'another process computes it'}") from None
    except OSError:
        return False
    return True
