"""One version, wherever it stands: what is cited is what is released."""

import re
from pathlib import Path

import yaml

import springtune

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
