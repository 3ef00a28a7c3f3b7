"""Another workflow that uses this one: ``module springtune``, of this machine and of a host."""

import re
import zipfile
from pathlib import Path

import pytest

from tables import STUDIES

OTHERS = Path(__file__).with_name("others.smk").read_text()

REPOSITORY = Path(__file__).parents[2]

HERE = repr(str(REPOSITORY / "Snakefile"))

MINE = '{"study": "config/mine.yaml"}'


@pytest.fixture
def others(run_alone):
    """Writes the workflow of others beside a study, and calls Snakemake on it, as they would."""
    (run_alone.folder / "config").mkdir()
    run_alone.write("config/mine.yaml", STUDIES["elsewhere"].replace("grids:", "outputs: [tables]\ngrids:"))

    def call(*arguments, snakefile=HERE, config=MINE, further="", added="", **environment):
        run_alone.write("Snakefile", OTHERS.format(snakefile=snakefile, config=config, further=further) + added)
        return run_alone.forked(["--cores", "2", "--scheduler", "greedy", *arguments], **environment)

    call.folder = run_alone.folder
    return call


def test_it_runs_and_reports_what_another_workflow_asks_for(others):
    code, told = others("-n")
    assert code == 0 and "springtune_present" not in told, told  # our `all` is not its target
    code, told = others("all", "springtune_all")
    assert code == 0 and "springtune_present_scenes" in told, told
    made = [others.folder / name for name in ("told.txt", "results/mine/index.html", "results/mine/summary.txt")]
    assert all(path.is_file() for path in made)
    code, told = others("springtune_all", "--report", "report.zip")
    assert code == 0, told
    with zipfile.ZipFile(others.folder / "report.zip") as file:
        page = file.read("report/report.html").decode()
    assert (REPOSITORY / "workflow/report/tables.rst").read_text().split("\n")[0] in page


def test_another_ones_file_of_configuration_may_be_the_study(others):
    code, told = others("-n", "--configfile", "config/mine.yaml", config="config")
    assert code == 0 and re.search(r"^springtune_solve +\d", told, re.MULTILINE), told


def test_hooks_of_another_workflow_may_call_ours(others):
    """For the lock and the summary."""
    own = "onstart:\n    springtune.begin()\nonsuccess:\n    springtune.end('ending')\n"
    code, told = others("results/mine/done/mesh_0.json", added=own)
    assert code == 0 and "There is no dataset yet." in told, told


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"further": "    prefix: 'there'\n"}, "module of springtune: results are in results/<study> and take no"),
        ({"config": "{'study': 3}"}, "study: 3 is no path; give that of a study's YAML file"),
        ({"config": "{'study': 'none.yaml'}"}, "none.yaml: cannot be read: No such file or directory"),
    ],
    ids=["prefix", "type", "missing"],
)
def test_what_a_module_cannot_be_given_is_told(others, given, says):
    code, told = others("-n", **given)
    assert code == 1 and says in told and "Traceback" not in told, told
    assert not (others.folder / "results").exists()
