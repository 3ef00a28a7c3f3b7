"""Stored results: one HDF5 file a mesh and stage, results by the hash of their inputs.

Scalars and texts are one JSON text, since groups with attributes cost more than solving; arrays are datasets. Former
results stay, so that going back to them is free. A file starts with its checksum and its name in a user block, which
are compared before HDF5 reads the rest: files whose names were exchanged are made again.
"""

import hashlib
import json
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from springtune.safe_io import atomic

from .checked_json import DamagedError, set_aside

if TYPE_CHECKING:
    import h5py

SCALARS = "scalars"

MAGIC = b"springtune results, SHA-256 of what follows after 512 bytes: "

LIMITS = "limits"
"""Name under which the failed result of a task beyond its limits has these, in words; readers do not get it."""

USER_BLOCK, CHECKSUM = 512, 64
"""Length of the block before HDF5's own, and of the checksum in it [bytes]."""


@contextmanager
def _opened(path: str | Path) -> "Iterator[tuple[h5py.File, dict[str, dict[str, Any]]]]":
    """Context of a file whose checksum is right, and its scalars."""
    _check(path)
    import h5py  # here: a plan reads no results

    with h5py.File(path) as file:
        yield file, json.loads(file[SCALARS][()])


def _check(path: str | Path) -> None:
    """Compare a file with its checksum."""
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise DamagedError(path, error.strerror or "cannot be read") from None
    if not content:
        raise DamagedError(path, "it is empty")
    if content[:USER_BLOCK] != (wanted := _user_block(path, content[USER_BLOCK:])):
        if not content.startswith(MAGIC):
            raise DamagedError(path, "it is no file of results")
        sound = content.startswith(wanted[: len(MAGIC) + CHECKSUM])
        raise DamagedError(path, f"its {'name' if sound else 'checksum'} is not that of its content")


def _user_block(path: str | Path, image: bytes) -> bytes:
    return (MAGIC + hashlib.sha256(image).hexdigest().encode() + Path(path).name.encode()).ljust(USER_BLOCK, b"\0")


def stored(path: str | Path, limits: str | None = None) -> set[str]:
    """Keys of stored results; a damaged file is renamed and counts as empty."""
    if not Path(path).exists():
        return set()
    try:
        with _opened(path) as (_, scalars):
            pass
    except DamagedError as error:
        set_aside(error)
        return set()
    return {name for name, result in scalars.items() if limits is None or result.get(LIMITS, limits) == limits}


def read(path: str | Path, names: Iterable[str], fields: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """Read results."""
    with _opened(path) as (file, scalars):
        names = list(names)
        lacking = [name for name in names if name not in scalars]
        if lacking:
            raise DamagedError(path, f"it lacks {len(lacking)} of {len(names)} results", whole=True)
        results = {name: {label: value for label, value in scalars[name].items() if label != LIMITS} for name in names}
        for name, result in results.items() if fields else ():
            if name in file:
                result |= {label: file[name][label][()] for label in fields if label in file[name]}
    return results


def contents(path: str | Path) -> dict[str, dict[str, Any]]:
    """All stored results, in the form that `add` takes."""
    with _opened(path) as (file, found):
        for name, result in found.items():
            result |= {label: array[()] for label, array in file[name].items()} if name in file else {}
    return found


def read_one(folder: str | Path, key: str, fields: Sequence[str] = ()) -> dict[str, Any]:
    """Read a result with a file of its own, named by its key."""
    return read(Path(folder) / f"{key}.h5", [key], fields)[key]


KEPT_BACK = 5.0
"""Seconds between writes of a `Keeper`: writing costs as much as computing small results."""


class Keeper:
    """Context that stores results at intervals and at its end, so that a failure loses little."""

    def __init__(self, path: str | Path) -> None:
        self.path, self.results, self.since = path, dict[str, Mapping[str, Any]](), time.perf_counter()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._write()

    def __setitem__(self, key: str, result: Mapping[str, Any]) -> None:
        self.results[key] = result
        if time.perf_counter() > self.since + KEPT_BACK:
            self._write()

    def _write(self) -> None:
        add(self.path, self.results)
        self.results, self.since = {}, time.perf_counter()


def add(path: str | Path, results: Mapping[str, Mapping[str, Any]]) -> None:
    """Add results to a file atomically.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "results.h5"
    ...     add(path, {"one": {"displacement": 1.25e-3, "field": np.arange(3.0)}})
    ...     read(path, stored(path), ["field"])
    {'one': {'displacement': 0.00125, 'field': array([0., 1., 2.])}}
    """
    if not results:
        return
    scalars: dict[str, dict[str, Any]] = {}
    # In memory: what is on the disk is written at once, checksum and all.
    import h5py  # here: a plan reads no results

    with h5py.File("results", "w", driver="core", backing_store=False) as file:
        if stored(path):
            with h5py.File(path) as before:
                known = json.loads(before[SCALARS][()])
                scalars = {name: kept for name, kept in known.items() if name not in results}
                for name in before:
                    if name in scalars:
                        before.copy(name, file)
        for name, result in results.items():
            scalars[name] = {}
            for label, value in result.items():
                if isinstance(value, np.ndarray):
                    file.create_dataset(f"{name}/{label}", data=value)
                else:
                    scalars[name][label] = value.item() if isinstance(value, np.generic) else value
        file[SCALARS] = json.dumps(scalars)
        file.flush()
        image = file.id.get_file_image()
    atomic.write_bytes(path, _user_block(path, image) + image)
