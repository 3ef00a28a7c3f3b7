"""Studies, and calls and files that are refused, from the files of YAML beside; and how the command is called."""

import math
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

import springtune as st
from springtune.cli import main

HERE = Path(__file__).parent
COMMON = {"math": math, "np": np, "st": st}
STUDIES = yaml.load((HERE / "studies.yaml").read_text(), yaml.CSafeLoader)


def study_text(names, *changes):
    """Text of a study, or of several in one file, in which some texts stand in place of others."""
    text = "".join(STUDIES[name] for name in names.split())
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def refused_files(name):
    """Texts of files that are refused, and parts of what is said of each."""
    return yaml.safe_load((HERE / "refused_files.yaml").read_text())[name]


@cache
def beside(file):
    """What `cases.yaml` has in the folder of a file of tests."""
    return yaml.load(Path(file).with_name("cases.yaml").read_text(), yaml.CSafeLoader)


def cases(test):
    """Parametrize a test by its rows in `cases.yaml` beside it.

    A text that begins with "=" is an expression of the test's file, and what is under "slow" is a slow row.
    """
    names, *rows = beside(test.__code__.co_filename)[test.__qualname__]
    values = partial(evaluated, known=test.__globals__)
    told = [values(row.get("slow", row) if isinstance(row, dict) else row) for row in rows]
    told = [row if "," in names else (row,) for row in told]
    marks = [[pytest.mark.slow] * (isinstance(row, dict) and "slow" in row) for row in rows]
    return pytest.mark.parametrize(names, [pytest.param(*row, marks=mark) for row, mark in zip(told, marks)])(test)


def slow_but(quick, values):
    """Values of a parameter; all but a few are slow."""
    return [pytest.param(one, marks=[] if one in quick else [pytest.mark.slow]) for one in values]


def evaluated(told, known):
    """What a file of YAML tells, its lists as tuples, and its expressions as what they are."""
    if isinstance(told, list):
        return tuple(evaluated(one, known) for one in told)
    if isinstance(told, dict):
        return {name: evaluated(one, known) for name, one in told.items()}
    return eval(told[1:], COMMON | known) if isinstance(told, str) and told.startswith("=") else told


def run(*arguments):
    """What becomes of a call of `springtune`."""
    return CliRunner().invoke(main, [str(argument) for argument in arguments])
