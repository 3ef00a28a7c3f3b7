"""Studies, and calls and files that are refused, from the files of YAML beside."""

import shlex
from pathlib import Path

import pytest
import yaml

HERE = Path(__file__).parent
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


def refused_files(name):
    """Texts of files that are refused, and parts of what is said of each."""
    return yaml.safe_load((HERE / "refused_files.yaml").read_text())[name]
