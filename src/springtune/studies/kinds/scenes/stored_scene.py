"""Stored scenes: numbers under one key, whole fields under another, so that either is there without the other."""

from typing import Any

import numpy as np

from ...runs.checked_json import hash_of

FIELD_ARRAYS = {"displacements": "f8", "spring_stiffnesses": "f4", "spring_forces": "f4"}
"""Arrays of all particles and springs, and their types."""

PACKED = "fields"
"""What they are stored as: one array, since three take as long to write as the scene to solve."""


def calibrated_key(key: str, stiffness: float | None) -> str:
    """Key of a scene with a calibrated stiffness [N/m], or None."""
    return hash_of(key, stiffness)


def fields_key(key: str) -> str:
    """Key of the fields of a scene."""
    return hash_of(key, "fields")


def parts(task: dict[str, Any], result: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """What is stored of a result of a task, by key: numbers, and fields where these are kept."""
    fields = {fields_key(task["key"]): packed(result)} if task.get("keep_fields") else {}
    return fields | {task["key"]: {name: value for name, value in result.items() if name not in FIELD_ARRAYS}}


def packed(result: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Fields of a result as they are stored; nothing where it has none."""
    if not FIELD_ARRAYS.keys() <= result.keys():
        return {}
    arrays = [result[name].astype(kind).ravel() for name, kind in FIELD_ARRAYS.items()]
    lengths = np.array([len(array) for array in arrays])
    return {PACKED: np.concatenate([array.view("u1") for array in (lengths, *arrays)])}


def unpacked(stored: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Fields of what is stored: `packed`, undone.

    Returns
    -------
    dict
        ``displacements`` of the particles, shape (n_points, 2), ``spring_stiffnesses`` and ``spring_forces``.

    Examples
    --------
    >>> fields = {"displacements": np.ones((2, 2)), "spring_stiffnesses": np.ones(3), "spring_forces": np.zeros(3)}
    >>> {name: array.shape for name, array in unpacked(packed(fields)).items()}
    {'displacements': (2, 2), 'spring_stiffnesses': (3,), 'spring_forces': (3,)}
    """
    if PACKED not in stored:
        return {}
    head = 8 * len(FIELD_ARRAYS)
    lengths = stored[PACKED][:head].view("i8")
    sizes = [length * np.dtype(kind).itemsize for length, kind in zip(lengths, FIELD_ARRAYS.values())]
    parts = np.split(stored[PACKED][head:], np.cumsum(sizes)[:-1])
    found = {name: part.view(kind) for part, (name, kind) in zip(parts, FIELD_ARRAYS.items())}
    return found | {"displacements": found["displacements"].reshape(-1, 2)}
