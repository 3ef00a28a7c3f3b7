"""A sheet in time: the masses of its particles, and its load switched on at rest."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.sparse.linalg import ArpackError

from ..mechanics.dynamics import Motion, masses
from ..mechanics.network import Network
from ..problem.loads import LoadKind
from ..springs import Springs
from .sheet import Sheet


def motion_of(
    sheet: Sheet, kind: LoadKind, springs: Springs, density: float, force: float = 0.0, **options: Any
) -> Motion:
    """Springs of a sheet with their masses, under a load.

    Parameters
    ----------
    density : float
        Of the material [kg/m3].
    force : float, optional
        With its sign [N].

    Examples
    --------
    >>> from springtune.mesh import MESH_TYPES
    >>> from springtune.problem.loads import LOADS
    >>> from springtune.problem.materials import Material
    >>> sheet = Sheet(MESH_TYPES["structured"](0.1, 0.02, 5e-3), 1e-3)
    >>> springs, _ = sheet.derive("lattice", Material(210e9, 0.3))
    >>> found = motion_of(sheet, LOADS["traction"].kind, springs, 7850.0, linear=True)
    >>> f"{1e9 * found.step_limit('central-difference'):.0f} ns"
    '602 ns'
    """
    inertia = masses(sheet.mesh, density, sheet.thickness) / springs.reference
    load = {} if "load" in options else {"load": force / springs.reference * sheet.pattern(kind, springs)}
    return Motion(sheet.problem(kind, springs).network, inertia, **(load | options))


def stable_steps(
    sheet: Sheet, springs: Springs, inertia: np.ndarray, integrators: Iterable[str], held: np.ndarray | None = None
) -> dict[str, float] | str:
    """Largest stable steps of springs about rest, undamped.

    Parameters
    ----------
    inertia : ndarray of float, shape (n_points,)
        Masses of the particles [kg].
    held : ndarray of bool, shape (n_points, 2), optional
        Which directions are held; none without.

    Returns
    -------
    dict of str to float, or str
        By integrator [s], infinite where any step is stable; or why they were not found.

    Examples
    --------
    >>> from springtune.mesh import MESH_TYPES
    >>> from springtune.problem.materials import Material
    >>> sheet = Sheet(MESH_TYPES["structured"](0.1, 0.02, 5e-3), 1e-3)
    >>> springs, _ = sheet.derive("lattice", Material(210e9, 0.3))
    >>> inertia = masses(sheet.mesh, 7850.0, sheet.thickness)
    >>> f"{1e9 * stable_steps(sheet, springs, inertia, ['central-difference'])['central-difference']:.0f} ns"
    '602 ns'
    """
    if held is None:
        free = np.zeros(sheet.mesh.points.shape, dtype=bool)
        network = Network(sheet.mesh, free, springs.relative, springs.energies)
    else:
        network = sheet.network(held, springs)
    motion = Motion(network, inertia / springs.reference)
    try:
        return {name: motion.step_limit(name) for name in integrators}
    except ArpackError as error:
        return str(error)
