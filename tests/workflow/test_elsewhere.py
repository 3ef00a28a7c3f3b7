"""Jobs that a cluster's nodes run: what they ask for, and what they read of a study."""

import os
import re
import subprocess
import sys

import pytest

from springtune.studies.runs import locks

from tables import STUDIES

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
