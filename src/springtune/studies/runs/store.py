"""Stored results: one HDF5 file a mesh and stage, results by the hash of their inputs.

Scalars and texts are one JSON text, since HDF5 attributes cost more than solving; arrays are datasets. Former results
stay. Structures have checksums by the file format ``latest``, data by the filter Fletcher-32, and a file has its name
in it, so that damaged and exchanged files are found.
"""

import io
import json
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from springtune.safe_io import atomic

if TYPE_CHECKING:
    import h5py

SCALARS = "scalars"


class DamagedError(Exception):
    """A stored file is damaged or missing."""

    @property
    def path(self) -> Path:
        """The file."""
        return Path(self.args[0])

    def __str__(self) -> str:
        remedy = "delete it, and call" if self.path.exists() else "call"
        return f"{self.args[0]}: {self.args[1]}; {remedy} the same command again, which makes it anew"


@contextmanager
def _opened(path: str | Path) -> "Iterator[tuple[h5py.File, dict[str, dict[str, Any]]]]":
    """Context of a file, and its scalars."""
    import h5py  # here: a plan reads no results

    if not Path(path).exists():
        raise DamagedError(path, "it is missing")
    try:
        with h5py.File(path) as file:
            name, scalars = json.loads(file[SCALARS][()].tobytes())
            if name != Path(path).name:
                raise ValueError(f"it is {name}")
            yield file, scalars
    except (OSError, RuntimeError, LookupError, ValueError, TypeError, AttributeError) as error:
        reason = str(error).strip("'\"").partition("\n")[0]
        raise DamagedError(path, f"it is damaged ({reason})") from None


def stored_keys(path: str | Path) -> set[str]:
    """Keys of stored results."""
    if not Path(path).exists():
        return set()
    return set(read_all(path))


def read(path: str | Path, names: Iterable[str], fields: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """Read results."""
    names = list(names)
    with _opened(path) as (file, scalars):
        lacking = sum(name not in scalars for name in names)
        results = {name: dict(scalars[name]) for name in names if name in scalars}
        for name, result in results.items() if fields else ():
            if name in file:
                result |= {label: file[name][label][()] for label in fields if label in file[name]}
    if lacking:
        raise DamagedError(path, f"it lacks {lacking} of {len(names)} results")
    return results


def read_all(path: str | Path) -> dict[str, dict[str, Any]]:
    """Read the scalars of all results of a file."""
    with _opened(path) as (_, scalars):
        return scalars


def read_one(folder: str | Path, key: str, fields: Sequence[str] = ()) -> dict[str, Any]:
    """Read a result with a file of its own, named by its key."""
    return read(Path(folder) / f"{key}.h5", [key], fields)[key]


SECONDS_BETWEEN_WRITES = 5.0
"""Seconds between writes of a `ResultBuffer`: writing costs as much as computing small results."""


class ResultBuffer:
    """Context that stores results at intervals and at its end, so that a failure loses little."""

    def __init__(self, path: str | Path) -> None:
        self.path, self.results, self.since = path, dict[str, Mapping[str, Any]](), time.perf_counter()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._write()

    def __setitem__(self, key: str, result: Mapping[str, Any]) -> None:
        self.results[key] = result
        if time.perf_counter() > self.since + SECONDS_BETWEEN_WRITES:
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
    ...     read(path, stored_keys(path), ["field"])
    {'one': {'displacement': 0.00125, 'field': array([0., 1., 2.])}}
    """
    if not results:
        return
    import h5py  # here: a plan reads no results

    scalars: dict[str, dict[str, Any]] = {}
    # In memory: what is on the disk is written at once. The image of an open file has a stale checksum before HDF5 2.
    image = io.BytesIO()
    with h5py.File(image, "w", libver="latest") as file:
        if stored_keys(path):
            with _opened(path) as (before, known):
                scalars = {name: kept for name, kept in known.items() if name not in results}
                for name in before:
                    if name in scalars:
                        before.copy(name, file)
        for name, result in results.items():
            scalars[name] = {}
            for label, value in result.items():
                if isinstance(value, np.ndarray) and value.ndim:
                    _put(file, f"{name}/{label}", value)
                else:
                    scalars[name][label] = value.item() if isinstance(value, np.generic | np.ndarray) else value
        _put(file, SCALARS, np.frombuffer(json.dumps([Path(path).name, scalars]).encode(), np.uint8))
    atomic.write_bytes(path, image.getvalue())


def _put(file: "h5py.File", name: str, array: np.ndarray) -> None:
    """Store an array in one chunk, with its checksum; an empty one has nothing to check."""
    chunked = {"chunks": array.shape, "fletcher32": True} if array.size else {}
    file.create_dataset(name, data=array, **chunked)
