"""Studies from their text, in a folder of each test."""

from functools import partial

import pytest

import campaigns


@pytest.fixture
def load(tmp_path):
    """Load a study from its text."""
    return partial(campaigns.load_text, tmp_path)


@pytest.fixture
def refusal(tmp_path):
    """Message that the text of a study gets."""
    return partial(campaigns.refusal, tmp_path)
