"""Stage `benchmark`: run time against error, of definitions on all mesh types and of other approaches.

Each case runs several times in a process of its own, forked warm. The first run imports and reads what the approach
needs, and is kept apart.
"""

import multiprocessing
import os
import resource
import signal
import statistics
import time
import traceback
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace

import numpy as np

from springtune.linalg import SOLVERS, factors
from springtune.mechanics.integrators import PRECISIONS
from springtune.mechanics.network import Network
from springtune.mechanics.series import trace
from springtune.mechanics.stepping import make_stepper
from springtune.mesh import MESH_TYPES
from springtune.problem.boundary import held, weights
from springtune.problem.compare import assured, unbeaten
from springtune.problem.geometry import Beam
from springtune.problem.loads import LOADS
from springtune.problem.materials import Material, material_of
from springtune.problem.status import Status
from springtune.reference import calculix
from springtune.reference.small_strain import solve_small_strain
from springtune.scene.motion import motion_of
from springtune.scene.sheet import Sheet
from springtune.springs import DefinitionError, Springs
from springtune.springs.lattice import COEFFICIENT, half_weight, uniform

from ...runs.job import end_with_parent, own_reason
from . import BUSY, CURVE_COUNTS, PARTS, THREAD_COUNTS
from .approaches import APPROACHES, network

REPETITIONS = 3
BRIEF = 0.05
"""Cases below these seconds are repeated twice as often."""

LONG = 0.4
"""Cases above these seconds run once."""

SPREAD = 0.25
"""Largest spread of the quickest runs of a case over the quickest; beyond it the machine was busy."""

OF_PROCESSOR = 0.8
"""Smallest share of a run's time, above `BRIEF`, in which it has the processor."""

WAITING = 2.0
"""Seconds for which runs are repeated on a busy machine, besides those that are wanted."""

UPDATES = 4_000_000
"""Springs that an explicit run advances, each step counted anew,"""

FEWEST_STEPS = 50
"""in at least so many steps."""


CURVE_SIZE = 1e-3
"""Mesh size of the curves whose cost is measured, on the first scene's beam [m]."""


def failed(task, why):
    """Result of a scene of which nothing is measured."""
    shape = len(task["approaches"]), len(task["mesh_sizes"])
    return {
        "status": np.full(shape, Status.FAILED, dtype=np.int8),
        "message": np.full(shape, why, dtype=object).tolist(),
    }


def solve(task):
    """Errors and seconds of a scene."""
    scene = LoadedBeam(Beam(**task["beam"]), material_of(task["material"]), task["load"], task["force"])
    second = Beam(**task["second_beam"]) if task["second_beam"] else None
    most, sizes = task["most_seconds"], task["mesh_sizes"]
    found = measure(scene, task["approaches"], sizes, task["finest"], most, second)
    if task["curves"]:
        found |= curves(scene, max(CURVE_SIZE, min(sizes)), most)
        found |= explicit(scene, sizes, most) | solvers(scene, sizes, most)
    return {name: values.tolist() if name.endswith("message") else values for name, values in found.items()}


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


def clocks():
    """Seconds of a clock, and of the processor in this process and what it has started."""
    there = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.perf_counter(), time.process_time() + there.ru_utime + there.ru_stime


def timed(run):
    """Seconds of a run, whether it had the processor, and its result."""
    begin, used = clocks()
    result = run()
    end, spent = clocks()
    seconds = end - begin
    return seconds, seconds < BRIEF or spent - used >= OF_PROCESSOR * seconds, result


def steady(run, wanted, runs=()):
    """Seconds and results of the quickest runs, as many as `wanted`, repeated until they are alike; else none.

    `runs` were `timed` before and count.
    """
    runs, until = [*runs], None
    while True:
        quickest = sorted((seconds, number) for number, (seconds, quiet, _) in enumerate(runs) if quiet)[:wanted]
        if len(quickest) == wanted and quickest[-1][0] <= (1 + SPREAD) * quickest[0][0]:
            return [(seconds, runs[number][2]) for seconds, number in quickest]
        if len(runs) >= wanted:
            until = until or clocks()[0] + WAITING
            if clocks()[0] >= until:
                return []
        runs.append(timed(run))


def middle(runs):
    """Median seconds of `steady` runs; NaN without any."""
    return statistics.median(seconds for seconds, _ in runs) if runs else np.nan


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


class Alarm:
    """Limit of what a process does: seconds of the processor for each run."""

    def __init__(self, most):
        self.most = most

    def set(self):
        """Begin a run: what it takes beyond its limit ends the process, and what it starts."""
        used = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, self.most)
        # Whole seconds; counted anew in a program that is started, whose own they are.
        resource.setrlimit(resource.RLIMIT_CPU, (int(used + self.most) + 2, resource.getrlimit(resource.RLIMIT_CPU)[1]))


def measure(scene, approaches, sizes, finest, most_seconds, second_beam=None):
    """All approaches on their sizes [m], from coarse to fine, each down to its ``finest`` [m].

    An approach that fails or exceeds its seconds has a status and a message, and so have its finer sizes.
    """
    seconds, quiet, reference = timed(
        lambda: solve_small_strain(scene.beam, scene.material, scene.force, kind=scene.kind)
    )
    result = {
        "reference_displacement": reference.displacement,
        "reference_error_estimate": reference.error_estimate,
        "reference_seconds": seconds if quiet else np.nan,
        "machine_load": os.getloadavg()[0],
    }
    names = ("displacement", "seconds", "seconds_spread", "cold_seconds", "peak_memory", "unknowns")
    cases = _Cases((len(approaches), len(sizes)), *names, *(f"{part}_seconds" for part in PARTS))
    meshes, beyond = {}, {}
    for mesh_type in {approach.partition("/")[2] for approach in approaches if "/" in approach}:
        MESH_TYPES[mesh_type](1.0, 0.5, 0.25)  # libraries are read
    for j in reversed(range(len(sizes))):
        for i, approach in enumerate(approaches):
            if sizes[j] < finest[i]:
                continue
            if approach in beyond:
                size, why = beyond[approach]
                found = _failed(f"not run: at {1e3 * size:g} mm it was {why}")
            else:
                found = _case(scene, approach, sizes[j], meshes, most_seconds)
            if found.get("beyond"):
                beyond[approach] = sizes[j], found["message"]
            cases.note(found, i, j)
    result |= cases.numbers | cases.judged("")
    result["error"] = (result["displacement"] - reference.displacement) / abs(reference.displacement)
    result |= _second(scene, second_beam, approaches, sizes, cases.status == Status.SOLVED, most_seconds)
    result["assured_error"] = assured(result["error"], result["second_error"])
    return result | rates(result, sizes)


class _Cases:
    """Numbers of cases by name, their statuses and messages; cells that nobody asks for are blank."""

    def __init__(self, shape, *names):
        self.numbers = {name: np.full(shape, np.nan) for name in names}
        self.status, self.message = np.zeros(shape, dtype=np.int8), np.full(shape, "", dtype=object)

    def note(self, found, *place):
        """Note what a process found: its numbers, or what became of it."""
        self.status[place], self.message[place] = found.get("status", Status.SOLVED), found.get("message", "")
        for name, values in self.numbers.items() if "status" not in found else ():
            values[place] = found[name]

    def judged(self, name):
        """Statuses and messages, by their names in the dataset."""
        return {f"{name}status": self.status, f"{name}message": self.message}


def _failed(message, status=Status.FAILED):
    return {"status": status, "message": message}


def _limit(seconds):
    return f"{seconds:g} s of the processor (`most_seconds` of the benchmark)"


def _second(scene, beam, approaches, sizes, solved, most_seconds):
    """Errors on another beam of the cases that were solved [1], and what became of them; nothing without one."""
    cases = _Cases(solved.shape, "displacement")
    if beam is None:
        return cases.judged("second_") | {"second_error": cases.numbers["displacement"]}
    scene, meshes = replace(scene, beam=beam), {}
    reference = solve_small_strain(beam, scene.material, scene.force, kind=scene.kind).displacement
    for i, j in np.argwhere(solved):
        cases.note(_case(scene, approaches[i], sizes[j], meshes, most_seconds, once=True), i, j)
    error = (cases.numbers["displacement"] / reference - 1) * np.sign(reference)
    return cases.judged("second_") | {"second_error": error}


def _case(scene, approach, size, meshes, most_seconds, once=False):
    """Result of a case; the mesh of a definition is made before, and its time counted."""
    if approach.startswith("calculix") and not calculix.program():
        return _failed("CalculiX (ccx) is not on this machine; install it, or ask for other approaches")
    mesh, meshing = None, 0.0
    if approach not in APPROACHES:
        mesh_type = approach.partition("/")[2]
        if (mesh_type, size) not in meshes:

            def make():
                made = MESH_TYPES[mesh_type](scene.beam.length, scene.beam.height, size)
                made.edges  # noqa: B018  computed when first asked for
                return made

            seconds, quiet, made = timed(make)
            meshes[mesh_type, size] = made, seconds if quiet or once else np.nan
        mesh, meshing = meshes[mesh_type, size]
    return in_process(_repeat, most_seconds, scene, approach, size, mesh, meshing, once)


def in_process(function, most_seconds, *arguments):
    """Result of a function in a process of its own, or `status`, `message` and whether it went `beyond` its limits."""
    context = multiprocessing.get_context("fork")
    receive, send = context.Pipe(duplex=False)
    process = context.Process(target=_child, args=(send, function, Alarm(most_seconds), arguments))
    process.start()
    send.close()
    try:
        found = receive.recv()
        if isinstance(found, Exception):  # the program is broken
            raise found
        return found
    except EOFError:
        process.join()
        if process.exitcode == -signal.SIGPROF:
            return _failed(f"not done within {_limit(most_seconds)}") | {"beyond": True}
        return _failed("its process died: a crash, or too little memory") | {"beyond": True}
    finally:
        process.join()


def _child(send, function, alarm, arguments):
    end_with_parent()
    try:
        alarm.set()
        send.send(function(alarm, *arguments))
    except DefinitionError as error:
        send.send(_failed(str(error)))
    except MemoryError:
        send.send(_failed("not enough memory: the machine has no more") | {"beyond": True})
    except Exception as error:  # the other cases shall still be measured
        others = resource.getrusage(resource.RUSAGE_CHILDREN)
        why = own_reason(error)
        if why and others.ru_utime + others.ru_stime >= alarm.most:
            send.send(_failed(f"not done within {_limit(alarm.most)} ({why})") | {"beyond": True})
            return
        if not why:
            traceback.print_exc()
        send.send(_failed(why, Status.NOT_CONVERGED) if why else error)


def _repeat(alarm, scene, approach, size, mesh, meshing, once):
    """Numbers of a case, run again and again."""
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    def run():
        alarm.set()
        clock = Clock()
        if mesh is None:
            displacement, unknowns = APPROACHES[approach](scene, size, clock)
        else:
            displacement, unknowns = network(scene, mesh, approach.partition("/")[0], clock)
        return displacement, unknowns, clock.seconds | ({"meshing": meshing} if mesh is not None else {})

    cold = timed(run)
    displacement, unknowns, _ = cold[2]
    found = {"displacement": displacement, "unknowns": unknowns}
    if once:
        return found
    # The first run is cold, which a long one does not feel.
    brief = REPETITIONS * (2 if cold[0] < BRIEF else 1)
    warm = steady(run, 1, [cold]) if cold[0] > LONG else steady(run, brief)
    here, there = (resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    found["peak_memory"] = 1024.0 * max(here - base, there)
    if not warm or np.isnan(meshing):
        names = ("seconds", "seconds_spread", "cold_seconds", *(f"{part}_seconds" for part in PARTS))
        return found | dict.fromkeys(names, np.nan) | {"message": BUSY}
    found |= {f"{part}_seconds": statistics.median(one[2][part] for _, one in warm) for part in PARTS}
    found |= {"seconds": middle(warm) + meshing, "seconds_spread": warm[-1][0] - warm[0][0]}
    return found | {"cold_seconds": cold[0] + meshing}


def rates(result, sizes):
    """Order of the error in the mesh size, exponent of the seconds in the unknowns, and the cases that nothing beats.

    An error that changes its sign, or does not fall with the mesh size, has no order.
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


def curves(scene, size, most_seconds):
    """Seconds of sensitivity curves, shape (n_counts,): as one path, and solve by solve."""
    found = in_process(_curves, most_seconds, scene, size)
    status, message = found.pop("status", Status.SOLVED), found.pop("message", "")
    return found | {"curve_status": status, "curve_message": np.array(message, dtype=object)}


def _curves(alarm, scene, size):
    mesh = MESH_TYPES["structured"](scene.beam.length, scene.beam.height, size)
    pattern = weights(mesh, scene.kind)
    membrane = scene.sheet.young_modulus * scene.beam.thickness

    def problem():
        return Sheet(mesh, scene.beam.thickness).problem(scene.kind, Springs(1.0, uniform(mesh)))

    together, force = np.zeros(len(CURVE_COUNTS)), scene.force / (COEFFICIENT * membrane)
    for number, count in enumerate(CURVE_COUNTS):
        loads = scene.force / (COEFFICIENT * membrane * np.linspace(0.4, 1.6, count))
        together[number] = _median(alarm, lambda loads=loads: trace(problem(), pattern, loads))
    one = _median(alarm, lambda: problem().nonlinear(force))
    linear = _median(alarm, lambda: problem().linear(force))
    apart = one * np.array(CURVE_COUNTS)
    found = {"curve_seconds": together, "separate_seconds": apart, "nonlinear_seconds": one, "linear_seconds": linear}
    return found | _noted(*found.values())


def solvers(scene, sizes, most_seconds):
    """Seconds of linear solvers, shape (n_solvers, n_sizes): from a matrix to its solution, and for the next matrix."""
    cases = _Cases((len(SOLVERS), len(sizes)), "solver_seconds", "solver_again_seconds")
    for j, size in enumerate(sizes):
        mesh = MESH_TYPES["structured"](scene.beam.length, scene.beam.height, size)
        for i, name in enumerate(SOLVERS):
            if name == "Cholesky" and not factors.CHOLESKY:
                found = _failed("CHOLMOD is not installed; install cvxopt")
            else:
                found = in_process(_solver, most_seconds, scene, mesh, name)
            cases.note(found, i, j)
    return cases.numbers | cases.judged("solver_")


def _solver(alarm, scene, mesh, name):
    coarse = MESH_TYPES["structured"](scene.beam.length, scene.beam.height, scene.beam.height / 2)

    def twice(one=mesh):
        springs = Network(one, held(one, scene.kind), half_weight(one), solver=name)
        matrix, right, seconds = springs.tangent(), np.ones(springs.unknowns), []
        for _ in range(2):
            alarm.set()
            seconds.append(timed(lambda: springs.factorize_matrix(matrix).solve(right))[0])
        return seconds

    twice(coarse)  # libraries are read
    runs = steady(twice, 2)
    first, again = np.median([one for _, one in runs], axis=0) if runs else (np.nan, np.nan)
    return {"solver_seconds": first, "solver_again_seconds": again} | _noted(first)


def explicit(scene, sizes, most_seconds, updates=UPDATES):
    """Explicit steps a second of nonlinear springs, and the bytes that they move, beside a plain copy of memory.

    A step reads each spring's ends, rest vector, length and stiffness, and four vectors of each particle, of which it
    writes two.
    """
    cases, shape = _Cases(len(sizes)), (len(sizes), len(THREAD_COUNTS), len(PRECISIONS))
    names = ("explicit_steps", "spring_updates", "explicit_bandwidth")
    cases.numbers = {name: np.full(shape, np.nan) for name in names} | {"explicit_error": np.full(shape[::2], np.nan)}
    for j, size in enumerate(sizes):
        cases.note(in_process(_explicit, most_seconds, scene, size, updates), j)
    copied = [_copied(count) for count in THREAD_COUNTS]
    return cases.numbers | cases.judged("explicit_") | {"copy_bandwidth": np.array(copied)}


def _explicit(alarm, scene, size, updates):
    mesh = MESH_TYPES["structured"](scene.beam.length, scene.beam.height, size)
    sheet = Sheet(mesh, scene.beam.thickness)
    springs, _ = sheet.derive("lattice", scene.material)
    motion = motion_of(sheet, scene.kind, springs, scene.material.density, scene.force)
    step = 0.9 * motion.step_bound("central-difference")
    steps = max(FEWEST_STEPS, round(updates / len(mesh.edges)))
    seconds, ends = np.full((len(THREAD_COUNTS), len(PRECISIONS)), np.nan), []
    for k, precision in enumerate(PRECISIONS):
        for t, threads in enumerate(THREAD_COUNTS):
            # The steps alone: what a run prepares once is soon less than they are.
            with closing(make_stepper(motion, "central-difference", step, precision, threads)) as stepper:
                stepper.begin(*np.zeros((2, *motion.load.shape)))
                stepper.advance(steps)  # with the first ones threads begin
                displacements, _ = stepper.state()  # after as many steps on any machine
                seconds[t, k] = _median(alarm, lambda stepper=stepper: stepper.advance(steps))
            if not np.isfinite(displacements).all():
                raise ArithmeticError(f"diverged with steps of {step:.3g} s")
        ends.append(displacements)
    rate = steps / seconds
    bytes_of = np.array([np.dtype(precision).itemsize for precision in PRECISIONS])
    touched = len(mesh.edges) * (8 + 4 * bytes_of) + len(mesh.points) * 12 * bytes_of
    wrong = [np.abs(one - ends[0]).max() / np.abs(ends[0]).max() for one in ends]
    return {
        "explicit_steps": rate,
        "spring_updates": rate * len(mesh.edges),
        "explicit_bandwidth": rate * touched,
        "explicit_error": np.array(wrong),
    } | _noted(seconds)


def _copied(threads):
    """Bytes a second that a plain copy by some threads reads and writes."""
    large = np.ones((threads, 2**24 // threads))
    other = np.zeros_like(large)
    with ThreadPoolExecutor(threads) as pool:
        seconds = _median(None, lambda: list(pool.map(np.copyto, other, large)))
    return 2 * large.nbytes / seconds


def _median(alarm, function):
    """Median seconds of a function; NaN on a busy machine."""

    def run():
        if alarm:
            alarm.set()
        function()

    return middle(steady(run, REPETITIONS))


def _noted(*seconds):
    """Message of times of which some are not measured; nothing of others."""
    return {"message": BUSY} if any(np.isnan(one).any() for one in seconds) else {}
