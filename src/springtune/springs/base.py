"""What a definition returns, and how it refuses a mesh."""

from dataclasses import dataclass

import numpy as np


class DefinitionError(ValueError):
    """A definition that cannot live on a mesh or with a material; the message says why and what to do."""


@dataclass(frozen=True)
class Springs:
    """Parameters of a network.

    Attributes
    ----------
    reference : float
        Reference stiffness [N/m].
    relative : ndarray of float, shape (n_edges,)
        Stiffness of each spring over the reference stiffness [1].
    energies : tuple of Energy
        Energies besides the springs', their moduli over the reference stiffness.
    lateral : float
        Stress on the long faces over the axial stress [1] that goes with the springs in uniaxial scenes.
    evaluations : int
        Solves that finding the parameters took.
    linear_springs : ndarray of float, shape (n_edges,), or None
        Stiffness over the reference stiffness at rest of springs whose law is part of an energy [1].
    """

    reference: float
    relative: np.ndarray
    energies: tuple = ()
    lateral: float = 0.0
    evaluations: int = 0
    linear_springs: np.ndarray | None = None

    @property
    def spring_ratio(self):
        """Largest stiffness of a spring over the smallest one [1]; infinite where a spring has none."""
        springs = np.abs(self.relative if self.linear_springs is None else self.linear_springs)
        return float(springs.max() / springs.min()) if springs.min() > 0 else np.inf


def zero(mesh):
    """No springs, shape (n_edges,)."""
    return np.zeros(len(mesh.edges))


def triangles_only(mesh):
    """Refuse a mesh of quadrilaterals."""
    if len(mesh.quads):
        raise DefinitionError("needs triangles and the mesh has quadrilaterals; choose another mesh type")


def rectangles_only(mesh):
    """Sides of the rectangles of a mesh, refusing any other mesh.

    Returns
    -------
    along, across : ndarray of float, shape (n_quads,)
        Lengths of each quadrilateral's first and second side [m].
    """
    if len(mesh.triangles):
        raise DefinitionError("needs rectangles with both diagonals and the mesh has triangles; use mesh type 'braced'")
    lengths = mesh.edge_lengths[mesh.cell_edges[4]]
    tolerance = 1e-9 * lengths.max(axis=1)
    pairs = ((0, 2), (1, 3), (4, 5))  # opposite sides, and diagonals
    if any((np.abs(lengths[:, i] - lengths[:, j]) > tolerance).any() for i, j in pairs):
        raise DefinitionError("needs rectangles and the mesh has other quadrilaterals; use mesh type 'braced'")
    return lengths[:, 0], lengths[:, 1]


def from_rectangles(mesh, first, second, diagonal):
    """Springs from the stiffness that each rectangle gives its first and second pair of sides and its diagonals."""
    return mesh.sum_to_edges({4: np.stack([first, second, first, second, diagonal, diagonal], axis=1)})


def not_negative(stiffness):
    """Stiffnesses, refused where one is negative: such a network need not be stable."""
    bad = int((stiffness < 0).sum())
    if bad:
        raise DefinitionError(
            f"gives {bad} of {len(stiffness)} springs a negative stiffness; use a mesh with less slender or obtuse "
            "cells"
        )
    return stiffness
