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


def test_a_plan_for_a_cluster_has_jobs_of_the_wanted_time(run):
    """A bundle of both meshes is what one machine does."""
    run.write("elsewhere.yaml", STUDY)
    code, output = run.snakemake("elsewhere.yaml", "-n", "--config", "job_minutes=1e-6")
    assert code == 0 and re.search(r"^solve +2$", output, re.MULTILINE), output
    assert not (run.folder / "results").exists()  # of a study that was never run a plan writes nothing


@pytest.mark.parametrize("minutes", ["-1", *(pytest.param(one, marks=pytest.mark.slow) for one in ("soon", "true"))])
def test_a_time_that_is_none_is_refused_by_its_name(run, minutes):
    run.write("elsewhere.yaml", STUDY)
    code, output = run.snakemake("elsewhere.yaml", "-n", "--config", f"job_minutes={minutes}")
    assert code == 1 and "Traceback" not in output
    assert re.search(f"job_minutes={minutes}: no number of minutes; the profile slurm has 5", output, re.IGNORECASE)


def test_what_the_dataset_is_not_to_tell_reaches_the_job_that_writes_it(run):
    run.write("elsewhere.yaml", STUDY)
    code, output = run.snakemake("elsewhere.yaml", "-n", "-p", "--config", "no_diff=true", "no_host=true")
    assert code == 0 and re.search(r"kinds\.collect .* git_diff host > ", output), output
    code, output = run.snakemake("elsewhere.yaml", "-n", "-p")
    assert code == 0 and re.search(r"kinds\.collect .* [0-9a-f]{24} +> ", output), output
    code, output = run.snakemake("elsewhere.yaml", "-n", "--config", "no_host=maybe")
    assert code == 1 and "--config no_host=maybe: neither true nor false; give one of them" in output, output
    code, output = run.springtune("elsewhere.yaml", "--no-host", "-n", "-p")
    assert code == 0 and re.search(r"kinds\.collect .* host > ", output), output


def test_rules_whose_jobs_go_elsewhere_have_a_benchmark(repository):
    """What is noted of a job names it, and a rule cannot be told to have none."""
    for path in sorted((repository / "workflow/rules").glob("*.smk")):
        text = path.read_text()
        rules = re.findall(r"^ *(?:rule \w+|rule|use rule \w+ as \w+ with):$", text, re.MULTILINE)
        assert len(rules) == text.split().count("benchmark:") + ("rule publish:" in text), path


def test_rules_quote_all_that_they_give_to_a_shell(repository):
    """All but the command of a job on another machine, which is quoted already."""
    for path in sorted((repository / "workflow/rules").glob("*.smk")):
        blocks = re.findall(r"shell:\n((?:\s+\".*\"\n)+)", path.read_text())
        assert len(blocks) == path.read_text().count("shell:"), path
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


def test_storage_without_a_place_is_asked_for(run):
    run.write("elsewhere.yaml", STUDY)
    code, output = run.snakemake("elsewhere.yaml", "--nolock", "publish")
    assert code == 1 and "where? give --config storage=s3://bucket/folder" in output, output


def test_a_job_on_a_node_reads_no_study_and_writes_its_own_files_alone(run, repository):
    """As the plugin calls it; that its study is none, and grew by a million scenes, is not seen."""
    run.write("unread.yaml", "no: study\n")
    folder = run.folder / "results/unread"
    told = {
        "rule": "solve",
        "wildcards": {"bundle": "3"},
        "output": ["results/unread/done/solve_{bundle}.json"],
        "log": ["results/unread/logs/solve_{bundle}.log"],
        "benchmark": "results/unread/benchmarks/solve_{bundle}.tsv",
        "threads": 1,
        "command": "echo '{braces}' $HDF5_USE_FILE_LOCKING > results/unread/done/solve_3.json",
    }
    workload.remember_commands(folder, [told | {"wildcards": {"bundle": "2"}, "command": "false"}, told])
    before = (folder / workload.COMMANDS_FILE).read_bytes()
    command = [sys.executable, "-m", "snakemake", "--snakefile", repository / "Snakefile", "--mode", "remote",
               "--target-jobs", "solve:bundle=3", "--allowed-rules", "solve", "--cores", "all", "--force", "--nolock",
               "--no-hooks", "--ignore-incomplete", "--configfiles", "unread.yaml",
               "--config", "job_minutes=5"]  # fmt: skip
    done = subprocess.run(list(map(str, command)), cwd=run.folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (folder / "done/solve_3.json").read_text() == "{braces} FALSE\n"
    made = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert made - {"logs/solve_3.log"} == {workload.COMMANDS_FILE, "done/solve_3.json", "benchmarks/solve_3.tsv"}
    assert (folder / workload.COMMANDS_FILE).read_bytes() == before
