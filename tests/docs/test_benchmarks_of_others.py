"""The numbers of docs/shapes.md are what networks on the shapes of config/shapes.yaml give."""

import re
from functools import cache
from importlib.metadata import version
from pathlib import Path

import pytest

import springtune as st

REPOSITORY = Path(__file__).parents[2]

MESHER = re.search(r"^netgen-mesher==(\S+)", (REPOSITORY / "requirements/run.txt").read_text(), re.MULTILINE)[1]
pytestmark = pytest.mark.skipif(
    version("netgen-mesher") != MESHER,
    reason=f"the page's meshes are those of netgen {MESHER}; others have other particles",
)

DEFINITIONS = ("lattice", "energy-fit", "patch", "patch-fit", "delingette")

SLACK = {"displacement": 0.05, "reaction": 0.05, "stress": 0.5}
"""Differences [%] that another order of sums makes in fits, and then in a stress at a point."""


@cache
def study():
    return st.load_study(REPOSITORY / "config/shapes.yaml")


@cache
def mesh(shape, size):
    part = study().shapes
    refined = {name: factor * size for name, factor in dict(part.refined.get(shape, {})).items()}
    return st.mesh_shape(part.shape[shape], size, refined=refined)


@cache
def result(shape, load, size, definition):
    part = study().shapes
    wanted = {one.material for one in part.scenes if one.shape == shape}
    material = study().materials_of(shape, *wanted)[""]
    return st.Scene(
        part.shape[shape], mesh(shape, size), material, load, definition=definition, kinematics="linear"
    ).solve()


def rows(heading):
    """Cells of the table below a heading, a list a row."""
    text = (REPOSITORY / "docs/shapes.md").read_text()
    lines = text.partition(f"## {heading}\n")[2].partition("\n## ")[0].splitlines()
    table = [line for line in lines if line.startswith("| `")]
    assert table, heading
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table]


def place(cell):
    """Shape, load and quantity of a cell like ``cook shear: tip``."""
    return re.fullmatch(r"`(\S+) (\S+): (\S+)`", cell).groups()


def told(cell):
    return float(cell.removesuffix(" %").replace("−", "-"))


def kind(shape, load, quantity):
    asked = study().shapes.shape[shape].loads[load].quantities
    return next(one.kind for one in asked if one.name == quantity)


@pytest.mark.parametrize(
    "row",
    [
        row if row[0].startswith(("`cook", "`hole")) else pytest.param(row, marks=pytest.mark.slow)
        for row in rows("On the finest mesh")
    ],
    ids=lambda row: row[0],
)
def test_errors_on_the_finest_mesh_are_those_of_the_page(row):
    shape, load, quantity = place(row[0])
    sizes = [one.mesh_size for one in study().shapes.scenes if one.shape == shape]
    size = told(row[3].removesuffix(" mm")) / 1e3
    assert size == pytest.approx(min(sizes))
    assert len(mesh(shape, min(sizes)).mesh.points) == told(row[4].replace(",", ""))
    for definition, cell in zip(DEFINITIONS, row[5:], strict=True):
        error = 100 * result(shape, load, min(sizes), definition).errors[quantity]
        assert told(cell) == pytest.approx(error, abs=SLACK[kind(shape, load, quantity)] + 0.005), definition
