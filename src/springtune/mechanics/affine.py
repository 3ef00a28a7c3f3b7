"""Stiffness of networks whose particles all follow an even strain: closed forms, before anything relaxes."""

import numpy as np

from ..mesh.cells import Mesh
from .moduli import Elastic, unit_fields, work_of
from .network import Network


def affine_stiffness(mesh: Mesh, springs: Elastic) -> np.ndarray:
    """Return the plane-stress stiffness if all particles followed an even strain (Cauchy and Born).

    For springs ``C_ijkl t = 1/A sum k L^2 n_i n_j n_k n_l``, with C12 = C66; an upper bound of
    `springtune.mechanics.moduli.outline_stiffness`, with the same shape and unit, which a lattice attains.

    Examples
    --------
    The equilateral lattice, each spring the mean of two triangles: ``9/8, 3/8, 3/8`` of E t:

    >>> from types import SimpleNamespace
    >>> from springtune.mesh import lattice
    >>> mesh = lattice(12, 8)
    >>> springs = SimpleNamespace(relative=0.5 * mesh.cells_per_edge, energies=(), lateral=0.0)
    >>> abs(affine_stiffness(mesh, springs) * 3**0.5 / 2).round(6).tolist()
    [[1.125, 0.375, 0.0], [0.375, 1.125, 0.0], [0.0, 0.0, 0.375]]
    """
    network = Network(mesh, np.ones(mesh.points.shape, dtype=bool), springs.relative, springs.energies)
    fields = unit_fields(mesh)
    return work_of(fields, [network.linear_forces(field) for field in fields], mesh)
