"""The page of licences is that of the lock files, and only the extra that says so is under the GPL."""

import importlib.util
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parents[2] / "tools/licences.py"


@pytest.fixture(scope="module")
def licences():
    spec = importlib.util.spec_from_file_location("licences", PROGRAM)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_what_the_lock_files_ask_for(licences):
    licences.main(check=True)


def test_the_gpl_comes_with_one_extra_only(licences):
    parts = licences.parts()
    assert parts["cholesky"] == {"cvxopt"}
    assert licences.licence_of("cvxopt").startswith("GPL")
    names = parts["run"] | parts["export"] | parts["paper"]
    assert not {name for name in names if licences.licence_of(name).startswith(("GPL", "AGPL"))}
