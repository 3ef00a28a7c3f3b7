"""Stage `benchmark`: run time, without a first run, and error of definitions on all mesh types and other approaches."""

import time
import traceback
from collections import defaultdict
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import chain, product

import numpy as np

from springtune.mechanics import PRECISIONS
from springtune.mechanics.stepping import make_stepper
from springtune.mesh.cells import MESH_TYPES
from springtune.problem.compare import assured, deformation_error
from springtune.problem.loads import LOADS
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
from .approaches import APPROACHES, network

REPETITIONS = 3

LONG_CASE_SECONDS = 0.4
"""Cases that take longer run once."""

EXPLICIT_UPDATES = 4_000_000
"""Springs times steps of a timed explicit run."""

FEWEST_STEPS = 50
"""Fewest steps of a timed explicit run."""


def failed(task, why):
    """Rows of a scene of which nothing could be measured."""
    return {"rows": [labels | _failed_case(why) for labels in cases(**task)]}


def solve(task):
    """Measure errors and seconds of a scene."""
    scene = LoadedBeam(Beam(**task["beam"]), material_of(task["material"]), task["load"], task["force"])
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
    load: str
    force: float

    @property
    def kind(self):
        """Kind of the load."""
        return LOADS[self.load].kind

    @property
    def in_plane(self):
        """Material with the constants that the beam has in its plane."""
        return self.material.in_plane

    @property
    def side(self):
        """Coordinate of the loaded side [m], axis of that coordinate, axis of the force."""
        return self.kind.loaded.place(self.beam.length, self.beam.height), self.kind.normal, self.kind.axis


class Clock:
    """Seconds of each part of a run."""

    def __init__(self):
        self.seconds = dict.fromkeys(PARTS, 0.0)

    @property
    def total(self):
        """Seconds of all parts."""
        return sum(self.seconds.values())

    @contextmanager
    def __call__(self, part):
        """Add the seconds of this context to a part."""
        begin = time.perf_counter()
        yield
        self.seconds[part] += time.perf_counter() - begin


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
        for row, error in zip(reversed(own), assured(errors)[0].tolist()):
            row["assured_error"] = error
    about = {
        "reference_displacement": reference.displacement,
        "reference_error_estimate": reference.error_estimate,
        "reference_seconds": clock.seconds["solving"],
    }
    return [about, *chain.from_iterable(rows.values())]


def _failed_case(message, status=Status.FAILED):
    """Result of a case without numbers."""
    return {"status": int(status), "message": message}


def _measure_case(scene, approach, size):
    """Run a case several times and return its median seconds; the first, cold run of a short case does not count."""
    if approach.startswith("calculix") and not calculix.program():
        return _failed_case("CalculiX (ccx) is not on this machine; install it, or ask for other approaches")
    definition, _, mesh_type = approach.partition("/")
    run, clocks = partial(network, definition=definition, mesh_type=mesh_type), []
    run = run if mesh_type else APPROACHES[approach]
    try:
        while len(clocks) <= REPETITIONS and not (clocks and clocks[0].total > LONG_CASE_SECONDS):
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
    found |= {f"{part}_seconds": np.median([clock.seconds[part] for clock in warm]) for part in PARTS}
    return found | {"seconds": np.median([clock.total for clock in warm])}


def explicit(scene, sizes, updates=EXPLICIT_UPDATES):
    """Yield how many nonlinear springs explicit steps advance in a second."""
    for size in sizes:
        mesh = MESH_TYPES["structured"](scene.beam.length, scene.beam.height, size)
        cache = MeshCache(mesh, scene.beam.thickness)
        springs, _ = cache.derive("lattice", scene.material)
        motion = motion_of(cache, scene.kind, springs, scene.material.density, scene.force)
        step = 0.9 * motion.step_bound("central-difference")
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
            seconds = np.median([clock.total for clock in clocks])
            labels = {"mesh_size": size, "thread_count": threads, "precision": precision}
            yield labels | {"spring_updates": steps * len(mesh.edges) / seconds}
