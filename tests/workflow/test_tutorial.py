"""The tutorial, as a reader follows it; its first chapter takes the paper's study twice, and is slow."""

import shutil

import matplotlib
import pytest
from matplotlib import pyplot

import springtune as st
from springtune.studies.kinds import load_study

from campaigns import Campaign
from pages import blocks, claims, follow, patch, write_study

CHAPTERS = ("own-beam", "own-material", "own-mesh-file", "own-definition", "own-figure")


@pytest.fixture
def reader(run, repository, monkeypatch):
    """A run whose folder has the studies, and is the current one; what chapters declare and draw is put away."""
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


def test_the_chapters_can_be_followed(reader, repository):
    """Chapters add to one study, so that one run of what it is in the end serves them all."""
    pages = [repository / f"docs/tutorial/{name}.md" for name in CHAPTERS]
    for page in pages:
        for block in blocks(page):
            if block.language == "yaml":
                study = write_study(block.code, reader.folder)
            elif ".write(" in block.code:
                exec(block.code, {})  # the mesh file
    Campaign("config/mine.yaml").finish()
    study.unlink()
    steps = [block for page in pages for block, _ in follow(page, reader.folder)]
    assert sum("make study" in block.code for block in steps) == 3
    for figure in ("finger.pdf", "shear.pdf"):
        assert (reader.folder / figure).stat().st_size > 5000


def test_a_plate_goes_from_its_file_to_springs_error_and_picture(reader, repository):
    """The study of fifteen lines: nothing of it is a hole, and nothing is left to do."""

    def study(path):
        Campaign(path).finish()

    steps = [block for block, _ in follow(repository / "docs/tutorial/own-shape.md", reader.folder, study)]
    (text,) = (block.code for block in steps if block.code.startswith("# config/plate.yaml"))
    assert len(text.splitlines()) <= 16
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


def test_the_change_of_the_first_chapter_adds_the_cells_that_it_shows(reader, repository):
    page = repository / "docs/tutorial/from-clone-to-paper.md"
    (diff,) = (block for block in blocks(page) if block.language == "diff")
    before = load_study(reader.folder / "config/paper.yaml")
    patch(diff.code, reader.folder)
    after = load_study(reader.folder / "config/paper.yaml")
    assert set(after.axes["mesh_size"]) - set(before.axes["mesh_size"]) == {3e-3}
    assert len(after.scenes) == len(before.scenes) + 18
    shutil.copy(repository / "config/paper.yaml", reader.folder / "config")


@pytest.mark.slow
def test_from_a_clone_to_a_paper(reader, repository):
    """Both runs are made, and every number that the page shows is theirs, as are those of the README's table."""

    def study(path):
        code, output = reader.snakemake(path)
        assert code == 0, output

    steps = list(follow(repository / "docs/tutorial/from-clone-to-paper.md", reader.folder, study))
    assert sum("make study" in block.code for block, _ in steps) == 2
    with st.open("results/paper") as tree:
        found = 100 * abs(tree.to_dataset().deformation_error.sel(kinematics="linear"))
        for name, claimed in claims(repository / "README.md").items():
            errors = found.sel(definition=name)
            assert errors.count() == 45 and claimed == f"{errors.median():.2f} % | {errors.max():.2f} %"
