"""Stage `interpolate`: the references of all beams of a sample, as one function of aspect and Poisson's ratio."""

import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from ...jobs import store
from ...jobs.spent import Spent
from ...problem.loads import LOAD_KINDS, LoadKind
from ...reference.interpolant import Interpolant, NotCertifiedError


def run(tasks: dict[str, Any], spent: Spent) -> None:
    """Build the interpolants that are not there yet.

    Parameters
    ----------
    tasks : dict
        ``folder`` and ``references``, each with ``key``, ``kind`` (of load, by name), ``aspect_range`` and
        ``nu_range``.
    spent : Spent
        What tasks cost is added to it.
    """
    for path, task in store.missing(tasks["folder"], tasks["references"], spent.limits):
        begin = time.perf_counter()
        result = spent.attempt(task["key"], partial(_built, task), _hole)
        if result is not None:
            store.add(path, {task["key"]: result})
            spent.add("interpolant", 0, time.perf_counter() - begin)


def lose(tasks: dict[str, Any], key: str, why: str, limits: str) -> None:
    """Store that an interpolant is beyond its limits; parameters as of other stages."""
    store.lose(tasks["folder"], key, _hole(why), limits)


def _hole(why: str) -> dict[str, Any]:
    return {"message": why}


def _built(task: Mapping[str, Any]) -> dict[str, Any]:
    try:
        found = Interpolant.build(LOAD_KINDS[task["kind"]], task["aspect_range"], task["nu_range"])
    except NotCertifiedError as error:
        return _hole(str(error))
    return found.arrays() | {"message": ""}


def read(folder: str | Path, key: str, kind: LoadKind) -> tuple[Interpolant | None, str]:
    """Interpolant of a stored result, and why there is none.

    Parameters
    ----------
    folder : str or Path
    key : str
    kind : LoadKind

    Returns
    -------
    Interpolant or None
    str
    """
    found = store.read_one(folder, key, ("values", "aspect_range", "nu_range"))
    return (None if found["message"] else Interpolant.from_arrays(kind, found)), found["message"]
