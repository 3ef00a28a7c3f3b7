"""Run time against error: definitions on all mesh types, and other approaches.

Every case runs in a process of its own, forked warm, several times; the first run, which also imports and reads what
the approach needs, is told apart. The machine's load and the largest memory are noted beside the seconds.
"""

import multiprocessing
import os
import resource
import signal
import statistics
import time
import traceback
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from ...jobs.failures import own_reason
from ...jobs.guard import go_with_parent
from ...linalg import SOLVERS, factors
from ...mechanics.network import Network
from ...mechanics.series import trace
from ...mesh import MESH_TYPES
from ...problem.boundary import weights
from ...problem.compare import assured, unbeaten
from ...problem.geometry import Beam
from ...problem.loads import LOADS
from ...problem.materials import Material
from ...problem.status import Status
from ...reference.calculix import installed
from ...reference.small_strain import solve_small_strain
from ...scene.motion import motion_of
from ...scene.sheet import Sheet
from ...springs import DefinitionError, Springs
from ...springs.lattice import COEFFICIENT, half_weight, uniform
from .approaches import APPROACHES, network
from .names import CURVE_COUNTS, PARTS

REPETITIONS = 3
BRIEF = 0.05
"""Cases below these seconds are repeated twice as often."""

LONG = 0.4
"""Cases above these seconds run once."""


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
    def side(self):
        """Coordinate of the loaded side [m], axis of that coordinate, axis of the force."""
        return self.kind.loaded.place(self.beam.length, self.beam.height), self.kind.normal, self.kind.axis


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


def run(scene, approaches, sizes, most_seconds, thorough=(), most_thorough=0.0, second_beam=None):
    """All approaches on all sizes, from coarse to fine, as long as a run is not expected to take too long.

    Parameters
    ----------
    scene : LoadedBeam
    approaches : sequence of str
        Names as `springtune.kinds.benchmark.names.approach_names` gives them.
    sizes : sequence of float
        Lengths of an edge [m], ascending.
    most_seconds : float
        Seconds that one run may take; finer sizes of an approach that would take longer are left out.
    thorough : sequence of str, optional
        Approaches that may take more,
    most_thorough : float, optional
        so many seconds.
    second_beam : Beam, optional
        Another beam, on which each case that was solved is solved once more, for its error alone.

    Returns
    -------
    dict of str to ndarray
        Variables of `springtune.kinds.benchmark.variables.BENCHMARK` over approach and mesh size.
    """
    begin = time.perf_counter()
    reference = solve_small_strain(scene.beam, scene.material, scene.force, kind=scene.kind)
    result = {
        "reference_displacement": reference.displacement,
        "reference_error_estimate": reference.error_estimate,
        "reference_seconds": time.perf_counter() - begin,
        "machine_load": os.getloadavg()[0],
    }
    shape = len(approaches), len(sizes)
    names = ("displacement", "seconds", "seconds_spread", "cold_seconds", "peak_memory", "unknowns")
    arrays = {name: np.full(shape, np.nan) for name in (*names, *(f"{part}_seconds" for part in PARTS))}
    status, message = np.zeros(shape, dtype=np.int8), np.full(shape, "", dtype=object)
    meshes = {}
    for mesh_type in {approach.partition("/")[2] for approach in approaches if "/" in approach}:
        MESH_TYPES[mesh_type](1.0, 0.5, 0.25)  # libraries are read
    for j in reversed(range(len(sizes))):
        for i, approach in enumerate(approaches):
            before = arrays["seconds"][i, j + 1 :]
            most = most_thorough if approach in thorough else most_seconds
            if len(before) and np.isfinite(before[0]) and before[0] * _growth(before, sizes[j:]) > most:
                message[i, j] = f"left out: more than {most:g} s to be expected"
                continue
            if message[i, j + 1 :].any():
                message[i, j] = message[i, j + 1]
                continue
            if approach.startswith("calculix") and not installed():
                message[i, j] = "left out: CalculiX (ccx) is not on this machine"
                continue
            found = _in_process(scene, approach, sizes[j], meshes)
            if "message" in found:
                status[i, j], message[i, j] = found["status"], found["message"]
                continue
            status[i, j] = Status.SOLVED
            for name, values in arrays.items():
                values[i, j] = found[name]
    result |= arrays | {"status": status, "message": message}
    result["error"] = (arrays["displacement"] - reference.displacement) / abs(reference.displacement)
    result["second_error"] = _second(scene, second_beam, approaches, sizes, status == Status.SOLVED)
    result["assured_error"] = assured(result["error"], result["second_error"])
    return result | rates(result, sizes)


def _second(scene, beam, approaches, sizes, solved):
    """Errors on another beam of the cases that were solved [1]; NaN without one."""
    errors = np.full(solved.shape, np.nan)
    if beam is None:
        return errors
    scene, meshes = replace(scene, beam=beam), {}
    reference = solve_small_strain(beam, scene.material, scene.force, kind=scene.kind).displacement
    for i, j in np.argwhere(solved):
        found = _in_process(scene, approaches[i], sizes[j], meshes, once=True)
        errors[i, j] = found.get("displacement", np.nan) / reference - 1
    return errors * np.sign(reference)


def _growth(seconds, sizes):
    """Factor by which the next finer size takes longer: as from the last one to this, at least as the particles."""
    particles = (sizes[1] / sizes[0]) ** 2
    if len(seconds) < 2 or not np.isfinite(seconds[1]):
        return particles
    exponent = np.log(seconds[0] / seconds[1]) / np.log((sizes[2] / sizes[1]) ** 2)
    return particles ** float(np.clip(exponent, 1.0, 2.0))


def _in_process(scene, approach, size, meshes, once=False):
    """Result of a case from a process of its own; the mesh of a definition is made before, and its time counted."""
    mesh, meshing = None, 0.0
    if approach not in APPROACHES:
        mesh_type = approach.partition("/")[2]
        if (mesh_type, size) not in meshes:
            begin = time.perf_counter()
            made = MESH_TYPES[mesh_type](scene.beam.length, scene.beam.height, size)
            made.edges  # noqa: B018  computed when first asked for
            meshes[mesh_type, size] = made, time.perf_counter() - begin
        mesh, meshing = meshes[mesh_type, size]
    context = multiprocessing.get_context("fork")
    receive, send = context.Pipe(duplex=False)
    left = signal.getitimer(signal.ITIMER_PROF)[0]  # of the task's limit, which a new process does not have
    process = context.Process(target=_repeat, args=(send, scene, approach, size, mesh, meshing, once, left))
    process.start()
    send.close()
    try:
        found = receive.recv()
        if isinstance(found, Exception):  # the program is broken
            raise found
        return found
    except EOFError:
        return {
            "status": Status.FAILED,
            "message": "its process was ended: by the limits of the study, or for lack of memory",
        }
    finally:
        process.join()


def _repeat(send, scene, approach, size, mesh, meshing, once, left):
    go_with_parent()
    signal.setitimer(signal.ITIMER_PROF, left)
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seconds, parts = [], []
    try:
        while True:
            clock, begin = Clock(), time.perf_counter()
            if mesh is None:
                displacement, unknowns = APPROACHES[approach](scene, size, clock)
            else:
                displacement, unknowns = network(scene, mesh, approach.partition("/")[0], clock)
            seconds.append(time.perf_counter() - begin + meshing)
            parts.append(clock.seconds | ({"meshing": meshing} if mesh is not None else {}))
            # The first run is cold, which a long one does not feel.
            wanted = 1 if once or seconds[0] > LONG else 1 + REPETITIONS * (2 if seconds[-1] < BRIEF else 1)
            if len(seconds) >= wanted:
                break
    except DefinitionError as error:
        send.send({"status": Status.FAILED, "message": str(error)})
        return
    except Exception as error:  # the other cases shall still be measured
        why = own_reason(error)
        if not why:
            traceback.print_exc()
        send.send({"status": Status.NOT_CONVERGED, "message": why} if why else error)
        return
    warm, of_warm = (seconds[1:], parts[1:]) if len(seconds) > 1 else (seconds, parts)
    here, there = (resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    found = {f"{part}_seconds": statistics.median(one[part] for one in of_warm) for part in PARTS}
    found |= {"displacement": displacement, "unknowns": unknowns, "seconds": statistics.median(warm)}
    found |= {"seconds_spread": max(warm) - min(warm), "cold_seconds": seconds[0]}
    send.send(found | {"peak_memory": 1024.0 * max(here - base, there)})


def rates(result, sizes):
    """Order of the error in the mesh size, exponent of the seconds in the unknowns, and which cases nothing beats.

    An error that changes its sign or does not fall with the mesh size has no order.
    """
    count = len(result["error"])
    rates, exponents = np.full(count, np.nan), np.full(count, np.nan)
    for i in range(count):
        good = np.isfinite(result["error"][i])
        errors, signs = np.abs(result["error"][i])[good], np.sign(result["error"][i])[good]
        if len(errors) >= 3 and np.abs(signs.sum()) == len(signs) and (np.diff(errors) > 0).all():
            rates[i] = np.polyfit(np.log(np.asarray(sizes)[good]), np.log(errors), 1)[0]
        large = np.isfinite(result["seconds"][i]) & (result["unknowns"][i] >= 3000)
        if large.sum() >= 2 and np.ptp(result["unknowns"][i][large]) > 0:
            logs = np.log(result["unknowns"][i][large]), np.log(result["seconds"][i][large])
            exponents[i] = np.polyfit(*logs, 1)[0]
    best = unbeaten(np.abs(result["error"]), result["seconds"]).astype(np.int8)
    return {"error_rate": rates, "cost_exponent": exponents, "pareto": best}


def curves(scene, size):
    """Seconds of sensitivity curves over the number of stiffnesses: as one path, and solve by solve.

    Returns
    -------
    dict of str to ndarray, shape (n_counts,)
    """
    mesh = MESH_TYPES["structured"](scene.beam.length, scene.beam.height, size)
    pattern = weights(mesh, scene.kind)
    membrane = scene.material.young_modulus * scene.beam.thickness

    def problem():
        return Sheet(mesh, scene.beam.thickness).problem(scene.kind, Springs(1.0, uniform(mesh)))

    together, apart = np.zeros(len(CURVE_COUNTS)), np.zeros(len(CURVE_COUNTS))
    for number, count in enumerate(CURVE_COUNTS):
        loads = scene.force / (COEFFICIENT * membrane * np.linspace(0.4, 1.6, count))
        together[number] = _median(lambda loads=loads: trace(problem(), pattern, loads))
    one = _median(lambda: problem().nonlinear(scene.force / (COEFFICIENT * membrane)))
    linear = _median(lambda: problem().linear(scene.force / (COEFFICIENT * membrane)))
    apart[:] = one * np.array(CURVE_COUNTS)
    return {"curve_seconds": together, "separate_seconds": apart, "nonlinear_seconds": one, "linear_seconds": linear}


def solvers(scene, sizes, most_seconds):
    """Seconds of the solvers of one linear system, from its matrix to its solution, the next matrix's with them.

    Returns
    -------
    dict of str to ndarray, shape (n_solvers, n_sizes)
        NaN where a solver is not installed, and from where a coarser mesh says that it would exceed `most_seconds`.
    """
    first, again = np.full((2, len(SOLVERS), len(sizes)), np.nan)
    for number in np.argsort(sizes)[::-1]:
        mesh = MESH_TYPES["structured"](scene.beam.length, scene.beam.height, sizes[number])
        for solver, name in enumerate(SOLVERS):
            coarser = first[solver, number + 1 :]
            if name == "Cholesky" and not factors.CHOLESKY or np.nanmax(coarser, initial=0.0) * 8 > most_seconds:
                continue
            springs = Network(mesh, Sheet(mesh, 1.0).held(scene.kind), half_weight(mesh), solver=name)
            matrix, right = springs.tangent(), np.ones(springs.unknowns)
            for seconds in (first, again):
                begin = time.perf_counter()
                springs.factorize_matrix(matrix).solve(right)
                seconds[solver, number] = time.perf_counter() - begin
    return {"solver_seconds": first, "solver_again_seconds": again}


def explicit(scene, size):
    """Explicit steps a second of nonlinear springs, and the memory that they move, beside a plain copy of memory.

    A step reads each spring's ends, rest vector, length and stiffness once, and six vectors a particle; what it does
    not find in a cache it moves.

    Returns
    -------
    dict of str to float
    """
    mesh = MESH_TYPES["structured"](scene.beam.length, scene.beam.height, size)
    sheet = Sheet(mesh, scene.beam.thickness)
    springs, _ = sheet.derive("lattice", scene.material)
    motion = motion_of(sheet, scene.kind, springs, scene.material.density, load=None)
    step = 0.9 * motion.step_limit("central-difference")
    motion.run("central-difference", step, 10)  # compiled
    steps = 2000
    seconds = _median(lambda: motion.run("central-difference", step, steps))
    moved = len(mesh.edges) * (2 * 4 + 4 * 8) + len(mesh.points) * 6 * 16
    large = np.ones(2**24)
    other = np.empty_like(large)
    copy = _median(lambda: np.copyto(other, large))
    rate = steps / seconds
    return {
        "explicit_steps": rate,
        "explicit_bandwidth": rate * moved,
        "copy_bandwidth": 2 * large.nbytes / copy,
    }


def _median(function):
    seconds = []
    for _ in range(REPETITIONS):
        begin = time.perf_counter()
        function()
        seconds.append(time.perf_counter() - begin)
    return statistics.median(seconds)
