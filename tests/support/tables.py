"""Studies, and calls and files that are refused, from the files of YAML beside; and how the command is called."""

from pathlib import Path

import yaml
from click.testing import CliRunner

from springtune.cli import main

HERE = Path(__file__).parent
STUDIES = yaml.safe_load((HERE / "studies.yaml").read_text())


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


def run(*arguments):
    """What becomes of a call of `springtune`."""
    return CliRunner().invoke(main, [str(argument) for argument in arguments])
