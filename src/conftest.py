"""Where the examples of docstrings run: in a folder with studies and a dataset, `tree`, and without a window."""

import shutil
from pathlib import Path

import matplotlib
import pytest

import springtune

from synthetic import dataset

# Two modules of one name cannot both be searched for examples, and these have none.
collect_ignore_glob = ["conftest.py"]

REPOSITORY = Path(__file__).parents[1]


@pytest.fixture(scope="session")
def folder(doctest_namespace, tmp_path_factory):
    """A folder as the repository's after a study of all kinds; its dataset is known to every example."""
    folder = tmp_path_factory.mktemp("examples")
    shutil.copytree(REPOSITORY / "config", folder / "config")
    (folder / "results/mine").mkdir(parents=True)
    tree = doctest_namespace["tree"] = dataset()
    tree.attrs = {"springtune_version": springtune.__version__, "study": "mine"}
    tree.to_netcdf(folder / "results/mine/dataset.nc", engine="h5netcdf")
    return folder


@pytest.fixture(autouse=True)
def surroundings(folder, monkeypatch):
    """Examples are run in the folder; figures open no window, and are closed after the example that made them."""
    from matplotlib import pyplot

    monkeypatch.chdir(folder)
    with matplotlib.rc_context():
        pyplot.switch_backend("agg")
        yield
    pyplot.close("all")
