"""Scenes without a reference, or beyond it: solved, and never with an error that says nothing."""

import contextlib
import csv

import numpy as np
import pytest
import xarray as xr

import springtune as st
from springtune.studies.kinds import collect
from springtune.studies.output import present
from springtune.studies.runs import store

from campaigns import Campaign
from tables import STUDIES

STUDY = STUDIES["beyond_reference"]


@pytest.fixture(scope="module")
def tree(run):
    """By its jobs in this process; that Snakemake runs them is tested by what is next to this module."""
    run.write("beyond.yaml", STUDY)
    with contextlib.chdir(run.folder):
        Campaign("beyond.yaml").finish()
    with st.open(run.folder / "results/beyond") as opened:
        yield opened.load()


def test_a_scene_beyond_the_linear_reference_says_so(tree, run):
    root = tree.to_dataset().sel(beam="slender", mesh_size=2e-3, mesh_type="structured", load="bending").squeeze()
    assert root.reference_rotation.item() == pytest.approx(0.5, rel=0.01)
    assert root.reference_applies.sel(kinematics="nonlinear") == 0
    assert root.reference_applies.sel(kinematics="linear") == 1
    assert root.reference_applies.attrs["flag_meanings"] == "no yes"
    bent = root.sel(definition="lattice")
    assert (bent.status == 1).all() and np.isfinite(bent.deformation_error).all()
    message = bent.message.sel(kinematics="nonlinear").item()
    assert "the linear reference does not apply: it turns by 0.5 rad" in message and "9.4 %" in message
    assert bent.message.sel(kinematics="linear").item() == ""
    assert "does not apply: it turns by 0.5 rad" in (run.folder / "results/beyond/tables/index.html").read_text()


def test_the_run_says_so_in_the_end(tree, run):
    text = (run.folder / "results/beyond/summary.txt").read_text()
    # Three networks on one beam, of which one fails, and one on the other; of two kinematics each.
    beyond = (tree.to_dataset().reference_applies == 0).sum().item()
    assert beyond == 1 and "beyond small strain, so the error is not the network's alone: 2 of 8" in text
    assert "slender, soft, bending: the linear reference does not apply: it turns by 0.5 rad" in text


def test_against_finite_strain_what_is_left_is_the_mesh(tree, run):
    """Small strain and large rotation: laws do not differ, and the linear network's error is the nonlinear one's."""
    root, finite = tree.to_dataset(), tree["finite_strain"].to_dataset()
    assert finite.reference_displacement.dims == ("beam", "material", "load", "reference")
    assert finite.deformation_error.dims[-1] == "reference"
    place = {"beam": "slender", "definition": "delingette"}
    stress = finite.sel(place | {"reference": "neo-hooke-plane-stress"}).squeeze()
    assert stress.reference_error_estimate < 1e-4 and stress.reference_message.item() == ""
    errors = root.deformation_error.sel(place)
    linear, nonlinear = (errors.sel(kinematics=name).item() for name in ("linear", "nonlinear"))
    against = stress.deformation_error.sel(kinematics="nonlinear").item()
    assert nonlinear < linear - 0.07  # finite rotation, 9.5 % at F L^2 / (E I) = 1
    assert abs(against - linear) < 0.02
    other = finite.reference_displacement.sel(beam="slender", reference="neo-hooke-plane-strain").item()
    # A slender beam in plane strain is stiffer by 1 / (1 - nu^2).
    assert other / stress.reference_displacement.item() == pytest.approx(1 - 0.3**2, rel=0.03)
    page = (run.folder / "results/beyond/tables/index.html").read_text()
    assert "Against references at finite strain" in page
    tables = run.folder / "results/beyond/tables"
    assert (tables / "finite_strain.csv").exists()
    # Tables and summary have like with like.
    with open(tables / "bending_structured_soft.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if (row["beam"], row["definition"]) == ("slender", "delingette")]
    found = {row["kinematics"]: row for row in rows}
    for kinematics, error in (("nonlinear", against), ("linear", linear)):
        assert float(found[kinematics]["error_percent"]) == pytest.approx(100 * error, rel=1e-5)
    wanted = 1e3 * stress.reference_displacement.item()
    assert float(found["nonlinear"]["reference_mm"]) == pytest.approx(wanted, rel=1e-5)
    assert found["nonlinear"]["reference_applies"] == "yes" and "marks a reference at finite strain" in page
    assert "nonlinear networks against finite strain" in (run.folder / "results/beyond/summary.txt").read_text()


def test_a_scene_without_a_reference_says_so(tree, run, tmp_path):
    """References that did not converge are stored with their message alone."""
    lost = "bending reference, 10 times as long as high, nu = 0.3: relative rounding error 2.0e-04"
    # One file a unit problem; the shorter beam turns less. Those at finite strain hold no rotation.
    found = {file: store.read(file, [file.stem])[file.stem] for file in run.folder.glob("results/beyond/references/*")}
    file = min(found, key=lambda file: found[file].get("rotation", np.inf))
    kept = file.read_bytes()
    try:
        store.add(file, {file.stem: {"message": lost, "seconds": 0.1}})
        path = run.folder / "beyond.yaml"
        collect.run(st.load_study(path), run.folder / "results/beyond", tmp_path / "dataset.nc")
    finally:
        file.write_bytes(kept)
    text = (tmp_path / "summary.txt").read_text()
    assert f"without a reference, and so without an error: 2 of 8\n  other, soft, bending: no reference: {lost}" in text
    with xr.open_datatree(tmp_path / "dataset.nc", engine="h5netcdf") as tree:
        root = tree.to_dataset().sel(beam="other", definition="lattice").squeeze()
        assert np.isnan(root.reference_displacement) and np.isnan(root.deformation_error).all()
        assert root.reference_message.item() == f"no reference: {lost}"
        assert (root.reference_applies == 0).all() and (root.status == 1).all()
        assert (root.message == f"no reference: {lost}").all()
        present.write_page(tree, tmp_path)
    assert f"no reference: {lost}" in (tmp_path / "index.html").read_text()
    rows = csv.DictReader(min(tmp_path.glob("bending_*.csv")).read_text().splitlines())
    applies = {(row["beam"], row["kinematics"]): row["reference_applies"] for row in rows}
    # Nonlinear networks have a reference of their own, at finite strain.
    assert [place for place, said in applies.items() if said == "no"] == [("other", "linear")]
