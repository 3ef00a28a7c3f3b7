"""Stage `stability`: stress tests of numerical stability, whose results are the group ``/stability`` of a dataset."""

import time
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product

import numpy as np

from springtune.mechanics import BEHAVIOURS, EXPLICIT, INTEGRATORS, BackwardEuler
from springtune.mechanics.continuation import buckling as critical_load
from springtune.mechanics.continuation import follow
from springtune.mechanics.continuum import PatchTest
from springtune.mechanics.dynamics import Motion, relax
from springtune.mechanics.statics import SingularError, StaticProblem
from springtune.mesh.cells import MESH_TYPES, Mesh, corner_angles
from springtune.problem.boundary import weights
from springtune.problem.loads import AXIAL, FACE
from springtune.problem.materials import Material, material_of
from springtune.problem.quantities import Status
from springtune.problem.shapes import Beam
from springtune.scene.mesh_cache import MeshCache
from springtune.scene.motion import motion_of
from springtune.springs.base import DefinitionError, Springs

from . import AXES

GROWTH_STEPS = 2000  # steps of each run that measures a limit


def failed(task, why):
    """Result of an experiment that failed."""
    return {"experiment_seconds": np.nan, "experiment_message": why}


def solve(task):
    """Run an experiment."""
    made = {"beam": Beam(**task["beam"]), "material": material_of(task["material"]).in_plane}
    setup = Setup(**{name: value for name, value in task.items() if name not in ("key", "name")} | made)
    begin, rows = time.perf_counter(), EXPERIMENT_FUNCTIONS[task["name"]](setup)
    return {"rows": [*rows, {"experiment_seconds": time.perf_counter() - begin, "experiment_message": ""}]}


@dataclass(frozen=True)
class Setup:
    """A beam under a traction [N], with its meshes on ascending edge lengths [m], springs and problems."""

    beam: Beam
    material: Material
    force: float
    definition: str
    mesh_type: str
    mesh_sizes: list[float]

    @cached_property
    def coarse(self):
        """Coarsest mesh, which most experiments use."""
        return self.mesh(self.mesh_sizes[-1])

    def mesh(self, size):
        """Mesh of the beam."""
        return MESH_TYPES[self.mesh_type](self.beam.length, self.beam.height, size)

    def springs(self, mesh):
        """Springs of the definition."""
        return self.cache(mesh).derive(self.definition, self.material)[0]

    def cache(self, mesh):
        """Cache of a mesh."""
        return _mesh_cache(mesh, self.beam.thickness)

    def problem(self, mesh, kind=AXIAL, follower=False):
        """Static problem and its reference stiffness."""
        springs = replace(self.springs(mesh), lateral=0.0)  # without the forces that a definition adds to a load
        return self.cache(mesh).problem(kind, springs, follower), springs.reference

    def loaded(self, mesh):
        """Static problem of the traction, and its load over the reference stiffness."""
        problem, reference = self.problem(mesh)
        return problem, self.force / reference

    def motion(self, mesh, linear=True, **load):
        """Undamped motion of the beam under its force."""
        springs, density = replace(self.springs(mesh), lateral=0.0), self.material.density
        return motion_of(self.cache(mesh), AXIAL, springs, density, self.force, linear=linear, **load)


@lru_cache(maxsize=1)
def _mesh_cache(mesh, thickness):
    return MeshCache(mesh, thickness)


def modified(motion, **options):
    """Copy a motion with other parameters."""
    kept = {"load": motion.load, "mass_damping": motion.mass_damping, "dampers": motion.dampers}
    return Motion(motion.network, motion.inertia[:, 0], **(kept | {"linear": motion.linear} | options))


def _displacement(found, pattern):
    """Mean displacement of a solution over a pattern of weights."""
    return float(np.tensordot(found.displacements, pattern, axes=2))


def _noise(motion, size=1e-6, seed=0):
    return size * np.random.default_rng(seed).standard_normal(motion.network.held.shape) * ~motion.network.held


# -- steps in time -----------------------------------------------------------------------------------------------------


def limits(setup):
    """Largest stable step of every explicit scheme, predicted and measured, by mesh size and damping."""
    for size in setup.mesh_sizes:
        motion = setup.motion(setup.mesh(size), load=None)
        yield {"mesh_size": size, "omega_max": motion.omega_max, "dt_particle_bound": 2 / motion.particle_bound}
        for integrator, damper, ratio in product(EXPLICIT, AXES["damper"], AXES["damping_ratio"]):
            damped = modified(motion, **_damping(motion, damper, ratio))
            labels = {"mesh_size": size, "integrator": integrator, "damper": damper, "damping_ratio": ratio}
            predicted, measured = damped.step_limit(integrator), measured_limit(damped, integrator)
            yield labels | {"dt_limit_predicted": predicted, "dt_limit_measured": measured}


def _damping(motion, kind, ratio):
    """Damping with a ratio in the highest mode; approximate for dampers along springs."""
    if kind == "mass":
        return {"mass_damping": 2 * ratio * motion.omega_max}
    stiffness = np.abs(motion.network.stiffness)
    stiffness = stiffness if stiffness.any() else np.ones(len(stiffness))  # springs whose law is an energy's
    return {"dampers": 2 * ratio / motion.omega_max * stiffness}


def measured_limit(motion, integrator, resolution=2e-3):
    """Measure the largest step that does not amplify noise [s], by bisection of linear runs about rest."""

    def grows(step):
        """Return whether a run with a step amplifies noise."""
        half = motion.run(integrator, step, GROWTH_STEPS // 2, _noise(motion))
        if half.status == "diverged":
            return True
        found = motion.run(integrator, step, GROWTH_STEPS // 2, half.displacements, half.velocities)
        if found.status == "diverged":
            return True
        # Accelerations show the high modes, which go first.
        early, late = (np.linalg.norm(motion.missing(one.displacements) / motion.mass) for one in (half, found))
        return late > 3 * early

    # The prediction only says where to begin: both ends are moved until they hold the limit between them.
    low = high = motion.step_limit(integrator)
    while grows(low := 0.98 * low):
        pass
    while not grows(high := 1.02 * high):
        pass
    while high / low > 1 + resolution:
        middle = np.sqrt(low * high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    return np.sqrt(low * high)


def maps(setup):
    """Behaviour of noise by step and damping, in every scheme."""
    motion = setup.motion(setup.coarse, load=None)
    for integrator, ratio in product(INTEGRATORS, AXES["map_damping_ratio"]):
        damped, labels = modified(motion, mass_damping=2 * ratio * motion.omega_max), {"map_damping_ratio": ratio}
        predicted = min(damped.step_limit(integrator) * motion.omega_max / 2, 1e3)
        yield labels | {"integrator": integrator, "step_ratio_predicted": predicted}
        for step in AXES["step_ratio"]:
            behaviour = _behaviour(damped, integrator, 2 * step / motion.omega_max)
            yield labels | {"integrator": integrator, "step_ratio": step, "behaviour": behaviour}


def _behaviour(motion, integrator, step):
    start = _noise(motion)
    found = motion.run(integrator, step, 400 if integrator in EXPLICIT else 60, start)
    if found.status == "diverged":
        return BEHAVIOURS.index("nan")
    before, after = (np.linalg.norm(motion.missing(u) / motion.mass) for u in (start, found.displacements))
    ratio = after / before
    return BEHAVIOURS.index("growing" if ratio > 3 else "decaying" if ratio < 0.3 else "stable")


def drift(setup):
    """Energy of an undamped vibration and momentum of a floating beam over many steps."""
    motion = setup.motion(setup.coarse, linear=False)
    if motion.network.energies:  # not compiled, and the same schemes
        motion = modified(motion, linear=True)
    problem, _ = setup.problem(setup.coarse)
    pulled = (problem.linear if motion.linear else problem.nonlinear)(motion.load.sum()).displacements
    free = modified(motion, load=np.zeros_like(motion.load))
    step = 0.5 * free.step_limit("central-difference")
    unheld = setup.cache(setup.coarse).network(np.zeros_like(motion.network.held), setup.springs(setup.coarse))
    floating = Motion(unheld, motion.inertia[:, 0], linear=motion.linear)
    kick = np.random.default_rng(1).standard_normal(motion.load.shape)
    for integrator in INTEGRATORS:
        steps = 100_000 if integrator in EXPLICIT else 4_000
        energy = free.run(integrator, step, steps, pulled, sample=max(10, steps // 10_000)).samples[:, 1]
        tenth = max(1, len(energy) // 10)
        momentum = floating.run(integrator, step, 500, velocities=1e-3 * kick, sample=100).samples[:, 2:]
        yield {
            "integrator": integrator,
            "energy_drift": energy[-tenth:].mean() / energy[:tenth].mean() - 1,
            "energy_swing": np.ptp(energy) / energy[0],
            "momentum_drift": np.abs(momentum - momentum[0]).max() / np.abs(floating.inertia * 1e-3 * kick).sum(),
        }
        places = np.linspace(0, len(energy) - 1, len(AXES["sample"])).round().astype(int)
        for sample, value in zip(AXES["sample"], energy[places] / energy[0]):
            yield {"integrator": integrator, "sample": sample, "energy": value}


def rest(setup):
    """Steps to rest by damping, and errors of backward Euler with a truncated linear solver."""
    motion = setup.motion(setup.coarse)
    omega = motion.loaded_frequency
    step = 0.9 * motion.step_limit("central-difference")
    yield {"loaded_frequency": omega}
    for ratio in AXES["critical_ratio"]:
        found = modified(motion, mass_damping=2 * ratio * omega).run("central-difference", step, 100_000, rest=1e-3)
        yield {"critical_ratio": ratio, "steps_to_rest": found.steps if found.status == "rest" else np.nan}
    for size in setup.mesh_sizes:
        mesh = setup.mesh(size)
        motion = setup.motion(mesh)
        static = setup.problem(mesh)[0].linear(motion.load.sum()).displacements
        largest = np.abs(static).max()
        for iterations in AXES["cg_iterations"]:
            u, v, done, labels = None, None, 0, {"mesh_size": size, "cg_iterations": iterations}
            for steps in AXES["implicit_steps"]:
                found = motion.run(BackwardEuler(iterations=iterations or None), 0.01, steps - done, u, v)
                u, v, done = found.displacements, found.velocities, steps
                yield labels | {"implicit_steps": steps, "truncated_error": np.abs(u - static).max() / largest}
        found = relax(motion.network, motion.load, linear=True)
        error = np.abs(found.displacements - static).max() / largest
        yield {"mesh_size": size, "relaxation_error": error, "relaxation_steps": found.steps}


@contextmanager
def _judged_row(name, **labels):
    """Yield a row for status and message of an equilibrium, and its judge; exceptions go into the row."""

    def note(status, message, pivots=np.nan):
        """Write status, message and negative pivots into the row."""
        labels[f"{name}_status"], labels[f"{name}_message"] = int(status), message
        labels[f"{name}_negative_pivots"] = pivots

    def judge(problem, s, solution):
        """Judge a solution, and return whether it is an equilibrium."""
        status, *others = problem.judge(s, solution)
        note(status, *others)
        return status in (Status.SOLVED, Status.UNSTABLE)

    try:
        yield labels, judge
    except (SingularError, ArithmeticError, ValueError) as error:
        note(Status.FAILED, f"{type(error).__name__}: {error}".removeprefix("DefinitionError: "))


# -- meshes and numbers ------------------------------------------------------------------------------------------------


def slivers(setup):
    """Step limit and error with one particle moved towards the opposite side, down to angles of half a degree."""
    mesh, pattern = setup.coarse, weights(setup.coarse, AXIAL)
    whole, s = setup.loaded(mesh)
    answer = _displacement(whole.linear(s), pattern)
    inside = np.setdiff1d(np.arange(len(mesh.points)), mesh.edges[mesh.on_outline])
    away = np.linalg.norm(mesh.points[inside] - mesh.points.mean(axis=0), axis=1)
    moved = inside[np.argmax(away <= away.min() + 1e-9 * away.max())]  # of equal ones the first, not rounding's choice
    triangle = mesh.triangles[(mesh.triangles == moved).any(axis=1)][0]
    first, second = (mesh.points[corner] for corner in triangle if corner != moved)
    middle, side = 0.5 * (first + second), np.linalg.norm(second - first)
    away = mesh.points[moved] - middle
    for angle in AXES["sliver_angle"]:
        points = mesh.points.copy()
        points[moved] = middle + away / np.linalg.norm(away) * 0.5 * side * np.tan(np.radians(angle))
        drawn = Mesh(points, mesh.triangles)
        assert np.degrees(corner_angles(points, drawn.triangles).min()) <= angle * (1 + 1e-9)
        with _judged_row("sliver", sliver_angle=angle) as (row, judge):
            problem, s = setup.loaded(drawn)
            row["sliver_step_limit"] = setup.motion(drawn).step_limit("central-difference")
            if judge(problem, s, solution := problem.linear(s)):
                row["sliver_error"] = _displacement(solution, pattern) / answer - 1
        yield row


MOST_ROUNDING_LOSS = 1e-2
"""Largest share of digits that rounding may take from a factor; above it results depend on solver and processor.
The condition number of a network is about its number of particles times the contrast."""


def contrast(setup):
    """Error of the linear solution by ratio of stiff to soft parts, against extended precision."""
    whole, reference = setup.problem(setup.coarse)
    network, s = whole.network, setup.force / reference
    middle = setup.coarse.points[setup.coarse.edges].mean(axis=1)[:, 0]
    soft = (middle / setup.beam.height + 1e-9) // 1 % 2 == 0  # what lies between two parts is the right one's
    sure = MOST_ROUNDING_LOSS / (np.finfo(float).eps * len(setup.coarse.points))
    base = network.stiffness if network.stiffness.any() else 0.5 * setup.coarse.cells_per_edge
    for ratio in AXES["stiffness_contrast"]:
        problem = setup.cache(setup.coarse).problem(AXIAL, Springs(reference, base * np.where(soft, 1.0, ratio)))
        solution = problem.linear(s)
        with _judged_row("contrast", stiffness_contrast=ratio) as (row, judge):
            judge(problem, s, solution)
        if ratio > sure:  # the same status and message on every processor
            why = f"ill-conditioned: rounding may leave no digit beyond a contrast of {sure:.0e}"
            row |= {"contrast_status": int(Status.NOT_CONVERGED), "contrast_message": why}
            row["contrast_negative_pivots"] = np.nan
        exact = _refined_solution(problem, s, solution.displacements)
        error = float(np.abs(solution.displacements - exact).max() / np.abs(exact).max())
        yield row | {"contrast_error": error, "contrast_estimate": solution.error_estimate}


def _refined_solution(problem, s, displacements):
    """Linear solution by iterative refinement, residuals spring by spring in extended precision."""
    network = problem.network
    normals = network.rest_vectors.astype(np.longdouble)
    normals /= np.sqrt((normals**2).sum(axis=1))[:, None]
    moved, load = displacements.astype(np.longdouble), np.zeros(network.held.shape, np.longdouble)
    load[~network.held] = s * problem.load
    for _ in range(12):
        missing = load.copy()
        pulls = (network.stiffness * (normals * network.end_differences(moved)).sum(axis=1))[:, None] * normals
        np.add.at(missing, network.first, pulls)
        np.subtract.at(missing, network.second, pulls)
        moved = moved + network.expand(network.rest_factor.solve(network.reduce(missing).astype(float)))
    return moved


def poisson(setup):
    """Young's modulus and step limit up to an incompressible material."""
    test, given = PatchTest(setup.coarse), setup.material
    for ratio in AXES["stressed_poisson_ratio"]:
        # Of the modulus and density alone: rubber of a test has no other ratio than its own.
        one = replace(setup, material=Material(given.young_modulus, ratio, given.density, given.name))
        with _judged_row("poisson", stressed_poisson_ratio=ratio) as (row, judge):
            problem, s = one.loaded(one.coarse)
            row["poisson_step_limit"] = one.motion(one.coarse).step_limit("central-difference")
            springs, membrane = one.springs(one.coarse), one.material.young_modulus * one.beam.thickness
            row["poisson_modulus_error"] = test.axial(springs)[0] * springs.reference / membrane - 1
            judge(problem, s, problem.linear(s))
        yield row


def sizes(setup):
    """Step limit and error of the same beam scaled over four decades, in double and single precision."""
    for size in AXES["scale"]:
        ratio = size / setup.mesh_sizes[-1]
        sides = {name: getattr(setup.beam, name) * ratio for name in ("length", "height", "thickness")}
        one = replace(setup, beam=replace(setup.beam, **sides), force=setup.force * ratio**2, mesh_sizes=(size,))
        motion = one.motion(one.coarse, linear=False)
        motion = modified(motion, mass_damping=motion.loaded_frequency)
        static = one.problem(one.coarse)[0].nonlinear(motion.load.sum()).displacements
        limit = motion.step_limit("central-difference") / size
        yield {"scale": size, "scaled_step_limit": limit}
        for kind in AXES["precision"]:
            found = motion.run("central-difference", 0.9 * limit * size, 60_000, precision=kind)
            error = np.abs(found.displacements - static).max() / np.abs(static).max()
            yield {"scale": size, "precision": kind, "precision_error": error}


# -- equilibria --------------------------------------------------------------------------------------------------------


def strains(setup):
    """Nonlinear equilibria under loads that strain a linear beam by up to 300 %."""
    mesh, membrane = setup.coarse, setup.material.young_modulus * setup.beam.thickness
    for load in AXES["strain_load"]:
        kind, side = (AXIAL, setup.beam.height) if load == "axial" else (FACE, setup.beam.length)
        pattern = weights(mesh, kind)
        for strain in AXES["strain"]:
            with _judged_row("strain", strain_load=load, strain=strain) as (row, judge):
                problem, reference = setup.problem(mesh, kind, load != "axial")
                s = strain * membrane * side / reference
                solution = problem.nonlinear(s)
                row["strain_load_share"] = solution.load_share
                if judge(problem, s, solution):
                    row["strain_displacement"] = _displacement(solution, pattern)
            row["negative_pivots"] = row.pop("strain_negative_pivots")
            yield row


def perturbation(setup):
    """Errors with inner particles moved at random, and Newton's method from inverted starts."""
    mesh, size = setup.coarse, setup.mesh_sizes[-1]
    pattern = weights(mesh, AXIAL)
    random = np.random.default_rng(0).uniform(-1, 1, mesh.points.shape)
    random[np.unique(mesh.edges[mesh.on_outline])] = 0.0
    unmoved, load = setup.loaded(mesh)
    whole = unmoved.nonlinear(load)
    answer = _displacement(whole, pattern) if whole.converged else np.nan
    for share in AXES["perturbation"]:
        points = mesh.points + share * size * random
        with _judged_row("perturbed", perturbation=share) as (row, judge):
            if mesh.inverted(points):
                raise DefinitionError("triangles of the mesh are inverted; move its particles less")
            moved = Mesh(points, mesh.triangles)
            problem, s = setup.loaded(moved)
            row["perturbed_step_limit"] = setup.motion(moved).step_limit("central-difference")
            if judge(problem, s, solution := problem.nonlinear(s)):
                row["perturbed_error"] = _displacement(solution, pattern) / answer - 1
        yield row
    right, wrong, trials = 0, 0, 20
    for seed in range(trials):
        start = _noise(setup.motion(mesh), size, seed)  # an edge's length: half of the triangles are inverted
        end = unmoved.newton(load, start, 40)
        near = end.converged and np.abs(end.displacements - whole.displacements).max() <= 1e-6 * abs(answer)
        right += near
        wrong += end.converged and not near and unmoved.judge(load, end)[0] is Status.SOLVED
    yield {"inverted_starts_right": right / trials, "inverted_starts_wrong": wrong / trials}


def buckling(setup):
    """Buckling load of a slender column of ten and twenty rows, Euler's load, and the path of a shallow arch."""
    height = 0.05 * setup.beam.length
    euler = np.pi**2 * setup.material.young_modulus * setup.beam.thickness * height**3 / 12
    euler /= 4 * setup.beam.length**2
    yield {"euler_load": euler}
    for rows in AXES["rows"]:
        mesh, row = MESH_TYPES[setup.mesh_type](setup.beam.length, height, height / rows), {"rows": rows}
        try:
            problem, reference = setup.problem(mesh)
            load, row["buckling_message"] = critical_load(problem, -euler / reference)
            row["buckling_load"] = -load * reference
        except (DefinitionError, SingularError) as error:
            row["buckling_message"] = str(error)
        yield row
    yield from _arch(setup)


def _arch(setup):
    """Yield the path of a shallow arch, clamped at both ends and pushed down in its middle, which snaps through."""
    length, height = setup.beam.length, 0.01 * setup.beam.length
    flat = MESH_TYPES[setup.mesh_type](length, height, 0.4 * height)
    rise = 0.04 * length
    points = flat.points.copy()
    points[:, 1] += rise * np.sin(np.pi * points[:, 0] / length)
    mesh = Mesh(points, flat.triangles, flat.quads)
    directions = np.zeros(points.shape, dtype=bool)
    for end in (0.0, flat.points[:, 0].max()):
        directions[np.abs(flat.points[:, 0] - end) <= 1e-9 * length] = True
    away = np.hypot(flat.points[:, 0] - 0.5 * length, flat.points[:, 1] - height)
    middle = np.argmax(away <= away.min() + 1e-9 * length)  # of equal ones the first, not rounding's choice
    pattern = np.zeros(points.shape)
    pattern[middle, 1] = 1.0
    try:
        springs = setup.springs(mesh)
    except DefinitionError:
        return
    network = setup.cache(mesh).network(directions, springs)
    inertia = setup.material.young_modulus * setup.beam.thickness * height**3
    s = -40 * inertia * rise / length**3 / springs.reference
    problem = StaticProblem(network, pattern)
    increment = 0.05 * rise * np.sqrt(network.unknowns)
    path = follow(problem, 10 * s, increment=increment, most_points=200, limit=1.8 * rise * np.sqrt(network.unknowns))
    found = -path.loads * springs.reference, -path.displacements[:, middle, 1], path.negative_pivots
    names = "arch_point", "arch_load", "arch_deflection", "arch_negative_pivots"
    yield from (dict(zip(names, values)) for values in zip(AXES["arch_point"], *found))


FUNCTIONS = limits, maps, drift, rest, slivers, contrast, poisson, sizes, strains, perturbation, buckling
EXPERIMENT_FUNCTIONS = {one.__name__: one for one in FUNCTIONS}
