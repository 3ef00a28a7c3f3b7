"""The approaches of the benchmark against each other and the reference, and how a case is run."""

import itertools
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from runpy import run_path

import numpy as np
import pytest
import xarray as xr

from springtune.linalg import SOLVERS
from springtune.linalg.factors import SingularError
from springtune.mechanics.network import Network
from springtune.mechanics.statics import StaticProblem
from springtune.mesh import MESH_TYPES
from springtune.problem.boundary import held, weights
from springtune.problem.geometry import Beam
from springtune.problem.loads import AXIAL
from springtune.problem.materials import Material
from springtune.problem.status import Status
from springtune.reference import calculix
from springtune.reference.small_strain import solve_small_strain
from springtune.springs.lattice import half_weight
from springtune.studies.kinds.benchmark import OTHER_APPROACHES, approach_names
from springtune.studies.kinds.benchmark import solve as benchmark
from springtune.studies.kinds.benchmark.approaches import APPROACHES
from springtune.studies.kinds.benchmark.kind import VARIABLES
from springtune.studies.kinds.benchmark.solve import LoadedBeam

BEAM = Beam(0.1, 0.02, 1e-3, "100x20")
SCENES = {
    "traction": LoadedBeam(BEAM, Material(210e9, 0.3, 7850.0, "steel"), "traction", 20e3),
    "bending": LoadedBeam(BEAM, Material(210e9, 0.3, 7850.0, "steel"), "bending", 200.0),
    "block": LoadedBeam(BEAM, Material(1e6, 0.49, 1000.0, "rubber"), "pressure", -10.0),
}
CLOSE = {
    # largest error at 2 mm, ten rows: linear triangles; quadratic; constant boundary elements; no physics
    "traction": (5e-4, 1e-4, 1e-3, 5e-3),
    "bending": (2e-2, 5e-4, 0.6, 3e-2),
    "block": (2e-3, 3e-4, 1e-2, 0.3),
}


def answer(scene, approach, size=2e-3):
    return APPROACHES[approach](scene, size, benchmark.Clock())


@pytest.fixture(scope="module")
def references():
    return {
        name: solve_small_strain(scene.beam, scene.material, scene.force, kind=scene.kind).displacement
        for name, scene in SCENES.items()
    }


@pytest.mark.parametrize("name", SCENES)
def test_every_other_approach_comes_near_the_reference(name, references):
    linear, quadratic, boundary, free = CLOSE[name]
    allowed = dict.fromkeys(OTHER_APPROACHES, linear)
    allowed |= {"quadratic-triangles": quadratic, "boundary-elements": boundary, "free-form": free}
    for approach in OTHER_APPROACHES:
        if approach.startswith("calculix") or "backward" in approach:
            continue
        found, unknowns = answer(SCENES[name], approach)
        assert found == pytest.approx(references[name], rel=allowed[approach]), approach
        assert unknowns > 0


@pytest.mark.parametrize("name", SCENES)
def test_ways_to_linear_triangles_agree(name):
    """scikit-fem, vertex and edge tensors, condensed responses, motion to rest and springs with coupling are one."""
    first, _ = answer(SCENES[name], "linear-triangles", 4e-3)
    for approach in ("tensor-mass", "condensation", "relaxation"):
        assert answer(SCENES[name], approach, 4e-3)[0] == pytest.approx(first, rel=1e-6), approach


def test_boundary_elements_converge(references):
    errors = [abs(answer(SCENES["bending"], "boundary-elements", size)[0] / references["bending"] - 1)
              for size in (4e-3, 2e-3, 1e-3)]  # fmt: skip
    assert errors[0] > 1.3 * errors[1] > 1.3**2 * errors[2]


@pytest.mark.skipif(not calculix.program(), reason="needs CalculiX (ccx; Debian package calculix-ccx)")
@pytest.mark.parametrize("name", SCENES)
def test_calculix_takes_part(name, references):
    assert answer(SCENES[name], "calculix-cps3")[0] == pytest.approx(references[name], rel=CLOSE[name][0])
    assert answer(SCENES[name], "calculix-cps8")[0] == pytest.approx(references[name], rel=2e-3)


def asked(sizes, approaches, **shortest):
    """The shortest size of each approach; the shortest of all of those that are not named."""
    return [shortest.get(name.replace("-", "_").replace("/", "_"), min(sizes)) for name in approaches]


def clocks(patch, step, used):
    """Put clocks in place of those of the time and of the processor; each look at one takes its step [s]."""
    for name, one in (("perf_counter", step), ("process_time", used)):
        patch.setattr(time, name, itertools.count(0, one).__next__)


@pytest.fixture(autouse=True)
def quiet(monkeypatch):
    """A machine that does nothing else, whatever this one does."""
    clocks(monkeypatch, 1e-3, 1e-2)


def test_a_case_has_the_shapes_of_the_dataset_and_what_was_asked_for():
    approaches = approach_names(["lattice", "delingette"], ["structured", "braced"], ["linear-triangles", "free-form"])
    assert approaches == (
        "lattice/structured",
        "lattice/braced",
        "delingette/structured",
        "linear-triangles",
        "free-form",
    )
    wanted = (2e-3, 5e-3, 1e-2)
    finest = asked(wanted, approaches, lattice_structured=1e-2)
    found = benchmark.measure(SCENES["traction"], approaches, wanted, finest, 30.0)
    sizes = {"scene": 1, "approach": len(approaches), "mesh_size": 3}
    for name, values in found.items():
        assert np.shape(values) == tuple(sizes[one] for one in VARIABLES[name][0] if one != "scene"), name
    assert np.isfinite(found["seconds"][1]).all() and np.isfinite(found["seconds"][0]).tolist() == [False, False, True]
    assert found["status"][0].tolist() == [Status.NOT_REQUESTED, Status.NOT_REQUESTED, Status.SOLVED]
    assert not found["message"].any() and (found["peak_memory"][1] >= 0).all()
    assert np.abs(found["error"][2, 2]) < 0.01
    parts = sum(found[f"{part}_seconds"][1] for part in benchmark.PARTS)
    assert (parts > 0).all() and (found["factorizing_seconds"][1] > 0).all()


def test_what_is_run_does_not_depend_on_the_machine(monkeypatch):
    approaches, sizes = ("lattice/structured", "linear-triangles"), (5e-3, 1e-2)
    quick = benchmark.measure(SCENES["traction"], approaches, sizes, asked(sizes, approaches), 30.0)
    clocks(monkeypatch, 10.0, 100.0)  # all takes ten thousand times as long
    slow = benchmark.measure(SCENES["traction"], approaches, sizes, asked(sizes, approaches), 30.0)
    assert (slow["seconds"] > 1.0).all() and (slow["status"] == quick["status"]).all()
    assert (quick["status"] == Status.SOLVED).all() and (slow["error"] == quick["error"]).all()


class TestSteady:
    """Runs of given seconds on a clock of their own, and what of them it had the processor."""

    @pytest.fixture
    def times(self, monkeypatch):
        def times(seconds, share=1.0):
            now = [0.0, 0.0]

            def run():
                taken = next(seconds)
                now[:] = now[0] + taken, now[1] + share * taken
                return taken

            monkeypatch.setattr(time, "perf_counter", lambda: now[0])
            monkeypatch.setattr(time, "process_time", lambda: now[1])
            return run

        return times

    def test_runs_that_are_alike_are_enough(self, times):
        seconds = iter((0.1, 0.11, 0.12, 9.0))
        assert benchmark.middle(benchmark.steady(times(seconds), 3)) == pytest.approx(0.11)
        assert next(seconds) == 9.0

    def test_a_run_that_waited_is_repeated(self, times):
        runs = benchmark.steady(times(iter((0.86, 0.14, 0.5, 0.74, 0.15, 0.16))), 3)
        assert [result for _, result in runs] == [0.14, 0.15, 0.16]

    def test_times_of_a_busy_machine_are_none(self, times):
        seconds = iter(0.1 * 1.5**number for number in range(99))
        assert benchmark.steady(times(seconds), 3) == [] and next(seconds) < 0.1 * 1.5**10
        assert np.isnan(benchmark.middle([]))

    def test_a_run_without_the_processor_is_none(self, times):
        assert benchmark.steady(times(iter((0.9,) * 9), share=0.5), 1) == []
        assert len(benchmark.steady(times(iter((0.9,) * 9), share=0.9), 1)) == 1


def test_what_a_busy_machine_spoils_keeps_its_error_and_says_so(monkeypatch):
    clocks(monkeypatch, 1.0, 0.1)
    approaches, sizes = ("lattice/structured", "linear-triangles"), (1e-2,)
    found = benchmark.measure(SCENES["traction"], approaches, sizes, asked(sizes, approaches), 30.0)
    assert (found["status"] == Status.SOLVED).all() and np.isfinite(found["error"]).all()
    assert np.isnan(found["seconds"]).all() and not found["pareto"].any() and np.isnan(found["reference_seconds"])
    assert set(found["message"].ravel()) == {"not measured: the machine was busy"}
    curves = benchmark.curves(SCENES["traction"], 1e-2, 30.0)
    assert curves["curve_status"] == Status.SOLVED and "busy" in curves["curve_message"].item()
    systems, steps = (of(SCENES["traction"], sizes, 30.0) for of in (benchmark.solvers, benchmark.explicit))
    assert {"not measured: the machine was busy"} <= set(systems["solver_message"].ravel())
    assert "busy" in steps["explicit_message"][0] and np.isnan(steps["copy_bandwidth"]).all()


def ended_by(number, below):
    """Approach that ends as if the machine were too slow, or too small, for sizes below one."""

    def approach(scene, size, clock):
        if size < below:
            os.kill(os.getpid(), number)
        return APPROACHES["free-form"](scene, size, clock)

    return approach


@pytest.mark.parametrize(
    ("number", "message"),
    [
        (signal.SIGPROF, "not done within 30 s of the processor (`most_seconds` of the benchmark)"),
        (signal.SIGKILL, "ended: by the limits of the study, or for lack of memory"),
    ],
)
def test_what_a_machine_cannot_do_is_a_hole_that_says_so(number, message, monkeypatch):
    """Limits of time and memory, as on a slow machine: cells with status and message, and the others are measured."""
    approaches, sizes = ("relaxation", "linear-triangles"), (2e-3, 4e-3, 5e-3, 1e-2)
    monkeypatch.setitem(APPROACHES, "relaxation", ended_by(number, below=4.5e-3))
    second = Beam(0.06, 0.015, 1e-3, "60x15")
    found = benchmark.measure(SCENES["traction"], approaches, sizes, asked(sizes, approaches), 30.0, second)
    assert found["status"][0].tolist() == [Status.FAILED, Status.FAILED, Status.SOLVED, Status.SOLVED]
    assert message in found["message"][0, 1]
    assert found["message"][0, 0].startswith("not run: at 4 mm it was ")
    assert (found["status"][1] == Status.SOLVED).all() and not found["message"][1].any()
    assert np.isnan(found["seconds"][0, :2]).all() and np.isfinite(found["seconds"][0, 2:]).all()
    assert found["second_status"][0].tolist() == [0, 0, Status.SOLVED, Status.SOLVED]


def test_seconds_of_the_processor_end_a_run():
    """Of the process, and of a program that it starts."""

    def spin(alarm):
        while True:
            pass

    found = benchmark.in_process(spin, 0.05)
    assert found["status"] == Status.FAILED and found["beyond"] and "not done within 0.05 s" in found["message"]

    def call(alarm):
        subprocess.run([sys.executable, "-c", "while True: pass"])
        raise RuntimeError("the program failed")

    found = benchmark.in_process(call, 0.05)
    assert found["status"] == Status.FAILED and "not done within 0.05 s" in found["message"]


def test_parts_beside_the_cases_are_holes_too():
    """Each takes hundreds of the milliseconds that it has."""
    scene, sizes, most = SCENES["traction"], (2e-3,), 1e-3
    curves = benchmark.curves(scene, 2e-3, most)
    assert curves["curve_status"] == Status.FAILED and "not done within 0.001 s" in curves["curve_message"].item()
    steps = benchmark.explicit(scene, sizes, most)
    assert (steps["explicit_status"] == Status.FAILED).all() and steps["explicit_message"].all()
    systems = benchmark.solvers(scene, sizes, most)
    multigrid = SOLVERS.index("multigrid")
    assert systems["solver_status"][multigrid] == Status.FAILED and systems["solver_message"][multigrid].all()


def test_explicit_steps_are_timed_in_threads_and_precisions(monkeypatch):
    found = benchmark.explicit(SCENES["traction"], (5e-3,), 30.0, updates=1)
    assert (found["explicit_status"] == Status.SOLVED).all() and (found["spring_updates"] > 0).all()
    springs = len(MESH_TYPES["structured"](0.1, 0.02, 5e-3).edges)
    assert found["spring_updates"][0] == pytest.approx(springs * found["explicit_steps"][0])
    assert (found["explicit_error"][:, 0] == 0).all() and (found["explicit_error"][:, 1] > 0).all()
    assert (found["explicit_error"] < 1e-4).all() and (found["copy_bandwidth"] > 0).all()
    clocks(monkeypatch, 0.1, 0.01)  # a busy machine, on which runs are repeated more often
    repeated = benchmark.explicit(SCENES["traction"], (5e-3,), 30.0, updates=1)
    assert (repeated["explicit_error"] == found["explicit_error"]).all()


def test_errors_are_checked_on_a_second_beam():
    """A definition's error there is what a run of that beam has, and the assured error is the largest of all."""
    second = Beam(0.06, 0.015, 1e-3, "60x15")
    approaches, sizes = ("lattice/structured", "linear-triangles"), (2e-3, 5e-3)
    finest = asked(sizes, approaches)
    found = benchmark.measure(SCENES["block"], approaches, sizes, finest, 30.0, second_beam=second)
    there = benchmark.measure(replace(SCENES["block"], beam=second), approaches, sizes, finest, 30.0)
    assert found["second_error"] == pytest.approx(there["error"], rel=1e-9)
    assert np.isnan(found["assured_error"][:, 0]).all()  # nothing finer was run
    both = np.abs([found["error"], found["second_error"]])
    assert found["assured_error"][:, 1] == pytest.approx(both.max(axis=(0, 2)))
    assert np.isnan(there["second_error"]).all() and np.isnan(there["assured_error"]).all()


def test_an_error_that_crosses_zero_or_stays_has_no_order():
    sizes = np.array([1e-3, 2e-3, 4e-3, 8e-3])
    errors = np.array([3e3 * sizes**2, -3e3 * sizes**2, 3e3 * (sizes - 3e-3) ** 2, sizes - 3e-3, 0 * sizes + 0.1])
    shown = {"error": errors, "seconds": np.full(errors.shape, np.nan), "unknowns": np.full(errors.shape, np.nan)}
    found = benchmark.rates(shown, sizes)["error_rate"]
    assert found[:2] == pytest.approx([2, 2]) and np.isnan(found[2:]).all()


def test_a_case_that_fails_is_stored_with_its_message():
    found = benchmark.measure(SCENES["traction"], ("van-gelder/braced",), (5e-3,), (5e-3,), 30.0)
    assert found["status"][0, 0] == Status.FAILED and found["message"][0, 0]


def test_comparison_flags_what_became_slower(tmp_path, monkeypatch, capsys):
    pages = run_path("tools/pages.py")
    dimensions, values = ("scene", "approach", "mesh_size"), np.full((1, 3, 2), 0.1)
    coordinates = {"scene": ["a"], "approach": ["x", "y", "z"], "mesh_size": [1e-3, 2e-3]}
    old = xr.Dataset({"seconds": (dimensions, values), "seconds_spread": (dimensions, 0.01 * values)}, coordinates)
    new = 2.0 * old  # a machine half as fast
    assert pages["comparison"](old, new)[1] == 0
    new["seconds"][0, 1] *= 2
    lines, flagged = pages["comparison"](old, new)
    assert flagged == 1 and any("y" in line and "slower" in line for line in lines)
    root = xr.Dataset(attrs={"springtune_version": "1"})
    for name, groups in {"old": {"/benchmark": old}, "new": {"/benchmark": new}, "without": {}}.items():
        xr.DataTree.from_dict({"/": root, **groups}).to_netcdf(tmp_path / f"{name}.nc", engine="h5netcdf")

    def compare(*names):
        monkeypatch.setattr(sys, "argv", ["pages.py", "--compare", *(str(tmp_path / f"{name}.nc") for name in names)])
        pages["main"]()

    compare("old", "old")
    with pytest.raises(SystemExit, match="1"):
        compare("old", "new")
    assert "  2.00  y  slower" in capsys.readouterr().out
    with pytest.raises(SystemExit, match="without.nc: has no group /benchmark; run config/benchmark.yaml"):
        compare("without", "old")
    with pytest.raises(SystemExit, match="none.nc.*; run config/benchmark.yaml"):
        compare("none", "old")


# -- what makes it fast ------------------------------------------------------------------------------------------------


def test_multigrid_gives_what_the_factorization_gives():
    mesh = MESH_TYPES["structured"](0.2, 0.04, 2e-3)
    pattern = weights(mesh, AXIAL)
    answers = []
    for solver in ("SuperLU", "multigrid"):
        problem = StaticProblem(Network(mesh, held(mesh, AXIAL), half_weight(mesh), solver=solver), pattern)
        found = problem.linear(1e-3)
        assert found.converged and problem.judge(1e-3, found)[0] is Status.SOLVED
        answers.append((found.factor.name, float(np.tensordot(found.displacements, pattern, axes=2))))
    assert [name for name, _ in answers] == ["SuperLU", "multigrid"]
    assert answers[1][1] == pytest.approx(answers[0][1], rel=1e-9)


def test_multigrid_refuses_a_network_beyond_its_buckling_load():
    mesh = MESH_TYPES["structured"](0.2, 0.01, 2e-3)
    problem = StaticProblem(Network(mesh, held(mesh, AXIAL), half_weight(mesh)), weights(mesh, AXIAL))
    bent = 5e-3 * problem.slope / np.abs(problem.slope).max() * -1
    assert problem.network.factorize_tangent(bent).negative_pivots > 0
    network = Network(mesh, held(mesh, AXIAL), half_weight(mesh), solver="multigrid")
    factor = network.factorize_tangent(bent)
    across = problem.network.reduce(np.stack([0 * mesh.points[:, 0], mesh.points[:, 0] ** 2], axis=1))
    with pytest.raises(SingularError):
        factor.solve(across)
    assert factor.negative_pivots == 1  # without being shown where to look
    assert network.factorize_tangent(0.01 * bent).negative_pivots == 0
