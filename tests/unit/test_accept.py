"""Values that were accepted as right: their file, its tolerances, and what departs from it."""

import contextlib
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

import springtune as st
from springtune.cli import main
from springtune.studies.output import expected
from springtune.studies.output.comparison import Tolerance, compare
from test_diff import CURVE, SCENE, made, written

from tables import refused_calls

FILE = "config/expected/small.yaml"


def run(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def store(tree, name="small"):
    tree.attrs["study"] = name
    return written(tree, Path(f"results/{name}/dataset.nc"))


def lines():
    return Path(FILE).read_text().splitlines()


def edit(old, new):
    text = Path(FILE).read_text()
    assert old in text
    Path(FILE).write_text(text.replace(old, new, 1))


@pytest.fixture(scope="module")
def accepted(tmp_path_factory):
    """A folder in which the results of a study were accepted, to be copied."""
    folder = tmp_path_factory.mktemp("accepted")
    with contextlib.chdir(folder):
        store(made())
        store(xr.DataTree(xr.Dataset(attrs={"springtune_version": "0"})), "empty")
        result = run("accept", "small")
    assert result.exit_code == 0, result.output
    assert "config/expected/small.yaml: 32 scenes, 16 of /sensitivity accepted of results/small" in result.stdout
    return folder


@pytest.fixture
def here(accepted, tmp_path, monkeypatch):
    """The same, for one test."""
    shutil.copytree(accepted, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")


class TestFile:
    @pytest.mark.parametrize("ending", expected.EXPECTED_ENDINGS)
    def test_what_is_written_is_read(self, ending, tmp_path):
        """Beyond its tolerance not a digit is lost, and an own tolerance of a scene stays."""
        kept = expected.accepted(made())
        kept = expected.with_tolerances(kept, {"": Tolerance(1e-8), "displacement": Tolerance(1e-3, 1e-9)})
        kept["tolerance"] = xr.full_like(kept.displacement, np.nan)
        kept["tolerance"].loc[SCENE] = 0.25
        path = tmp_path / f"kept{ending}"
        expected.write(path, kept)
        read = expected.read(path)
        assert expected.tolerances(read) == expected.tolerances(kept)
        assert not compare(kept, read, Tolerance(1e-8)).different and not compare(read, kept, Tolerance(1e-8)).different
        assert float(read["tolerance"].sel(SCENE)) == 0.25 and int(read["tolerance"].notnull().sum()) == 1
        assert set(read["sensitivity"].data_vars) == {"deformation_error", "best_stiffness"}

    def test_a_scene_and_a_curve_are_a_line_each(self, here):
        found = lines()
        (scene,) = [line for line in found if line.strip().startswith("100x20, free, 5 mm, steel, bending, patch")]
        value = float(made().displacement.sel(SCENE))
        assert f"linear: {{status: solved, displacement: {value:.9g}, deformation_error: " in scene
        (curve,) = [line for line in found if line.strip().startswith("100x20, free, 5 mm, steel, bending, linear")]
        numbers = made()["sensitivity/deformation_error"].sel(CURVE).values
        assert f"deformation_error: [{', '.join(f'{number:.9g}' for number in numbers)}]" in curve
        assert "      stiffness_ratio: [0.5, 1.0, 1.5]" in found

    def test_groups_may_have_labels_of_their_own(self, here):
        """Curves of one beam, scenes of two: labels of a tree are those of all groups."""
        tree = made()
        tree["sensitivity/deformation_error"].loc[{"beam": "200x40"}] = np.nan
        tree["sensitivity/best_stiffness"].loc[{"beam": "200x40"}] = np.nan
        store(tree)
        assert run("accept", "small").exit_code == 0
        assert run("accept", "--check").exit_code == 0

    def test_dimensions_with_numbers_keep_their_units(self, tmp_path):
        tree = xr.DataTree(made()["/"].to_dataset().drop_vars("force").expand_dims(force=[1e3, 2.5e3]).copy(deep=True))
        tree["force"].attrs["units"] = "N"
        kept = expected.accepted(tree)
        expected.write(tmp_path / "kept.yaml", kept)
        assert "\n      2500 N, 200x40, structured, 2 mm, " in (tmp_path / "kept.yaml").read_text()
        assert not compare(expected.read(tmp_path / "kept.yaml"), tree, part=True).different

    def test_too_much_for_a_text_is_told(self, tmp_path):
        tree = made(mesh_size=tuple(1e-3 * np.arange(1, 1200)))
        with pytest.raises(ValueError, match=r"numbers are more than a text to review \(20000\); give a file"):
            expected.write(tmp_path / "large.yaml", expected.accepted(tree))
        with pytest.raises(ValueError, match=r"'.txt' is no form of expected values; give a file ending"):
            expected.write(tmp_path / "small.txt", expected.accepted(made()))
        assert not list(tmp_path.iterdir())

    @pytest.mark.parametrize(
        ("old", "new", "said"),
        [
            ("{relative: 1e-06}", "{relative: one}", ":7: tolerances.all.relative: 'one' is no number; give one"),
            ("{relative: 1e-06}", "{relative: -1}", ":7: tolerances.all.relative: -1 is no tolerance; give 0 or more"),
            ("{relative: 1e-06}", "{rel: 1}", ":7: tolerances.all.rel: is no part of a tolerance; give relative or"),
            ("{relative: 1e-06}", "{}\n  gap: {relative: 1}", ":8: tolerances.gap: no value has this name"),
            ("200x40, structured, 2 mm", "200x40, 2 mm", "6 labels; give 7: beam, mesh_type, mesh_size"),
            ("200x40, structured, 2 mm", "200x40, structured, 2 cm", "mesh_size '2 cm' is no number in mm"),
            ("status: solved", "status: sold", "'sold' is no status; known: not_requested, solved"),
            ("displacement: 0.001,", "displacement: far,", "'far' is no number"),
            ("deformation_error: [0.001, ", "deformation_error: [", "2 numbers; give 3, one for each place along it"),
            ("groups:", "groups:\n\t", ":9: not YAML"),
            ("accepted: small", "about: small", "holds no expected values; accept the results anew"),
        ],
    )  # fmt: skip
    def test_a_spoiled_file_is_told_with_its_line(self, here, old, new, said):
        edit(old, new)
        result = run("accept", "--check", "small", "--to", FILE)
        assert result.exit_code == 2 and said in result.stderr and len(result.stderr.splitlines()) == 1, result.output


class TestCheck:
    def test_results_that_are_as_accepted_pass(self, here):
        for arguments in (("accept", "--check"), ("accept", "--check", "small"), ("diff", FILE, "small")):
            result = run(*arguments)
            assert result.exit_code == 0 and "the same: " in result.stdout, result.output

    def test_what_departs_is_named(self, here):
        tree = made()
        tree["displacement"].loc[SCENE] *= 1.01
        tree["status"].loc[SCENE | {"beam": "200x40"}] = st.Status.UNSTABLE
        tree["sensitivity/deformation_error"].loc[CURVE | {"stiffness_ratio": 1.0}] += 1.0
        store(tree)
        result = run("accept", "--check")
        assert result.exit_code == 1
        said = [" ".join(line.split()) for line in result.stdout.splitlines()]
        assert "200x40, free, 5 mm, bending, patch solved -> unstable" in said
        assert any(line.startswith("sensitivity/deformation_error") and "+1" in line and line.endswith(
            "100x20, free, 5 mm, bending, stiffness ratio 1") for line in said)  # fmt: skip
        assert any(line.startswith("displacement") and "(+1 %)" in line for line in said)
        assert run("diff", FILE, "small").exit_code == 1

    def test_what_nobody_accepted_is_no_departure_unless_it_is_a_scene(self, here):
        tree = made()
        tree["field_error"].values[...] = 7.0
        tree["residual"].values[...] = 7.0
        store(tree)
        assert run("accept", "--check").exit_code == 0
        store(made(mesh_size=(2e-3, 5e-3, 1e-2)))
        result = run("accept", "--check")
        assert result.exit_code == 1 and "  mesh_size only now: 10 mm" in result.stdout

    def test_tolerances_are_of_all_of_a_variable_or_of_a_line(self, here):
        tree = made()
        tree["displacement"].loc[SCENE] *= 1.01
        store(tree)
        assert run("accept", "--check").exit_code == 1
        edit("{relative: 1e-06}", "{relative: 1e-06}\n  displacement: {relative: 0.02}")
        assert run("accept", "--check").exit_code == 0
        edit("{relative: 0.02}", "{relative: 0.005}")
        assert run("accept", "--check").exit_code == 1
        edit(
            "100x20, free, 5 mm, steel, bending, patch, linear: {",
            "100x20, free, 5 mm, steel, bending, patch, linear: {tolerance: 0.02, ",
        )
        edit("  displacement: {relative: 0.005}\n", "")
        assert run("accept", "--check").exit_code == 0

    def test_a_curve_is_in_a_tube_as_wide_as_its_largest_value_says(self, here):
        curve = made()["sensitivity/deformation_error"].sel(CURVE)
        for share, code in ((0.9, 0), (1.1, 1)):
            tree = made()
            width = 1e-6 * max(1.0, float(curve.max()))  # an error has no unit: the tolerance is absolute, too
            tree["sensitivity/deformation_error"].loc[CURVE | {"stiffness_ratio": 0.5}] += share * width
            store(tree)
            assert run("accept", "--check").exit_code == code

    def test_accepting_anew_tells_changes_and_keeps_tolerances(self, here):
        edit("{relative: 1e-06}", "{relative: 1e-06}\n  displacement: {relative: 0.002}")
        line = "100x20, free, 5 mm, steel, bending, patch, linear: {"
        edit(line, f"{line}tolerance: 0.003, ")
        tree = made()
        tree["displacement"].loc[SCENE] *= 1.5
        store(tree)
        result = run("accept", "small")
        assert result.exit_code == 0 and "(+50 %)" in result.stdout
        assert "  displacement: {relative: 0.002}" in lines() and any("tolerance: 0.003" in line for line in lines())
        assert run("accept", "--check").exit_code == 0

    def test_variables_are_chosen_and_stay_so(self, here):
        names = "deformation_error,reference_displacement,sensitivity/displacement"
        assert run("accept", "small", "--variables", names, "--relative", "1e-4").exit_code == 0
        assert "  all: {relative: 0.0001}" in lines()
        assert any("reference_displacement: " in line for line in lines())  # of each scene, though it has fewer labels
        assert run("accept", "--check").exit_code == 0
        assert run("accept", "small").exit_code == 0 and not any("best_stiffness" in line for line in lines())
        tree = made()
        tree["reference_displacement"].values[...] *= 1.001
        store(tree)
        assert run("accept", "--check").exit_code == 1

    def test_tolerances_of_what_is_not_accepted_any_more_are_dropped(self, here):
        """Else the file that is written could not be read."""
        own = "{relative: 1e-06}\n  displacement: {relative: 0.002}\n  deformation_error: {relative: 0.003}\n"
        edit("{relative: 1e-06}\n", f"{own}  sensitivity/best_stiffness: {{relative: 0.1}}\n")
        tree = made()
        tree["sensitivity/best_stiffness"].values[...] = np.nan  # nothing of it is written then
        store(tree)
        for arguments in (("--variables", "deformation_error,sensitivity/best_stiffness"), ()):
            result = run("accept", "small", *arguments)
            assert result.exit_code == 0, result.output
            assert run("accept", "--check").exit_code == 0
            told = lines()[lines().index("tolerances:") : lines().index("groups:")]
            assert told == ["tolerances:", "  all: {relative: 1e-06}", "  deformation_error: {relative: 0.003}"]

    def test_a_tolerance_of_a_cell_goes_with_its_dimension(self):
        former = expected.accepted(xr.DataTree(made()["/"].to_dataset().drop_vars("force").expand_dims(force=[1e3])))
        former["tolerance"] = xr.full_like(former.displacement, 0.25)
        assert "tolerance" not in expected.with_tolerances_of(expected.accepted(made()), former)

    def test_the_option_for_one_tolerance_leaves_the_other(self, here):
        edit("{relative: 1e-06}", "{relative: 1e-06, absolute: 2e-09}")
        assert run("accept", "small", "--relative", "1e-4").exit_code == 0
        assert "  all: {relative: 0.0001, absolute: 2e-09}" in lines()
        assert run("accept", "small", "--absolute", "0").exit_code == 0
        assert "  all: {relative: 0.0001, absolute: 0}" in lines()


class TestRefusals:
    def test_scenes_that_are_not_solved_are_listed(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        tree = made()
        tree["status"].loc[SCENE] = st.Status.FAILED
        tree["message"].loc[SCENE] = "springs gone"
        tree["displacement"].loc[SCENE] = np.nan
        store(tree)
        result = run("accept", "small")
        assert result.exit_code == 1 and not (tmp_path / "config").exists()
        assert "  100x20, free, 5 mm, steel, bending, patch, linear: failed, springs gone" in result.stderr
        assert "nothing is accepted; mend these, or accept that they are so with --unsolved" in result.stderr
        result = run("accept", "small", "--unsolved")
        assert result.exit_code == 0 and "springs gone" in result.stderr
        assert run("accept", "--check").exit_code == 0
        store(made())
        assert run("accept", "--check").exit_code == 1  # what is solved now is to be accepted, too

    @pytest.mark.parametrize(("arguments", "code", "said"), refused_calls("accept"))
    def test_bad_calls_are_one_line(self, here, arguments, code, said):
        result = run(*arguments)
        assert result.exit_code == code and said in result.stderr, result.output
        assert len([line for line in result.stderr.splitlines() if line.startswith("Error")]) == 1
        assert {path.name for path in Path().iterdir()} == {"config", "results"}
