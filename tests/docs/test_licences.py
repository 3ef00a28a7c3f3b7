"""Licences of all packages, of which one extra alone is under the GPL; and one version in all places."""

import importlib.util
import re
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement

import springtune

PROGRAM = Path(__file__).parents[2] / "tools/licences.py"


@pytest.fixture(scope="module")
def licences():
    spec = importlib.util.spec_from_file_location("licences", PROGRAM)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_table_is_what_the_lock_files_ask_for(licences):
    licences.main(check=True)


def test_each_dependency_says_what_it_is_for(licences):
    """A row each: name, use, MB, what it brings, what would replace it."""
    section = licences.PAGE.read_text().partition("## What each dependency is for")[2].partition("\n## ")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in section.splitlines() if line[:2] == "| "]
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    assert [name for name, *_ in rows[1:]] == [Requirement(one).name for one in project["dependencies"]]
    assert all(use and float(megabytes) > 0 and instead for _, use, megabytes, _, instead in rows[1:])


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
    assert CITATION["version"] == VERSION == springtune.__version__
    assert re.fullmatch(r"\d+\.\d+\.\d+", VERSION)


def test_a_release_has_its_date_in_both():
    """`(unreleased)` until it is released; then the day, and CITATION.cff has the same."""
    released = str(CITATION.get("date-released", "unreleased"))
    assert released == DATE
    assert DATE == "unreleased" or re.fullmatch(r"\d{4}-\d{2}-\d{2}", DATE)
