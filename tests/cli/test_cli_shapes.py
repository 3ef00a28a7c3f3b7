"""Shapes of a study on the command line: predictions, springs, and what is refused."""

import math
from pathlib import Path

import numpy as np
import pytest

import springtune as st
from springtune.mesh import write_mesh
from springtune.problem.compare import error_text

from tables import STUDIES, refused_calls, run

SHAPES = Path(__file__).parents[2] / "config/shapes.yaml"

STUDY = STUDIES["cli_shapes"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a study, and the mesh file that it names."""
    folder = tmp_path_factory.mktemp("study")
    plate = st.Shape.rectangle("40 mm", "20 mm", holes=[st.Hole.circle(("20 mm", "10 mm"), "4 mm")])
    write_mesh(folder / "own.vtu", st.mesh_shape(plate, "4 mm"))
    (folder / "study.yaml").write_text(STUDY.replace("{supports: {a: fixed}", "{supports: {a: fixed, b: {y: 0}}"))
    return folder


@pytest.fixture
def here(folder, monkeypatch):
    """The folder, as the current one."""
    monkeypatch.chdir(folder)
    return folder


PLATE = ("--study", "study.yaml:plate", "--load", "pull", "--size", "4 mm")
OWN = ("--study", "study.yaml:own", "--material", "steel")


def test_a_study_gives_its_shapes_and_materials_by_name(here):
    study = st.load_study("study.yaml")
    assert study.shape("other").area == pytest.approx(0.5e-6)  # no grid has it
    assert study.material("steel").density == 7850
    with pytest.raises(ValueError, match=r"shape: 'plat' is unknown; did you mean 'plate'\? known: plate, own, other"):
        study.shape("plat")
    with pytest.raises(ValueError, match=r"material: 'stel' is unknown; did you mean 'steel'\?"):
        study.material("stel")
    with pytest.raises(ValueError, match="shape: 'plate' is unknown; the study has none"):
        st.load_study(SHAPES.with_name("paper.yaml")).shape("plate")


class TestPredict:
    def test_a_prediction_is_that_of_the_library(self, here):
        """With the study's refinement, and a quantity without a reference beside one that has one."""
        said = run("predict", *PLATE).stdout
        plate = st.load_study("study.yaml").shape("plate")
        grouped = st.mesh_shape(plate, "4 mm", refined={"hole": "2 mm"})
        steel = st.load_study("study.yaml").material("steel")
        choices = st.predict(plate, grouped, steel, load="pull")
        assert f"{len(grouped.mesh.points)} particles, {len(grouped.mesh.edges)} springs" in said
        assert f"recommended: {choices[0].definition};" in said and choices[0].worst < 0.05
        assert f"{choices[0].definition} {error_text(choices[0].errors['end'])} (end, " in said
        # Held there: the reference is zero, so there is no error of it, which costs the other one nothing.
        assert all(math.isnan(one.errors["corner"]) for one in choices)

    def test_the_text_has_a_row_a_definition_and_the_references(self, here):
        said = run("predict", *PLATE, "--springs-alone").stdout
        assert said.startswith("plate, load pull, free 4 mm: ") and "steel, t = 1 mm" in said
        lines = [line.split()[0] for line in said.splitlines() if line.strip()]
        assert {"energy-fit", "patch-fit"} & set(lines) and "delingette" not in lines
        assert "end" in lines and "error estimate" in said

    def test_a_shape_of_a_file_has_the_mesh_of_it(self, here, tmp_path):
        result = run("predict", *OWN, "--write", tmp_path / "net.json", "--springs-alone")
        assert result.exit_code == 0 and result.stdout.startswith("own, load pull, own.vtu: ")
        net = st.SpringNet.read(tmp_path / "net.json")
        assert len(net.points) == len(st.read_shape("own.vtu").mesh.points)
        assert net.forces.sum(axis=0) == pytest.approx([10, 0]) and net.header["shape"] == "own"


class TestSprings:
    def test_springs_are_those_of_the_scene(self, here, tmp_path):
        study = st.load_study("study.yaml")
        plate = study.shape("plate")
        grouped = st.mesh_shape(plate, "4 mm", refined={"hole": "2 mm"})
        linear = st.Scene(
            plate, grouped, study.material("steel"), "pull", definition="lattice", kinematics="linear"
        ).solve()
        target = tmp_path / "net.json"
        result = run("springs", *PLATE, "--definition", "lattice", "--scale", "2", "--out", target)
        assert result.exit_code == 0, result.output
        net = st.SpringNet.read(target)
        assert net.forces.sum(axis=0) == pytest.approx([20, 0], rel=1e-9)
        assert net.held.sum() == 2 * 6
        assert net.masses.sum() == pytest.approx(7850e-3 * (8e-4 - np.pi * 16e-6), rel=0.01)
        assert net.header["load"]["name"] == "pull" and net.header["load"]["scale"] == 2
        assert net.header["expected_error"]["end"] == linear.errors["end"]
        assert net.header["expected_error"]["corner"].startswith("not computed")

    def test_a_density_is_for_materials_that_have_none(self, here, tmp_path):
        asked = ("springs", "--study", "study.yaml:own", "--definition", "lattice", "--out", tmp_path / "net.json")
        assert run(*asked, "--material", "third", "--density", "1000 kg/m^3").exit_code == 0
        net = st.SpringNet.read(tmp_path / "net.json")
        assert net.masses.sum() == pytest.approx(1e-3 * 1e3 * 8e-4 * 0.94, rel=0.02)


class TestError:
    """`predict --error`."""

    ASKED = ("predict", "--study", f"{SHAPES}:cook", "--material", "third", "--error", "3 %")

    def test_it_says_what_it_found(self):
        said = run(*self.ASKED[:-1], "10 %").stdout
        assert said.startswith(
            "cook, load shear; 48 x 60 mm, third, t = 1 mm; an error of at most 10 % in tip and edge"
        )
        assert "recommended: free " in said and "with springs alone: free " in said

    @pytest.mark.parametrize(("options", "message"), refused_calls("predict, an error"))
    def test_refusals(self, options, message):
        result = run(*self.ASKED, *options)
        assert result.exit_code == 2 and result.stderr.startswith(f"Error: {message}"), result.output

    def test_what_has_no_mesh_or_no_reference_is_refused(self, here):
        result = run("predict", *OWN, "--error", "1 %")
        assert (
            result.exit_code == 1 and "'own': has the mesh of its file, so there is none to be found" in result.stderr
        )
        result = run("predict", *PLATE[:-2], "--error", "1 %")
        assert result.exit_code == 2
        assert result.stderr == (
            "Error: --load 'pull': 'corner' has no reference, so no error of it can be kept: it is zero; take it out "
            "of the quantities\n"
        )
        study = st.load_study("study.yaml")
        with pytest.raises(ValueError, match="of beams alone"):
            st.find_mesh(study.shape("plate"), study.material("steel"), "1 %", loads=["bending"])
        with pytest.raises(ValueError, match="load: 'pull' is of shapes alone"):
            st.find_mesh(st.Beam("40 mm", "20 mm"), study.material("steel"), "1 %", load="pull")


BOTH = [
    pytest.param([*command, *one.values[0]], one.values[1], id=f"{command[0]} {one.id}")
    for command in (("predict",), ("springs", "--out", "net.csv"))
    for one in refused_calls("shapes")
]


@pytest.mark.parametrize(("arguments", "message"), [*BOTH, *refused_calls("shapes, one command")])
def test_refusals_are_one_line(arguments, message, here):
    before = sorted(here.iterdir())
    result = run(*arguments)
    assert result.exit_code == 2 and message in result.stderr, result.output
    assert len(result.stderr.splitlines()) == 1 and sorted(here.iterdir()) == before


@pytest.mark.parametrize("ending", [".xml", ".py", ".xpbd.json"])
def test_follower_pressure_is_refused_by_simulators(ending, here, tmp_path):
    asked = ("--study", "study.yaml:plate", "--load", "push", "--size", "4 mm", "--definition", "lattice")
    result = run("springs", *asked, "--out", tmp_path / f"net{ending}")
    assert "load 'push': turns with the side that it acts on" in result.stderr
    assert "give its pressures 'follower: false'" in result.stderr and not [*tmp_path.iterdir()]


def test_neither_a_beam_nor_a_shape(here):
    for command in (("predict",), ("springs", "--out", "net.csv")):
        result = run(*command)
        assert result.exit_code == 2 and "Missing option '--beam' such as 200x40, or '--study'" in result.stderr
