"""Small boundary-value problems that several tests solve."""

import numpy as np

from springtune.mesh import MESH_TYPES, lattice
from springtune.problem.loads import AXIAL
from springtune.scene.sheet import Sheet
from springtune.springs import Springs
from springtune.springs.lattice import uniform


def beam_problem(mesh_type="structured", length=0.1, height=0.02, size=5e-3, relative=None, kind=AXIAL):
    """A clamped beam pulled at its end: the problem and the weights of its mean end displacement."""
    mesh = MESH_TYPES[mesh_type](length, height, size)
    sheet = Sheet(mesh, 1.0)
    return sheet.problem(kind, Springs(1.0, (relative or uniform)(mesh))), sheet.weights(kind)


def roller_patch(cells, rows, stiffness):
    """Effective E t over the reference stiffness, and effective nu, of an exact lattice between rollers.

    Both ends of every line of points are given u_x = strain x; u_y is free but for one particle.
    """
    mesh = lattice(cells, rows)
    strain = 1e-3
    ends = np.zeros(len(mesh.points), dtype=bool)
    starts = np.arange(rows + 1) * (cells + 1)
    ends[starts] = ends[starts + cells] = True
    held = np.zeros((len(mesh.points), 2), dtype=bool)
    held[ends, 0] = True
    held[0, 1] = True
    network = Sheet(mesh, 1.0).network(held, Springs(1.0, stiffness(mesh)))
    given = np.zeros(mesh.points.shape)
    given[ends, 0] = strain * mesh.points[ends, 0]
    displacements = given + network.expand(network.factorize_tangent().solve(-network.linear_resistance(given)))
    # The pull on the right ends: every spring that crosses a cut, summed through the work of the whole strain.
    normals = network.rest_vectors / network.rest_lengths[:, None]
    elongations = np.einsum("ij,ij->i", normals, network.stretch(displacements))
    work = float(network.stiffness @ elongations**2)
    length, height = float(cells), float(np.ptp(mesh.points[:, 1]))
    young_times_thickness = work / (strain**2 * length * height)
    top = mesh.points[:, 1] == mesh.points[:, 1].max()
    bottom = mesh.points[:, 1] == 0.0
    shrink = displacements[bottom, 1].mean() - displacements[top, 1].mean()
    return young_times_thickness, shrink / height / strain
