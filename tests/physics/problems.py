"""Small boundary-value problems that several tests solve."""

import numpy as np

from springtune.mechanics.network import Network
from springtune.mesh import MESH_TYPES
from springtune.problem.loads import AXIAL
from springtune.scene.sheet import Sheet
from springtune.springs import Springs
from springtune.springs.lattice import uniform


def beam_problem(mesh_type="structured", length=0.1, height=0.02, size=5e-3, relative=None, kind=AXIAL):
    """A clamped beam pulled at its end: the problem and the weights of its mean end displacement."""
    mesh = MESH_TYPES[mesh_type](length, height, size)
    sheet = Sheet(mesh, 1.0)
    return sheet.problem(kind, Springs(1.0, (relative or uniform)(mesh))), sheet.weights(kind)


def free_network(mesh, springs):
    """The network of springs on a mesh of which nothing is held."""
    return Network(mesh, np.zeros(mesh.points.shape, dtype=bool), springs.relative, springs.energies)
