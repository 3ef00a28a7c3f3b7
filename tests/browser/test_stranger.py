"""What a stranger does: clone, run, browse, change the study, run again, see the new cell, build the paper."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pypdf
import pytest
import xarray as xr

from pages import blocks, patch

REPOSITORY = Path(__file__).parents[2]
CELL = {
    "beam": "200x40", "mesh_type": "structured", "mesh_size": 3e-3, "material": "steel", "load": "traction",
    "definition": "lattice", "kinematics": "nonlinear",
}  # fmt: skip
HEADING = "document.querySelector('.chosen-cell h2').textContent"


def fonts(resources):
    """Fonts of a page and of the figures on it: what kind, and whether it is embedded."""
    for font in (resources.get("/Font") or {}).values():
        font = font.get_object()
        parts = [one.get_object() for one in font.get("/DescendantFonts", [font])]
        files = ("/FontFile", "/FontFile2", "/FontFile3")
        yield font["/Subtype"], any(name in part.get("/FontDescriptor", {}) for part in parts for name in files)
    for one in (resources.get("/XObject") or {}).values():
        if "/Resources" in one.get_object():
            yield from fonts(one.get_object()["/Resources"].get_object())


@pytest.fixture
def clone(tmp_path):
    """The files that the repository has, without what was made of them."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=REPOSITORY, capture_output=True, text=True, check=True)
    for name in filter(None, listed.stdout.split("\0")):
        if (REPOSITORY / name).exists():
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(REPOSITORY / name, tmp_path / name, follow_symlinks=False)
    return tmp_path


def make(clone, *words):
    """What a target of make prints; it takes the clone's own environment."""
    own = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(["make", *words], cwd=clone, env=own | {"CI": "1"}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.mark.slow
def test_from_a_clone_to_a_paper(browser, clone):
    make(clone, "study")
    address = (clone / "results/paper/index.html").as_uri()
    browser.open(address)
    cells = browser.ask("return springtune.views.cells.table.order.length")
    assert cells == 360 and browser.complaints() == []
    (change,) = (block for block in blocks(clone / "docs/tutorial/from-clone-to-paper.md") if block.language == "diff")
    patch(change.code, clone)
    make(clone, "study")
    with xr.open_datatree(clone / "results/paper/dataset.nc") as tree:
        error = 100 * float(tree.deformation_error.sel(CELL))
    browser.open(address, "#" + "&".join(f"{name}={label}" for name, label in CELL.items()))
    assert browser.ask("return springtune.views.cells.table.order.length") == cells + 18
    assert "200x40 · structured · 3 mm · steel · traction · lattice" in browser.ask(f"return {HEADING}")
    text = browser.ask("return document.querySelector('.chosen-cell').textContent")
    shown = re.search(r"deformation error\s*([+−][\d.]+)", text)[1].replace("−", "-")
    assert float(shown) == pytest.approx(error, rel=1e-4)  # five digits
    make(clone, "paper")
    path = clone / "results/paper/paper.pdf"
    content, reader = path.read_bytes(), pypdf.PdfReader(path)
    assert 8 <= len(reader.pages) <= 12
    found = [font for page in reader.pages for font in fonts(page["/Resources"].get_object())]
    assert len(found) > 5 and all(embedded and kind != "/Type3" for kind, embedded in found), found
    assert "Nothing to be done" in make(clone, "paper")
    path.unlink()
    make(clone, "paper")
    assert path.read_bytes() == content
