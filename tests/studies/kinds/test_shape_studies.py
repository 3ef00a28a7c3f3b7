"""Studies of shapes: what they may hold, what they expand to, and what their dataset says."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

import springtune as st
from springtune.cli import main
from springtune.mesh.formats import write_mesh
from springtune.studies.config.model import outputs
from springtune.studies.kinds import collect
from springtune.studies.kinds.bodies.kind import shape_mesh_keys, shape_reference_task, shape_scene_task
from springtune.studies.kinds.bodies.shapes import LARGEST_FILE_CHECKED
from springtune.studies.output import present
from springtune.studies.output.dataset import STATUS
from springtune.studies.runs.plan import output_files

from campaigns import do_stages, load_text
from tables import STUDIES, cases

COOK = STUDIES["shapes"]


def done(study, folder):
    """Tree of the dataset of a study, its groups and its folder; all stages run in this process."""
    do_stages(study, folder)
    collect.run(study, folder, folder / "dataset.nc")
    with st.open(folder) as tree:
        tree.load()
    return tree, (folder / "summary.txt").read_text()


def scenes(study, folder):
    """Scenes of the dataset of a study of shapes."""
    return done(study, folder)[0]["shapes"].to_dataset().squeeze(drop=True)


# -- what a study may hold ---------------------------------------------------------------------------------------------


def test_a_study_of_nothing_is_told_what_it_may_have(refusal):
    text = "title: nothing\nmaterials: {one: {young_modulus: 1 MPa, poisson_ratio: 0.3}}\n"
    others = "or 'shape_grids', 'laying', 'stability', 'benchmark', 'samples', 'engines'"
    assert f"'grids' is missing; give a section for each grid, by name, {others}" in refusal(text)


# -- what it expands to ------------------------------------------------------------------------------------------------


def test_keys_know_no_labels(load):
    """A quantity that is renamed, or of which another value is expected, a load, a shape: nothing is solved again."""
    one = load(COOK)
    text = COOK.replace("cook", "panel").replace("shear:", "other:").replace("third", "soft")
    text = text.replace("tip: {displacement", "end: {displacement").replace("23.96 mm, source: somebody", "24 mm")
    two = load(text, "two.yaml")
    assert [*shape_mesh_keys(one).values()] == [*shape_mesh_keys(two).values()]
    for first, second in zip(one.shapes.scenes, two.shapes.scenes):
        assert shape_scene_task(one, first)["key"] == shape_scene_task(two, second)["key"]
    assert (
        shape_reference_task(one, "cook", "third", "shear")["key"]
        == shape_reference_task(two, "panel", "soft", "other")["key"]
    )
    stiffer = load(COOK.replace("1 MPa", "2 MPa"), "stiffer.yaml")
    assert shape_mesh_keys(one) == shape_mesh_keys(stiffer)
    assert (
        shape_scene_task(one, one.shapes.scenes[0])["key"] != shape_scene_task(stiffer, stiffer.shapes.scenes[0])["key"]
    )


# -- what becomes of it ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def cook(tmp_path_factory):
    """A study of a shape alone, from its text to its dataset."""
    folder = tmp_path_factory.mktemp("cook")
    study = load_text(folder, COOK)
    return study, *done(study, folder / "results/study")


def test_values_are_those_of_scenes(cook):
    """The dataset has what the library gives, errors against the reference and against what others give."""
    _, tree, _ = cook
    data = tree["shapes"].to_dataset()
    assert (data.status == STATUS.index("solved")).all() and not (data.message != "").any()
    cell = data.sel(shape="cook", mesh_type="free", mesh_size=8e-3, material="third", load="shear", kinematics="linear")
    outline = [(0, 0), (48e-3, 44e-3), (48e-3, 60e-3), (0, 44e-3)]
    sides = [st.Segment(corner, group=name) for corner, name in zip(outline, ("lower", "right", "upper", "left"))]
    tip = st.Quantity("tip", "displacement", "tip", "y")
    case = st.LoadCase("shear", (st.Support("left", 0, 0),), (st.Traction("right", (0, 1)),), quantities=(tip,))
    shape = st.Shape("cook", 1e-3, sides, points={"tip": (48e-3, 52e-3)}, loads={"shear": case})
    mesh, third = st.mesh_shape(shape, 8e-3), st.Material(1e6, 1 / 3)
    for name in ("lattice", "delingette"):
        found = st.Scene(shape, mesh, third, "shear", definition=name, kinematics="linear").solve()
        one = cell.sel(definition=name, quantity="tip")
        assert float(one.value) == pytest.approx(found.values["tip"], rel=1e-9)
        assert float(one.error) == pytest.approx(float(one.value) / float(one.reference_value) - 1, rel=1e-9)
        assert float(one.expected_error) == pytest.approx(float(one.value) / 23.96e-3 - 1, rel=1e-9)
    # Others' value is of fine meshes; what is known of the reference is far less than its distance from it.
    assert abs(float(cell.reference_expected_error.sel(quantity="tip"))) < 1e-3
    assert float(cell.reference_error_estimate.sel(quantity="tip")) < 1e-4
    # Twice the strain energy is the work of the force on the side that it is on.
    assert (cell.particles > 0).all() and cell.quantity_units.values.tolist() == ["m", "J"]


def test_a_study_of_shapes_alone_has_all_its_pages(cook, tmp_path):
    study, tree, told = cook
    assert not tree.data_vars and set(tree.children) == {"shapes", "shape_fields"}
    assert "4 solved" in told and study.title in told
    present.write_page(tree, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {
        Path(name).name for name in output_files(outputs()["tables"], study)
    }
    rows = (tmp_path / "shapes.csv").read_text().splitlines()
    assert len(rows) == 1 + 2 * len(study.shapes.scenes)
    assert "Sources: cook, tip: somebody." in (tmp_path / "index.html").read_text()


def test_networks_that_are_drawn_are_stored(cook):
    _, tree, _ = cook
    fields = tree["shape_fields"].to_dataset().sel(case="cook, shear")
    assert float(fields.case_mesh_size) == 8e-3
    moved = fields.sel(definition="delingette")
    tip = int(np.argmin(np.hypot(fields.x - 48e-3, fields.y - 52e-3).values))
    value = tree["shapes"].value.sel(shape="cook", mesh_size=8e-3, definition="delingette", quantity="tip")
    assert float(moved.displacement_y[tip]) == pytest.approx(value.item(), rel=1e-6)
    held = np.abs(fields.outline_x.values) < 1e-9
    assert np.abs(fields.reference_displacement_y.values[held]).max() < 1e-9


def test_what_cannot_be_solved_is_a_hole_that_says_why(load, tmp_path):
    """A definition that cannot live on the mesh costs its own scenes; a reference that does not converge its error."""
    text = COOK.replace("delingette, lattice", "axis-exact, lattice").replace(
        "work: energy", "peak: {stress: yy, at: notch}"
    )
    text = text.replace("points: {", "points: {notch: [0, 44 mm], ").replace("[16 mm, 8 mm]", "16 mm")
    tree, told = done(load(text), tmp_path / "results/study")
    data = tree["shapes"].to_dataset().squeeze(drop=True)
    lost = data.sel(definition="axis-exact")
    assert STATUS[int(lost.status)] == "failed" and "isosceles" in lost.message.item()
    solved = data.sel(definition="lattice")
    # The stress at a clamped corner has no bound: no reference for it, and one for the displacement.
    assert np.isfinite(solved.error.sel(quantity="tip")) and np.isnan(solved.error.sel(quantity="peak"))
    assert np.isfinite(solved.value.sel(quantity="peak"))
    assert "no reference" in solved.message.item() and "'peak'" in solved.message.item()
    assert "1 failed" in told


# -- files -------------------------------------------------------------------------------------------------------------

PLATE = yaml.safe_load(STUDIES["shape_plate"])


@pytest.fixture
def plate(tmp_path):
    grouped = st.mesh_shape(st.Shape.rectangle("100 mm", "40 mm"), "10 mm")
    write_mesh(tmp_path / "plate.vtu", grouped)
    return grouped


def test_a_file_is_the_mesh_and_the_geometry(load, plate, tmp_path):
    study = load(yaml.safe_dump(PLATE))
    assert study.shapes.scenes[0].mesh_type == "file" and study.axes["mesh_size"] == (0.0,)
    cell = scenes(study, tmp_path / "results/study")
    assert int(cell.particles) == len(plate.mesh.points) and STATUS[int(cell.status)] == "solved"
    assert abs(float(cell.error)) < 0.01
    # The file is part of the keys, its place is not.
    before = shape_mesh_keys(study)
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "plate.vtu").rename(tmp_path / "elsewhere/plate.vtu")
    moved = PLATE | {"shapes": {"plate": PLATE["shapes"]["plate"] | {"file": "elsewhere/plate.vtu"}}}
    assert shape_mesh_keys(load(yaml.safe_dump(moved), "moved.yaml")) == before
    write_mesh(tmp_path / "elsewhere/plate.vtu", st.mesh_shape(st.Shape.rectangle("100 mm", "40 mm"), "8 mm"))
    assert shape_mesh_keys(load(yaml.safe_dump(moved), "moved.yaml")) != before


@cases
def test_groups_of_a_file_are_looked_at_as_the_study_is_read(refusal, plate, old, new, said):
    message = refusal(yaml.safe_dump(PLATE).replace(old, new))
    assert all(part in message for part in said), message


TWO = yaml.safe_load(STUDIES["shape_plate_of_two"])
STRETCH = 1e3 / (0.04 * 1e-3) * (0.05 / 210e9 + 0.05 / 2e9)
"""Of the plate, its left half of steel, its right half of a polymer [m]."""


@cases
def test_each_part_of_a_file_has_its_material(load, refusal, tmp_path, monkeypatch, whole, parts, material):
    mesh = st.make_mesh(st.Beam("100 mm", "40 mm"), "right", "10 mm")
    left = mesh.points[mesh.triangles, 0].mean(axis=1) < 0.05
    sides = {"left": mesh.outline_edges(0, 0), "right": mesh.outline_edges(0, 0.1), "lower": mesh.outline_edges(1, 0)}
    both = {"hard": {3: left}} | ({"soft": {3: ~left}} if whole else {})
    write_mesh(tmp_path / "plate.vtu", st.GroupedMesh(mesh, sides, {}, both))
    shape = TWO["shapes"]["plate"] | {"file": "plate.vtu", "parts": parts}
    grid = TWO["shape_grids"]["plate"] | {"material": material, "kinematics": "linear"}
    text = yaml.safe_dump(TWO | {"shapes": {"plate": shape}, "shape_grids": {"plate": grid}})
    study = load(text)
    tree, _ = done(study, tmp_path / "results/study")
    assert not any(tree["shapes"].message.values.ravel()), tree["shapes"].message.values
    np.testing.assert_allclose(tree["shapes"].value.values.ravel(), STRETCH, rtol=1e-9)
    np.testing.assert_allclose(tree["shapes"].reference_value.values.ravel(), STRETCH, rtol=1e-9)

    body, mesh = study.shape("plate"), st.read_shape(tmp_path / "plate.vtu")
    with pytest.raises(ValueError, match="material: one is given, and the body has the parts"):
        st.Scene(body, mesh, study.material(material), "pull")
    materials = study.materials_of("plate", material)
    scene = st.Scene(body, mesh, materials, "pull", definition="delingette", kinematics="linear")
    assert scene.solve().values["stretch"] == pytest.approx(STRETCH, rel=1e-9)
    rows = [f"{share},{share * STRETCH}" for share in (0.0, 0.5, 1.0, 2.0)]
    (tmp_path / "curve.csv").write_text("\n".join(["force [kN],displacement [m]", *rows]))
    known = {"nu": 0, "E hard": 210e9} if whole else {"nu": 0, "E main": 2e9}
    found = st.identify(st.MeasuredTest(body, "pull", tmp_path / "curve.csv"), "regions", known=known)
    assert list(found.materials) == (["hard", "soft"] if whole else ["", "hard"])
    assert found.values["E soft" if whole else "E hard"] == pytest.approx(2e9 if whole else 210e9, rel=1e-4)

    monkeypatch.chdir(tmp_path)
    call = ["--study", "study.yaml:plate", "--material", material]
    (tmp_path / "study.yaml").write_text(text)
    assert st.predict(body, mesh, materials)[0].errors["stretch"] == pytest.approx(0, abs=1e-9)
    said = CliRunner().invoke(main, ["predict", *call])
    assert said.exit_code == 0 and " +0.00 % (stretch" in said.output.replace("-0.00", "+0.00"), said.output
    said = CliRunner().invoke(main, ["springs", *call, "--definition", "delingette", "--out", "net.json"])
    assert said.exit_code == 0 and "stretch +" in said.output, said.output
    del shape["parts"]
    text = yaml.safe_dump(TWO | {"shapes": {"plate": shape}, "shape_grids": {"plate": grid}})
    assert "plate.vtu has parts 'hard'" in refusal(text)
    path = tmp_path / "plate.vtu"  # too large to be looked at as the study is read
    if whole:
        path.write_bytes(path.read_bytes() + b"<!--" + LARGEST_FILE_CHECKED // 10 * b"nothing at all\n" + b"-->\n")
        cell = scenes(load(text), tmp_path / "results/large")
        assert STATUS[int(cell.status)] == "failed" and "the body has the parts" in cell.message.item()


def test_files_of_several_sizes_show_convergence(load, refusal, tmp_path, monkeypatch):
    beam, files = st.Shape.rectangle("100 mm", "40 mm"), []
    for size in (20, 10, 5):
        write_mesh(tmp_path / f"{size}.vtu", st.mesh_shape(beam, f"{size} mm"))
        files.append({"file": f"{size}.vtu", "mesh_size": f"{size} mm"})
    text = yaml.safe_dump(PLATE | {"shapes": {"plate": PLATE["shapes"]["plate"] | {"file": files}}})
    study = load(text)
    tree, _ = done(study, tmp_path / "results/study")
    data = tree["shapes"].to_dataset().squeeze(drop=True)
    assert data.mesh_size.values.tolist() == [0.005, 0.01, 0.02] and study.axes["mesh_type"] == ("file",)
    meshes = [st.read_shape(tmp_path / f"{size}.vtu").mesh for size in (5, 10, 20)]
    assert data.particles.values.tolist() == [len(mesh.points) for mesh in meshes]
    assert np.all(np.diff(np.abs(data.error)) > 0) and np.abs(data.error[0]) < 0.003
    line = st.plot_shape_errors(tree, shape="plate")[0, 0].lines[0]
    np.testing.assert_allclose(line.get_xdata(), data.particles[::-1])
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.yaml").write_text(text)
    predict = ["predict", "--study", "study.yaml", "--material", "steel"]
    said = CliRunner().invoke(main, predict).output
    assert "--size: missing; 'plate' has files of 5 mm, 10 mm, 20 mm; give one" in said
    assert "100 x 40 mm, steel" in CliRunner().invoke(main, [*predict, "--size", "20 mm"]).output
    message = refusal(text.replace("mesh_size: 10 mm", "mesh_size: 20 mm"))
    assert "shapes.plate.file[1]" in message and "another file has this mesh size" in message
    write_mesh(tmp_path / "10.vtu", st.mesh_shape(st.Shape.rectangle("100 mm", "80 mm"), "10 mm"))
    assert "10.vtu is 100 x 80 mm, and 5.vtu 100 x 40 mm; give files of one body and unit" in refusal(text)


@pytest.mark.filterwarnings("always::springtune.problem.shapes.AssumptionWarning")  # several commands, one process
@pytest.mark.parametrize(("unit", "warned"), [({}, True), ({"unit": "1 m"}, False), ({"unit": "1 mm"}, False)])
def test_extents_are_in_sight(tmp_path, monkeypatch, unit, warned):
    """A file in mm that is read in m."""
    write_mesh(tmp_path / "plate.vtu", st.mesh_shape(st.Shape.rectangle(80, 60), 10))
    shape = PLATE["shapes"]["plate"] | {"file": "plate.vtu"} | unit
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(PLATE | {"shapes": {"plate": shape}}))
    monkeypatch.chdir(tmp_path)
    asked = ["--study", "study.yaml", "--material", "steel"]
    for command in (["scenes", "study.yaml"], ["predict", *asked], ["springs", *asked, "--out", "net.csv"]):
        said = CliRunner().invoke(main, command)
        assert ("80 x 60 mm," if unit.get("unit") == "1 mm" else "80 x 60 m,") in said.stdout
        message = "'plate': 80 x 60 m, since numbers in plate.vtu are read in m; give their unit, such as 'unit: 1 mm'"
        assert (message in said.stderr) == warned


def test_a_large_file_costs_its_own_scenes(load, plate, tmp_path):
    """What is too large to be looked at as the study is read is looked at by its stages."""
    comment = b"<!--" + LARGEST_FILE_CHECKED // 10 * b"nothing at all\n" + b"-->\n"
    path = tmp_path / "plate.vtu"
    path.write_bytes(path.read_bytes() + comment)
    cell = scenes(load(yaml.safe_dump(PLATE).replace("right", "rihgt")), tmp_path / "results/study")
    assert STATUS[int(cell.status)] == "failed" and "no group is named 'rihgt'" in cell.message.item()
    path.write_bytes(comment + b"$MeshFormat\n")
    cell = scenes(load(yaml.safe_dump(PLATE)), tmp_path / "results/broken")
    assert STATUS[int(cell.status)] == "failed" and cell.message.item().startswith("mesh: ")


def test_figures_of_two_loads_never_share_a_name(refusal):
    content = yaml.safe_load(COOK)
    one = content["shapes"]["cook"]
    content["shapes"] = {"a": one | {"loads": {"b_c": one["loads"]["shear"]}}}
    content["shapes"]["a_B"] = one | {"loads": {"c": one["loads"]["shear"]}}
    content["shape_grids"]["all"]["shape"] = ["a", "a_B"]
    message = refusal(yaml.safe_dump(content))
    assert "figures of shape 'a_B' under 'c' and of 'a' under 'b_c' would have one name" in message


def test_errors_of_rubber_are_against_its_law_at_finite_strain(load, tmp_path):
    """Each law has a reference; what has none of its own has no error there, and what fails says why."""
    config = yaml.safe_load(COOK)
    loads, grid = config["shapes"]["cook"]["loads"], config["shape_grids"]["all"]
    loads["shear"]["forces"] = {"right": [0, "0.5 N"]}
    loads["push"] = loads["shear"] | {"forces": {"right": ["-500 N", 0]}}
    grid |= {"definition": ["neo-hooke", "delingette", "lattice"], "kinematics": ["nonlinear", "linear"]}
    grid |= {"mesh_size": "8 mm", "finite_strain": True}
    study = load(yaml.safe_dump(config, sort_keys=False))
    laws = [law for *_, law in study.shapes.finite]
    assert laws == ["st-venant", "rubber"] * 2  # as definitions are ordered
    tree, _ = done(study, tmp_path / "results/study")
    finite, data = tree["shapes_finite_strain"].to_dataset(), tree["shapes"].to_dataset()
    references = finite.reference_value.sel(shape="cook", material="third", quantity="tip")
    cut = {"shape": "cook", "material": "third", "mesh_size": 8e-3, "mesh_type": "free", "quantity": "tip"}
    for name, law in (("neo-hooke", "rubber"), ("delingette", "st-venant")):
        cell = cut | {"load": "shear", "definition": name, "kinematics": "nonlinear"}
        value, error = float(data.value.sel(cell)), float(finite.error.sel(cell))
        reference = float(references.sel(load="shear", law=law))
        assert error == pytest.approx(value / reference - 1, rel=1e-9) and abs(error) < 0.1
    for without in ({"definition": "lattice"}, {"kinematics": "linear"}, {"load": "push"}):
        assert np.isnan(finite.error.sel(without)).all()
    assert np.isnan(references.sel(load="push")).all()
    why = str(finite.reference_message.sel(load="push", law="rubber").item())
    assert "shape 'cook', load 'push': no " in why and "% of the load" in why
