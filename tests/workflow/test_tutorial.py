"""The tutorial as a reader follows it, and the README's table from a run of the paper's study, which is slow."""

import shutil

import matplotlib
import pytest
from matplotlib import pyplot

import springtune as st

from campaigns import Campaign
from pages import claims, follow

PAPER = "config/paper.yaml"


@pytest.fixture
def reader(run, repository, monkeypatch):
    """A run whose folder has the studies and is the current one; definitions of the tutorial are removed afterwards."""
    if not (run.folder / "config").exists():
        shutil.copytree(repository / "config", run.folder / "config")
    monkeypatch.chdir(run.folder)
    known = list(st.DEFINITIONS)
    with matplotlib.rc_context():
        pyplot.switch_backend("agg")
        yield run
    pyplot.close("all")
    for name in set(st.DEFINITIONS) - set(known):
        st.DEFINITIONS.discard(name)


def test_the_tutorial_can_be_followed(reader, repository):
    """Except for the paper's study, which the slow test below runs."""
    studies = []

    def study(path):
        studies.append(path)
        if path != PAPER:
            Campaign(path).finish()

    assert list(follow(repository / "docs/tutorial.md", reader.folder, study))
    assert studies == [PAPER, "config/mine.yaml", "config/plate.yaml"]
    assert (reader.folder / "finger.pdf").stat().st_size > 5000
    results = reader.folder / "results/plate"
    with st.open(results) as tree:
        data = tree["shapes"].to_dataset().squeeze(drop=True)
        assert (data.status == 1).all() and (data.reference_error_estimate < 1e-4).all()
        assert (abs(data.error.sel(definition="delingette", quantity="stretch")) < 0.01).all()
        assert float(data.reference_value.sel(quantity="stretch")) > 4e3 * 0.1 / (210e9 * 0.04 * 1e-3)
    for name in ("shapes_overview", "shapes_errors_plate_pull", "shapes_deformed_plate_pull"):
        assert (results / f"figures/{name}.png").stat().st_size > 5000
    assert (results / "tables/shapes.csv").exists() and (results / "index.html").exists()
    assert Campaign("config/plate.yaml").due() == []


@pytest.mark.slow
def test_the_study_of_the_paper_has_the_errors_of_the_readme(reader, repository):
    code, output = reader.snakemake(PAPER)
    assert code == 0, output
    with st.open("results/paper") as tree:
        found = 100 * abs(tree.to_dataset().deformation_error.sel(kinematics="linear"))
        for name, claimed in claims(repository / "README.md").items():
            errors = found.sel(definition=name)
            assert errors.count() == 45 and claimed == f"{errors.median():.2f} % | {errors.max():.2f} %"
