"""Jobs that a cluster's nodes run: what they ask for, and what they read of a study."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from springtune.studies.runs import locks, workload

from tables import STUDIES

STUDY = STUDIES["elsewhere"]


def test_rules_have_a_benchmark_and_quote_all_that_they_give_to_a_shell(repository):
    """What is noted of a job names it; the command of a job on another machine is quoted already."""
    for path in sorted((repository / "workflow/rules").glob("*.smk")):
        text = path.read_text()
        rules = re.findall(r"^ *(?:rule \w+|rule|use rule \w+ as \w+ with):$", text, re.MULTILINE)
        assert len(rules) == text.split().count("benchmark:"), path
        blocks = re.findall(r"shell:\n((?:\s+\".*\"\n)+)", text)
        assert len(blocks) == text.count("shell:"), path
        fields = [field for block in blocks for field in re.findall(r"\{(.*?)\}", block)]
        assert all(field.endswith(":q") for field in fields) or fields == ["params.command"], path


HOSTILE = "-a b'\"$(touch PWNED)`touch PWNED`;touch PWNED&{x}{}\n\tü*~#!%s<>|?[y]"
"""Name of a folder: what a shell, Snakemake or a terminal may take for something else."""


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
    assert locks.claimed(results / "results/-mine") == config / "-mine.yaml"
    assert not [*tmp_path.rglob("PWNED*")] and not (repository / "PWNED").exists()


def test_no_path_ends_the_script_of_a_report():
    """Snakemake writes paths of parameters into it as they are."""
    one = Path("here/a<")
    for path in (one / "script>b<script>alert(1)<" / "script>mine.yaml", Path("<!--<script>/mine.yaml")):
        assert "use no <" in workload.refusal(path, Path("/home"), Path("/home"), Path("/bin/python"), on_cluster=False)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("a\\b", r"/a\\\\b': the netCDF library reads \\ in a path as /; run in a folder without \\ in its name"),
        ("\udcfc", r"/\\udcfc': not UTF-8, as texts of results are; rename the file or folder"),
    ],
    ids=["backslash", "not UTF-8"],
)
def test_a_folder_that_results_cannot_be_in_is_refused(run, name, says):
    folder = run.folder / name
    folder.mkdir()
    run.write("elsewhere.yaml", STUDY)
    code, output = run.snakemake("elsewhere.yaml", "--directory", folder)
    assert code == 1 and re.search(says, output) and "Traceback" not in output, output
    assert not (folder / "results").exists()


def test_a_folder_of_another_study_is_refused(run):
    """Before anything is computed."""
    run.write("elsewhere.yaml", STUDY)
    (run.folder / "w").mkdir()
    run.write("w/elsewhere.yaml", STUDY.replace("20 kN", "30 kN"))
    locks.claim(run.folder / "results/elsewhere", run.folder / "w/elsewhere.yaml")
    before = run.times("results/**/*")
    code, output = run.snakemake("elsewhere.yaml")
    assert code == 1 and "holds the results of w/elsewhere.yaml, another study of the same name; rename" in output
    assert "Traceback" not in output and run.times("results/**/*") == before
    (run.folder / "w/elsewhere.yaml").unlink()
    code, output = run.snakemake("elsewhere.yaml", "-n")
    assert code == 0, output


@pytest.mark.parametrize("what", ["config", "folder", "checkout", "python"])
@pytest.mark.parametrize("name", ["a b", "$(x)", "`x`", "it's", 'a"b', "a;b", "a&b", "{x}", "a\nb", "%j", "a\\b"])
def test_slurm_gets_no_path_that_its_plugin_would_have_to_quote(what, name):
    """It puts paths into double quotes for a shell; nothing is submitted then."""
    paths = dict.fromkeys(("config", "folder", "checkout", "python"), Path("/home/müller/x+y/a.b,c=d@e:f"))
    assert workload.refusal(**paths | {"python": Path("/usr/bin/python3")}, on_cluster=True) == ""
    told = workload.refusal(**paths | {"python": Path("/usr/bin/python3"), what: Path("/home", name)}, on_cluster=True)
    assert told == (
        f"{f'/home/{name}'!r}: the plugin for Slurm passes paths to a shell without quotes; use letters, digits and "
        "@ + = : , . / _ - in names of files and folders"
    )
