"""Studies: expansion, names, order, and what bad input gets (more cases are in refused_studies.yaml)."""

import csv
import itertools
import math
import shutil
from contextlib import nullcontext
from functools import partial
from pathlib import Path

import pytest
import yaml
from click.testing import CliRunner
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some

import springtune as st
from springtune.cli import main
from springtune.studies.config.model import CurveSpec, MeshSpec, Reference, SceneSpec, kinds, outputs

from tables import STUDIES, beside, refused_files, study_text

CONFIG = Path(__file__).parents[3] / "config"
LATTICE = math.sqrt(3) / 2
SMALL = STUDIES["small"]
changed = partial(study_text, "small")


def mesh_name(mesh):
    """Labels of a mesh in one word."""
    return f"{mesh.beam.name}_{mesh.mesh_type}_{1e3 * mesh.mesh_size:g}mm"


# -- what a study asks for ---------------------------------------------------------------------------------------------


class TestExpansion:
    def test_values_are_si(self, load):
        study = load(SMALL)
        long, short = st.Beam(0.2, 0.03, 0.001, "long"), st.Beam(0.1, 0.02, 0.002, "short")
        steel = st.Material(210e9, 0.3, name="steel")
        assert study.scenes[0] == SceneSpec(
            MeshSpec(long, "structured", 0.002), steel, "traction", 300e3, "paper", "nonlinear"
        )
        assert study.references == (
            Reference(long, steel, "traction", 300e3),
            Reference(short, steel, "traction", 20e3),
            Reference(short, steel, "compression", -20e3),
        )
        assert study.curves[-1] == CurveSpec(MeshSpec(short, "free", 0.005), steel, "traction", 20e3, "linear")
        assert study.stiffness_table == {("structured", "steel"): 170e6, ("free", "steel"): 185e6}
        assert study.calibration == ("long", "traction")
        assert study.printed == ()
        assert study.printed_path is None

    def test_stiffness_ratios(self, load):
        assert len(load(SMALL).stiffness_ratios) == 61
        ratios = load(changed(("grids:", "sensitivity: {from: 0.5, to: 1, points: 3}\ngrids:"))).stiffness_ratios
        assert ratios == pytest.approx([0.5 * LATTICE, 0.75 * LATTICE, LATTICE], rel=1e-9)
        assert all(type(ratio) is float for ratio in ratios)

    def test_a_scene_of_two_grids_is_one_scene(self, load):
        twice = SMALL + SMALL.partition("grids:\n")[2].replace("pull:", "pull2:").replace("push:", "push2:")
        once, again = load(SMALL), load(twice)
        for name in ("meshes", "scenes", "curves", "references", "axes"):
            assert getattr(once, name) == getattr(again, name)
        assert len(again.grids) == 4


class TestCalibrationCurves:
    def test_are_made_without_sensitivity(self, load):
        study = load(SMALL.replace("    kinematics: [nonlinear, linear]", "    sensitivity: false"))
        assert [mesh_name(curve.mesh) for curve in study.curves] == [
            "long_structured_2mm", "long_structured_5mm", "long_free_2mm", "long_free_5mm"
        ]  # fmt: skip
        assert not study.grids[0].curves

    def test_are_made_for_kinematics_of_other_grids(self, load):
        text = changed(("kinematics: [nonlinear, linear]", "kinematics: nonlinear"))
        text = text.replace("definition: lattice", "definition: calibrated\n    kinematics: linear")
        curves = [curve for curve in load(text).curves if curve.kinematics == "linear"]
        assert [mesh_name(curve.mesh) for curve in curves] == ["long_structured_2mm", "long_structured_5mm"]


AXES = beside(__file__)["AXES"]


@some.composite
def grids(draw):
    grid = {name: draw(some.lists(some.sampled_from(values), min_size=1, unique=True)) for name, values in AXES.items()}
    return grid | {"force": "1 N", "sensitivity": draw(some.booleans())}


def study_of(path, asked):
    config = yaml.safe_load(SMALL) | {"grids": {f"grid {number}": grid for number, grid in enumerate(asked)}}
    # Calibration needs curves on its own beam, whatever the others are.
    config["grids"]["calibration"] = {name: list(values) for name, values in AXES.items()} | {
        "beam": "long", "load": "traction", "definition": "lattice", "force": "1 N"
    }  # fmt: skip
    path.write_text(yaml.safe_dump(config, sort_keys=False))
    return st.load_study(path)


@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(some.lists(grids(), min_size=1, max_size=3), some.randoms(use_true_random=False))
def test_expansion_is_complete_without_duplicates_and_in_one_order(tmp_path, asked, random):
    study = study_of(tmp_path / "study.yaml", asked)
    expected = set()
    for grid in asked:
        sizes = [f"{size.split()[0]}mm" for size in grid["mesh_size"]]
        axes = [grid["beam"], grid["mesh_type"], sizes]
        axes += [grid[name] for name in ("material", "load", "definition", "kinematics")]
        expected |= {"_".join(labels) for labels in itertools.product(*axes)}

    def name(scene):
        return "_".join((study.labels(scene) | {"mesh_size": f"{1e3 * scene.mesh.mesh_size:g}mm"}).values())

    names = [name(scene) for scene in study.scenes]
    calibrating = {name(scene) for scene in study.grids[-1].scenes}
    assert set(names) == expected | calibrating
    for items in (study.meshes, study.scenes, study.curves, study.references):
        assert len(set(items)) == len(items)
    # Every calibrated scene has curves to calibrate it on.
    curves = {(c.mesh.beam.name, c.load, c.mesh.mesh_type, c.material, c.kinematics) for c in study.curves}
    for scene in study.scenes:
        if scene.definition == "calibrated":
            assert (*study.calibration, scene.mesh.mesh_type, scene.material, scene.kinematics) in curves

    for grid in asked:
        for values in grid.values():
            if isinstance(values, list):
                random.shuffle(values)
    random.shuffle(asked)
    shuffled = study_of(tmp_path / "study.yaml", asked)
    for name in ("meshes", "scenes", "curves", "references", "axes"):
        assert getattr(shuffled, name) == getattr(study, name)


# -- the studies of the repository -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def study():
    return st.load_study(CONFIG / "paper.yaml")


class TestPaper:
    def test_printed_cells_are_the_cells_of_the_grids(self, study):
        cells = {(s.mesh.beam.name, s.mesh.mesh_type, s.mesh.mesh_size, s.material.name, s.load) for s in study.scenes}
        printed = {(c.beam, c.mesh_type, c.mesh_size, c.material, c.load) for c in study.printed}
        assert len(study.printed) == len(printed) == 45
        assert printed == cells
        for cell in study.printed:
            table = next(grid for grid in study.grids if grid.name == f"table {cell.table}")
            assert cell.beam in {scene.mesh.beam.name for scene in table.scenes}
            assert study.stiffness_table[cell.mesh_type, cell.material] == cell.stiffness

    def test_forces_are_the_printed_ones_but_for_the_misprint(self, study):
        forces = {(r.beam.name, r.material.name, r.load): r.force for r in study.references}
        for cell in study.printed:
            used = forces[cell.beam, cell.material, cell.load]
            assert math.copysign(1, used) == (1 if cell.load == "traction" else -1)
            misprint = cell.table in (1, 2) and cell.beam == "100x20"
            assert abs(used) == (20e3 if misprint else cell.force)

    def test_a_remark_wherever_the_print_contradicts_itself(self, study):
        """A printed displacement may be rounded or truncated, so it stands for -1/2 to 1 unit of its last digit."""
        with open(study.printed_path) as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
        modulus = {"steel": 210e9, "rubber": 1e6}
        for row, cell in zip(rows, study.printed, strict=True):
            network, reference = (_printed_range(row[key]) for key in ("displacement_mm", "reference_displacement_mm"))
            errors = [n / r - 1 for n in network for r in reference]
            smallest = 0 if min(errors) < 0 < max(errors) else min(map(abs, errors))
            fits = smallest - 1e-4 <= cell.deformation_error <= max(map(abs, errors)) + 1e-4
            length, height = (1e-3 * float(side) for side in cell.beam.split("x"))
            by_hand = cell.force * length / (modulus[cell.material] * height * 1e-3)
            fits &= abs(by_hand / cell.reference_displacement - 1) < 0.02
            assert fits == (not cell.remark), row


def _printed_range(text):
    unit = 10.0 ** -len(text.partition(".")[2])
    return float(text) - 0.5 * unit, float(text) + unit


def test_quick_is_small_but_has_everything():
    study = st.load_study(CONFIG / "quick.yaml")
    assert len(study.scenes) <= 50
    assert min(mesh.mesh_size for mesh in study.meshes) >= 0.002
    assert {mesh.beam.name for mesh in study.meshes} == {"100x20"}
    whole = st.load_study(CONFIG / "paper.yaml").axes
    for dimension in ("mesh_type", "material", "load", "definition", "kinematics"):
        assert set(study.axes[dimension]) >= set(whole[dimension])
    assert study.axes["load"] == tuple(st.LOADS)
    # Which would give its dataset further dimensions, and further labels; engines have seconds of compiling.
    assert set(study.outputs) == set(outputs()) - {"sweep", "shapes", "engines"}


class TestDefinitions:
    def test_moduli_of_every_pair(self, load):
        study = load(study_text("small moduli"))
        box, cells = study.parts["moduli"]
        assert len(cells) == 2 * 2 * 2 * 2
        assert [*cells[0].values()] == ["area", "right", 0.002, 0.3]
        assert study.axes["poisson_ratio"] == (0.3, 0.5)
        assert (box.length, box.height) == (0.1, 0.02)
        assert study.outputs == ("definitions",)

    def test_stated_stiffness_has_no_moduli(self, load):
        study = load(changed(("    kinematics: [nonlinear, linear]\n", "    moduli: true\n")))
        assert {labels["definition"] for labels in study.parts["moduli"][1]} == {"lattice"}


# -- bad input ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("key", ["laying", "stability", "benchmark", "samples"])
def test_a_section_that_computes_needs_no_grid(load, refusal, key):
    quick = yaml.safe_load((CONFIG / "quick.yaml").read_text())
    content = {"title": "One section", "outputs": "tables", key: quick[key]}
    declared = {name: quick[name] for name in ("beams", "materials")}
    study = load(yaml.safe_dump(content | declared))
    (kind,) = (kind for kind in kinds() if study.parts[kind.name])
    assert not study.scenes and key in kind.study_fields and kind.summary(study.parts[kind.name])[0][1] > 0
    if key == "samples":
        assert load(yaml.safe_dump(content)).parts["samples"]
    else:
        assert "; or declare it under beams" in refusal(yaml.safe_dump(content))


def test_missing_file_and_folder(tmp_path):
    for path in (tmp_path / "no.yaml", tmp_path):
        with pytest.raises(st.StudyError, match="cannot be read: .*; give the path of a study"):
            st.load_study(path)


def test_name_of_the_file(refusal):
    assert "'my study' cannot name a study; rename the file" in refusal(SMALL, "my study.yaml")


def test_several_problems_are_one_message(refusal):
    lines = refusal(SMALL.replace(" mm", " mN")).splitlines()
    assert len(lines) == 6
    assert all(line.startswith("study.yaml:") for line in lines[:5])
    assert [int(line.split(":")[1]) for line in lines[:5]] == [3, 3, 4, 4, 4]
    assert lines[5] == "... and 3 more"


# -- printed values ----------------------------------------------------------------------------------------------------

HEADER = (
    "table,beam,mesh_type,mesh_size_mm,material,load,force_N,stiffness_N_per_m,"
    "reference_displacement_mm,displacement_mm,deformation_error_percent,remark"
)
CELL = "1,long,free,5,steel,traction,300000,185e6,9.5,8.13,14.41,"


class TestPrinted:
    @pytest.fixture
    def with_printed(self, tmp_path):
        def write(*lines):
            (tmp_path / "printed.csv").write_text("\n".join(lines) + "\n")
            return changed(("grids:", "printed: printed.csv\ngrids:"))

        return write

    def test_read(self, load, with_printed, tmp_path):
        study = load(with_printed("# a comment", "", HEADER, "# another", CELL + '"so, why"'))
        (cell,) = study.printed
        assert study.printed_path == tmp_path / "printed.csv"
        assert (cell.table, cell.mesh_size, cell.displacement, cell.remark) == (1, 0.005, 8.13e-3, "so, why")
        assert cell.deformation_error == 0.1441

    @pytest.mark.parametrize(("text", "says", "changes"), [(*row[:2], row[2:]) for row in refused_files("printed")])
    def test_refused(self, refusal, with_printed, text, says, changes):
        text = text.replace("HEAD", HEADER).replace("CELL", CELL)
        for old, new in zip(changes[::2], changes[1::2]):
            text = text.replace(old, new)
        assert says in refusal(with_printed(*text.splitlines()))

    def test_not_text(self, refusal, with_printed, tmp_path):
        text = with_printed()
        (tmp_path / "printed.csv").write_bytes(b"\xff\xfe")
        assert "printed: 'printed.csv' cannot be read: not UTF-8 text; give" in refusal(text)


class TestPressureAndLaying:
    def test_pressure_is_a_force_on_the_face(self, load):
        study = load(study_text("small pressed"))
        forces = {scene.load: scene.force for scene in study.scenes if "pressure" in scene.load}
        assert forces == pytest.approx({"pressure": -0.1e6 * 0.1 * 2e-3, "follower-pressure": -0.1e6 * 0.1 * 2e-3})
        # A force that follows is no F/k: it has no curve.
        assert [curve.load for curve in study.curves if "pressure" in curve.load] == ["pressure"]


# -- the benchmark -----------------------------------------------------------------------------------------------------


HERE = Path(__file__).parent
REFUSED = {
    f"{study}: {name}": (study, *case)
    for study, cases in yaml.load((HERE / "refused_studies.yaml").read_text(), yaml.CSafeLoader).items()
    for name, case in cases.items()
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_study_is_refused_with_line_key_and_remedy(refusal, tmp_path, case):
    study, old, new, *parts = REFUSED[case]
    for path in (CONFIG / "treloar").glob("*.csv"):
        shutil.copy(path, tmp_path)
    (tmp_path / "own.msh").write_text("any")
    changes = zip(old, new) if isinstance(old, list) else [(old, new)]
    message = refusal(new if old is None else study_text(study, *changes))
    assert all(line.isprintable() and line.startswith("study.yaml:") for line in message.splitlines())
    for part in parts:
        assert message.startswith(part) if part.startswith("study.yaml") else part in message


@pytest.mark.parametrize("ratio", ["-0.99", "-0.3", "-0.0", "0.5", "-1", "-1.2", "0.51", "nan"])
def test_one_range_of_poissons_ratio(refusal, tmp_path, ratio):
    """Above -1 and at most 0.5: for the library, `predict`, `springs`, and materials, grids, samples."""
    legal, value = -1 < float(ratio) <= 0.5, float(ratio)
    with nullcontext() if legal else pytest.raises(ValueError, match="Poisson's ratio of 'm' is .*: isotropic"):
        st.Material(1e9, value, name="m")
    sheet = ["--beam", "40x10", "--size", "5 mm", "--young", "1 GPa", "--poisson", ratio]
    out = ["--definition", "patch", "--out", str(tmp_path / "net.csv")]
    for call in (["predict", *sheet, "--load", "traction"], ["springs", *sheet, *out]):
        result = CliRunner().invoke(main, call)
        assert result.exit_code == (0 if legal else 2), result.output
        assert legal or f"--poisson of 'material' is {value}: isotropic materials have -1 < nu <= 0.5" in result.stderr
    for text in (
        STUDIES["small"].replace("poisson_ratio: 0.3", f"poisson_ratio: {ratio}"),
        STUDIES["small"].replace("load: traction\n", f"load: traction\n    poisson_ratio: [{ratio}]\n"),
        study_text("samples", ("poisson_ratio: {from: 0, to: 0.4}", f"poisson_ratio: {ratio}")),
    ):
        (tmp_path / "one.yaml").write_text(text)
        if legal:
            st.load_study(tmp_path / "one.yaml")
        else:
            assert "is out of range; give a number above -1 and at most 0.5" in refusal(text)
