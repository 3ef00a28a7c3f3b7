"""Constants of a sheet from measured tests: synthetic ones with noise, rubber's, and what is refused."""

import re
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

import springtune as st
from springtune.cli import main
from springtune.cli.study import template_text
from springtune.problem.materials import TestDataError
from springtune.reference.by_constants import ENTRIES, Family
from springtune.reference.shapes import solve_shape
from springtune.scene.identify import Model
from springtune.scene.measured import blocks, body_of_test

from tables import cases, refused_files, slow_but

BEAM = st.Beam("100 mm", "20 mm")
PLY = st.AnisotropicMaterial.orthotropic("14 GPa", "5 GPa", 0.3, "2 GPa", name="ply")
FORCES = np.linspace(0.0, 500.0, 21)
SHEET = st.Material("3 GPa", 0.35)
CORE = st.Shape.rectangle(
    "60 mm", "30 mm", holes=[st.Hole.circle(("30 mm", "15 mm"), "8 mm", part="core")],
    loads={"pull": st.LoadCase("pull", (st.Support("left", 0, 0),), (st.Traction("right", (300.0, 0.0)),))},
)  # fmt: skip
GRIPPED = st.Shape.rectangle(
    "100 mm", "20 mm",
    loads={"grip": st.LoadCase("grip", (st.Support("left", 0, 0), st.Support("right", 1e-4, 0)))},
)  # fmt: skip


def write(path, head, *columns):
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=head, comments="")
    return str(path)


def curve(path, material, load="traction", noise=0.0, seed=0, angle=0.0):
    """File of a curve of a beam with its transverse displacement, in um, and a zero that is off by 3 um."""
    write(path, "force [N],displacement [um]", [0.0, 1.0], [0.0, 1.0])
    shape, case, _ = body_of_test(st.MeasuredTest(BEAM, load, path))
    turned = material.rotated(angle) if angle else material
    family = Family(shape, case, None, {"": turned})
    moved = family.solve(np.array([[turned.plane_stress[one]] for one in ENTRIES]))[:, 0]
    across = family.mean("gauge-2", 1) - family.mean("gauge-1", 1)
    clean = np.stack([np.outer(FORCES, row @ moved) for row in (family.forces[None], across[None])])[:, :, 0]
    along, width = clean + np.random.default_rng(seed).normal(0.0, noise or 1e-12, clean.shape) + 3e-6
    return write(path, "force [N],displacement [um],transverse [um]", FORCES, 1e6 * along, 1e6 * width)


def field(path, shape, load, materials, noise, seed=0):
    """File of a field of 300 points of a shape, moved as a camera that shifts and turns."""
    random = np.random.default_rng(seed)
    points = random.uniform(*np.array(shape.extent), (300, 2))
    moved = solve_shape(shape, shape.loads[load], materials).at(points)
    moved += random.normal(0.0, noise, moved.shape) + [2e-6, -5e-6] + 1e-5 * points[:, ::-1] * [-1, 1]
    return write(path, "x [mm],y [mm],u [um],v [um],exx [1]", 1e3 * points, 1e6 * moved, 0 * points[:, 0])


@cache
def exact(material, load):
    """Finite elements of the beam under 1 N."""
    with NamedTemporaryFile(suffix=".csv") as file:
        write(file.name, "force [N],displacement [um]", [0.0, 1.0], [0.0, 1.0])
        shape, case, _ = body_of_test(st.MeasuredTest(BEAM, load, file.name))
    return solve_shape(shape, case, {"": material})


def beam_field(path, material=SHEET, load="traction", spoil=lambda points, moved, random: moved, seed=0):
    """File of a field of 300 points of a beam under 500 N, with noise of 1 um, and the test of it."""
    random = np.random.default_rng(seed)
    points = random.uniform(0, (0.1, 0.02), (300, 2))
    moved = 500 * exact(material, load).at(points) + random.normal(0.0, 1e-6, (300, 2))
    moved = spoil(points, moved, random)
    return write(path, "x [mm],y [mm],u [um],v [um]", 1e3 * points, 1e6 * moved)


def windows(points, moved, random):
    """Noise of a grid of 1 mm, averaged over windows of 5 mm, at points."""
    places = np.stack(np.meshgrid(np.arange(-3, 104), np.arange(-3, 24), indexing="ij"), axis=-1).reshape(-1, 2) * 1e-3
    near = np.abs(points[:, None] - places).max(axis=2) < 2.5e-3
    return moved + 4e-6 * near @ random.normal(size=(len(places), 2)) / 5


def put(share, value):
    def spoil(points, moved, random):
        moved[random.random(len(moved)) < share] = value
        return moved

    return spoil


def patch(points, moved, random):
    moved[np.linalg.norm(points - [0.06, 0.012], axis=1) < 4e-3] = 0
    return moved


def gross(points, moved, random):
    moved[:8, 1] += random.normal(0, 1e-4, 8)
    return moved


def within(found, **expected):
    for name, value in expected.items():
        low, high = found.intervals[name]
        assert low < value < high, (name, low, high)
        assert high - low < 0.2 * abs(value)


def test_derivatives_by_constants_are_those_of_differences():
    case = CORE.loads["pull"]
    materials = {"": st.Material("2 GPa", 0.3), "core": PLY.rotated(0.4)}
    family = Family(CORE, case, None, materials)
    constants = np.array([one.plane_stress[entry] for one in materials.values() for entry in ENTRIES])
    directions = np.random.default_rng(0).normal(size=(len(constants), 3)) * 1e9
    moved, *slopes = family.solve(np.column_stack([constants, directions])).T
    for slope, direction in zip(slopes, directions.T):
        ahead, behind = (family.solve((constants + sign * 1e-5 * direction)[:, None])[:, 0] for sign in (1, -1))
        np.testing.assert_allclose((ahead - behind) / 2e-5, slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max())
    points = np.array([[0.03, 0.015], [0.05, 0.02], [0.02, 0.007]])
    rows, apart = family.at(points)
    expected = solve_shape(CORE, case, materials).at(points)
    np.testing.assert_allclose((rows @ moved).reshape(-1, 2), expected, atol=2e-3 * np.abs(expected).max())
    assert apart.max() < 1e-9


def test_a_curve_with_its_width_tells_both_constants(tmp_path):
    test = st.MeasuredTest(BEAM, "traction", curve(tmp_path / "c.csv", st.Material("3 GPa", 0.35), noise=2e-6))
    found = st.identify(test)
    within(found, E=3e9, nu=0.35)
    assert not found.notes and not found.undetermined
    known = st.identify(test, known={"nu": 0.35})
    assert np.isnan(known.intervals["nu"][0]) and "0.35, given" in str(known)


def test_a_curve_alone_does_not_tell_the_ratio(tmp_path):
    path = tmp_path / "c.csv"
    curve(path, st.Material("3 GPa", 0.35))
    rows = [",".join(line.split(",")[:2]) for line in path.read_text().splitlines()]
    path.write_text("\n".join(rows))
    found = st.identify(st.MeasuredTest(BEAM, "traction", path))
    assert found.undetermined == ("nu",)
    assert found.values["E"] == pytest.approx(3e9, rel=0.01)
    assert found.notes[0].startswith("nu: not determined by these data; add a transverse displacement")
    assert "not determined; 0.3 is assumed" in str(found)


@pytest.mark.parametrize("load", ["compression", "pressure"])
def test_columns_are_positive_along_the_load(tmp_path, load):
    path = tmp_path / "c.csv"
    write(path, "force [N],displacement [um]", [0.0, 100.0, 200.0, 300.0], [0.0, 1.0, 2.0, 3.1])
    assert st.identify(st.MeasuredTest(BEAM, load, path), known={"nu": 0.3}).values["E"] > 0
    write(path, "force [N],displacement [um]", [0.0, 100.0, 200.0, 300.0], [0.0, -1.0, -2.0, -3.1])
    with pytest.raises(TestDataError, match="displacement of .*c.csv.*: is opposite to the load"):
        st.identify(st.MeasuredTest(BEAM, load, path), known={"nu": 0.3})


def test_coupons_at_angles_tell_orthotropic_constants(tmp_path):
    angles = (0.0, np.pi / 4, np.pi / 2)
    files = [curve(tmp_path / f"{n}.csv", PLY, noise=1e-6, seed=n, angle=angle) for n, angle in enumerate(angles)]
    tests = [st.MeasuredTest(BEAM, "traction", file, angle=angle) for file, angle in zip(files, angles)]
    within(st.identify(tests, "orthotropic"), E1=14e9, E2=5e9, nu12=0.3, G12=2e9)
    assert {"E2", "G12"} <= set(st.identify(tests[0], "orthotropic").undetermined)


def test_a_field_tells_regions_and_rigid_motion_does_not_matter(tmp_path):
    materials = {"": st.Material("2 GPa", 0.3), "core": st.Material("9 GPa", 0.3)}
    file = field(tmp_path / "f.csv", CORE, "pull", materials, 2e-8)
    found = st.identify(st.MeasuredTest(CORE, "pull", file), "regions")
    low, high = found.intervals["E core"]
    assert low < 9e9 < high and high < 2 * low
    within(found, **{"E main": 2e9, "nu": 0.3})
    assert found.materials["core"].young_modulus == found.values["E core"]
    with pytest.raises(ValueError, match="take 'regions'"):
        st.identify(st.MeasuredTest(CORE, "pull", file))


def test_a_moved_support_tells_no_modulus(tmp_path):
    file = field(tmp_path / "f.csv", GRIPPED, "grip", st.Material("3 GPa", 0.35), 1e-8)
    found = st.identify(st.MeasuredTest(GRIPPED, "grip", file))
    assert found.undetermined == ("E",)
    within(found, nu=0.35)
    path = write(tmp_path / "c.csv", "displacement [mm],force [N]", [0.0, 0.1], [0.0, 600.0])
    with pytest.raises(TestDataError, match="'grip' is not one force; give a field of points"):
        st.identify(st.MeasuredTest(GRIPPED, "grip", path))


UNMEASURED = {
    "zeros": put(0.04, 0), "many zeros": put(0.4, 0), "of no camera": put(0.03, [0, -1]), "-999": put(0.03, -999e-6),
    "1e20": put(0.03, 1e14), "patch": patch, "gross": gross,
}  # fmt: skip


@pytest.mark.parametrize("kind", slow_but(("zeros", "patch", "gross"), UNMEASURED))
def test_points_that_were_not_measured_are_left_out(tmp_path, kind):
    file = beam_field(tmp_path / "f.csv", spoil=UNMEASURED[kind], seed=1)
    found = st.identify(st.MeasuredTest(BEAM, "traction", file, force=500))
    within(found, E=3e9, nu=0.35)
    assert len(found.notes) == 1 and " of 300 points are left out, the first at x, y = " in found.notes[0]


@pytest.mark.parametrize("cell", ["", "-nan(ind)", "1.79769e308"])
def test_points_without_numbers_are_left_out(tmp_path, cell):
    lines = Path(beam_field(tmp_path / "f.csv")).read_text().splitlines()
    for line, column in ((1, 2), (5, 3), (9, 0)):
        lines[line] = ",".join(cell if n == column else text for n, text in enumerate(lines[line].split(",")))
    (tmp_path / "f.csv").write_text("\n".join(lines))
    found = st.identify(st.MeasuredTest(BEAM, "traction", tmp_path / "f.csv", force=500))
    within(found, E=3e9, nu=0.35)
    assert found.notes == (f"'{tmp_path / 'f.csv'}': 3 points have no numbers and are left out",)


NOT_AS_STATED = {
    "v runs down": (SHEET, "traction", lambda _, moved, __: moved * [1, -1], "change the sign of v"),
    "v of shear": (SHEET, "shear", lambda _, moved, __: moved * [1, -1], "does not fit"),
    "windows": (SHEET, "traction", windows, "residuals are not random, so the intervals are too narrow"),
    "isotropic law": (PLY, "shear", lambda _, moved, __: moved, "the law does not fit"),
    "angle": (PLY.rotated(0.3), "traction", lambda _, moved, __: moved, "the law does not fit"),
}


@pytest.mark.parametrize("kind", slow_but(("v runs down", "windows"), NOT_AS_STATED))
def test_what_does_not_fit_is_noted(tmp_path, kind):
    material, load, spoil, note = NOT_AS_STATED[kind]
    file = beam_field(tmp_path / "f.csv", material, load, spoil)
    found = st.identify(st.MeasuredTest(BEAM, load, file, force=500), "orthotropic" if kind == "angle" else "isotropic")
    assert re.search(note, " ".join(found.notes))


@cases
def test_a_field_of_another_load_is_refused(tmp_path, load, sign, why):
    file = beam_field(tmp_path / "f.csv", SHEET, load, lambda _, moved, __: sign * moved)
    with pytest.raises(TestDataError, match=f"f.csv.*({why})"):
        st.identify(st.MeasuredTest(BEAM, "traction", file, force=500))


@pytest.mark.slow
def test_three_curves_tell_three_constants_and_a_usual_ratio_is_assumed(tmp_path):
    tests = []
    for n, angle in enumerate((0.0, np.pi / 2, np.pi / 4)):
        path = tmp_path / f"{n}.csv"
        lines = Path(curve(path, PLY, noise=1e-6, seed=n, angle=angle)).read_text().splitlines()
        path.write_text("\n".join(line.rpartition(",")[0] for line in lines))
        tests.append(st.MeasuredTest(BEAM, "traction", path, angle=angle))
    found = st.identify(tests, "orthotropic")
    within(found, E1=14e9, E2=5e9, G12=2e9)
    assert found.undetermined == ("nu12",) and found.values["nu12"] == pytest.approx(0.3, rel=0.02)
    isotropic = st.identify(tests, "isotropic")
    assert isotropic.undetermined == ("nu",) and isotropic.values["nu"] == 0.3
    assert "law does not fit" in " ".join(isotropic.notes)


def test_constants_without_influence_have_intervals_without_bounds(tmp_path):
    test = st.MeasuredTest(BEAM, "traction", curve(tmp_path / "c.csv", PLY, noise=1e-6))
    shape, case, _ = body_of_test(test)
    family = Family(shape, case, None, {"": PLY})
    start = {"E1": 14e9, "E2": 5e9, "nu12": 0.3, "G12": 2e9}
    *_, half = Model([(family, blocks(test, family, case), 0.0)]).fit(start, list(start))  # of two numbers
    assert half.max() > 100


@pytest.mark.slow
def test_estimates_lie_within_their_intervals_as_often_as_they_say(tmp_path):
    material = st.Material("3 GPa", 0.35)
    file = curve(tmp_path / "c.csv", material)
    test = st.MeasuredTest(BEAM, "traction", file)
    shape, case, _ = body_of_test(test)
    family = Family(shape, case, None, {"": material})
    found = blocks(test, family, case)
    model, random = Model([(family, found, 0.0)]), np.random.default_rng(32)
    clean, inside = [block.values.copy() for block in found], np.zeros(2)
    for _ in range(200):
        for block, values in zip(found, clean):
            block.values[:] = values + random.normal(0.0, 2e-6, values.shape)
        start = {"E": 2e9, "nu": 0.3}
        assert model.undetermined(start, list(start)) == []
        constants, _, _, half = model.fit(start, list(start))
        inside += np.abs([np.log(constants["E"] / 3e9), constants["nu"] - 0.35]) < half
    # A binomial count of 200 with a share of .95 is within these bounds with a probability of 99.9 %.
    assert (180 <= inside).all() and (inside <= 199).all(), inside


@pytest.mark.parametrize(("text", "message"), refused_files("measured"))
def test_a_bad_file_is_refused(tmp_path, text, message):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(TestDataError) as error:
        st.identify(st.MeasuredTest(BEAM, "traction", path, force="5 N" if text[0] == "x" else None))
    assert message in str(error.value) and "bad.csv" in str(error.value) and ";" in str(error.value)


def test_the_command_prints_materials_that_a_study_takes(tmp_path, monkeypatch):
    law = st.Material("3 GPa", 0.35)
    curve(tmp_path / "c.csv", law, noise=2e-6)
    monkeypatch.chdir(tmp_path)
    Path("pull.yaml").write_text("tests: {pull: {beam: 100x20, load: traction, file: c.csv}}")
    made = CliRunner().invoke(main, ["identify", "pull.yaml"])
    assert made.exit_code == 0, made.output
    assert "95 %" in made.output
    study = yaml.safe_load(template_text(Path("x"), "beam")) | yaml.safe_load(made.output.split("in a study:\n")[1])
    for grid in study["grids"].values():
        grid |= {"material": "measured"}
    Path("mine.yaml").write_text(yaml.safe_dump(study))
    found = st.load_study("mine.yaml").materials["measured"]
    assert found.young_modulus == pytest.approx(law.young_modulus, rel=0.02)
    assert found.poisson_ratio == pytest.approx(law.poisson_ratio, abs=0.05)
