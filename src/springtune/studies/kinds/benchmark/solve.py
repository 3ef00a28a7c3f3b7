"""Stage `benchmark`: run time against error, of definitions on all mesh types and of other approaches.

The first run of a case imports and reads what the approach needs, and does not count.
"""

import time
import traceback
from collections import defaultdict
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import chain, product

import numpy as np

from springtune.mechanics.integrators import PRECISIONS
from springtune.mechanics.series import trace
from springtune.mechanics.stepping import make_stepper
from springtune.mesh.types import MESH_TYPES
from springtune.problem.boundary import weights
from springtune.problem.compare import assured, deformation_error
from springtune.problem.geometry import Beam
from springtune.problem.loads import LOADS
from springtune.problem.materials import Material, material_of
from springtune.problem.status import Status
from springtune.reference import calculix
from springtune.reference.small_strain import solve_small_strain
from springtune.scene.motion import motion_of
from springtune.scene.sheet import Sheet
from springtune.springs.base import DefinitionError, Springs
from springtune.springs.lattice import COEFFICIENT, uniform

from ...runs.job import own_reason
from . import CURVE_COUNTS, PARTS, THREAD_COUNTS
from .approaches import APPROACHES, network

REPETITIONS = 3

LONG = 0.4
"""Cases above these seconds run once."""

UPDATES = 4_000_000
"""Springs that an explicit run advances, each step counted anew,"""

FEWEST_STEPS = 50
"""in at least so many steps."""

CURVE_SIZE = 1e-3
"""Mesh size of the curves whose cost is measured, on the first scene's beam [m]."""


def failed(task, why):
    """Result of a scene of which nothing is measured."""
    return {"rows": [labels | _failed(why) for labels in cases(**task)]}


def solve(task):
    """Errors and seconds of a scene."""
    scene = LoadedBeam(Beam(**task["beam"]), material_of(task["material"]), task["load"], task["force"])
    rows = measure(scene, list(cases(**task)), task["most_seconds"])
    if task["curves"]:
        rows += [*curves(scene, max(CURVE_SIZE, min(task["mesh_sizes"]))), *explicit(scene, task["mesh_sizes"])]
    return {"rows": rows}


def cases(approaches, mesh_sizes, finest, **_):
    """Labels of the cases of a scene, from coarse to fine; an approach goes down to its ``finest`` size [m]."""
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
    def sheet(self):
        """Material with the constants that the beam has in its plane."""
        return self.material.in_plane

    @property
    def side(self):
        """Coordinate of the loaded side [m], axis of that coordinate, axis of the force."""
        return self.kind.loaded.place(self.beam.length, self.beam.height), self.kind.normal, self.kind.axis


def timed(run):
    """Seconds of a run, and its result."""
    begin = time.perf_counter()
    result = run()
    return time.perf_counter() - begin, result


def median(run):
    """Median seconds of some runs."""
    return float(np.median([timed(run)[0] for _ in range(REPETITIONS)]))


class Clock:
    """Seconds of each part of a run."""

    def __init__(self):
        self.seconds = dict.fromkeys(PARTS, 0.0)

    @contextmanager
    def __call__(self, part):
        """Context whose seconds are a part's."""
        begin = time.perf_counter()
        yield
        self.seconds[part] += time.perf_counter() - begin


def measure(scene, cases, most_seconds):
    """Rows of all cases, which go from coarse to fine, and of the reference.

    Where an approach fails it has a status and a message; where it exceeds its seconds finer sizes have.
    """
    seconds, reference = timed(lambda: solve_small_strain(scene.beam, scene.material, scene.force, kind=scene.kind))
    meshes, beyond, rows = {}, {}, defaultdict(list)
    for mesh_type in {case["approach"].partition("/")[2] for case in cases if "/" in case["approach"]}:
        MESH_TYPES[mesh_type](1.0, 0.5, 0.25)  # libraries are read
    for case in cases:
        approach, size = case["approach"], case["mesh_size"]
        if approach in beyond:
            found = _failed(beyond[approach])
        else:
            taken, found = timed(partial(_case, scene, approach, size, meshes))
            if taken > most_seconds:
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
        "reference_seconds": seconds,
    }
    return [about, *chain.from_iterable(rows.values())]


def _failed(message, status=Status.FAILED):
    return {"status": int(status), "message": message}


def _case(scene, approach, size, meshes):
    """Result of a case; the mesh of a definition is made before, and its time counted."""
    if approach.startswith("calculix") and not calculix.program():
        return _failed("CalculiX (ccx) is not on this machine; install it, or ask for other approaches")
    try:
        return _repeat(scene, approach, size, meshes)
    except DefinitionError as error:
        return _failed(str(error))
    except MemoryError:
        return _failed("not enough memory: the machine has no more")
    except Exception as error:  # the other cases shall still be measured
        why = own_reason(error)
        if not why:
            raise
        traceback.print_exc()
        return _failed(why, Status.NOT_CONVERGED)


def _repeat(scene, approach, size, meshes):
    """Numbers of a case, run again and again."""
    definition, _, mesh_type = approach.partition("/")

    def make():
        made = MESH_TYPES[mesh_type](scene.beam.length, scene.beam.height, size)
        made.edges  # noqa: B018  computed when first asked for
        return made

    if mesh_type and (mesh_type, size) not in meshes:
        meshes[mesh_type, size] = timed(make)
    meshing, mesh = meshes[mesh_type, size] if mesh_type else (0.0, None)

    def run():
        clock = Clock()
        found = network(scene, mesh, definition, clock) if mesh_type else APPROACHES[approach](scene, size, clock)
        return *found, clock.seconds

    # The first run is cold, which a long one does not feel.
    runs = [timed(run)]
    if runs[0][0] <= LONG:
        runs = [timed(run) for _ in range(REPETITIONS)]
    displacement, unknowns, _ = runs[0][1]
    parts = {f"{part}_seconds": np.median([seconds[part] for _, (*_, seconds) in runs]) for part in PARTS}
    parts["meshing_seconds"] += meshing
    found = {"displacement": displacement, "unknowns": unknowns, "status": int(Status.SOLVED), "message": ""}
    return found | parts | {"seconds": np.median([seconds for seconds, _ in runs]) + meshing}


def curves(scene, size):
    """Rows of seconds of sensitivity curves: as one path, and solve by solve."""
    mesh = MESH_TYPES["structured"](scene.beam.length, scene.beam.height, size)
    pattern = weights(mesh, scene.kind)
    membrane = scene.sheet.young_modulus * scene.beam.thickness

    def problem():
        return Sheet(mesh, scene.beam.thickness).problem(scene.kind, Springs(1.0, uniform(mesh)))

    force = scene.force / (COEFFICIENT * membrane)
    one = median(lambda: problem().nonlinear(force))
    yield {"nonlinear_seconds": one, "linear_seconds": median(lambda: problem().linear(force))}
    for count in CURVE_COUNTS:
        loads = force / np.linspace(0.4, 1.6, count)
        together = median(lambda loads=loads: trace(problem(), pattern, loads))
        yield {"curve_count": count, "curve_seconds": together, "separate_seconds": one * count}


def explicit(scene, sizes, updates=UPDATES):
    """Rows of the nonlinear springs a second that explicit steps advance."""
    for size in sizes:
        mesh = MESH_TYPES["structured"](scene.beam.length, scene.beam.height, size)
        sheet = Sheet(mesh, scene.beam.thickness)
        springs, _ = sheet.derive("lattice", scene.material)
        motion = motion_of(sheet, scene.kind, springs, scene.material.density, scene.force)
        step = 0.9 * motion.step_bound("central-difference")
        steps = max(FEWEST_STEPS, round(updates / len(mesh.edges)))
        for threads, precision in product(THREAD_COUNTS, PRECISIONS):
            # The steps alone: what a run prepares once is soon less than they are.
            with closing(make_stepper(motion, "central-difference", step, precision, threads)) as stepper:
                stepper.begin(*np.zeros((2, *motion.load.shape)))
                stepper.advance(steps)  # with the first ones threads begin
                seconds = median(lambda stepper=stepper, steps=steps: stepper.advance(steps))
            labels = {"mesh_size": size, "thread_count": threads, "precision": precision}
            yield labels | {"spring_updates": steps * len(mesh.edges) / seconds}
