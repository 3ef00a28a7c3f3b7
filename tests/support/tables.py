"""Studies, and calls and files that are refused, from the files of YAML beside; and how the command is called."""

import shlex
from pathlib import Path

import pytest
import yaml
from click.testing import CliRunner

from springtune.cli import main

HERE = Path(__file__).parent
SMALL_AXES = {
    "beam": ("200x40", "100x20"),
    "mesh_type": ("structured", "free"),
    "mesh_size": (2e-3, 5e-3),
    "material": ("steel",),
    "load": ("traction", "bending"),
    "definition": ("lattice", "patch"),
    "kinematics": ("linear",),
    "stiffness_ratio": (0.5, 1.0, 1.5),
}
"""Labels of a small dataset of scenes and curves."""
STUDIES = yaml.safe_load((HERE / "studies.yaml").read_text())


def study_text(names, *changes):
    """Text of a study, or of several in one file, in which some texts stand in place of others."""
    text = "".join(STUDIES[name] for name in names.split())
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def refused_calls(name):
    """Words of calls of a command that are refused, what else `refused_calls.yaml` has of each, and its id."""
    rows = yaml.safe_load((HERE / "refused_calls.yaml").read_text())[name]
    return [pytest.param(shlex.split(call), *told, id=call) for call, *told in rows]


def refused_numbers(name):
    """Texts in the place of numbers, which a command refuses."""
    return yaml.safe_load((HERE / "refused_calls.yaml").read_text())[name]


def refused_files(name):
    """Texts of files that are refused, and parts of what is said of each."""
    return yaml.safe_load((HERE / "refused_files.yaml").read_text())[name]


def run(*arguments):
    """What becomes of a call of `springtune`."""
    return CliRunner().invoke(main, [str(argument) for argument in arguments])
