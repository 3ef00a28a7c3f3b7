"""Who runs what in a folder, whose results it holds, and locks that a run which was killed has left.

Snakemake locks the files of a run by lists of them, does not say by whom, and at the end of a run removes the locks of
all others in its folder. So a run notes its process beside them; a lock is stale when that process is gone.
"""

import filecmp
import os
import re
import shlex
import sys
import time
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import Any

from springtune.safe_io.processes import lives, this_host

from . import checked_json
from .run_tasks import TASKS

LOCKS, RUNS = Path(".snakemake/locks"), Path(".snakemake/springtune")
"""Snakemake's locks, and notes of processes, from the folder on that a run is called in."""

STUDY_FILE = f"{TASKS}/study.json"
"""File in a study's folder: the path of the config that was run last."""


class LockedError(ValueError):
    """Another process computes a study, or its folder is another study's; the message has the reason and the remedy."""


def claim(folder: Path, config: Path) -> None:
    """Note the study that a folder belongs to."""
    place, path = (Path(os.path.abspath(one)) for one in (folder.parent.parent, config))
    note = {"config": str(path.relative_to(place) if path.is_relative_to(place) else path)}
    if checked_json.read(folder / STUDY_FILE) != note:
        checked_json.write(folder / STUDY_FILE, note)


def claimed(folder: Path) -> Path | None:
    """File of the study that a folder belongs to; None where it is not known or not there."""
    note = checked_json.read(folder / STUDY_FILE, config=str)
    path = folder.parent.parent / note["config"] if note else None
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
    _forget(Path(), named)
    checked_json.write(_note(), note)


def _forget(place: Path, locked: Collection[str] = ()) -> None:
    """Remove notes of runs that are gone: of this machine, and those on folders that are locked by this process."""
    for path, note in _notes(place):
        gone = note["host"] == this_host() and not _is_alive(note)
        if gone or not {*note["folders"]}.isdisjoint(locked):
            path.unlink(missing_ok=True)


def end() -> None:
    """Note that this process is at its end."""
    _note().unlink(missing_ok=True)


def _note() -> Path:
    return RUNS / f"{re.sub('[^0-9A-Za-z-]+', '-', this_host())}_{os.getpid()}.json"


def is_held(folder: Path) -> bool:
    """Whether a run has locked a study; that it is gone may be seen from a lock that is stale."""
    place = folder.parent.parent
    locked = any(_is_on(path, folder) for path in _files(place / LOCKS, "*.lock"))
    noted = False
    for _, note in _notes(place):
        if Path(folder.parent.name, folder.name) not in map(Path, note["folders"]):
            continue
        noted = True
        if note["host"] != this_host() and locked:
            raise LockedError(_told(folder, note, f"on {note['host']}, where this machine cannot look"))
        if note["host"] == this_host() and _is_alive(note):
            raise LockedError(_told(folder, note, "on this machine"))
    if not locked:
        return False
    # A run that was killed before it noted anything.
    other = None if noted else _running_in(place)
    if other is not None:
        remedy = f"wait for its end, or stop it: kill {other}"
        raise LockedError(f"{folder}: process {other} computes in this folder; {remedy}")
    return True


def release(folder: Path) -> str:
    """Remove locks on a study that a process which is gone has left."""
    if not is_held(folder):
        return ""
    place = folder.parent.parent
    for path in _files(place / LOCKS, "*.lock"):
        if _is_on(path, folder):
            path.unlink(missing_ok=True)
    _forget(place)
    return f"{folder}: the run before was killed and left its lock; the lock is removed"


def _told(folder: Path, note: dict[str, Any], where: str) -> str:
    since = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(note["start"]))
    remedy = f"wait for its end, or stop it: kill {note['pid']}"
    if note["host"] != this_host():
        remedy = f"wait for its end; if it is gone: rm -r {LOCKS}"
    return f"{folder}: process {note['pid']} {where} computes it since {since} ({note['command']}); {remedy}"


def _files(folder: Path, pattern: str) -> list[Path]:
    return sorted(folder.glob(pattern)) if folder.is_dir() else []


def _is_on(lock: Path, folder: Path) -> bool:
    try:
        named = Path(folder.parent.name, folder.name)  # Snakemake names files from where it was called
        return any(Path(line).is_relative_to(named) for line in lock.read_text(errors="replace").splitlines())
    except OSError:
        return False


def _notes(place: Path) -> Iterator[tuple[Path, dict[str, Any]]]:
    for path in _files(place / RUNS, "*.json"):
        note = checked_json.read(path, host=str, pid=int, start=float, folders=list)
        if note is not None:
            yield path, note


def _is_alive(note: dict[str, Any]) -> bool:
    return lives(note["pid"], note["start"])


def _running_in(place: Path) -> int | None:
    """Another process of Snakemake in a folder that computes."""
    import psutil

    own = psutil.Process()
    family = {own.pid, *(process.pid for process in own.parents())}
    for process in psutil.process_iter():
        try:
            if process.pid in family or not lives(process.pid):
                continue
            if Path(process.cwd()) != place.resolve():
                continue
            words = process.cmdline()
        except psutil.Error:
            continue
        if any(Path(word).name == "snakemake" for word in words[:3]) and not {"-n", "--dry-run", "--dryrun"} & {*words}:
            return process.pid
    return None
