"""What a sensitivity curve costs, counted."""

import numpy as np

from springtune.mechanics.network import Network
from springtune.mechanics.series import trace
from springtune.mechanics.statics import StaticProblem
from springtune.mesh import MESH_TYPES
from springtune.problem.boundary import held, weights
from springtune.problem.loads import LOADS


class Counted(Network):
    """A network that counts the tangents that it factorizes."""

    factorized_tangents = 0

    def factorize_matrix(self, *arguments, **options):
        self.factorized_tangents += 1
        return super().factorize_matrix(*arguments, **options)


def test_one_path_is_many_solves_worth():
    """Two hundred stiffnesses on one path take no more factorizations than one of them solved by itself."""
    mesh, kind = MESH_TYPES["structured"](0.1, 0.02, 5e-3), LOADS["traction"].kind
    pattern = weights(mesh, kind)

    def problem():
        return StaticProblem(Counted(mesh, held(mesh, kind), np.ones(len(mesh.edges))), pattern)

    loads = 2e4 / (0.866 * 2.1e8 * np.linspace(0.4, 1.6, 201))
    together, apart = problem(), [problem() for _ in loads[::50]]
    values, stable = trace(together, pattern, loads)
    found = [one.nonlinear(load) for one, load in zip(apart, loads[::50])]
    assert stable.all()
    np.testing.assert_allclose(values[::50], [np.tensordot(one.displacements, pattern, axes=2) for one in found],
                               rtol=1e-9)  # fmt: skip
    assert 1 <= together.network.factorized_tangents <= min(one.network.factorized_tangents for one in apart)
