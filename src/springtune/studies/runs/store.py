"""Stored results: one HDF5 file per mesh and stage, results by the hash of their inputs.

Scalars and texts are one JSON text, since HDF5 attributes cost more than solving. Arrays that are written together and
have one shape are rows of a dataset. Checksums and a file's name in it show damaged and exchanged files.
"""

import io
import json
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, Self

import numpy as np

from springtune.safe_io import write_bytes

SCALARS = "scalars"

LAYOUT = 2  # number of the layout of files, which changes with it

Places = dict[str, dict[str, tuple[str, int]]]  # dataset and row of arrays, by key and label


class DamagedError(Exception):
    """A stored file is damaged or missing."""

    @property
    def path(self) -> Path:
        """Path of the damaged file."""
        return Path(self.args[0])

    def __str__(self) -> str:
        remedy = "delete it, and call" if self.path.exists() else "call"
        return f"{self.args[0]}: {self.args[1]}; {remedy} the same command again, which makes it anew"


class OtherLayoutError(DamagedError):
    """Another version of this package wrote a stored file."""


@contextmanager
def _opened(path: str | Path) -> "Iterator[tuple[Any, dict[str, dict[str, Any]], Places]]":
    """Context of a file, its scalars by key and label, and the places of its arrays."""
    import h5py  # here: a plan reads no results

    if not Path(path).exists():
        raise DamagedError(path, "it is missing")
    try:
        with h5py.File(path) as file:
            layout, *content = json.loads(file[SCALARS][()].tobytes())
            if layout != LAYOUT:
                raise OtherLayoutError(path, "another version of springtune wrote it")
            name, scalars, places = content
            if name != Path(path).name:
                raise ValueError(f"it is {name}")
            yield file, scalars, places
    except (OSError, RuntimeError, LookupError, ValueError, TypeError, AttributeError) as error:
        reason = str(error).strip("'\"").partition("\n")[0]
        raise DamagedError(path, f"it is damaged ({reason})") from None


def stored_keys(path: str | Path) -> set[str]:
    """Keys of stored results; of another layout none, so that it is written anew."""
    with suppress(OtherLayoutError):
        return set(read_all(path)) if Path(path).exists() else set()
    return set()


def read(path: str | Path, names: Iterable[str], fields: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """Read results."""
    names = list(names)
    with _opened(path) as (file, scalars, places):
        if lacking := sum(name not in scalars for name in names):
            raise DamagedError(path, f"it lacks {lacking} of {len(names)} results")
        results = {name: dict(scalars[name]) for name in names}
        dataset, labels = cache(file.__getitem__), set(fields)
        for name, result in results.items() if labels else ():
            for label in places[name].keys() & labels:
                stack, row = places[name][label]
                result[label] = dataset(stack)[row]
        return results


def read_all(path: str | Path) -> dict[str, dict[str, Any]]:
    """Read the scalars of all results of a file."""
    with _opened(path) as (_, scalars, _places):
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
    """Add results to a file atomically; former results stay."""
    if not results:
        return
    import h5py  # here: a plan reads no results

    scalars: dict[str, dict[str, Any]] = {}
    places: Places = {}
    stacks: dict[tuple[str, tuple[int, ...], np.dtype], list[tuple[str, np.ndarray]]] = {}
    # In memory: what is on the disk is written at once. The image of an open file has a stale checksum before HDF5 2.
    image = io.BytesIO()
    with h5py.File(image, "w", libver="latest") as file:
        if stored_keys(path):
            with _opened(path) as (before, scalars, places):
                for stack in before.keys() - {SCALARS}:
                    before.copy(stack, file)
        for name, result in results.items():
            scalars[name], places[name] = {}, {}
            for label, value in result.items():
                if isinstance(value, np.ndarray) and value.ndim:
                    stacks.setdefault((label, value.shape, value.dtype), []).append((name, value))
                else:
                    scalars[name][label] = value
        for (label, _, _), members in stacks.items():
            stack = f"{label}_{len(file)}"
            places |= {name: places[name] | {label: (stack, row)} for row, (name, _) in enumerate(members)}
            _put(file, stack, np.stack([value for _, value in members]))
        numbers = [LAYOUT, Path(path).name, scalars, places]
        content = json.dumps(numbers, default=lambda value: value.tolist()).encode()  # of numpy
        _put(file, SCALARS, np.frombuffer(content, np.uint8)[np.newaxis])
    write_bytes(path, image.getvalue())


def _put(file: Any, name: str, rows: np.ndarray) -> None:
    """Store arrays, each in one chunk with its checksum; empty ones have nothing to check."""
    chunked = {"chunks": (1, *rows.shape[1:]), "fletcher32": True} if rows.size else {}
    file.create_dataset(name, data=rows, **chunked)
