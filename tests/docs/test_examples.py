"""The examples: each runs, and finds a number that is known from elsewhere."""

import runpy
from pathlib import Path

import pytest

from tables import beside, evaluated

EXAMPLES = Path(__file__).parents[2] / "examples"

STEEL, RUBBER = 210e9, 1e6
"""Young's moduli [Pa]."""

KNOWN = evaluated(beside(__file__)["KNOWN"], globals())

ON_A_DATASET = {"read_dataset"}
"""Run by tests/workflow/test_quick.py, which has one."""


def test_every_example_has_a_known_number():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(KNOWN) | ON_A_DATASET


@pytest.mark.parametrize("name", KNOWN)
def test_example(name, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    number, tolerance = KNOWN[name]
    found = runpy.run_path(str(EXAMPLES / f"{name}.py"))["main"]()
    assert found == pytest.approx(number, rel=tolerance)
    assert 1 <= len(capsys.readouterr().out.splitlines())
    assert not list(tmp_path.iterdir()), "leaves files behind"
