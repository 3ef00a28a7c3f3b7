"""Operations on files, counted, and one of them made to fail.

What Python code does to files goes through a few functions, which are replaced here: opening for writing, writing (as
the system gets it, after buffers), putting on the disk, renaming, removing, making folders, setting times. A library
that writes from C, as netCDF's does, counts as one operation.
"""

import builtins
import errno
import io
import os
import signal
import traceback
from dataclasses import dataclass
from pathlib import Path

FAULTS = ("error", "full", "kill")
"""How an operation fails: the device has an error; the disk is full from then on, and a write ends halfway; the process
and all of its group are killed, halfway through a write."""

WIDTH = 200
"""Characters of a line of notes."""

ROOM = {"open", "write", "library", "mkdir", "fsync"}
"""Operations that need room on a disk."""

NAMES = ("fsync", "replace", "rename", "unlink", "remove", "mkdir", "rmdir", "utime")
REAL = {name: getattr(os, name) for name in NAMES}
REAL_OPEN = builtins.open


@dataclass
class Faults:
    """Counts operations on files below a folder, and lets one of them fail.

    Attributes
    ----------
    folder : Path
    notes : Path
        File, elsewhere, with a line of `WIDTH` for each operation so far, of this process and of those that it starts:
        they count together.
    number : int
        Which operation fails, from 1; none does at 0.
    how : str
        One of `FAULTS`.
    report : Path or None
        File, elsewhere, that tells of the failure.
    """

    folder: Path
    notes: Path
    number: int = 0
    how: str = ""
    report: Path | None = None

    def __enter__(self):
        self.folder = os.path.realpath(self.folder)
        for name, real in REAL.items():
            setattr(os, name, self._watched(name, real))
        builtins.open = io.open = self._open
        return self

    def __exit__(self, *_):
        for name, real in REAL.items():
            setattr(os, name, real)
        builtins.open = io.open = REAL_OPEN

    def operation(self, name, path, half=lambda: None):
        """Count an operation; fail, if it is its turn."""
        path = os.fspath(path) if not isinstance(path, int) else os.readlink(f"/proc/self/fd/{path}")
        path = os.fsdecode(path)
        if not os.path.abspath(path).startswith(self.folder + os.sep):
            return
        number = self._count(name, os.path.relpath(path, self.folder))
        if number == self.number:
            self._fail(name, path, half)
        if self.how == "full" and 0 < self.number < number and name in ROOM:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), path)

    def _count(self, name, path):
        """Number of an operation, of all processes."""
        line = f"{name} {path}"[-WIDTH + 1 :].ljust(WIDTH - 1) + "\n"
        file = os.open(self.notes, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
        os.write(file, line.encode())  # at its end, whoever else writes
        number = os.lseek(file, 0, os.SEEK_CUR) // WIDTH
        os.close(file)
        return number

    def _fail(self, name, path, half):
        if self.report:
            with REAL_OPEN(self.report, "a") as report:
                report.write(f"{self.how} at operation {self.number}: {name} {path}\n")
                report.write("".join(traceback.format_stack(limit=12)[:-2]))
        if self.how != "error":
            half()
        if self.how == "kill":
            os.killpg(os.getpgid(0), signal.SIGKILL)
        code = errno.ENOSPC if self.how == "full" else errno.EIO
        raise OSError(code, os.strerror(code), path)

    def _watched(self, name, real):
        def function(path, *arguments, **options):
            self.operation(name, path)
            return real(path, *arguments, **options)

        return function

    def _open(self, file, mode="r", buffering=-1, encoding=None, errors=None, newline=None, closefd=True, opener=None):
        if isinstance(file, int) or not set(mode) & set("wax+"):
            return REAL_OPEN(file, mode, buffering, encoding, errors, newline, closefd, opener)
        self.operation("open", file)
        raw = _Raw(file, mode.replace("b", "").replace("t", ""), self, opener)
        if buffering == 0:
            return raw
        buffered = (io.BufferedRandom if "+" in mode else io.BufferedWriter)(raw)
        if "b" in mode:
            return buffered
        return io.TextIOWrapper(buffered, io.text_encoding(encoding), errors, newline, line_buffering=buffering == 1)

    def watch_library(self, function):
        """A method of a dataset that writes a file, as one operation."""

        def write(data, path=None, *arguments, **options):
            def half():
                function(data, path, *arguments, **options)
                os.truncate(path, os.path.getsize(path) // 2)

            if path is not None:
                self.operation("library", path, half)
            return function(data, path, *arguments, **options)

        return write


class _Raw(io.FileIO):
    """A file without a buffer, whose writes are counted."""

    def __init__(self, file, mode, faults, opener):
        super().__init__(file, mode, opener=opener)
        self._faults = faults

    def write(self, data):
        half = bytes(data)[: memoryview(data).nbytes // 2]
        self._faults.operation("write", self.name, lambda: super(_Raw, self).write(half))
        return super().write(data)


def operations(notes):
    """Operations and their files, from the notes of `Faults`."""
    return [tuple(line.split(maxsplit=1)) for line in notes.read_text().splitlines()]
