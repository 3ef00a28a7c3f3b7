"""A study to begin with, and what is said of studies that cannot be run."""

import re
import shutil
from importlib.util import find_spec
from pathlib import Path

import pytest

import springtune as st
from springtune.cli.study import SLURM

from campaigns import Campaign
from tables import run

REPOSITORY = Path(__file__).parents[2]


def refused(result, code, *said):
    assert result.exit_code == code, result.output
    assert len([line for line in result.stderr.splitlines() if line.startswith(("Error", "config", "study"))]) == 1
    for one in said:
        assert one in result.stderr


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder as a checkout's."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config").mkdir()
    for name in ("Snakefile", "workflow"):
        (tmp_path / name).symlink_to(REPOSITORY / name)
    shutil.copy(REPOSITORY / "config/study.schema.json", tmp_path / "config")
    return tmp_path


def ran(config, group="/"):
    """Run all jobs of a study, look for what they make, and return its scenes, which are solved."""
    campaign = Campaign(config)
    campaign.write()
    for name in campaign.jobs:
        campaign.do(name)
    for product in ("figures", "tables/index.html", "index.html"):
        assert (campaign.folder / product).exists()
    with st.open(campaign.folder) as tree:
        scenes = tree[group].to_dataset(inherit=False).squeeze(drop=True).load()
    assert (scenes.status == st.Status.SOLVED).all()
    return scenes


class TestNew:
    def test_it_is_written_beside_the_others_and_says_what_is_next(self, checkout):
        result = run("new", "my-study")
        assert result.exit_code == 0
        assert result.stdout.splitlines() == [
            "config/my-study.yaml: 2 scenes; change it as you like, and run it:",
            "  springtune run config/my-study.yaml",
        ]
        study = st.load_study("config/my-study.yaml")
        assert len(study.scenes) == 2 and study.title == "My study"
        assert {scene.definition for scene in study.scenes} == {"lattice", "patch"}

    def test_it_is_short_and_what_its_comments_name_exists(self, checkout):
        run("new", "my-study")
        lines = Path("config/my-study.yaml").read_text().splitlines()
        assert len([line for line in lines if not line.startswith("#")]) <= 15 and max(map(len, lines)) <= 120
        (types,) = (line.partition("# or ")[2].split(", ") for line in lines if "mesh_type:" in line)
        assert {"free", "right"} <= set(types) <= set(st.MESH_TYPES)
        (loads,) = (line.partition("# or ")[2].split(", ") for line in lines if "load:" in line)
        assert len(loads) > 1 and set(loads) <= set(st.LOADS)
        for load in loads:  # each may be put in the place of the one that is there
            text = "\n".join(lines).replace("load: traction", f"load: {load}")
            Path("config/other.yaml").write_text(text)
            assert len(st.load_study("config/other.yaml").scenes) == 2
        assert (Path("config") / re.search(r"\$schema=(\S+)", lines[0])[1]).is_file()

    @pytest.mark.slow
    def test_a_study_of_a_shape_is_explained_and_runs_as_it_is(self, checkout):
        result = run("new", "my-plate", "--shape")
        assert result.stdout.startswith("config/my-plate.yaml: 4 scenes; change it as you like")
        text = Path("config/my-plate.yaml").read_text()
        assert max(map(len, text.splitlines())) <= 120
        study = st.load_study("config/my-plate.yaml")
        assert len(study.shapes.scenes) == 4 and study.title == "My plate"
        # What the comments offer may be put in.
        Path("config/pressed.yaml").write_text(text.replace("# pressures:", "pressures:"))
        assert st.load_study("config/pressed.yaml").shape("plate").loads["pull"].pressures[0].pressure == 1e6
        Path("config/rollers.yaml").write_text(text.replace("left: fixed", "left: {x: 0 mm}, top: {y: 0}"))
        assert st.load_study("config/rollers.yaml").shape("plate").loads["pull"].supports[0].y is None
        scenes = ran("config/my-plate.yaml", "shapes")
        assert float(abs(scenes.error.sel(quantity="stretch")).max()) < 0.1

    def test_it_runs_as_it_is(self, checkout):
        run("new", "my-study")
        assert run("scenes", "config/my-study.yaml").stdout.endswith("nothing is stored in results/my-study\n")
        scenes = ran("config/my-study.yaml")
        said = run("scenes", "config/my-study.yaml").stdout.splitlines()[-1]
        assert said.startswith("stored in results/my-study: ") and said.endswith("solve 2 of 2; a run computes nothing")
        assert float(abs(scenes.deformation_error).max()) < 0.1

    def test_outside_of_a_checkout_it_is_written_here(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        assert run("new", "my-study").exit_code == 0
        assert len(st.load_study(tmp_path / "my-study.yaml").scenes) == 2
        schema = re.search(r"\$schema=(\S+)", (tmp_path / "my-study.yaml").read_text())[1]
        assert (tmp_path / schema).resolve() == REPOSITORY / "config/study.schema.json"

    @pytest.mark.parametrize("source", sorted(path.stem for path in (REPOSITORY / "config").glob("*.yaml")))
    def test_a_study_that_comes_along_is_copied_with_its_files(self, source, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        assert run("new", "mine", "--from", source).exit_code == 0
        copied, its_own = st.load_study("mine.yaml"), st.load_study(REPOSITORY / f"config/{source}.yaml")
        assert copied.scenes == its_own.scenes and len(copied.files) == len(its_own.files)
        first, text = Path("mine.yaml").read_text().split("\n", 1)
        assert (tmp_path / first.partition("=")[2]).resolve() == REPOSITORY / "config/study.schema.json"
        assert "README.md explains" not in text

    def test_files_of_a_copied_study_replace_no_others(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        Path("paper_tables.csv").write_text("mine")
        refused(run("new", "mine", "--from", "paper"), 1, "paper_tables.csv: is there already, and is not that of")
        assert not Path("mine.yaml").exists()

    def test_nothing_is_overwritten(self, checkout):
        run("new", "my-study")
        Path("config/my-study.yaml").write_text("mine")
        said = "config/my-study.yaml: is there already; give another name, or change that file"
        for given in ("my-study", "config/my-study.yaml"):
            refused(run("new", given), 1, said)
        assert Path("config/my-study.yaml").read_text() == "mine"
        Path("config/gone.yaml").symlink_to("nowhere")
        refused(run("new", "gone"), 1, "is there already")


class TestRun:
    """What `springtune run` says before Snakemake starts; bad content is tests/workflow/test_reruns.py's."""

    @pytest.fixture(autouse=True)
    def studies(self, checkout):
        run("new", "one")
        run("new", "two")
        (checkout / "config/folder.yaml").mkdir()

    @pytest.fixture
    def called(self, monkeypatch):
        """Folders and commands that Snakemake would be called by."""
        found = []

        monkeypatch.setattr("snakemake.cli.main", lambda arguments: found.append((Path.cwd(), arguments)))
        return found

    @pytest.mark.parametrize("folder", ["", "of mine"], ids=["here", "elsewhere"])
    def test_the_workflow_of_the_library_runs_it_here(self, checkout, monkeypatch, called, folder):
        """In the folder one stands in, though it holds no workflow; or in that of --results."""
        here = checkout / "empty"
        here.mkdir()
        monkeypatch.chdir(here)
        assert run("new", "mine").stdout.splitlines()[1] == "  springtune run mine.yaml"
        told = run("run", "mine.yaml", "--list-rules", *(["--results", folder] if folder else []))
        ((place, command),) = called
        study = here / "mine.yaml" if folder else "mine.yaml"
        assert place == here / folder
        assert command[-4:-1] == ["--snakefile", str(REPOSITORY / "Snakefile"), "--list-rules"]
        assert command[-1] == f"--configfile={study}"
        said = f"results go to {folder}/results/mine; paths below are as seen from {folder}\n"
        assert told.stderr == (said if folder else "")

    def test_without_a_study_it_is_the_papers_of_here_or_of_the_library(self, checkout, called):
        run("run", "--list-rules")
        shutil.copy("config/one.yaml", "config/paper.yaml")
        run("run", "--list-rules")
        studies = [command[-1].removeprefix("--configfile=") for _, command in called]
        assert studies == [str(REPOSITORY / "config/paper.yaml"), "config/paper.yaml"]
        assert "; `springtune new quick --from quick` writes it here" in run("run", "quick").stderr

    @pytest.mark.parametrize("named", [["--workflow-profile", "slurm"], ["--workflow-profile=workflow/profiles/slurm"]])
    @pytest.mark.skipif(bool(find_spec(SLURM)), reason="the plugin is installed")
    def test_slurm_without_its_plugin_says_what_to_install(self, named):
        result = run("run", "config/one.yaml", *named)
        assert result.exit_code == 2 and "which is not installed" in result.stderr
        assert "pip install '.[slurm]'" in result.stderr
