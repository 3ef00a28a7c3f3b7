"""The quick study, end to end: the dataset's contract, and what the pages and an example say of it."""

import contextlib
import csv
import math
import re
import runpy

import meshio
import nbformat
import numpy as np
import pytest
import xarray as xr
import yaml
from nbclient import NotebookClient

import springtune as st

from campaigns import Campaign

SCENE = ("beam", "mesh_type", "mesh_size", "material", "load", "definition", "kinematics")


@pytest.fixture(scope="module")
def tree(run, repository):
    """By its jobs in this process; tests/studies/output/test_figures.py draws the other figures."""
    content = yaml.safe_load((repository / "config/quick.yaml").read_text())
    content["outputs"] = ["laying", "paraview", "tables"]
    del content["samples"]  # tests/studies/kinds/test_samples.py has them
    content["stability"]["experiment"].remove("slivers")  # tests/studies/kinds/test_stability.py has them
    content["benchmark"]["mesh_size"] = "5 mm"
    run.write("quick.yaml", yaml.safe_dump(content, sort_keys=False))
    with contextlib.chdir(run.folder):
        Campaign("quick.yaml").finish()  # the bundles of `snakemake` on this machine
    with xr.open_datatree(run.folder / "results/quick/dataset.nc", engine="h5netcdf") as opened:
        yield opened.load()


def test_root_has_the_names_of_the_contract(tree):
    root = tree.to_dataset()
    for name in "displacement deformation_error stiffness status message solve_seconds iterations residual".split():
        assert root[name].dims == SCENE, name
    for name in ("reference_displacement", "force"):
        assert root[name].dims == ("beam", "material", "load"), name
    further = "reference_error_estimate particles springs minimum_angle edge_length_spread"
    further += " paper_displacement paper_deformation_error paper_reference_displacement"
    assert {*further.split(), "beam_length", "beam_height", "beam_thickness"} <= {*root.variables}
    assert root.mesh_size.values.tolist() == [2e-3, 5e-3]
    assert root.status.attrs["flag_meanings"] == "not_requested solved linear_only not_converged unstable failed"
    assert list(root.status.attrs["flag_values"]) == [0, 1, 2, 3, 4, 5]


def test_the_stiffness_to_type_is_stated_for_each_definition(tree):
    root = tree.to_dataset()
    found = {name: root[f"stiffness_{name}"] for name in ("inside", "outline", "least", "most")}
    assert all(one.dims == SCENE and one.attrs["units"] == "N/m" for one in found.values())
    lattice = {name: one.sel(definition="lattice", mesh_type="structured").max().item() for name, one in found.items()}
    inside = 0.5 * 3**0.5 * 210e9 * 1e-3  # E t
    assert lattice == pytest.approx({"inside": inside, "outline": 0.5 * inside, "least": 0.5 * inside, "most": inside})
    assert all((one == root.stiffness).values[root.stiffness.notnull().values].all() for one in found.values())
    alike = root.stiffness_alike.sel(mesh_type="structured").groupby("definition").mean(...)
    assert (alike.sel(definition="lattice"), alike.sel(definition="delingette")) == (1, 0)
    solved = root.status == root.status.attrs["flag_values"][1]
    assert (found["inside"].notnull() | ~solved).all() and (found["least"] <= found["inside"]).values[solved].all()


def test_block_and_laying_have_the_names_of_the_contract(tree):
    block, laid = tree["block"].to_dataset(), tree["laying"].to_dataset()
    place = {"beam": "100x20", "material": "rubber", "mesh_type": "structured", "mesh_size": 5e-3}
    pressed = block.sel(place | {"kinematics": "linear"})
    area = pressed.face_displacement.sel(definition="area", load="pressure").item()
    small = pressed.reference_face_displacement.sel(load="pressure", reference="small-strain-plane-stress").item()
    finite = pressed.reference_face_displacement.sel(load="pressure", reference="neo-hooke-plane-stress").item()
    assert area < 0 and area == pytest.approx(small, rel=0.12)  # four rows
    assert finite == pytest.approx(small, rel=0.1) and finite != small
    # Linear kinematics know no other place than that at rest: the pressure follows nothing.
    assert area == pressed.face_displacement.sel(definition="area", load="follower-pressure").item()
    same = place | {"definition": "area", "load": "pressure", "kinematics": "linear"}
    assert tree.displacement.sel(same).item() == area
    strip = laid.sel(definition="area", mesh_size=2e-3, loading="pressure", friction=0)
    assert abs(strip.area_error.item()) <= 0.01 and strip.penetration.item() <= 1e-3
    assert abs(strip.elongation.item() - strip.reference_elongation.item()) <= 0.01
    assert "rigid" in strip.skipped.item()
    # No reference without the band in which it is known.
    assert 0 < strip.reference_elongation_error_estimate.item() < 0.1
    assert 0 < strip.reference_area_error_estimate.item() < 50e-6


def test_stability_has_the_names_of_the_contract(tree):
    data = tree["stability"].to_dataset()
    ratio = data.dt_limit_measured / data.dt_limit_predicted
    assert int(ratio.notnull().sum()) == 3 * 2 * 3  # explicit schemes, dampers, ratios
    assert abs(ratio - 1).max() <= 0.01
    place = {"definition": "delingette", "mesh_size": 5e-3}
    undamped = data.dt_limit_predicted.sel(place | {"damping_ratio": 0.0, "damper": "mass"})
    assert data.dt_particle_bound.sel(place) <= undamped.min()
    assert data.negative_pivots.dims == ("definition", "strain_load", "strain")
    assert data.negative_pivots.sel(definition="delingette", strain_load="axial", strain=-0.05) >= 1
    solved = data.strain_status == 1
    assert solved.any() and data.strain_displacement.where(solved).notnull().sum() == solved.sum()
    assert (data.strain_message.where(data.strain_status.isin([3, 4]), "why") != "").all()
    solved = data.contrast_status == 1
    # At 1e12 one solver leaves ten digits, and another none: the same status by both.
    assert solved.sel(stiffness_contrast=slice(None, 1e10)).all()
    assert not solved.sel(stiffness_contrast=slice(1e12, None)).any()
    assert (data.contrast_error.where(solved).fillna(0) <= 2 * data.contrast_estimate.clip(1e-9)).all()
    euler = data.buckling_load.sel(definition="delingette") / data.euler_load.sel(definition="delingette")
    assert abs(euler - 1).max() <= 0.02
    assert data.dt_limit_predicted.attrs["units"] == "s" and "flag_meanings" in data.strain_status.attrs
    assert "energy" not in data  # not asked for


def test_benchmark_has_the_names_of_the_contract(tree):
    """That seconds are there; how many, and their ratios, depend on what else the machine does."""
    data = tree["benchmark"].to_dataset()
    for name in ("error", "seconds", "unknowns"):
        assert data[name].dims == ("scene", "approach", "mesh_size"), name
    traction = data.sel(scene="traction", mesh_size=5e-3)
    ours, theirs = (traction.error.sel({"approach": name}) for name in ("delingette/structured", "linear-triangles"))
    assert abs(ours - theirs).max() <= 1e-9
    assert (traction.solving_seconds.sel({"approach": "condensation"}) > 0).all()
    assert (data.reference_error_estimate < 1e-4).all()
    assert (data.spring_updates.sel(mesh_size=5e-3) > 0).all()


@pytest.mark.parametrize("mesh_type", ["structured", "braced"])
def test_fields_are_meshes_in_equilibrium(tree, mesh_type):
    """By UGRID: cells fill the beam, and the springs' forces balance at each particle that nothing else acts on."""
    load = {"structured": "traction", "braced": "bending"}[mesh_type]
    place = {"material": "steel", "load": load, "definition": "lattice", "kinematics": "linear"}
    network = st.field(tree, beam="100x20", mesh_type=mesh_type, **place)
    assert network.mesh.attrs["cf_role"] == "mesh_topology" and network.mesh.attrs["topology_dimension"] == 2
    points = np.stack([network[name].values for name in network.mesh.attrs["node_coordinates"].split()], axis=1)
    ends = network[network.mesh.attrs["edge_node_connectivity"]].values
    cells = network[network.mesh.attrs["face_node_connectivity"]].values
    counted = tree.sel(beam="100x20", mesh_type=mesh_type, mesh_size=5e-3)
    assert len(points) == counted.particles and len(ends) == counted.springs
    x, y = points[cells].transpose(2, 0, 1)
    areas = 0.5 * (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)
    assert (areas > 0).all() and areas.sum() == pytest.approx(0.1 * 0.02)
    along = points[ends[:, 1]] - points[ends[:, 0]]
    pulls = network.spring_force.values[:, None] * along / np.linalg.norm(along, axis=1)[:, None]
    total = np.zeros_like(points)
    np.add.at(total, ends[:, 0], pulls)
    np.add.at(total, ends[:, 1], -pulls)
    inside = (points[:, 0] > 1e-9) & (points[:, 0] < 0.1 - 1e-9)
    # Forces are stored with seven digits, and at most eight springs meet.
    assert np.abs(total[inside]).max() <= 1e-6 * np.abs(network.spring_force.values).max()
    axis, size = {"traction": (0, 20e3), "bending": (1, 200.0)}[load]
    right = points[:, 0] >= 0.1 - 1e-9
    assert abs(total[right, axis].sum()) == pytest.approx(size, rel=1e-5)


def test_what_was_asked_for_is_solved_and_nothing_else(tree):
    root = tree.to_dataset()
    meanings = np.array(root.status.attrs["flag_meanings"].split())[root.status.values]
    assert set(np.unique(meanings)) == {"not_requested", "solved"}
    assert (root.displacement.notnull() == (root.status == 1)).all()
    assert int((root.status == 1).sum()) == 24 + 3 + 6 + 3 + 8 + 6
    assert (root.residual.where(root.status == 1, 0) <= 1e-10).all()  # exact: the criterion itself
    assert (root.reference_error_estimate.max() <= 1e-4).all()


def test_deformation_error_follows_its_formula(tree):
    root = tree.to_dataset()
    expected = (root.displacement - root.reference_displacement) / abs(root.reference_displacement)
    xr.testing.assert_allclose(root.deformation_error, expected.transpose(*SCENE), rtol=1e-9)


def test_uniform_scenes_lie_on_their_sensitivity_curve(tree):
    """The same mechanics by two ways: a cell's own solve, and the curve at its stiffness."""
    root, curves = tree.to_dataset(), tree["sensitivity"].to_dataset()
    place = {"beam": "100x20", "mesh_type": "free", "mesh_size": 2e-3, "material": "steel", "load": "traction"}
    place["kinematics"] = "nonlinear"
    curve = curves.sel(place)
    on_curve = np.interp(1 / 185e6, 1 / curve.stiffness.values[::-1], curve.displacement.values[::-1])
    # Linear interpolation between 61 points in 1/k; the curve is nearly straight there.
    assert float(root.displacement.sel(place | {"definition": "paper"})) == pytest.approx(on_curve, rel=1e-5)


def test_calibrated_is_the_mean_best_stiffness(tree):
    root, curves = tree.to_dataset(), tree["sensitivity"].to_dataset()
    place = {"mesh_type": "structured", "material": "steel", "load": "traction", "kinematics": "nonlinear"}
    place["beam"] = "100x20"
    best = curves.best_stiffness.sel(place)
    assert best.sizes == {"mesh_size": 2}
    stiffness = root.stiffness.sel(place | {"definition": "calibrated"})
    assert stiffness.values == pytest.approx(best.mean().item(), rel=1e-9)
    assert np.isnan(root.stiffness.sel(place | {"definition": "lattice"})).all()


def test_tables_and_figures_are_there(run, tree):
    results = run.folder / "results/quick"
    rows = list(csv.DictReader((results / "tables/table_1.csv").read_text().splitlines()))
    assert {row["mesh_size_mm"] for row in rows} == {"2", "5"}  # a row a network
    assert float(rows[0]["printed_displacement_mm"]) == 0.44
    assert re.search("Table 1.*20 kN fits", (results / "tables/index.html").read_text(), re.DOTALL)
    assert all((results / f"figures/laying.{ending}").stat().st_size > 5000 for ending in ("png", "pdf"))


def test_paraview_has_the_scenes_whose_fields_are_kept(run, tree):
    """Numbers of one are those of the same scene, solved by the library."""
    folder = run.folder / "results/quick/paraview"
    rows = list(csv.DictReader((folder / "scenes.csv").read_text().splitlines()))
    pieces = [row["file"] for row in rows]
    assert len(pieces) == int(tree["fields"].displacement_x.isel(particle=0).notnull().sum())
    assert sorted(pieces) == sorted(path.relative_to(folder).as_posix() for path in folder.glob("*.vtu"))
    grid = meshio.read(folder / "100x20_structured_5mm_steel_traction_lattice_nonlinear.vtu")
    beam, steel = st.Beam("100 mm", "20 mm"), st.Material("210 GPa", 0.3)
    mesh = st.make_mesh(beam, "structured", "5 mm")
    result = st.Scene(beam, mesh, steel, "traction", "20 kN", definition="lattice").solve()
    small = 1e-9 * np.abs(result.displacements).max()
    assert np.allclose(grid.point_data["displacement"][:, :2], result.displacements, rtol=0, atol=small)
    assert np.allclose(grid.cell_data["stiffness"][0], result.stiffness, rtol=1e-6)  # stored with seven digits
    assert np.allclose(grid.cell_data["force"][0], result.spring_forces, rtol=1e-6, atol=1e-6 * 20e3)
    error = result.displacements - result.reference().at(result.scene.mesh.points)
    assert np.allclose(grid.point_data["error"][:, :2], error, rtol=0, atol=small)


def test_example_reads_the_dataset(run, tree, repository, monkeypatch, tmp_path):
    """The reference is the paper's (table 1), which is printed to three digits."""
    monkeypatch.chdir(run.folder)
    main = runpy.run_path(str(repository / "examples/read_dataset.py"))["main"]
    assert main(figure=tmp_path / "curves.png") == pytest.approx(0.475e-3, rel=1e-3)
    assert (tmp_path / "curves.png").stat().st_size > 5000


def test_the_notebook_runs(run, tree, repository):
    folder = run.folder / "examples"
    folder.mkdir()
    notebook = nbformat.read(repository / "examples/springtune.ipynb", as_version=4)
    NotebookClient(notebook, kernel_name="python3", resources={"metadata": {"path": str(folder)}}).execute()
    shown = {cell.id: cell.outputs for cell in notebook.cells if cell.cell_type == "code"}
    text = {name: str(outputs) for name, outputs in shown.items()}
    # The closed form of an equilateral lattice, corrected for the outline; the reference of table 1.
    law = math.sqrt(3) / 2 * 210e9 * 1e-3 / (1 + math.sqrt(3) / 2 * 5 / 40)
    assert f"closed form {law / 1e6:.1f}e6 N/m" in text["sensitivity"] and "solved" in text["scene"]
    assert all("image/png" in text[name] for name in ("scene", "sensitivity", "figure"))
    errors = tree.deformation_error.sel(beam="100x20", mesh_type="structured", material="steel", load="traction")
    lattice = errors.sel(kinematics="nonlinear", definition="lattice", mesh_size=5e-3).item()
    assert f"{100 * lattice:.2f}" in text["dataset"] and "patch" in text["predict"]
    page = folder / re.search(r'src="(\S+)"', text["page"])[1]
    assert page.samefile(run.folder / "results/quick/index.html")


def test_second_run_has_nothing_to_do_and_reminds_of_holes(run, tree):
    code, output = run.snakemake("quick.yaml")
    assert code == 0 and "Nothing to be done" in output
    code, output = run.springtune("quick.yaml")
    assert code == 0 and "Nothing to be done" in output
    holes = int((tree["stability"].contrast_status > 1).sum())
    assert holes and f"Not everything is solved: {holes} of " in output
    assert "results/quick: index.html, dataset.nc" in output


def test_snakemake_runs_the_same_jobs(run, tree):
    """What each rule of a stage calls: its tasks, the record and the digest."""
    code, output = run.snakemake("quick.yaml", "-n", "-p", "--forceall")
    assert code == 0, output
    with contextlib.chdir(run.folder):
        here = Campaign("quick.yaml")
    jobs = {(str(one.tasks), str(one.record), one.digest) for one in here.bundles.values()}
    assert set(re.findall(r"kinds\.collect|present|browse", output)) == {"kinds.collect", "present", "browse"}
    assert len(jobs) > 10 and set(re.findall(r"runs\.job (\S+) (\S+) (\S+) quick\.yaml > ", output)) == jobs
