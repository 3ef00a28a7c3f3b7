"""Shared by all tests."""

import importlib
import os
import sys
from functools import partial

import pytest
from hypothesis import HealthCheck, settings

# Two modules of one name cannot both be searched for examples, and these have none.
collect_ignore_glob = ["conftest.py", "*/conftest.py"]

# Tests run in several processes; threads of theirs would only fight for the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# What other packages declare here is no part of the tests.
os.environ.setdefault("SPRINGTUNE_PLUGINS", "none")

# No test is to fail because the machine is busy: nothing of these settings looks at the clock.
unhurried = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])

# `make test` draws the same examples every time, so that it says the same of the same commit; `make slow` draws anew.
settings.register_profile("same", unhurried, derandomize=True)
settings.register_profile("anew", unhurried, max_examples=400)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))


@pytest.fixture(params=["meshio", "meshlane"])
def mesh_library(request, monkeypatch):
    """meshio, and its fork in its place. Files of a test's own stay meshio's."""
    from springtune.mesh.formats import library  # with numpy, after the settings above

    package = importlib.import_module(request.param)
    monkeypatch.setitem(sys.modules, "meshio", package)
    assert library() is package and request.param in package.__file__
    return package


@pytest.fixture
def load(tmp_path):
    """Load a study from its text, in a folder of the test."""
    import campaigns  # with numpy, after the settings above

    return partial(campaigns.load_text, tmp_path)


@pytest.fixture
def refusal(tmp_path):
    """Message that the text of a study gets, in a folder of the test."""
    import campaigns  # with numpy, after the settings above

    return partial(campaigns.refusal, tmp_path)
