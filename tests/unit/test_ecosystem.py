"""What others read of the project besides its pages: environments, hosted CI, the notebook, the software paper."""

import os
import re
import tomllib
from pathlib import Path

import nbformat
import yaml
from packaging.requirements import Requirement

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
    packages, pip = environment("workflow/envs/springtune.yaml")
    assert sorted(packages) == sorted([f"python {PROJECT['requires-python']}", "pip", *by_conda]) and pip == by_pip
    assert environment("environment.yml") == (packages, [*pip, "--editable ."])


def test_hosted_ci_runs_ours_with_pinned_actions():
    found = yaml.safe_load((REPOSITORY / ".github/workflows/ci.yml").read_text())
    assert set(found) == {"name", True, "permissions", "jobs"} and found["permissions"] == {"contents": "read"}  # on: True
    for job in found["jobs"].values():
        assert {"runs-on", "timeout-minutes", "steps"} <= set(job)
        assert all(("run" in step) != ("uses" in step) for step in job["steps"])
        assert job["steps"][-1]["run"] == "bash .ci/run" and os.access(REPOSITORY / ".ci/run", os.X_OK)
        for used in (step["uses"] for step in job["steps"] if "uses" in step):
            assert re.fullmatch(r"[\w-]+/[\w-]+@[0-9a-f]{40}", used), f"{used}: pin a commit"


def test_the_notebook_has_no_outputs_and_explains_each_step():
    """tests/workflow/test_quick.py runs it."""
    notebook = nbformat.read(REPOSITORY / "examples/springtune.ipynb", as_version=4)
    nbformat.validate(notebook)
    assert notebook.cells[0].cell_type == "markdown" and "## The page" in notebook.cells[-2].source
    for cell in notebook.cells:
        assert cell.cell_type == "markdown" or not (cell.outputs or cell.execution_count)
