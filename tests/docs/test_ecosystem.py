"""What others read of the project besides its pages: environments, hosted CI, the notebook, the software paper."""

import importlib.util
import json
import os
import re
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement

import springtune as st

REPOSITORY = Path(__file__).parents[2]
PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]

CONDA = {"matplotlib": "matplotlib-base", "snakemake": "snakemake-minimal"}
"""Packages of other names in conda-forge and bioconda; netgen-mesher is in neither, and comes by pip."""


def environment(path):
    """Packages of a conda environment, and those that pip installs in it."""
    *packages, pip = yaml.safe_load((REPOSITORY / path).read_text())["dependencies"]
    return packages, pip["pip"]


def test_conda_environments_have_what_the_package_needs():
    needed = [Requirement(one) for one in PROJECT["dependencies"]]
    by_pip = [str(one) for one in needed if one.name == "netgen-mesher"]
    by_conda = [f"{CONDA.get(one.name, one.name)} {one.specifier}" for one in needed if str(one) not in by_pip]
    packages, pip = environment("environment.yml")
    assert sorted(packages) == sorted([f"python {PROJECT['requires-python']}", "pip", *by_conda])
    assert pip == [*by_pip, "--editable ."]


def test_hosted_ci_runs_ours_with_pinned_actions():
    found = yaml.safe_load((REPOSITORY / ".github/workflows/ci.yml").read_text())
    assert set(found) == {"name", True, "permissions", "jobs"} and found["permissions"] == {
        "contents": "read"
    }  # on: True
    for job in found["jobs"].values():
        assert {"runs-on", "timeout-minutes", "steps"} <= set(job)
        assert all(("run" in step) != ("uses" in step) for step in job["steps"])
        assert job["steps"][-1]["run"] == "bash .ci/run" and os.access(REPOSITORY / ".ci/run", os.X_OK)
        for used in (step["uses"] for step in job["steps"] if "uses" in step):
            assert re.fullmatch(r"[\w-]+/[\w-]+@[0-9a-f]{40}", used), f"{used}: pin a commit"


ARTICLE = (REPOSITORY / "article/paper.md").read_text()
_, HEAD, BODY = ARTICLE.split("---\n", 2)
TEXT = re.sub(r"<!--.*?-->", "", BODY, flags=re.DOTALL)


def test_numbers_of_the_software_paper_are_those_of_make_paper():
    """By their names; where the long paper was made here, they are compared with it."""
    folder = REPOSITORY / "workflow/paper"
    declared = yaml.safe_load((folder / "numbers.yaml").read_text())["numbers"]
    declared |= yaml.safe_load((folder / "printed.yaml").read_text())
    stated = dict(re.findall(r"(\w+): ([\d.]+)", re.search(r"<!-- Numbers(.*?)-->", BODY, re.DOTALL)[1]))
    assert set(stated) <= set(declared)
    assert set(re.findall(r"(?<![\w.-])\d+(?:\.\d+)?(?=e6\b|\b(?!-D))", TEXT)) == set(stated.values())
    readme = (REPOSITORY / "README.md").read_text()
    rows = [line for line in TEXT.splitlines() if line.startswith("| `")]
    assert rows and all(row in readme for row in rows)
    made = REPOSITORY / "results/paper/paper/numbers.json"
    if made.exists():
        found = json.loads(made.read_text())["numbers"]
        assert stated == {name: found[name]["text"] for name in stated}


PROGRAM = Path(__file__).parents[2] / "tools/licences.py"


@pytest.fixture(scope="module")
def licences():
    spec = importlib.util.spec_from_file_location("licences", PROGRAM)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_table_is_what_the_lock_files_ask_for(licences):
    licences.main(check=True)


def test_the_gpl_comes_with_one_extra_only(licences):
    parts = licences.parts()
    assert parts["cholesky"] == {"cvxopt"}
    under_it = {one: {name for name in names if licences.licence_of(name).startswith(("GPL", "AGPL"))}
                for one, names in parts.items()}  # fmt: skip
    assert {name for one, names in under_it.items() if one != "test" for name in names} == {"cvxopt"}


REPOSITORY = Path(__file__).parents[2]
CITATION = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text())
VERSION, DATE = re.search(r"^## (\S+) \((.*)\)$", (REPOSITORY / "CHANGELOG.md").read_text(), re.MULTILINE).groups()
"""Of the newest entry of the changelog."""


def test_version_of_citation_and_changelog():
    assert CITATION["version"] == VERSION == st.__version__
    assert re.fullmatch(r"\d+\.\d+\.\d+", VERSION)
