r"""Springs fitted, none negative, to patch tests under constant, linear, quadratic and cubic stresses; no reference.

A sheet under no body force, whatever its outline and its holes, has displacements in closed form for polynomial
stresses (Kolosov's formulas: N. Muskhelishvili, Some basic problems of the mathematical theory of elasticity, 1953):
with z = x + i y and analytic phi, psi

.. math:: 2 \mu (u + i v) = \kappa \varphi - z \overline{\varphi'} - \overline{\psi}, \qquad
          \sigma_{xx} + \sigma_{yy} = 4 \, \mathrm{Re} \, \varphi', \qquad
          \sigma_{yy} - \sigma_{xx} + 2 i \sigma_{xy} = 2 (\bar z \varphi'' + \psi'),

kappa = (3 - nu) / (1 + nu), mu = E / (2 (1 + nu)). phi and psi = z^m, i z^m for m = 1 to 4 give 15 tests: 3 of constant
stress (tension, shear), 4 of linear (bending), 4 of quadratic (shear forces), 4 of cubic stress. They are combined so
that the sheet's energies ``G_ab = integral of t_a . u_b along the outline`` are the unit matrix.

Let F have the tests' forces on the particles as columns, and K(k) be the stiffness of the free network. The network
has ``M = F^T K^-1 F`` in place of the unit matrix I. The springs s = 1 to n minimise

.. math:: \| M(k) - I \|^2 + \frac{\lambda}{n} \sum_s \ln^2 (k_s / k_{s,0})

about those of `springtune.springs.van_gelder`, k0 (form for nu = 0: exact on lattices), with lambda = 0.1. With the
elongations e_s of a spring in the tests, a row of ``B K^-1 F``, ``d M / d ln k_s = - k_s e_s e_s^T``: at most four
Gauss-Newton steps, each one factorization of the mesh, 15 solves and a system of 120 unknowns. Logarithms keep every
spring above zero, so any triangles are stable at rest. Turning, shifting or scaling the mesh does not change the
springs.

Central springs have nu = 1/3 (Cauchy's relation), so the tests have that ratio and the wanted E, whatever nu is.
Where cells repeat, Cauchy's relation holds in each: rows of isosceles triangles of base a and height h have ``C2222 /
C1212 = (2 h / a)^2`` with any springs, which is 3 if isotropic. In rows of h = a, as in free meshes of 5 mm in 20 mm,
it is 4: one of the two is off by 1/7 or more. Derived here.

The tests, lambda and steps are chosen by results on the beams and shapes of docs/which-definition.md, which names
where they fail, in curved beams above all. Assumptions: triangles, in one part.
"""

from collections.abc import Iterator

import numpy as np

from ..mesh.cells import Mesh
from ..problem.materials import Material
from . import van_gelder
from .base import Springs, definition
from .identification import tested_body

NU = 1 / 3  # Poisson's ratio of springs alone [1]

TEST_DEGREE = 4  # degree of the displacements of the tests, one above that of the stresses

TESTS = 4 * TEST_DEGREE - 1  # polynomial solutions up to that degree that are no rigid motion

LEAST_ENERGY_SHARE = 1e-12  # energy of a test over the largest one's; less is rounding, as in very slender sheets [1]

CHANGE_WEIGHT = 0.1
"""lambda: weight of the mean squared logarithm of a spring's change against the squared misfit of the tests [1]."""

STEPS, LARGEST_STEP, LAST_STEP = 4, 1.0, 0.3
"""Most Gauss-Newton steps; largest change of a logarithm in one, and that below which it is the last [1]."""


@definition("patch-fit", order=195, cells=(3,), cost=1)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs fitted to 15 patch tests of the mesh itself, from even to cubic stresses: none negative, nu = 1/3.

    Raises DefinitionError on quadrilaterals and on meshes of several parts.

    Source: own rule (derived).
    """
    from ..mechanics.network import Network  # here: see `springtune.springs`

    held = tested_body(mesh)
    start = van_gelder.springs(mesh, material, thickness).relative
    forces, _ = polynomial_tests(mesh)
    first, second = np.triu_indices(len(forces))
    # Entries beside the diagonal stand for two.
    twice = np.where(first == second, 1.0, np.sqrt(2.0))
    logarithms, network, evaluations = np.zeros(len(start)), None, 0
    while evaluations < STEPS:
        evaluations += 1
        network = Network(mesh, held, start * np.exp(logarithms), like=network)
        loads = [network.reduce(force) for force in forces]
        moved = [network.rest_factor.solve(load) for load in loads]
        normals = network.rest_vectors / network.rest_lengths[:, None]
        pulled = [(normals * network.end_differences(network.expand(field))).sum(axis=1) for field in moved]
        elongations = np.sqrt(network.stiffness)[:, None] * np.stack(pulled, axis=1)
        slope = -twice * elongations[:, first] * elongations[:, second]
        misfit = twice * (np.eye(len(forces)) - np.array(loads) @ np.array(moved).T)[first, second]
        normal = slope.T @ slope
        normal[np.diag_indices(len(normal))] += CHANGE_WEIGHT / len(start)
        change = slope @ np.linalg.solve(normal, misfit + slope.T @ logarithms) - logarithms
        largest = np.abs(change).max()
        logarithms += change * min(1.0, LARGEST_STEP / largest)
        if largest < LAST_STEP:
            break
    return Springs(material.young_modulus * thickness, start * np.exp(logarithms), evaluations=evaluations)


def polynomial_tests(
    mesh: Mesh, nu: float = NU, degrees: range = range(1, TEST_DEGREE + 1)
) -> tuple[np.ndarray, np.ndarray]:
    """Return forces of at most `TESTS` tests with polynomial stresses, and displacements of some `degrees`.

    Both are (n_tests, n_points, 2), for E t = 1. Times the square root of E t the forces are in N, with a work of 1 J
    on their own displacements and 0 on others'.
    """
    x, y = (mesh.points - mesh.points.mean(axis=0)).T
    places = (x + 1j * y) / np.hypot(x, y).max()
    # Sides of triangles run counter-clockwise around them: those of the outline have the sheet on their left.
    sides = np.concatenate([mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]], mesh.triangles[:, [0, 1]]])
    begin, end = sides[mesh.on_outline[mesh.cell_edges[3].T.ravel()]].T
    here, along = places[begin], places[end] - places[begin]
    inside = np.array([field for field, _ in _solutions(places, places, nu, degrees)])
    at_begin, at_end = np.zeros((2, len(inside), len(here)), dtype=complex)
    work = np.zeros((len(inside), len(inside)))
    # As many points as the degree integrate stresses times displacements exactly.
    for position, share in zip(*np.polynomial.legendre.leggauss(degrees[-1])):
        part = 0.5 * (1 + position)
        fields, tractions = np.stack(list(_solutions(here + part * along, -1j * along, nu, degrees)), axis=1)
        work += 0.5 * share * np.real(tractions @ fields.conj().T)
        at_begin += 0.5 * share * (1 - part) * tractions
        at_end += 0.5 * share * part * tractions
    forces, particles = [], np.concatenate([begin, end])
    for pulls in np.concatenate([at_begin, at_end], axis=1):
        axes = [np.bincount(particles, axis, len(places)) for axis in (pulls.real, pulls.imag)]
        forces.append(np.stack(axes, axis=1))
    energies, mixtures = np.linalg.eigh(0.5 * (work + work.T))
    significant = energies > LEAST_ENERGY_SHARE * energies[-1]
    mixtures = mixtures[:, significant] / np.sqrt(energies[significant])
    moved = np.stack([inside.real, inside.imag], axis=2)
    return np.einsum("ab,anx->bnx", mixtures, np.array(forces)), np.einsum("ab,anx->bnx", mixtures, moved)


def _solutions(
    places: np.ndarray, normals: np.ndarray, nu: float, degrees: range
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Displacement and traction along a normal of each polynomial solution for E = 1, as x + i y."""
    kappa, shear = (3 - nu) / (1 + nu), 1 / (2 * (1 + nu))
    for power in degrees:
        whole, slope = places**power, power * places ** (power - 1)
        bend = power * (power - 1) * places ** max(power - 2, 0)
        for phi, psi in ((1, 0), (1j, 0), (0, 1), (0, 1j)):
            if (power, phi) == (1, 1j):  # a rotation
                continue
            moved = kappa * phi * whole - places * np.conj(phi * slope) - np.conj(psi * whole)
            mean, apart = 2 * np.real(phi * slope), places.conj() * phi * bend + psi * slope
            # sigma . n of the real matrix as one number: mean part along n, deviatoric part along its conjugate.
            yield moved / (2 * shear), mean * normals - np.conj(apart * normals)
