"""An archive of the quick study: valid to a validator that others wrote, and reproduced in a new environment.

Run by `make test-archive`, which installs: validators by requirements/validator.txt, and an archive's own packages.
"""

import json
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]

PROFILES = ("ro-crate-1.1", "workflow-ro-crate-1.0", "workflow-run-crate-0.5", "provenance-run-crate-0.5")
"""What an archive is to be valid as; the last includes Process Run Crate."""

UNMET = {
    "process-run-crate-0.5_3.2": "tools have no page of their own unless CITATION.cff has repository-code or url",
    "process-run-crate-0.5_5.1": "tools are files of the archive, and versions of packages have package URLs",
    "process-run-crate-0.5_8.6": "who ran the study is not known",
    "ro-crate-1.1_22.3": "who publishes it is not known before it is published",
    "ro-crate-1.1_31.2": "an author of CITATION.cff that is no person has no page",
}
"""Recommendations that are not followed, and why."""

STUDY = """
title: Three networks of one beam
beams: {20x10: {length: 20 mm, height: 10 mm}}
materials: {steel: {young_modulus: 210 GPa, poisson_ratio: 0.3}}
outputs: [sensitivity, tables]
grids:
  one: {beam: 20x10, mesh_type: [structured, free], mesh_size: 2 mm, material: steel, load: traction, force: 10 kN,
        definition: [lattice, patch]}
"""


def called(*command, folder=REPOSITORY):
    """Output of a command; an assertion on its exit code has it."""
    done = subprocess.run([*map(str, command)], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="session")
def validators(tmp_path_factory):
    """Folder of programs that others wrote, and the validator's cache."""
    folder = tmp_path_factory.mktemp("validators")
    called("uv", "venv", "--python", sys.executable, folder / "venv")
    lock = REPOSITORY / "requirements/validator.txt"
    called("uv", "pip", "install", "--python", folder / "venv", "--require-hashes", "-r", lock)
    called(folder / "venv/bin/python", REPOSITORY / "tools/validator_cache.py", folder / "cache")
    return folder


@pytest.fixture(scope="session")
def checkout(tmp_path_factory):
    """A clone with the changes of this checkout, in which a study was run and archived."""
    folder = tmp_path_factory.mktemp("run") / "checkout"
    names = called("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard").split("\0")
    for name in filter(None, names):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if (REPOSITORY / name).exists():
            shutil.copy(REPOSITORY / name, folder / name, follow_symlinks=False)
    (folder / "config/small.yaml").write_text(STUDY)
    for name in ("small", "quick"):
        run(folder, "-m", "snakemake", "--configfile", f"config/{name}.yaml")
        run(folder, "-m", "springtune", "archive", f"results/{name}")
    return folder


def run(folder, *arguments):
    """Output of this Python on the program of a checkout."""
    program = (
        "import os, sys; os.environ['PYTHONPATH'] = 'src'; os.execv(sys.executable, [sys.executable, *sys.argv[1:]])"
    )
    return called(sys.executable, "-c", program, *arguments, folder=folder)


@pytest.mark.parametrize("profile", PROFILES)
def test_it_is_valid_to_another_ones_validator(checkout, validators, profile):
    told = validated(checkout / "results/quick.crate.zip", validators, profile, "required")
    assert "is a valid" in told


def test_recommendations_that_it_does_not_follow_are_known(checkout, validators):
    command = validated(checkout / "results/quick.crate.zip", validators, PROFILES[-1], "recommended", check=False)
    assert set(re.findall(r"\[ ?([a-z-]+-[0-9.]+_[0-9]+\.[0-9]+) ?\]", command)) == UNMET.keys()


def test_the_validator_finds_what_is_wrong(checkout, validators, tmp_path):
    with zipfile.ZipFile(checkout / "results/small.crate.zip") as file:
        file.extractall(tmp_path)
    path = tmp_path / "ro-crate-metadata.json"
    found = json.loads(path.read_text())
    found["@graph"] = [one for one in found["@graph"] if one["@id"] != "#step-collect"]
    path.write_text(json.dumps(found))
    assert "is not a valid" in validated(tmp_path, validators, PROFILES[-1], "required", check=False)


def validated(path, validators, profile, severity, check=True):
    """What the validator says."""
    command = [validators / "venv/bin/rocrate-validator", "-y", "--disable-color", "validate", "--offline"]
    command += ["--cache-path", validators / "cache", "-p", profile, "-l", severity, "--no-paging", "-v", path]
    if check:
        return called(*command)
    return subprocess.run([*map(str, command)], capture_output=True, text=True).stdout


def test_the_citation_file_is_valid(validators):
    assert "valid" in called(validators / "venv/bin/cffconvert", "--validate", "-i", "CITATION.cff")


def test_the_quick_study_reproduces_itself(checkout, tmp_path):
    """In this environment where it is the lock file's, and in a new one otherwise."""
    shutil.copy(checkout / "results/quick.crate.zip", tmp_path)
    told = called(sys.executable, "-m", "springtune", "verify", "quick.crate.zip", "--reproduce", folder=tmp_path)
    assert "values are the same, bit by bit" in told


def test_a_study_reproduces_itself_in_a_new_environment(checkout, tmp_path):
    """All that the new environment has comes out of the archive, and of a package registry."""
    shutil.copy(checkout / "results/small.crate.zip", tmp_path)
    told = called(sys.executable, "-m", "springtune", "verify", "small.crate.zip", "--fresh", folder=tmp_path)
    assert "environment: a new one" in told and "values are the same, bit by bit" in told


def test_an_archive_is_checked_and_run_by_hand(checkout, tmp_path):
    """As its README.md says, by programs that everybody has."""
    with zipfile.ZipFile(checkout / "results/small.crate.zip") as file:
        file.extractall(tmp_path)
    assert "FAILED" not in called("sha256sum", "--check", "SHA256SUMS", folder=tmp_path)
    run(tmp_path / "code", "-m", "snakemake", "--configfile", "config/small.yaml")
    command = ["diff", "../results/small", "results/small", "--relative", "0", "--absolute", "0"]
    assert "the same" in run(tmp_path / "code", "-m", "springtune", *command)
