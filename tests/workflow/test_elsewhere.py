"""The workflow as others call it: by the catalog's ways, as a module, on nodes, and the paper's studies in one run."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from springtune.studies.runs import locks

from tables import STUDIES, cases

STUDY = STUDIES["elsewhere"]


def test_rules_have_a_benchmark_and_quote_all_that_they_give_to_a_shell(repository):
    """Those that take over another rule have its benchmark."""
    for path in sorted((repository / "workflow/rules").glob("*.smk")):
        text = path.read_text()
        rules = re.findall(r"^ *(?:rule \w+|rule):$", text, re.MULTILINE)
        assert len(rules) == text.split().count("benchmark:"), path
        blocks = re.findall(r"shell:\n((?:\s+\".*\"\n)+)", text)
        assert len(blocks) == text.count("shell:"), path
        fields = [field for block in blocks for field in re.findall(r"\{(.*?)\}", block)]
        assert all(field.endswith(":q") for field in fields), path


HOSTILE = "-a b'\"$(touch PWNED)`touch PWNED`;touch PWNED&{x}{}\n\tü*~#!%s<>|?[y]"
"""Name of a folder: what a shell, Snakemake or a terminal may take for something else."""


@pytest.mark.slow
def test_no_character_of_a_path_is_the_shells(repository, tmp_path):
    """Of a config, a checkout and a folder of results; by `springtune run`, from a folder outside."""
    config, checkout, results = (tmp_path / name / HOSTILE for name in ("config", "checkout", "results"))
    config.mkdir(parents=True)
    (config / "-mine.yaml").write_text(STUDY.replace("grids:", "outputs: [tables]\ngrids:"))
    checkout.parent.mkdir()
    checkout.symlink_to(repository)
    command = [sys.executable, "-m", "springtune", "run", "./-mine.yaml", "--results", results, "--cores", "2"]
    environment = os.environ | {"PYTHONPATH": str(checkout / "src")}
    done = subprocess.run(list(map(str, command)), cwd=config, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (results / "results/-mine/dataset.nc").is_file()
    assert locks.claimed_study(results / "results/-mine") == config / "-mine.yaml"
    assert not [*tmp_path.rglob("PWNED*")] and not (repository / "PWNED").exists()


def test_deployment_methods_change_nothing(run):
    """Jobs stay on the packages that keys of results have: no environment is made, and nothing runs again."""
    run.write("small.yaml", STUDIES["smallest"])
    mesh = "results/small/done/mesh_0.json"
    asked = ("--software-deployment-method", "conda", "--dry-run", mesh)
    code, told = run.snakemake("small.yaml", "--nocolor", mesh)
    assert code == 0
    code, told = run.snakemake("small.yaml", *asked)
    assert code == 0 and "Nothing to be done" in told and "will be created" not in told


def test_the_linter_misses_environments_alone(run, repository):
    """Jobs run on the packages that keys of results have."""
    _, told = run.snakemake(repository / "config/quick.yaml", "--lint", "text", "paper")
    assert set(re.findall(r"\* (.*)", told)) == {"Specify a conda environment or container for each rule.:"}, told


def test_the_small_study_of_the_catalog_runs_by_its_snakefile(repository, run_alone):
    """Called as there is, and as a module, as snakedeploy writes it."""
    shutil.copytree(repository / ".test", run_alone.folder, dirs_exist_ok=True)
    beside = run_alone.folder / "Snakefile"
    beside.write_text(f"""configfile: "config/config.yaml"
module springtune:
    snakefile: {str(repository / "workflow/Snakefile")!r}
    config: config
use rule * from springtune
""")
    for snakefile in (repository / "workflow/Snakefile", beside):
        code, told = run_alone.forked(["--snakefile", snakefile, "--dry-run"])
        assert code == 0 and "results/config is complete" in told, told
    assert (repository / ".test/config/config.yaml").samefile(repository / "config/quick.yaml")


NAMES = ("paper", "definitions", "block", "laying", "stability", "benchmark", "shapes")


def write(run):
    """The studies of the paper, each of one scene, of which each has another beam."""
    for height, name in enumerate(NAMES, 10):
        run.write(f"{name}.yaml", STUDIES["smallest"].replace("height: 10", f"height: {height}"))


def jobs(output):
    """Rules of the jobs of a dry run."""
    return set(re.findall(r"^(\w+) +\d+$", output, re.MULTILINE))


def test_the_paper_takes_all_its_studies_and_another_target_takes_one(run):
    write(run)
    code, output = run.snakemake("paper.yaml", "-n", "paper")
    assert code == 0, output
    assert {"paper", "collect", *(f"{name}_collect" for name in NAMES[1:])} <= jobs(output)
    code, output = run.snakemake("definitions.yaml", "-n")
    assert code == 0, output
    assert {"collect", "mesh", "solve"} <= jobs(output) and not {"paper", "block_collect"} & jobs(output)


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
    own = "onstart:\n    springtune.begin()\nonsuccess:\n    springtune.end('success_report')\n"
    code, told = others("results/mine/done/mesh_0.json", added=own)
    assert code == 0 and "There is no dataset yet." in told, told


@cases
def test_what_a_module_cannot_be_given_is_told(others, given, says):
    code, told = others("-n", **given)
    assert code == 1 and says in told and "Traceback" not in told, told
    assert not (others.folder / "results").exists()
