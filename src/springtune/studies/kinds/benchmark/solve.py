"""Stage `benchmark`: run time, without a first run, and error of definitions on all mesh types and other approaches."""

import time
import traceback
from collections import Counter, defaultdict
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from itertools import chain, product

import numpy as np
from scipy.sparse import diags_array
from scipy.sparse.linalg import LinearOperator, cg

from springtune.linalg.factors import factorize
from springtune.mechanics import PRECISIONS
from springtune.mechanics.stepping import make_stepper
from springtune.mesh.cells import MESH_TYPES
from springtune.mesh.rows import structured
from springtune.problem.boundary import held_directions, measured_weights, weights
from springtune.problem.compare import deformation_error
from springtune.problem.loads import LOADS, LoadKind
from springtune.problem.materials import Material, material_of
from springtune.problem.quantities import Status
from springtune.problem.shapes import Beam
from springtune.reference import calculix
from springtune.reference.small_strain import solve_small_strain
from springtune.scene.mesh_cache import MeshCache
from springtune.scene.motion import motion_of
from springtune.springs.base import DefinitionError

from ...runs.attempts import failure_reason
from . import PARTS, THREAD_COUNTS

REPETITIONS = 3

LONG_CASE_SECONDS = 0.4  # cases that take longer run once

EXPLICIT_UPDATES = 4_000_000  # springs times steps of a timed explicit run

FEWEST_STEPS = 50  # fewest steps of a timed explicit run


def failed(task, why):
    """Rows of a scene of which nothing could be measured."""
    return {"rows": [labels | _failed_case(why) for labels in cases(**task)]}


def solve(task):
    """Measure errors and seconds of a scene."""
    scene = LoadedBeam(Beam(**task["beam"]), material_of(task["material"]), LOADS[task["load"]].kind, task["force"])
    rows = measure(scene, list(cases(**task)), task["most_seconds"])
    return {"rows": [*rows, *(explicit(scene, task["mesh_sizes"]) if task["explicit"] else ())]}


def cases(approaches, mesh_sizes, finest, **_):
    """Yield the labels of the cases of a scene, from coarse to fine, down to the ``finest`` size of an approach [m]."""
    for size in sorted(mesh_sizes, reverse=True):
        for approach, least in zip(approaches, finest):
            if size >= least:
                yield {"approach": approach, "mesh_size": size}


@dataclass(frozen=True)
class LoadedBeam:
    """A beam under a load, see `springtune.problem.loads`."""

    beam: Beam
    material: Material
    kind: LoadKind
    force: float

    @property
    def side(self):
        """Coordinate of the loaded side [m], axis of that coordinate, axis of the force."""
        return self.kind.loaded.place(self.beam.length, self.beam.height), self.kind.normal, self.kind.axis


class Clock(Counter[str]):
    """Seconds of each part of a run."""

    @contextmanager
    def __call__(self, part):
        """Add the seconds of this context to a part."""
        begin = time.perf_counter()
        yield
        self[part] += time.perf_counter() - begin


def measure(scene, cases, most_seconds):
    """Rows of the reference and of all cases, from coarse to fine; an approach that is too slow fails from there."""
    clock, beyond, rows = Clock(), {}, defaultdict(list)
    with clock("solving"):
        reference = solve_small_strain(scene.beam, scene.material, scene.force, kind=scene.kind)
    for case in cases:
        approach, size = case["approach"], case["mesh_size"]
        begin = time.perf_counter()
        found = _failed_case(beyond[approach]) if approach in beyond else _measure_case(scene, approach, size)
        if time.perf_counter() - begin > most_seconds:
            limit = f"it took longer than the {most_seconds:g} s of `most_seconds`"
            beyond[approach] = f"not run: at {1e3 * size:g} mm {limit}"
        found["error"] = float(deformation_error(found.get("displacement", np.nan), reference.displacement))
        rows[approach].append(case | found)
    for own in rows.values():
        errors = np.array([[row["error"] for row in reversed(own)]])
        for row, error in zip(reversed(own), largest_finer_errors(errors)[0].tolist()):
            row["assured_error"] = error
    about = {
        "reference_displacement": reference.displacement,
        "reference_error_estimate": reference.error_estimate,
        "reference_seconds": clock["solving"],
    }
    return [about, *chain.from_iterable(rows.values())]


def largest_finer_errors(errors: np.ndarray) -> np.ndarray:
    """Largest error of each mesh size and all finer ones that were run, since errors may cross zero by chance.

    Arrays are (n_approaches, n_sizes), finest size first. NaN there, and from where a finer one failed.
    """
    run_on = np.isfinite(errors)
    number = np.cumsum(run_on, axis=1)
    largest = np.maximum.accumulate(np.where(number > 0, np.abs(errors), 0.0), axis=1)  # NaN from a NaN on
    return np.where(run_on & (number > 1), largest, np.nan)


def _failed_case(message, status=Status.FAILED):
    return {"status": int(status), "message": message}


def _measure_case(scene, approach, size):
    """Run a case several times and return its median seconds; the first, cold run of a short case does not count."""
    if approach.startswith("calculix") and not calculix.program():
        return _failed_case("CalculiX (ccx) is not on this machine; install it, or ask for other approaches")
    definition, _, mesh_type = approach.partition("/")
    run, clocks = partial(network, definition=definition, mesh_type=mesh_type), []
    run = run if mesh_type else APPROACHES[approach]
    try:
        while len(clocks) <= REPETITIONS and not (clocks and clocks[0].total() > LONG_CASE_SECONDS):
            clocks.append(Clock())
            displacement, unknowns = run(scene, size, clocks[-1])
    except DefinitionError as error:
        return _failed_case(str(error))
    except MemoryError:
        return _failed_case("not enough memory: the machine has no more")
    except Exception as error:  # the other cases shall still be measured
        why = failure_reason(error)
        if not why:
            raise
        traceback.print_exc()
        return _failed_case(why, Status.NOT_CONVERGED)
    warm = clocks[1:] or clocks
    found = {"displacement": displacement, "unknowns": unknowns, "status": int(Status.SOLVED), "message": ""}
    found |= {f"{part}_seconds": np.median([clock[part] for clock in warm]) for part in PARTS}
    return found | {"seconds": np.median([clock.total() for clock in warm])}


def explicit(scene, sizes, updates=EXPLICIT_UPDATES):
    """Yield how many nonlinear springs explicit steps advance in a second."""
    for size in sizes:
        mesh = MESH_TYPES["structured"](scene.beam.length, scene.beam.height, size)
        cache = MeshCache(mesh, scene.beam.thickness)
        springs, _ = cache.derive("lattice", scene.material)
        motion = motion_of(cache, scene.kind, springs, scene.material.density, scene.force)
        step = 0.9 * (2 / motion.particle_bound)
        steps = max(FEWEST_STEPS, round(updates / len(mesh.edges)))
        for threads, precision in product(THREAD_COUNTS, PRECISIONS):
            # The steps alone: what a run prepares once is soon less than they are.
            clocks = [Clock() for _ in range(REPETITIONS)]
            with closing(make_stepper(motion, "central-difference", step, precision, threads)) as stepper:
                stepper.begin(*np.zeros((2, *motion.load.shape)))
                stepper.advance(steps)  # with the first ones threads begin
                for clock in clocks:
                    with clock("solving"):
                        stepper.advance(steps)
            seconds = np.median([clock.total() for clock in clocks])
            labels = {"mesh_size": size, "thread_count": threads, "precision": precision}
            yield labels | {"spring_updates": steps * len(mesh.edges) / seconds}


# -- approaches, all linear --------------------------------------------------------------------------------------------
#
# Each takes a scene, a mesh size and a clock; it returns the displacement of the loaded side and its unknowns.


def network(scene, size, clock, definition, mesh_type):
    """Solve the linear network of a definition; definitions share a mesh, whose time counts for each."""
    mesh, seconds = _timed_mesh(mesh_type, scene.beam, size)
    clock["meshing"] += seconds
    with clock("assembling"):
        cache, springs, problem = _problem(scene, mesh, definition)
        problem.network.tangent()
    with clock("factorizing"):
        problem.network.rest_factor  # noqa: B018  factorized when first asked for
    with clock("solving"):
        found = problem.linear(scene.force / springs.reference)
    if not found.converged:
        raise ArithmeticError(found.reason)
    return cache.displacement(scene.kind, found.displacements), problem.network.unknowns


@lru_cache(maxsize=len(MESH_TYPES))
def _timed_mesh(mesh_type, beam, size):
    """Return the mesh of a beam and the seconds to make it."""
    MESH_TYPES[mesh_type](1.0, 0.5, 0.25)  # libraries are read
    begin = time.perf_counter()
    mesh = MESH_TYPES[mesh_type](beam.length, beam.height, size)
    mesh.edges  # noqa: B018  computed when first asked for
    return mesh, time.perf_counter() - begin


def _problem(scene, mesh, definition):
    """Return mesh cache, springs and static problem, without the forces that a definition adds to a load."""
    cache = MeshCache(mesh, scene.beam.thickness)
    springs = replace(cache.derive(definition, scene.material)[0], lateral=0.0)
    cache.measured(scene.kind)
    return cache, springs, cache.problem(scene.kind, springs)


def _mesh(scene, size, clock):
    with clock("meshing"):
        mesh = structured(scene.beam.length, scene.beam.height, size)
        mesh.edges  # noqa: B018  computed when first asked for
    return mesh


def _middle_displacement(scene, places, moved):
    """Interpolate the displacement of the middle of the loaded side from particles at places along it [m]."""
    order = np.argsort(places)
    return float(np.interp(scene.kind.side_length(scene.beam) / 2, places[order], moved[order]))


def triangles(scene, size, clock, degree):
    """Solve by triangles of scikit-fem on equilateral rows."""
    from skfem import Basis, ElementTriP1, ElementTriP2, ElementVector, FacetBasis, LinearForm, MeshTri
    from skfem.models.elasticity import linear_elasticity

    with clock("meshing"):
        made = structured(scene.beam.length, scene.beam.height, size)
        mesh = MeshTri(made.points.T.copy(), made.triangles.T.copy())
    with clock("assembling"):
        element = ElementVector((ElementTriP1, ElementTriP2)[degree - 1]())
        basis = Basis(mesh, element)
        young, nu = scene.material.in_plane.young_modulus, scene.material.in_plane.poisson_ratio
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


def tensor_mass(scene, size, clock):
    """Linear triangles stored as tensors of particles and edges, forces gathered edge by edge.

    S. Cotin, H. Delingette, N. Ayache, Visual Computer 16:437, 2000; here in balance, by conjugate gradients.
    """
    mesh = _mesh(scene, size, clock)
    with clock("assembling"):
        young, nu = scene.material.in_plane.young_modulus, scene.material.in_plane.poisson_ratio
        lam, mu = young * nu / (1 - nu**2), young / (2 * (1 + nu))
        corners = mesh.points[mesh.triangles]
        opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
        slopes = np.stack([-opposite[..., 1], opposite[..., 0]], axis=2)
        double = opposite[:, 0, 0] * opposite[:, 1, 1] - opposite[:, 0, 1] * opposite[:, 1, 0]
        slopes = slopes / double[:, None, None]
        volume = 0.5 * np.abs(double) * scene.beam.thickness

        def tensor(i, j):
            """Return the stiffness tensor between two corners of each triangle."""
            a, b = slopes[:, i], slopes[:, j]
            outer = a[:, :, None] * b[:, None, :]
            inner = np.einsum("ni,ni->n", a, b)[:, None, None] * np.eye(2)
            return volume[:, None, None] * (lam * outer + mu * outer.transpose(0, 2, 1) + mu * inner)

        of_particles = np.zeros((len(mesh.points), 2, 2))
        of_edges = np.zeros((len(mesh.edges), 2, 2))
        for i in range(3):
            np.add.at(of_particles, mesh.triangles[:, i], tensor(i, i))
            j, k = (i + 1) % 3, (i + 2) % 3
            ordered = (mesh.triangles[:, j] < mesh.triangles[:, k])[:, None, None]
            np.add.at(of_edges, mesh.cell_edges[3][:, i], np.where(ordered, tensor(j, k), tensor(k, j)))
        first, second = mesh.edges.T
        moving = ~held_directions(mesh, scene.kind)
        load = scene.force * weights(mesh, scene.kind) * moving
        diagonal = np.einsum("nii->ni", of_particles)

    def forces(flat):
        """Return the forces of flat displacements."""
        u = flat.reshape(load.shape)
        total = np.einsum("nij,nj->ni", of_particles, u)
        to_first = np.einsum("nij,nj->ni", of_edges, u[second])
        to_second = np.einsum("nji,nj->ni", of_edges, u[first])
        for axis in range(2):
            total[:, axis] += np.bincount(first, to_first[:, axis], len(u))
            total[:, axis] += np.bincount(second, to_second[:, axis], len(u))
        return (total * moving).ravel()

    with clock("solving"):
        stiffness, inverse = LinearOperator((load.size, load.size), forces), diags_array(1 / diagonal.ravel())
        u, left = cg(stiffness, load.ravel(), rtol=1e-8, maxiter=20 * len(load), M=inverse)
        if left:
            raise ArithmeticError("conjugate gradients did not end")
    return float(np.tensordot(u.reshape(load.shape), measured_weights(mesh, scene.kind), axes=2)), int(moving.sum())


def condensation(scene, size, clock):
    """Solve for unit loads on the loaded side once (``factorizing``); a load then costs one product."""
    mesh = _mesh(scene, size, clock)
    with clock("assembling"):
        cache, springs, problem = _problem(scene, mesh, "delingette")
        problem.network.tangent()
    with clock("factorizing"):
        net, factor = problem.network, problem.network.rest_factor
        loaded = np.flatnonzero(problem.load)
        responses = np.zeros((len(loaded), len(loaded)))
        watched = net.reduce(cache.measured(scene.kind))
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


def boundary_elements(scene, size, clock):
    """Constant boundary elements with Kelvin's solution.

    C. A. Brebbia, J. Dominguez, Boundary elements, 1992, ch. 3; plane stress by nu / (1 + nu) in plane strain's place.
    """
    length, height = scene.beam.length, scene.beam.height
    with clock("meshing"):
        columns, rows = max(2, round(length / size)), max(2, round(height / size))
        x, y = np.linspace(0, length, columns + 1), np.linspace(0, height, rows + 1)
        around = [np.stack([x[:-1], 0 * x[:-1]], 1), np.stack([0 * y[:-1] + length, y[:-1]], 1)]
        around += [np.stack([x[:0:-1], 0 * x[:0:-1] + height], 1), np.stack([0 * y[:0:-1], y[:0:-1]], 1)]
        start = np.concatenate(around)
        end = np.roll(start, -1, axis=0)
        lengths = np.linalg.norm(end - start, axis=1)
        along = (end - start) / lengths[:, None]
        normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
        middle = 0.5 * (start + end)
        side = np.repeat(np.arange(4), [columns, rows, columns, rows])  # lower, right, upper, left
    with clock("assembling"):
        sheet = scene.material.in_plane
        nu = sheet.poisson_ratio / (1 + sheet.poisson_ratio)
        shear = sheet.young_modulus / (2 * (1 + sheet.poisson_ratio))
        count = len(middle)
        u, t = np.zeros((2, count, 2, count, 2))
        places, shares = np.polynomial.legendre.leggauss(8)
        for place, share in zip(places, shares):
            r = (middle + 0.5 * place * (end - start))[None, :, :] - middle[:, None, :]
            distance = np.linalg.norm(r, axis=2)
            np.fill_diagonal(distance, 1.0)
            r = r / distance[..., None]
            scale = 0.5 * share * lengths[None, :]
            across = np.einsum("ijk,jk->ij", r, normal)
            outer = r[..., :, None] * r[..., None, :]
            kelvin = outer + (3 - 4 * nu) * np.log(1 / distance)[..., None, None] * np.eye(2)
            turned = r[..., :, None] * normal[None, :, None, :] - r[..., None, :] * normal[None, :, :, None]
            push = across[..., None, None] * ((1 - 2 * nu) * np.eye(2) + 2 * outer) - (1 - 2 * nu) * turned
            u += (scale[..., None, None] * kelvin / (8 * np.pi * shear * (1 - nu))).transpose(0, 2, 1, 3)
            t -= ((scale / distance)[..., None, None] * push / (4 * np.pi * (1 - nu))).transpose(0, 2, 1, 3)
        own = np.arange(count)
        logs = lengths * (1 - np.log(lengths / 2)) * (3 - 4 * nu)
        itself = logs[:, None, None] * np.eye(2) + lengths[:, None, None] * along[:, :, None] * along[:, None, :]
        u[own, :, own, :] = itself / (8 * np.pi * shear * (1 - nu))
        t[own, :, own, :] = 0.5 * np.eye(2)
        u, t = u.reshape(2 * count, -1), t.reshape(2 * count, -1)
        clamped = np.repeat(side == (0 if scene.kind.normal == 1 else 3), 2)
        loaded = side == (2 if scene.kind.normal == 1 else 1)
        axis = scene.kind.axis
        traction = np.zeros((count, 2))
        traction[loaded, axis] = scene.force / (scene.beam.thickness * lengths[loaded].sum())
        matrix = np.where(clamped[None, :], -u, t)
        right = u[:, ~clamped] @ traction.ravel()[~clamped]
    with clock("factorizing"):
        solution = np.linalg.solve(matrix, right)
    with clock("solving"):
        moved = np.where(clamped, 0.0, solution).reshape(-1, 2)[:, axis]
        if scene.kind.pressed:
            displacement = _middle_displacement(scene, middle[loaded, scene.kind.along], moved[loaded])
        else:
            displacement = float(moved[loaded] @ lengths[loaded] / lengths[loaded].sum())
    return displacement, 2 * count


def free_form(scene, size, clock):
    """Free-form deformation by Bernstein polynomials: no physics, the end is put where the theory of bars has it.

    T. W. Sederberg, S. R. Parry, Computer Graphics 20(4):151, 1986.
    """
    beam, kind, mesh = scene.beam, scene.kind, _mesh(scene, size, clock)
    with clock("solving"):
        slender = (beam.length, beam.height)[kind.normal] / kind.side_length(beam)
        given = (slender if kind.direct else 4 * slender**3) / (scene.material.in_plane.young_modulus * beam.thickness)
        # Cubic: control points along the axis that carry a straight line, or a cantilever's cubic.
        control = np.linspace(0, 1, 4) if kind.direct else np.array([0, 0, 0.5, 1.0])
        s = mesh.points[:, kind.normal] / mesh.points[:, kind.normal].max()
        basis = np.stack([(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3], axis=1)
        moved = np.zeros(mesh.points.shape)
        moved[:, kind.axis] = scene.force * given * basis @ control
    return float(np.tensordot(moved, measured_weights(mesh, kind), axes=2)), 8


def calculix_cps3(scene, size, clock):
    """Solve by CalculiX with linear triangles on the same mesh."""
    mesh = _mesh(scene, size, clock)
    load, clamp = scene.force * weights(mesh, scene.kind), held_directions(mesh, scene.kind)
    with clock("solving"):
        found = calculix.solve(mesh.points, mesh.triangles, "CPS3", scene.material, scene.beam.thickness, load, clamp)
    return float(np.tensordot(found, measured_weights(mesh, scene.kind), axes=2)), int((~clamp).sum())


def calculix_cps8(scene, size, clock):
    """Solve by CalculiX with quadratic serendipity quadrilaterals."""
    value, along, axis = scene.side
    with clock("meshing"):
        points, elements = calculix.quadratic_mesh(scene.beam.length, scene.beam.height, size)
        shares = calculix.side_weights(points, along, value)
        load = np.zeros(points.shape)
        load[:, axis] = scene.force * shares
        clamp = np.repeat(points[:, [scene.kind.normal]] == 0.0, 2, axis=1)
    with clock("solving"):
        found = calculix.solve(points, elements, "CPS8", scene.material, scene.beam.thickness, load, clamp)
    moved = found[:, axis]
    if scene.kind.pressed:
        loaded = np.flatnonzero(shares)
        return _middle_displacement(scene, points[loaded, scene.kind.along], moved[loaded]), int((~clamp).sum())
    return float(moved @ shares), int((~clamp).sum())


LINEAR_SOLVES = tensor_mass, condensation, boundary_elements, free_form, calculix_cps3, calculix_cps8
APPROACHES = {one.__name__.replace("_", "-"): one for one in LINEAR_SOLVES}
APPROACHES |= {f"{name}-triangles": partial(triangles, degree=n) for n, name in enumerate(("linear", "quadratic"), 1)}
"""Approaches besides definitions, by their names in `OTHER_APPROACHES`."""
