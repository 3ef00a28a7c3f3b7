"""Small boundary-value problems that several tests solve."""

import numpy as np

import springtune as st
from springtune.mechanics.network import Network
from springtune.mechanics.statics import StaticProblem
from springtune.problem.loads import AXIAL
from springtune.scene.mesh_cache import MeshCache
from springtune.springs.lattice import uniform


def beam_problem(mesh_type="structured", length=0.1, height=0.02, size=5e-3, relative=None, kind=AXIAL):
    """A clamped beam pulled at its end: the problem and the weights of its mean end displacement."""
    mesh = st.MESH_TYPES[mesh_type](length, height, size)
    cache = MeshCache(mesh, 1.0)
    return cache.problem(kind, st.Springs(1.0, (relative or uniform)(mesh))), cache.loading(kind).pattern


CLAMP = (st.Support("left", x=0, y=0),)


def pulled(*force, name="pull", components="x", supports=CLAMP, others=()):
    """Load case of a force on the right side, the left one held; its displacements there, and others."""
    ends = [st.Quantity("end" if components == one else one, "displacement", "right", one) for one in components]
    return st.LoadCase(name, supports, [st.Traction("right", force)], quantities=[*ends, *others])


def outline(*sides):
    """Sides of a shape by their corners and groups; those of arcs with their centres."""
    return [st.Segment(corner, *(centre or [None]), group) for corner, group, *centre in sides]


def asked(**told):
    """Quantities by their names: kind, place and component."""
    return tuple(st.Quantity(name, *words.split()) for name, words in told.items())


class CountedNetwork(Network):
    """A network that counts the matrices that it factorizes."""

    taken = 0

    def factorize_matrix(self, *arguments, **options):
        self.taken += 1
        return super().factorize_matrix(*arguments, **options)


def free_network(mesh, springs):
    """The network of springs on a mesh of which nothing is held."""
    return Network(mesh, np.zeros(mesh.points.shape, dtype=bool), springs.relative, springs.energies)


def arch(stiffness=1.0, rise=0.1):
    """Two springs from supports 2 m apart to a particle in the middle, so high above them (von Mises' truss)."""
    mesh = st.Mesh(np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, rise]]), np.array([[0, 1, 2]]))
    held = np.array([[True, True], [True, True], [True, False]])
    network = Network(mesh, held, stiffness * (mesh.edges != [0, 1]).any(axis=1))
    return StaticProblem(network, np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]]))
