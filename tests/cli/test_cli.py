"""The command line, the schema of studies and their manual."""

import io
import json
import re
import runpy
import shlex
import sys
from contextlib import nullcontext
from pathlib import Path

import jsonschema
import pytest
import yaml
from click.testing import CliRunner

import springtune
from counting import counted
from springtune.cli import COMMANDS, EscapedStream, main
from springtune.handover.formats import NET_FORMATS
from springtune.mesh import MESH_TYPES, write_mesh
from springtune.mesh.types import MeshType
from springtune.prediction import choices as of_one_mesh
from springtune.prediction.search import find_mesh
from springtune.problem.geometry import AssumptionWarning, Beam
from springtune.problem.materials import Material
from springtune.scene.boundary_problem import unit_reference
from springtune.scene.mesh_cache import MeshCache
from springtune.springs import DEFINITIONS
from springtune.studies.config.sections import schema_text
from springtune.studies.kinds import load_study

from tables import STUDIES, refused_calls, refused_numbers, run

CONFIG = Path(__file__).parents[2] / "config"
RENEW = "run `make docs`"
TOOL = runpy.run_path(str(Path(__file__).parents[2] / "tools/manual.py"))
BEGIN, END, MANUAL, SCHEMA = (TOOL[name] for name in ("BEGIN", "END", "MANUAL", "SCHEMA"))
manual_text, sections = TOOL["manual_text"], TOOL["sections"]


def words(text):
    """Lines of a text with their runs of blanks made one."""
    return [" ".join(line.split()) for line in text.splitlines()]


def completed(words, number):
    """What bash is offered for the last of the words."""
    environment = {"COMP_WORDS": words, "COMP_CWORD": str(number), "_SPRINGTUNE_COMPLETE": "bash_complete"}
    result = CliRunner().invoke(main, env=environment, prog_name="springtune")
    return result.output.splitlines()


@pytest.mark.filterwarnings("default::springtune.problem.geometry.AssumptionWarning")
class TestAssumptions:
    """A beam 1 km thick and one of 200 m were taken without a word."""

    STUDY = STUDIES["cli_thickbodies"]

    def test_a_study_says_each(self, tmp_path):
        path = tmp_path / "thick.yaml"
        path.write_text(self.STUDY)
        told = [line for line in run("scenes", path).stderr.splitlines() if line.startswith("warning: ")]
        begins = [line.removeprefix("warning: ").partition(" exceeds ")[0] for line in told]
        thick = {"beam 'block'": "1e+06", "beam 'sheet'": "15", "samples": "13", "shape 'plate'": "20"}
        assert sorted(begins) == [f"{name}, thickness: {size} mm" for name, size in thick.items()]
        assert all("its smaller side, 12 mm" in line and "give a smaller thickness" in line for line in told)
        path.write_text(self.STUDY.replace("60 mm", "600 m"))
        told = run("scenes", path).stderr
        assert told.count("warning: beam 'sheet': its longer side is 600 m, more than 100 m; check the unit") == 1

    @pytest.mark.parametrize(
        ("asked", "said"),
        [
            (
                "--beam 60x12 --thickness '1 km' --size '6 mm'",
                "'60x12', thickness: 1e+06 mm exceeds its smaller side, 12 mm",
            ),
            ("--beam 200000x40000 --size '9000 mm'", "'200000x40000': its longer side is 200 m, more than 100 m"),
        ],
    )
    def test_a_command_says_it_beside_its_answer(self, asked, said):
        found = run("predict", "--material", "steel", *shlex.split(asked))
        assert found.stderr.count(f"warning: beam {said}") == 1 and "recommended: " in found.stdout

    @pytest.mark.parametrize(
        ("sides", "said"),
        [
            (("60 mm", "12 mm", "13 mm"), "'60x12', thickness: 13 mm exceeds its smaller side, 12 mm"),
            ((200, 40, 1e-3), "its longer side is 200 m, more than 100 m.* a text such as '200 mm' has its own"),
            (("8 um", "8 um", "1 um"), "its longer side is 8e-06 m, less than 10"),
            (("60 mm", "12 mm", "12 mm"), None),
            ((100, 40, 1e-3), None),
            (("10 um", "10 um", "1 um"), None),
        ],
    )
    def test_the_library_warns(self, sides, said):
        for body in (springtune.Beam, springtune.Shape.rectangle):
            with pytest.warns(AssumptionWarning, match=said) if said else nullcontext():
                body(*sides[:2], thickness=sides[2])


def test_shells_complete_commands_and_options(monkeypatch):
    monkeypatch.chdir(CONFIG.parent)
    assert completed("springtune ", 1) == [f"plain,{name}" for name in COMMANDS]
    assert completed("springtune scenes config/p", 2) == ["file,config/p"]
    assert completed("springtune scenes elsewhere/", 2) == ["file,elsewhere/"]
    assert "plain,--beam" in completed("springtune predict --", 2)


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_has_examples_that_name_real_commands_and_options(command):
    lines = run(*filter(None, [command]), "--help").stdout.splitlines()
    examples = [line.split() for line in lines[lines.index("  Examples:") + 1 :]]
    assert examples
    for program, name, *arguments in examples:
        if program == "springtune":
            assert name in ([command] if command else COMMANDS)
            known = {option for one in main.get_command(None, name).params for option in one.opts}
            assert name == "run" or {word for word in arguments if word.startswith("--")} <= known


def test_wrong_calls_exit_with_2():
    assert run("no-such-command").exit_code == 2
    assert run("predict").exit_code == 2 and "Missing option '--beam'" in run("predict").stderr
    assert run("scenes", "--no-such-option").exit_code == 2


class TestScenes:
    def test_counts_of_the_papers_study(self):
        result = run("scenes", CONFIG / "paper.yaml")
        assert result.exit_code == 0
        lines = words(result.stdout)
        assert "scenes 360" in lines
        assert "meshes 18 each serves 25 scenes and curves on average" in lines
        assert "references 9 from 4 solutions: small strain scales with force, E t and size" in lines
        assert any(line.startswith("curves 90 61 stiffnesses each") for line in lines)
        assert "printed 45 cells to compare with" in lines
        assert [line for line in lines if line.startswith("table ")] == [f"table {n} 54 54 9 3 18" for n in range(1, 6)]

    def test_bad_study_is_one_message_and_exit_code_1(self, tmp_path):
        path = tmp_path / "bad.yaml"
        path.write_text((CONFIG / "quick.yaml").read_text().replace("length:", "lenght:", 1))
        result = run("scenes", path)
        assert result.exit_code == 1
        assert result.stdout == ""
        assert result.stderr == (
            f"{path}:8: beams.100x20.lenght: unknown key 'lenght'; "
            "did you mean 'length'? known: length, height, thickness\n"
        )
        assert [file.name for file in tmp_path.iterdir()] == ["bad.yaml"]


def test_definitions_lists_all_with_summaries():
    lines = words(run("definitions").stdout)
    assert lines == [" ".join(f"{name} {definition.summary}".split()) for name, definition in DEFINITIONS.items()]


@pytest.fixture(scope="module")
def validator():
    """What editors hold a study against."""
    schema = json.loads(schema_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


class TestSchema:
    def test_it_is_kept_in_step(self):
        assert (CONFIG / SCHEMA).read_text() == schema_text(), RENEW

    def test_manual_is_kept_in_step(self):
        text = (CONFIG / MANUAL).read_text()
        assert manual_text(text) == text, RENEW

    @pytest.mark.parametrize("study", sorted(CONFIG.glob("*.yaml")), ids=lambda path: path.stem)
    def test_studies_are_valid(self, study, validator):
        text = study.read_text()
        assert text.startswith(f"# yaml-language-server: $schema={SCHEMA}\n")
        validator.validate(yaml.safe_load(text))
        load_study(study)

    @pytest.mark.parametrize(
        ("old", "new"),
        [
            ("length:", "lenght:"),
            ("100 mm", "100"),
            ("poisson_ratio: 0.3", "poisson_ratio: 0.6"),
            ("mesh_type: [structured, free]", "mesh_type: [structured, structured]"),
            ("mesh_size: [2 mm, 5 mm]", "mesh_size: []"),
            ("sensitivity: false", "sensitivity: maybe"),
            ("  100x20: {", "  .x: {"),
        ],
    )
    def test_editors_see_mistakes(self, old, new, validator):
        text = (CONFIG / "quick.yaml").read_text()
        assert old in text
        with pytest.raises(jsonschema.ValidationError):
            validator.validate(yaml.safe_load(text.replace(old, new, 1)))


@pytest.fixture(scope="module")
def choices():
    """Beam, material, references and choices of the command without its text."""
    beam, material = Beam(0.1, 0.02), Material(210e9, 0.3, name="steel")
    known = of_one_mesh.references(beam, material)
    mesh = MESH_TYPES["structured"](beam.length, beam.height, 5e-3)
    return beam, material, known, of_one_mesh.predict(beam, mesh, material, known)


SAID = yaml.safe_load(Path(__file__).with_name("said.yaml").read_text())
ABSURD = {name: refused_numbers(f"predict, absurd {name}") for name in ("beams", "sizes", "errors")}
STEEL, RUBBER = ("--beam", "100x20", "--material", "steel"), ("--beam", "200x40", "--material", "rubber")


class TestPredict:
    def test_recommends_with_numbers(self):
        result = run("predict", *STEEL, "--size", "5 mm")
        assert result.exit_code == 0
        rows = {line.split()[0]: line for line in result.stdout.splitlines() if line.startswith("  ")}
        names = {"van-gelder-general", "element-fit", "patch-area", "patch", "energy-fit"}
        assert list(rows)[0] == "definition" and set(rows) == {"definition", *names}
        assert "+0.00 %" in rows["patch"]
        # Traction, bending and shear as in tests/prediction/test_choices.py, in order of the worst of them.
        assert rows["patch-area"].split("N/m")[2].split()[:6] == ["+0.45", "%", "-6.31", "%", "+1.60", "%"]
        worst = [max(abs(float(word)) for word in line.split(" %")[0:3] for word in word.split()[-1:]) for line in
                 list(rows.values())[1:]]  # fmt: skip
        assert worst == sorted(worst)

    @pytest.mark.parametrize(("call", "said"), [(call, said) for call, *said in SAID])
    def test_what_a_prediction_says(self, call, said, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        write_mesh("own.vtu", MESH_TYPES["braced"](0.1, 0.02, 5e-3))
        result = run("predict", *shlex.split(call))
        assert result.exit_code == 0 and not [part for part in said if part not in result.stdout], result.stdout


@pytest.mark.parametrize(
    ("table", "arguments", "messages"),
    [
        pytest.param(table, one.values[0], one.values[1:], id=one.id)
        for table in ("predict", "predict, a mesh", "predict, an engine")
        for one in refused_calls(table)
    ],
)
def test_refused_predictions_are_one_line(table, arguments, messages, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.msh").write_text("")
    body = {"predict": (), "predict, a mesh": STEEL, "predict, an engine": RUBBER}[table]
    result = run("predict", *body, *arguments)
    assert result.exit_code == 2 and len(result.stderr.splitlines()) == 1
    assert all(message in result.stderr for message in messages), result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["own.msh"]


class TestPredictAMesh:
    """`predict --error`, and what predictions are written as."""

    FIND = (*STEEL, "--error", "8 %", "--mesh", "right,braced")

    def test_an_error_is_answered_by_meshes(self):
        result = run("predict", *self.FIND, "--density", "7850 kg/m^3")
        assert result.exit_code == 0
        lines = result.stdout.splitlines()
        body = "100x20 mm; steel, E = 210 GPa, nu = 0.3, t = 1 mm"
        assert lines[0] == f"{body}; an error of at most 8 % under traction, bending and shear"
        search = find_mesh(Beam(0.1, 0.02), Material(210e9, 0.3), "8 %", mesh_types=["right", "braced"])
        best, plain = search.best, search.best_springs
        size = f"{best.mesh_type} {1e3 * best.size:g} mm with {best.choice.definition}, {best.particles} particles"
        assert f"recommended: {size}" in lines
        assert (
            f"with springs alone: {plain.mesh_type} {1e3 * plain.size:g} mm with {plain.choice.definition}" in lines[3]
        )
        assert "right, with springs alone: none up to " in result.stdout and "% off at worst" in result.stdout
        heads = next(line for line in lines if line.split()[:2] == ["mesh", "size"])
        assert heads.split()[-5:] == ["traction", "bending", "shear", "largest", "step"]
        assert f"Solved: {len(search.tried)} meshes of " in result.stdout
        assert "all finer meshes tried, up to twice as fine" in result.stdout and "linear kinematics" in result.stdout
        assert "A definition is dropped if its error, at the rate of the last doubling" in result.stdout

    def test_what_is_written_is_what_is_said(self, tmp_path):
        target = tmp_path / "net.json"
        said = run("predict", *self.FIND, "--write", target).stdout
        header = json.loads(target.read_text())["header"]
        best = next(line for line in said.splitlines() if line.startswith("recommended: "))
        assert header["definition"] in best and f"{header['mesh']['particles']:,} particles" in best
        assert "net.json: " in said

        target.unlink()
        said = run("predict", *STEEL, "--size", "5 mm", "--write", target, "--springs-alone")
        header = json.loads(target.read_text())["header"]
        assert f"recommended: {header['definition']}; with springs alone: {header['definition']}" in said.stdout

        run("predict", *STEEL, "--size", "5 mm", "--load", "pressure", "--write", target)
        header, mesh = json.loads(target.read_text())["header"], MESH_TYPES["structured"](0.1, 0.02, 5e-3)
        best = of_one_mesh.predict(Beam(0.1, 0.02), mesh, Material(210e9, 0.3), loads=["pressure"])[0]
        assert header["definition"] == best.definition
        assert header["expected_error"] == pytest.approx(best.errors, rel=1e-9)

    def test_an_engine_is_calibrated_to(self, tmp_path):
        """The text and the springs that are written say the same."""
        asked = [
            *("--engine", "xpbd", "--dt", "1/60", "--substeps", "20", "--beam", "200x40", "--size", "20 mm"),
            *("--material", "rubber", "--density", "1000 kg/m^3", "--load", "traction,shear", "--force", "0.2 N"),
            *("--definition", "patch"),
        ]
        target = tmp_path / "net.json"
        text = run("predict", *asked, "--write", target)
        assert text.exit_code == 0, text.output
        lines, written = words(text.stdout), json.loads(target.read_text())
        assert lines[1] == "engine xpbd, dt 1/60 s, 20 substeps, 10 iterations, float64"
        assert lines[2] == f"factor {written['header']['calibrated']['factor']:.5g}"
        compliance = re.fullmatch("type compliance ([^ ]+) to ([^ ]+) m/N: 1 / k of a spring", lines[3])
        least, most = map(float, compliance.groups())
        assert 1 / max(written["stiffness"]) == pytest.approx(least, rel=1e-4)
        assert 1 / min(written["stiffness"]) == pytest.approx(most, rel=1e-4)

    def test_a_setting_without_a_factor_writes_nothing(self, tmp_path):
        asked = [
            *("--engine", "xpbd", "--beam", "200x40", "--size", "20 mm", "--material", "rubber", "--force", "0.2 N"),
            *("--density", "1000 kg/m^3", "--load", "traction", "--definition", "lattice"),
        ]
        result = run("predict", *asked, "--write", tmp_path / "net.csv")
        assert "in 4 orders of the same particles" in result.stdout and "take more substeps" in result.stdout
        assert result.exit_code == 1 and not [*tmp_path.iterdir()]
        assert result.stderr.startswith("Error: --write: there is no factor, so nothing is written: the error at dt")

    @pytest.mark.parametrize("command", ["predict", "springs"])
    def test_help_has_the_ending_of_every_format(self, command):
        said = run(command, "--help").stdout
        for ending in (*NET_FORMATS, ".xml", ".mjcf", ".py", ".newton.py", ".xpbd.json"):
            assert re.search(rf"(?<!\w){re.escape(ending)}\b", said), ending

    @pytest.mark.filterwarnings("default::springtune.problem.geometry.AssumptionWarning")
    @pytest.mark.parametrize(
        ("beam", "asked", "value"),
        [
            *((beam, *one) for beam in ABSURD["beams"] for one in (("--size", "5 mm"), ("--error", "5 %"))),
            *(("100x20", "--size", size) for size in ABSURD["sizes"]),
            *(("100x20", "--error", error) for error in ABSURD["errors"]),
        ],
    )
    def test_absurd_numbers_are_refused_before_anything_is_made_or_solved(self, beam, asked, value):
        """By one line each: no mesh, no reference, no network."""
        with counted(MeshType.__call__, unit_reference, MeshCache.__init__) as calls:
            result = run("predict", "--beam", beam, asked, value, "--material", "steel")
        refusals = [line for line in result.stderr.splitlines() if not line.startswith("warning: ")]
        assert not calls and result.exit_code == 2 and result.stdout == "" and len(refusals) == 1
        assert "; give " in result.stderr or "? give " in result.stderr or "beam theory" in result.stderr


def test_no_way_of_writing_leaves_control_characters():
    stream = io.StringIO()
    EscapedStream(stream).writelines(["red \x1b[31m\n"])
    assert stream.getvalue() == "red \\x1b[31m\n"
    assert not hasattr(EscapedStream(sys.stdout), "buffer")
