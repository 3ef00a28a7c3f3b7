"""Who runs what in a folder, and whose results it holds.

Snakemake's locks do not say which process holds them, and the end of a run removes the locks of all others in its
folder. So a run notes its process while it lasts. `springtune run` removes the lock of a process that is gone.
"""

import filecmp
import json
import os
import re
import shlex
import sys
import time
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import Any

from springtune.safe_io.atomic import lives, this_host, write_json

from .job import TASKS

RUNS = Path(".snakemake/springtune")
"""Notes of processes that run studies, in the folder that they were called in."""

STUDY_FILE = f"{TASKS}/study.json"
"""File in a study's folder: the path of the config that was run last."""


class LockedError(ValueError):
    """Another process computes a study, or its folder is another study's; the message has the reason and the remedy."""


def claim(folder: Path, config: Path) -> None:
    """Note the study that a folder belongs to."""
    place, path = (Path(os.path.abspath(one)) for one in (folder.parent.parent, config))
    note = {"config": str(path.relative_to(place) if path.is_relative_to(place) else path)}
    if _read(folder / STUDY_FILE) != note:
        write_json(folder / STUDY_FILE, note)


def claimed(folder: Path) -> Path | None:
    """File of the study that a folder belongs to; None where it is not known or not there."""
    note = _read(folder / STUDY_FILE)
    path = folder.parent.parent / str(note["config"]) if "config" in note else None
    return path if path and path.is_file() else None


def check_claim(folder: Path, config: Path) -> None:
    """Refuse a folder that belongs to another study of the same name.

    A file that was moved, a link to it and a file with the same content are the same study. A folder without a note is
    of any study of its name.
    """
    other = claimed(folder)
    if other is None or not config.is_file() or filecmp.cmp(other, config, shallow=False):
        return
    remedy = f"rename one of the two, or call: springtune run {shlex.quote(str(config))} --results FOLDER"
    raise LockedError(f"{folder}: holds the results of {other}, another study of the same name; {remedy}")


def begin(folders: Iterable[Path]) -> None:
    """Note that this process computes studies."""
    import psutil

    process, named = psutil.Process(), {str(folder) for folder in folders}
    note = {
        "host": this_host(),
        "pid": process.pid,
        "start": process.create_time(),
        "command": " ".join(sys.argv),
        "folders": sorted(named),
    }
    forget(Path(), named)
    write_json(_note(), note)


def forget(place: Path = Path(), locked: Collection[str] = ()) -> None:
    """Remove notes of runs that are gone: of this machine, and those on folders that are locked by this process."""
    for path, note in _notes(place):
        gone = note["host"] == this_host() and not lives(note["pid"], note["start"])
        if gone or not {*note["folders"]}.isdisjoint(locked):
            path.unlink(missing_ok=True)


def end() -> None:
    """Note that this process is at its end."""
    _note().unlink(missing_ok=True)


def _note() -> Path:
    return RUNS / f"{re.sub('[^0-9A-Za-z-]+', '-', this_host())}_{os.getpid()}.json"


def check_idle(folder: Path) -> bool:
    """Return whether a run of a study was killed and left its note; raise LockedError while a run computes it."""
    killed = False
    for _, note in _notes(folder.parent.parent):
        if Path(folder.parent.name, folder.name) not in map(Path, note["folders"]):
            continue
        if note["host"] != this_host():
            raise LockedError(_told(folder, note, f"on {note['host']}, where this machine cannot look"))
        if lives(note["pid"], note["start"]):
            raise LockedError(_told(folder, note, "on this machine"))
        killed = True
    return killed


def _told(folder: Path, note: dict[str, Any], where: str) -> str:
    since = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(note["start"]))
    remedy = f"wait for its end, or stop it: kill {note['pid']}"
    if note["host"] != this_host():
        remedy = f"wait for its end; if it is gone: rm -r {RUNS}, then snakemake --unlock"
    return f"{folder}: process {note['pid']} {where} computes it since {since} ({note['command']}); {remedy}"


def _notes(place: Path) -> Iterator[tuple[Path, dict[str, Any]]]:
    for path in sorted((place / RUNS).glob("*.json")):
        note = _read(path)
        if {"host", "pid", "start", "folders", "command"} <= note.keys():
            yield path, note


def _read(path: Path) -> dict[str, Any]:
    """Content of a note; empty if it cannot be read."""
    try:
        found = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
