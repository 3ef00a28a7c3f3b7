"""A definition, a mesh type and a load: what the library knows, without a study."""

import numpy as np

from springtune.mesh.cells import Mesh, mesh_type
from springtune.mesh.rows import right
from springtune.problem.loads import AXES, BOTTOM, TOP, Load, LoadKind
from springtune.springs import Springs, definition

LIFT = Load(LoadKind("lift", loaded=TOP, axis=1, held=((BOTTOM, AXES),)), 1.0)
"""The upper side is pulled up, the lower one is clamped."""


@definition("even", uniform=True)
def even(mesh, material, thickness):
    """Give every spring 0.8 E t, for the example's sake."""
    return Springs(0.8 * material.young_modulus * thickness, np.ones(len(mesh.edges)))


@mesh_type("left")
def left(length, height, size):
    """Squares cut by parallel diagonals, the other way than `right`."""
    made = right(length, height, size)
    return Mesh(made.points * [-1, 1] + [length, 0], made.triangles[:, ::-1])
