"""What the Snakemake workflow catalog asks of a workflow, and what its users try first."""

import re
import shutil
import subprocess
import sys

from tables import STUDIES


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


def test_the_small_study_of_the_catalog_runs_by_its_snakefile(repository, tmp_path):
    """Called as there is, and as a module, as snakedeploy writes it."""
    shutil.copytree(repository / ".test", tmp_path / "deployed")
    beside = tmp_path / "deployed/Snakefile"
    beside.write_text(f"""configfile: "config/config.yaml"
module springtune:
    snakefile: {str(repository / "workflow/Snakefile")!r}
    config: config
use rule * from springtune
""")
    for snakefile in (repository / "workflow/Snakefile", beside):
        command = [sys.executable, "-m", "snakemake", "--snakefile", snakefile, "--dry-run"]
        done = subprocess.run(command, cwd=tmp_path / "deployed", capture_output=True, text=True)
        assert done.returncode == 0 and "results/config is complete" in done.stdout, done.stderr
    assert (repository / ".test/config/config.yaml").samefile(repository / "config/quick.yaml")
