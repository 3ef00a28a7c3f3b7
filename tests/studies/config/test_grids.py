"""Grids: ranges, rows of a file, and what is swept."""

import numpy as np
import pytest
import xarray as xr
import yaml
from hypothesis import given
from hypothesis import strategies as some

import springtune as st
from springtune.problem.quantities import MOST_SCENES_VARIABLE, SWEPT
from springtune.studies.config.fields import spaced
from springtune.studies.kinds.bodies.tables import tables as tables_of

from campaigns import Campaign
from tables import STUDIES, beside, refused_files

HEAD = STUDIES["grids_head"]
GRID = beside(__file__)["GRID"]


def grid_text(grid):
    """Lines of the grid in `HEAD`, without the keys that are None."""
    lines = yaml.safe_dump({key: value for key, value in grid.items() if value is not None}, sort_keys=False)
    return "".join(f"    {line}\n" for line in lines.splitlines())


@pytest.fixture
def load(tmp_path):
    """Load a study of one grid: `GRID` with some keys changed, None for those that are not there."""

    def load(head=HEAD, **keys):
        (tmp_path / "study.yaml").write_text(head + grid_text(GRID | keys))
        return st.load_study(tmp_path / "study.yaml")

    return load


@pytest.fixture
def refusal(load, tmp_path):
    """Message that a grid gets, without the folder."""

    def refusal(**keys):
        with pytest.raises(st.StudyError) as caught:
            load(**keys)
        return str(caught.value).replace(f"{tmp_path}/", "")

    return refusal


class TestRanges:
    @given(
        some.floats(1e-6, 1e6),
        some.floats(1.001, 1e6),
        some.integers(2, 40),
        some.sampled_from(["linear", "logarithmic"]),
    )
    def test_ends_are_exact_and_steps_even(self, first, factor, points, spacing):
        last = first * factor
        values = spaced(first, last, points, spacing)
        assert (values[0], values[-1], len(values)) == (first, last, points)
        scaled = np.array(values) if spacing == "linear" else np.log(values)
        # Values are rounded to twelve digits, and steps are differences of them, or of their logarithms.
        size = values[-1] if spacing == "linear" else 1.0
        assert np.diff(scaled) == pytest.approx((scaled[-1] - scaled[0]) / (points - 1), abs=1e-9 * size)


class TestCombinations:
    def test_forces_of_each_beam_go_with_it(self, load):
        forces = {"long": {"from": "1 N", "to": "3 N", "points": "3"}, "short": "10 N"}
        study = load(beam=["long", "short"], force=forces)
        assert {(one.mesh.beam.name, one.force) for one in study.scenes} == {
            ("long", 1.0), ("long", 2.0), ("long", 3.0), ("short", 10.0)
        }  # fmt: skip
        assert study.swept == ("force",)
        assert study.axes["force"] == (1.0, 2.0, 3.0, 10.0)

    def test_figures_have_a_style(self, load):
        style = load(HEAD.replace("grids:", "style: {width: 85 mm, font_size: 8}\ngrids:")).style
        assert style == {"width": pytest.approx(0.085), "font_size": 8}

    def test_forces_of_each_load_go_with_it(self, load):
        study = load(load=["traction", "bending"], force={"traction": ["1 N", "2 N"], "bending": "10 N"})
        assert {(one.load, one.force) for one in study.scenes} == {("traction", 1), ("traction", 2), ("bending", 10)}

    def test_too_many_are_refused_before_they_are_made(self, refusal, monkeypatch):
        many = {"mesh_size": {"from": "2 mm", "to": "5 mm", "points": "10000"}}
        monkeypatch.setenv(MOST_SCENES_VARIABLE, "9999")
        assert "10000 scenes (10000 mesh_size); a study has at most 9999" in refusal(**many)
        monkeypatch.setenv(MOST_SCENES_VARIABLE, "many")
        assert f"{MOST_SCENES_VARIABLE}: 'many' is not a number of scenes" in refusal()

    def test_what_no_dataset_holds_is_refused_before_it_is_made(self, refusal, monkeypatch):
        """Whatever number of scenes is allowed."""
        monkeypatch.setenv(MOST_SCENES_VARIABLE, "1e9")
        many = {"from": "2 mm", "to": "5 mm", "points": "2000"}
        message = refusal(mesh_size=many, thickness=many)
        assert "4000000 cells of all labels together (2000 mesh_size x 2000 thickness); a study has at most" in message
        monkeypatch.setenv(MOST_SCENES_VARIABLE, "")  # as if it were not there
        assert "4000000 scenes" in refusal(mesh_size=many, thickness=many)


class TestRows:
    ROWS = "# measured\nbeam, mesh_size [mm], force\nlong, 5, 1 kN\n\nlong, 10, 2 kN\nshort, 5, 2 kN\n"

    def test_a_row_is_a_combination(self, load, tmp_path):
        (tmp_path / "rows.csv").write_text(self.ROWS)
        study = load(beam=None, mesh_size=None, force=None, rows="rows.csv", definition=["lattice", "area"])
        found = {(one.mesh.beam.name, one.mesh.mesh_size, one.force, one.definition) for one in study.scenes}
        rows = [("long", 5e-3, 1e3), ("long", 10e-3, 2e3), ("short", 5e-3, 2e3)]
        assert found == {(*row, definition) for row in rows for definition in ("lattice", "area")}

    @pytest.mark.parametrize(("text", "said"), refused_files("rows"))
    def test_bad_files(self, refusal, tmp_path, text, said):
        (tmp_path / "rows.csv").write_text(text)
        assert said in refusal(beam=None, mesh_size=None, force=None, rows="rows.csv")


class TestSwept:
    def test_forces_of_two_grids_on_one_beam_in_one_load_are_a_sweep(self, load):
        head = HEAD + grid_text(GRID) + "  two:\n"
        assert load(head, force="2 kN").axes["force"] == (1e3, 2e3)
        assert load(head, force="2 kN", load="bending").swept == ()

    def test_moduli_are_those_of_the_swept_ratios(self, load):
        study = load(poisson_ratio=["0.1", "0.2"], moduli="true")
        assert [labels["poisson_ratio"] for labels in study.parts["moduli"][1]] == [0.1, 0.2]

    def test_printed_cells_are_not_swept(self, load, tmp_path):
        (tmp_path / "printed.csv").write_text("")
        with pytest.raises(st.StudyError, match="printed: printed cells know no force, which grids sweep"):
            load(HEAD.replace("grids:", "printed: printed.csv\ngrids:"), force=["1 N", "2 N"])

    def test_labels_and_names_tell_scenes_apart(self, load):
        values = ["1 N", "2 N"], ["1 mm", "3 mm"], ["1 MPa", "2 MPa"], ["0", "0.5"], ["0.9", "1.1"]
        study = load(beam=["long", "short"], **dict(zip(SWEPT, values)))
        assert study.swept == tuple(SWEPT)
        assert len({tuple(study.labels(scene).items()) for scene in study.scenes}) == len(study.scenes) == 64


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A study that sweeps everything, and the same cells one by one."""
    folder = tmp_path_factory.mktemp("swept")
    values = beside(__file__)["swept"]
    grid = GRID | {key: list(each) for key, each in values.items()}
    grid |= {"definition": ["lattice", "delingette"], "kinematics": "nonlinear", "sensitivity": "true"}
    text = HEAD.replace("grids:", "outputs: [size, sensitivity, deformed, sweep, tables]\ngrids:")
    (folder / "all.yaml").write_text(text + grid_text(grid))
    alone = {
        number: {key: each[place >> bit & 1] for bit, (key, each) in enumerate(values.items())}
        for number, place in enumerate((13, 22))  # each value of each parameter in one of them
    }
    for number, one in alone.items():
        body = {"length": "200 mm", "height": "30 mm", "thickness": one["thickness"]}
        law = {name: one[name] for name in ("young_modulus", "poisson_ratio")}
        single = {key: value for key, value in grid.items() if key not in values} | {"force": one["force"]}
        of_grids(folder, f"one{number}", [single], beams={"long": body}, materials={"steel": law})
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        trees = [Campaign(f"{name}.yaml").collected() for name in ("all", *(f"one{number}" for number in alone))]
    yield trees[0], dict(zip(alone, trees[1:])), alone
    for tree in trees:
        tree.close()


SI = {"N": 1.0, "mm": 1e-3, "GPa": 1e9, "": 1.0}


def number_of(text):
    value, _, unit = text.partition(" ")
    return float(value) * SI[unit]


def test_a_cell_of_a_sweep_is_that_of_a_study_of_its_own(swept):
    """Bit for bit: a linear factor would not be the same for nonlinear kinematics."""
    tree, singles, alone = swept
    root, curves = tree.to_dataset(), tree["sensitivity"].to_dataset()
    assert (root.status == 1).all()
    for number, one in alone.items():
        values = {key: number_of(text) for key, text in one.items()}
        cell, single = root.sel(values), singles[number].to_dataset()
        scale = values.pop("stiffness_scale")
        assert float(cell.beam_thickness.sel(beam="long")) == values["thickness"]
        assert float(cell.material_young_modulus.sel(material="steel")) == values["young_modulus"]
        for name in ("reference_displacement", "reference_error_estimate"):
            assert cell[name].values == pytest.approx(single[name].values, rel=1e-9)
        if scale == 1:
            assert cell.displacement.equals(single.displacement.reset_coords(drop=True).assign_coords(cell.coords))
        else:
            assert (cell.displacement < single.displacement.values).all()
        assert (curves.sel(values).best_stiffness.values == singles[number]["sensitivity"].best_stiffness.values).all()


def test_a_stiffer_network_gives_way_as_one_under_less_force(swept):
    """Stiffness enters as F/k alone: 1.25 times it under 125 N is as 100 N, but for the rounding of a quotient."""
    root = swept[0].to_dataset()
    stiff, soft = (root.displacement.sel(stiffness_scale=scale, force=100 * scale) for scale in (1.25, 1.0))
    assert (np.abs(stiff / soft - 1) < 1e-9).all()
    assert (root.stiffness.sel(definition="lattice").isnull()).all()


def test_figures_show_the_last_values_and_say_which(swept):
    tree, _, _ = swept
    assert st.plot_sensitivity(tree)
    title = st.plot_size(tree)[0].get_title(loc="left").replace("\n", " ").replace("\u00a0", " ")
    assert title == "long (200 x 30 mm), 125 N, thickness 3 mm, E = 2 GPa, nu = 0.5"
    (panel,) = st.plot_sweep(tree, parameter="force")
    lines = {line.get_label(): line for line in panel.lines if line.get_label() in ("lattice", "delingette")}
    assert [*lines["lattice"].get_xdata()] == [100.0, 125.0]
    last = {"thickness": 3e-3, "young_modulus": 2e9, "poisson_ratio": 0.5, "stiffness_scale": 1.0}
    wanted = tree.deformation_error.sel(definition="lattice").sel(last)
    assert lines["lattice"].get_ydata() == pytest.approx(100 * wanted.values.ravel())
    doubted = tree.to_dataset().assign(reference_message=("force", ["it turns", "it turns more"]))
    doubted["reference_applies"] = 0 * doubted.reference_applies
    notes = [f"r long, nonlinear, force [N] {said}" for said in ("100: it turns", "125: it turns more")]
    assert tables_of(xr.DataTree(doubted))[0]["remarks"] == notes
    (panel,) = st.plot_sweep(doubted, parameter="force")
    assert any("hollow: beyond small strain" in text.get_text().replace("\n", " ") for text in panel.texts)
    with pytest.raises(ValueError, match="parameter: 'height' is not swept; the study sweeps force, thickness"):
        st.plot_sweep(tree, parameter="height")


def of_grids(folder, name, grids, **keys):
    """Path of a study of one beam, 60x20, of these grids on structured meshes, linear, without curves."""
    told = beside(__file__)["of grids"]
    content = told["study"] | {"title": name, "grids": {str(n): told["grid"] | grid for n, grid in enumerate(grids)}}
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(content | keys, sort_keys=False))
    return path


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder of its own as the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_beam_that_calibrates_has_its_thickness_from_its_own_curves(here):
    """Another grid sweeps the thickness of this beam under another load; a sheet twice as thick is as far off."""
    calibrating = {"load": "bending", "force": "100 N", "definition": "calibrated"}
    other = {"load": "traction", "force": "1 kN", "thickness": ["0.5 mm", "2 mm"]}
    other["definition"] = ["lattice", "calibrated"]
    on = {"calibrated": {"beam": "60x20", "load": "bending"}}
    path = of_grids(here, "thick", [calibrating, other], definitions=on)
    with Campaign(path).collected() as tree:
        root = tree.to_dataset().sel(definition="calibrated").squeeze(drop=True)
        bending = root.sel(load="bending", thickness=1e-3)
        traction = root.sel(load="traction", thickness=[0.5e-3, 2e-3])
        assert abs(float(bending.deformation_error)) < 1e-9  # which is what it is calibrated for
        assert traction.stiffness.values == pytest.approx(float(bending.stiffness) * np.array([0.5, 2.0]), rel=1e-9)
        assert traction.deformation_error.values == pytest.approx([float(traction.deformation_error[0])] * 2, rel=1e-9)


def test_forces_of_equal_products_are_one_label(here):
    grid = {"load": "pressure", "pressure": ["2 MPa", "3 MPa"], "thickness": ["1 mm", "1.5 mm"]}
    study = st.load_study(of_grids(here, "press", [grid], beams={"60x20": {"length": "70 mm", "height": "20 mm"}}))
    assert study.axes["force"] == (140.0, 210.0, 315.0)


def test_fields_of_a_sweep_say_of_which_values_they_are(here):
    grid = {"load": ["traction", "bending"], "force": ["1 kN", "2 kN"], "thickness": ["1 mm", "2 mm"]}
    grid |= {"mesh_size": "10 mm"}
    coarse = grid | {"load": "traction", "mesh_size": "20 mm", "force": "1 kN"}
    Campaign(of_grids(here, "said", [grid, coarse], outputs=["deformed", "paraview"])).finish()
    with st.open("results/said") as tree:
        fields = tree["fields"].to_dataset()[["shown_force", "shown_thickness"]].squeeze(drop=True)
        # Each load has its coarsest mesh, and the last values there.
        assert fields.shown_force.sel(load=["traction", "bending"]).values.tolist() == [1e3, 2e3]
        assert fields.shown_thickness.values.tolist() == [2e-3, 2e-3]
        place = {"beam": "60x20", "mesh_type": "structured", "load": "bending", "mesh_size": 10e-3}
        network = st.field(tree, **place, force=2e3, thickness=2e-3).squeeze()
        assert (float(network.force), float(network.thickness)) == (2e3, 2e-3)
        beam, steel = st.Beam("60 mm", "20 mm", "2 mm"), st.Material("210 GPa", 0.3)
        mesh = st.make_mesh(beam, "structured", "10 mm")
        result = st.Scene(beam, mesh, steel, "bending", "2 kN", definition="lattice", kinematics="linear").solve()
        small = 1e-9 * np.abs(result.displacements).max()
        assert np.allclose(network.displacement_y.values, result.displacements[:, 1], rtol=1e-9, atol=small)
        assert np.allclose(network.spring_force.values, result.spring_forces, rtol=1e-5, atol=1e-3)
        with pytest.raises(ValueError, match=r"fields are not kept of force 1000.0; they are of 2000.0"):
            st.field(tree, **place, force=1e3)
        (panel,) = st.plot_deformed(tree, load="bending", kinematics="linear")
        assert "2\u00a0kN, thickness 2\u00a0mm, mesh 10 mm" in panel.get_title(loc="left").replace("\n", " ")
        assert not [text for text in panel.texts if "no network" in text.get_text()]
        assert len([*(here / "results/said/paraview").glob("*.vtu")]) == 2
