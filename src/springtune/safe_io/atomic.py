"""Files that appear whole or not at all, and whether the processes that write them live."""

import json
import os
import platform
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

UNFINISHED_ENDING = ".unfinished"
"""Ending of the name of a file that is being written, after its own and who writes it, `writer`."""

ABANDONED_SECONDS = 3600.0
"""Seconds after which another machine's unfinished file counts as left over; writing takes seconds."""


def writer() -> str:
    """Process and machine for the name of an unfinished file: another machine may have the same process number."""
    return f"{os.getpid()}@{platform.node().replace('.', '-')}"


@contextmanager
def replacing(path: str | Path, synced: bool = False) -> Iterator[Path]:
    """Context that writes a file under another name and renames it when complete; after an error nothing changes."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f"{path.name}.{writer()}{UNFINISHED_ENDING}")
    try:
        yield unfinished
        if synced:
            with open(unfinished, "rb+") as file:
                os.fsync(file.fileno())
        os.replace(unfinished, path)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise


def check_folder(path: str | Path) -> None:
    """Refuse a file whose folder does not exist, rather than create a misspelled one."""
    folder = Path(path).parent
    if not folder.exists():
        raise ValueError(f"{path}: folder {folder} does not exist; make it first")


def remove_unfinished(folder: str | Path, below: bool = True) -> None:
    """Remove files in a folder that killed writers left; on other machines, those without a write for an hour."""
    for path in (Path(folder).rglob if below else Path(folder).glob)(f"*{UNFINISHED_ENDING}"):
        with suppress(FileNotFoundError):  # just finished, or another run was quicker
            if path.is_file() and not _is_being_written(path):
                path.unlink()


def reset_future_times(folder: str | Path) -> None:
    """Give files with a time in the future the present time; a clock that was set back leaves such files."""
    now = time.time()
    for path in Path(folder).rglob("*"):
        if path.is_file() and path.stat().st_mtime > now:
            os.utime(path)


def _is_being_written(path: Path) -> bool:
    """Return whether the process that writes an unfinished file runs, or may run."""
    number, _, host = path.name.removesuffix(UNFINISHED_ENDING).rpartition(".")[2].partition("@")
    if host not in ("", writer().partition("@")[2]):
        return time.time() < path.stat().st_mtime + ABANDONED_SECONDS
    return number.isdecimal() and is_running(int(number))


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write a file atomically; create missing folders."""
    with replacing(path) as unfinished:
        unfinished.write_bytes(content)


def write_text(path: str | Path, text: str) -> None:
    """Write UTF-8 text atomically; create missing folders."""
    write_bytes(path, text.encode())


def write_json(path: str | Path, content: Any) -> None:
    """Write JSON atomically."""
    write_text(path, json.dumps(content, indent=1) + "\n")


def is_running(pid: int) -> bool:
    """Return whether a process runs."""
    import psutil  # here: hardly ever is there something to ask

    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except (OverflowError, ValueError, psutil.NoSuchProcess):
        return False
    except psutil.AccessDenied:
        return True
