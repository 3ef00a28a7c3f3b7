"""A sheet in time: the masses of its particles, and its load switched on at rest."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.sparse.linalg import ArpackError

from ..mechanics.dynamics import Motion, masses
from ..problem.loads import LoadKind
from ..springs.base import Springs
from .mesh_cache import MeshCache


def motion_of(
    cache: MeshCache, kind: LoadKind, springs: Springs, density: float, force: float = 0.0, **options: Any
) -> Motion:
    """Springs of a sheet with their masses under a force with its sign [N]; density in kg/m3."""
    inertia = masses(cache.mesh, density, cache.thickness) / springs.reference
    load = {} if "load" in options else {"load": force / springs.reference * cache.pattern(kind, springs)}
    return Motion(cache.problem(kind, springs).network, inertia, **(load | options))


def stable_steps(
    cache: MeshCache, springs: Springs, inertia: np.ndarray, integrators: Iterable[str], held: np.ndarray | None = None
) -> dict[str, float] | str:
    """Largest stable steps [s] about rest, undamped, by integrator, or why not found; `inertia` is in kg."""
    held = np.zeros(cache.mesh.points.shape, dtype=bool) if held is None else held
    motion = Motion(cache.network(held, springs), inertia / springs.reference)
    try:
        return {name: motion.step_limit(name) for name in integrators}
    except ArpackError as error:
        return str(error)
