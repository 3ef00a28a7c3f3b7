"""Licences of all packages, of which one extra alone is under the GPL; and one version in all places."""

import importlib.util
import re
from pathlib import Path

import pytest
import yaml

import springtune as st

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
