"""Programs that `make test-engines` installs: those of the lock file, and what lacks is skipped by name."""

import re
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

import springtune as st

LOCK = (Path(__file__).parents[2] / "requirements/engines.txt").read_text()
PROGRAMS = {"mujoco": "mujoco", "newton": "newton", "warp-lang": "warp"}
"""Packages, and the modules that engines name in `needs`."""


@pytest.mark.parametrize("package", PROGRAMS)
def test_a_program_is_that_of_the_lock_file_and_no_engine_misses_it(package):
    try:
        found = version(package)
    except PackageNotFoundError:
        pytest.skip(f"{package} is not installed; `make test-engines` says why")
    assert found == re.search(rf"^{package}==(\S+)", LOCK, re.MULTILINE)[1]
    assert not [one.name for one in st.ENGINES.values() if {*one.needs} == {PROGRAMS[package]} and one.absent]
