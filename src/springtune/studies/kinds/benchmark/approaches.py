"""Other ways to a beam's displacement, for the benchmark: finite elements, CalculiX and pre-computed responses.

Each takes a scene, a mesh size and a clock, and returns the displacement of the loaded side and the number of unknowns.
All are linear.
"""

import time
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from springtune.linalg.factors import factorize
from springtune.mesh.rows import structured
from springtune.mesh.types import MESH_TYPES
from springtune.problem.boundary import held, measured, weights
from springtune.reference import calculix
from springtune.scene.sheet import Sheet


def network(scene, size, clock, definition, mesh_type):
    """A definition, linear; definitions share meshes, whose time counts for each of them."""
    mesh, seconds = _made(mesh_type, scene.beam, size)
    clock.seconds["meshing"] += seconds
    with clock("assembling"):
        sheet, springs, problem = _problem(scene, mesh, definition)
        problem.network.tangent()
    with clock("factorizing"):
        problem.network.rest_factor  # noqa: B018  factorized when first asked for
    with clock("solving"):
        found = problem.linear(scene.force / springs.reference)
    if not found.converged:
        raise ArithmeticError(found.reason)
    return sheet.displacement(scene.kind, found.displacements), problem.network.unknowns


@lru_cache(maxsize=len(MESH_TYPES))
def _made(mesh_type, beam, size):
    MESH_TYPES[mesh_type](1.0, 0.5, 0.25)  # libraries are read
    begin = time.perf_counter()
    mesh = MESH_TYPES[mesh_type](beam.length, beam.height, size)
    mesh.edges  # noqa: B018  computed when first asked for
    return mesh, time.perf_counter() - begin


def _problem(scene, mesh, definition):
    """Sheet, springs and static problem; forces that a definition adds to a load are left out."""
    sheet = Sheet(mesh, scene.beam.thickness)
    springs = replace(sheet.derive(definition, scene.material)[0], lateral=0.0)
    sheet.measured(scene.kind)
    return sheet, springs, sheet.problem(scene.kind, springs)


def _mesh(scene, size, clock):
    with clock("meshing"):
        mesh = structured(scene.beam.length, scene.beam.height, size)
        mesh.edges  # noqa: B018  computed when first asked for
    return mesh


def _middle(scene, places, moved):
    """Displacement of the middle of the loaded side, of particles at places along it [m]."""
    order = np.argsort(places)
    return float(np.interp(scene.kind.side_length(scene.beam) / 2, places[order], moved[order]))


def triangles(scene, size, clock, degree):
    """Triangles of scikit-fem on equilateral rows."""
    from skfem import Basis, ElementTriP1, ElementTriP2, ElementVector, FacetBasis, LinearForm, MeshTri
    from skfem.models.elasticity import linear_elasticity

    with clock("meshing"):
        made = structured(scene.beam.length, scene.beam.height, size)
        mesh = MeshTri(made.points.T.copy(), made.triangles.T.copy())
    with clock("assembling"):
        element = ElementVector((ElementTriP1, ElementTriP2)[degree - 1]())
        basis = Basis(mesh, element)
        young, nu = scene.sheet.young_modulus, scene.sheet.poisson_ratio
        lam, mu = young * nu / (1 - nu**2), young / (2 * (1 + nu))  # in the plane
        matrix = linear_elasticity(lam, mu).assemble(basis) * scene.beam.thickness
        value, along, axis = scene.side
        side = FacetBasis(mesh, element, facets=mesh.facets_satisfying(lambda x: np.isclose(x[along], value)))
        load = LinearForm(lambda v, w: v[axis]).assemble(side)
        mean = load / load.sum()
        clamp = basis.get_dofs(lambda x: np.isclose(x[scene.kind.normal], 0.0)).all()
        free = np.setdiff1d(np.arange(len(load)), clamp)
        matrix = matrix[free][:, free].tocsc()
    with clock("factorizing"):
        factor = factorize(matrix)
    with clock("solving"):
        solution = np.zeros(len(load))
        solution[free] = factor.solve(scene.force * mean[free])
    if scene.kind.pressed:
        middle = np.array([[scene.beam.length / 2], [scene.beam.height / 2]])
        middle[along] = value - 1e-12
        return float((basis.probes(middle) @ solution).ravel()[axis]), len(free)
    return float(mean @ solution), len(free)


def condensation(scene, size, clock):
    """Responses of the loaded side to unit loads, computed once (``factorizing``); a load then costs a product."""
    mesh = _mesh(scene, size, clock)
    with clock("assembling"):
        sheet, springs, problem = _problem(scene, mesh, "delingette")
        problem.network.tangent()
    with clock("factorizing"):
        net, factor = problem.network, problem.network.rest_factor
        loaded = np.flatnonzero(problem.load)
        responses = np.zeros((len(loaded), len(loaded)))
        watched = net.reduce(sheet.measured(scene.kind))
        unit = np.zeros(net.unknowns)
        of_watched = np.zeros(len(loaded))
        for number, place in enumerate(loaded):
            unit[place] = 1.0
            answer = factor.solve(unit)
            responses[:, number], of_watched[number] = answer[loaded], watched @ answer
            unit[place] = 0.0
    with clock("solving"):
        forces = scene.force / springs.reference * problem.load[loaded]
        responses @ forces
        displacement = float(of_watched @ forces)
    return displacement, len(loaded)


def calculix_cps3(scene, size, clock):
    """CalculiX with linear triangles, the same as ours."""
    mesh = _mesh(scene, size, clock)
    load = scene.force * weights(mesh, scene.kind)
    with clock("solving"):
        found = calculix.solve(
            mesh.points, mesh.triangles, "CPS3", scene.material, scene.beam.thickness, load, held(mesh, scene.kind)
        )
    return float(np.tensordot(found, measured(mesh, scene.kind), axes=2)), int((~held(mesh, scene.kind)).sum())


def calculix_cps8(scene, size, clock):
    """CalculiX with quadratic serendipity quadrilaterals."""
    value, along, axis = scene.side
    with clock("meshing"):
        points, elements = calculix.quadratic_mesh(scene.beam.length, scene.beam.height, size)
        shares = calculix.side_weights(points, along, value)
        load = np.zeros(points.shape)
        load[:, axis] = scene.force * shares
        clamp = np.zeros(points.shape, dtype=bool)
        clamp[points[:, scene.kind.normal] == 0.0] = True
    with clock("solving"):
        found = calculix.solve(points, elements, "CPS8", scene.material, scene.beam.thickness, load, clamp)
    moved = found[:, axis]
    if scene.kind.pressed:
        loaded = np.flatnonzero(shares)
        return _middle(scene, points[loaded, scene.kind.along], moved[loaded]), int((~clamp).sum())
    return float(moved @ shares), int((~clamp).sum())


APPROACHES = {
    "linear-triangles": partial(triangles, degree=1),
    "quadratic-triangles": partial(triangles, degree=2),
    "condensation": condensation,
    "calculix-cps3": calculix_cps3,
    "calculix-cps8": calculix_cps8,
}
"""Approaches besides definitions, by their names in `OTHER_APPROACHES`."""
