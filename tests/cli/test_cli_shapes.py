"""Shapes of a study on the command line: predictions, springs, and what is refused."""

import math
from pathlib import Path

import numpy as np
import pytest

import springtune as st
from springtune.mesh.formats import write_mesh
from springtune.problem.compare import error_text

from tables import STUDIES, run

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
        how = {"definition": "lattice", "kinematics": "linear"}
        linear = st.Scene(plate, grouped, study.material("steel"), "pull", **how).solve()
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
