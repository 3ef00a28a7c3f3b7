"""The command line, the schema of studies and their manual."""

import json
import re
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from shutil import copy

import jsonschema
import pytest
import yaml
from click.testing import CliRunner

import springtune as st
from springtune.cli import COMMANDS, main
from springtune.handover.formats import NET_FORMATS
from springtune.prediction import choices as of_one_mesh
from springtune.problem.shapes import AssumptionWarning

from tables import STUDIES, cases, run

CONFIG = Path(__file__).parents[2] / "config"
RENEW = "run `make docs`"
SCHEMA, MANUAL = "study.schema.json", "README.md"


def words(text):
    """Lines of a text with their runs of blanks made one."""
    return [" ".join(line.split()) for line in text.splitlines()]


def completed(words, number):
    """What bash is offered for the last of the words."""
    environment = {"COMP_WORDS": words, "COMP_CWORD": str(number), "_SPRINGTUNE_COMPLETE": "bash_complete"}
    result = CliRunner().invoke(main, env=environment, prog_name="springtune")
    return result.output.splitlines()


@pytest.mark.filterwarnings("default::springtune.problem.shapes.AssumptionWarning")
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

    @cases
    def test_the_library_warns(self, sides, said):
        for body in (st.Beam, st.Shape.rectangle):
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


def test_definitions_lists_all_with_summaries():
    lines = words(run("definitions").stdout)
    assert lines == [" ".join(f"{name} {definition.summary}".split()) for name, definition in st.DEFINITIONS.items()]


@pytest.fixture(scope="module")
def validator():
    """What editors hold a study against."""
    schema = json.loads((CONFIG / SCHEMA).read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


class TestSchema:
    def test_schema_and_manual_are_kept_in_step(self, tmp_path):
        copy(CONFIG / MANUAL, tmp_path)
        subprocess.run([sys.executable, CONFIG.parent / "tools/manual.py", tmp_path], check=True)
        for name in (SCHEMA, MANUAL):
            assert (tmp_path / name).read_text() == (CONFIG / name).read_text(), RENEW

    @pytest.mark.parametrize("study", sorted(CONFIG.glob("*.yaml")), ids=lambda path: path.stem)
    def test_studies_are_valid(self, study, validator):
        text = study.read_text()
        assert text.startswith(f"# yaml-language-server: $schema={SCHEMA}\n")
        validator.validate(yaml.safe_load(text))
        st.load_study(study)

    @cases
    def test_editors_see_mistakes(self, old, new, validator):
        text = (CONFIG / "quick.yaml").read_text()
        assert old in text
        with pytest.raises(jsonschema.ValidationError):
            validator.validate(yaml.safe_load(text.replace(old, new, 1)))


STEEL, RUBBER = ("--beam", "100x20", "--material", "steel"), ("--beam", "200x40", "--material", "rubber")


class TestPredict:
    def test_recommends_with_numbers(self, monkeypatch):
        monkeypatch.setattr("springtune.cli.predict.PROGRESS_SECONDS", -1)
        result = run("predict", *STEEL, "--size", "5 mm")
        assert result.exit_code == 0 and "solving patch-area: 129 particles ...\n" in result.stderr
        rows = {line.split()[0]: line for line in result.stdout.splitlines() if line.startswith("  ")}
        names = {"van-gelder-general", "element-fit", "patch-area", "patch", "energy-fit"}
        assert list(rows)[0] == "definition" and set(rows) == {"definition", *names}
        assert "+0.00 %" in rows["patch"]
        # Traction, bending and shear as in tests/prediction/test_choices.py, in order of the worst of them.
        assert rows["patch-area"].split("N/m")[2].split()[:6] == ["+0.45", "%", "-6.31", "%", "+1.60", "%"]
        worst = [max(abs(float(word)) for word in line.split(" %")[0:3] for word in word.split()[-1:]) for line in
                 list(rows.values())[1:]]  # fmt: skip
        assert worst == sorted(worst)


class TestPredictAMesh:
    """`predict --error`, and what predictions are written as."""

    FIND = (*STEEL, "--error", "8 %", "--mesh", "right,braced")

    def test_an_error_is_answered_by_meshes(self):
        result = run("predict", *self.FIND, "--density", "7850 kg/m^3")
        assert result.exit_code == 0
        lines = result.stdout.splitlines()
        body = "100x20 mm; steel, E = 210 GPa, nu = 0.3, t = 1 mm"
        assert lines[0] == f"{body}; an error of at most 8 % under traction, bending and shear"
        search = st.find_mesh(st.Beam(0.1, 0.02), st.Material(210e9, 0.3), "8 %", mesh_types=["right", "braced"])
        best, plain = search.best, search.best_springs
        size = f"{best.mesh_type} {1e3 * best.size:g} mm with {best.choice.definition}, {best.particles} particles"
        assert f"recommended: {size}" in lines
        alone = f"with springs alone: {plain.mesh_type} {1e3 * plain.size:g} mm with {plain.choice.definition}"
        assert alone in lines[3]
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
        header, mesh = json.loads(target.read_text())["header"], st.MESH_TYPES["structured"](0.1, 0.02, 5e-3)
        best = of_one_mesh.predict(st.Beam(0.1, 0.02), mesh, st.Material(210e9, 0.3), loads=["pressure"])[0]
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
        place = "type compliance inside ([^ ]+), on the outline ([^ ]+) m/N: 1 / k of a spring"
        compliance = re.fullmatch(place, lines[3])
        least, most = map(float, compliance.groups())
        assert 1 / max(written["stiffness"]) == pytest.approx(least, rel=1e-4)
        assert 1 / min(written["stiffness"]) == pytest.approx(most, rel=1e-4)

    @pytest.mark.parametrize("command", ["predict", "springs"])
    def test_help_has_the_ending_of_every_format(self, command):
        said = run(command, "--help").stdout
        for ending in (*NET_FORMATS, ".xml", ".mjcf", ".py", ".newton.py", ".xpbd.json"):
            assert re.search(rf"(?<!\w){re.escape(ending)}\b", said), ending
