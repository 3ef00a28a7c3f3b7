"""The approaches of the benchmark against each other and the reference, and how a case is run."""

import numpy as np
import pytest

import springtune as st
from springtune.reference import calculix
from springtune.reference.small_strain import solve_small_strain
from springtune.studies.kinds.benchmark import OTHER_APPROACHES, approach_names
from springtune.studies.kinds.benchmark import solve as benchmark
from springtune.studies.kinds.benchmark.kind import KIND
from springtune.studies.kinds.benchmark.solve import APPROACHES, LoadedBeam
from springtune.studies.kinds.collect import group_of

from tables import beside, cases

BEAM = st.Beam(0.1, 0.02, 1e-3, "100x20")
SCENES = {
    "traction": LoadedBeam(BEAM, st.Material(210e9, 0.3, 7850.0, "steel"), st.LOADS["traction"].kind, 20e3),
    "bending": LoadedBeam(BEAM, st.Material(210e9, 0.3, 7850.0, "steel"), st.LOADS["bending"].kind, 200.0),
    "block": LoadedBeam(BEAM, st.Material(1e6, 0.49, 1000.0, "rubber"), st.LOADS["pressure"].kind, -10.0),
}
CLOSE = beside(__file__)["CLOSE"]


def answer(scene, approach, size=2e-3):
    return APPROACHES[approach](scene, size, benchmark.Clock())


def axes(approaches, sizes):
    return KIND.axes({"traction": {"approaches": approaches, "mesh_sizes": sizes}}) | {"mesh_size": sizes}


def measured(approaches, sizes, finest, most_seconds=30.0):
    """Group of a benchmark of the first scene."""
    cases = list(benchmark.cases(approaches, sizes, finest))
    rows = [{"scene": "traction"} | row for row in benchmark.measure(SCENES["traction"], cases, most_seconds)]
    return group_of(KIND).of_rows(axes(approaches, sizes), rows).sel(scene="traction")


@pytest.fixture(scope="module")
def references():
    solved = {
        name: solve_small_strain(one.beam, one.material, one.force, kind=one.kind) for name, one in SCENES.items()
    }
    return {name: found.displacement for name, found in solved.items()}


@pytest.mark.parametrize("name", SCENES)
def test_every_other_approach_comes_near_the_reference(name, references):
    linear, quadratic, boundary, free = CLOSE[name]
    allowed = dict.fromkeys(OTHER_APPROACHES, linear)
    allowed |= {"quadratic-triangles": quadratic, "boundary-elements": boundary, "free-form": free}
    for approach in OTHER_APPROACHES:
        if approach.startswith("calculix"):
            continue
        found, unknowns = answer(SCENES[name], approach)
        assert found == pytest.approx(references[name], rel=allowed[approach]), approach
        assert unknowns > 0


@pytest.mark.parametrize("name", SCENES)
def test_ways_to_linear_triangles_agree(name):
    """scikit-fem, vertex and edge tensors, condensed responses and springs with coupling are one."""
    first, _ = answer(SCENES[name], "linear-triangles", 4e-3)
    for approach in ("tensor-mass", "condensation"):
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


def test_a_case_has_the_shapes_of_the_dataset_and_what_was_asked_for():
    approaches = approach_names(["lattice", "delingette"], ["structured", "braced"], ["linear-triangles", "free-form"])
    assert approaches == (
        *"lattice/structured lattice/braced delingette/structured linear-triangles free-form".split(),
    )
    found = measured(approaches, (2e-3, 5e-3, 1e-2), [1e-2, *[2e-3] * 4])
    seconds = found.seconds.values
    assert np.isfinite(seconds[1]).all() and np.isfinite(seconds[0]).tolist() == [False, False, True]
    assert found.status.values[0].tolist() == [st.Status.NOT_REQUESTED, st.Status.NOT_REQUESTED, st.Status.SOLVED]
    assert not found.message.any() and abs(found.error[2, 2]) < 0.01
    parts = sum(found[f"{part}_seconds"].values[1] for part in benchmark.PARTS)
    assert (parts > 0).all() and (found.factorizing_seconds[1] > 0).all()


@cases
def test_a_case_that_fails_is_a_hole_that_says_so(error, status, message, monkeypatch):
    def approach(scene, size, clock):
        if size < 4e-3:
            raise error
        return APPROACHES["free-form"](scene, size, clock)

    monkeypatch.setitem(APPROACHES, "condensation", approach)
    sizes = (2e-3, 5e-3)
    found = measured(("condensation", "linear-triangles"), sizes, [2e-3] * 2)
    assert found.status.values.tolist() == [[status, st.Status.SOLVED], [st.Status.SOLVED, st.Status.SOLVED]]
    assert message in found.message.item(0)
    assert np.isfinite(found.seconds).values.tolist() == [[False, True], [True, True]]


def test_an_error_of_the_program_is_raised(monkeypatch):
    monkeypatch.setitem(APPROACHES, "condensation", lambda scene, size, clock: None)
    with pytest.raises(TypeError):
        measured(("condensation",), (5e-3,), (5e-3,))


def test_beyond_its_seconds_an_approach_is_not_run_on_finer_sizes():
    found = measured(("linear-triangles",), (5e-3, 1e-2), (5e-3,), 0.0)
    assert found.status.values[0].tolist() == [st.Status.FAILED, st.Status.SOLVED]
    assert found.message.values[0].tolist() == ["not run: at 10 mm it took longer than the 0 s of `most_seconds`", ""]


def test_explicit_steps_have_a_rate():
    rows = [*benchmark.explicit(SCENES["traction"], (5e-3,), updates=1)]
    assert (group_of(KIND).of_rows(axes((), (5e-3,)), rows).spring_updates > 0).all()
