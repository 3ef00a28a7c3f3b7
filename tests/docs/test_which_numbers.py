"""Numbers of docs/which-numbers.md that its blocks do not print: measured again, and closed forms."""

import re
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest

import springtune as st

from tables import cases, slow_but

PAGE = " ".join((Path(__file__).parents[2] / "docs/which-numbers.md").read_text().split())
SHEET = st.Beam("300 mm", "200 mm")


def shown(pattern):
    """Numbers of the page's sentence that a pattern finds."""
    return [float(number) for number in re.search(pattern, PAGE).groups()]


def off(size="20 mm", force="10 N", young="5 MPa", density="1000 kg/m^3", substeps=20, factor=1.0):
    """Error of the page's sheet in XPBD, in percent."""
    mesh, material = st.make_mesh(SHEET, "structured", size), st.Material(young, 0.3, density=density)
    scene = st.Scene(SHEET, mesh, material, "traction", force, definition="patch")
    return 100 * st.in_engine(scene, "xpbd", dt="1/60", substeps=substeps, factor=factor).error


@cases
def test_errors_at_other_settings_are_those_of_the_page(pattern, changes):
    assert [off(**one) for one in changes] == pytest.approx(shown(pattern), abs=0.55)


def test_cells_that_sound_crosses_are_those_of_the_page():
    speed = (5e6 / 1000) ** 0.5
    assert shown(r"Here √\(E/ρ\) is (\d+) m/s") == [round(speed)]
    assert [speed / 60 / substeps / 0.02 for substeps in (40, 20)] == pytest.approx([1.5, 3], rel=0.02)
    mesh, rubber = st.make_mesh(SHEET, "structured", "20 mm"), st.Material("5 MPa", 0.3, density="1000 kg/m^3")
    limit = st.Scene(SHEET, mesh, rubber, "traction", "10 N", definition="patch").motion()
    assert shown(r"Explicit engines explode above ([\d.]+)\.") == [
        round(speed * limit.step_limit("symplectic-euler") / 0.02, 2)
    ]


def test_a_bent_strip_is_too_stiff_as_the_page_says():
    rows = [list(map(float, row)) for row in re.findall(r"\| (\d+) \| (\d+) % \| (\d+) % \|", PAGE)]
    assert [cells for cells, *_ in rows] == [2, 4, 8, 16]
    strip, rubber = st.Beam("200 mm", "40 mm"), st.Material("5 MPa", 0.3)
    for cells, *errors in rows:
        for mesh_type, error in zip(("right", "structured"), errors):
            mesh = st.make_mesh(strip, mesh_type, 0.04 / cells / (1 if mesh_type == "right" else 0.87))
            assert len(np.unique(mesh.points[:, 1].round(6))) == cells + 1
            scene = st.Scene(strip, mesh, rubber, "bending", "5 mN", definition="delingette")
            assert -100 * scene.solve().error == pytest.approx(error, abs=0.55)


def test_springs_of_a_mesh_are_those_of_the_page():
    rubber = st.Material("5 MPa", 1 / 3)
    for mesh_type, row in {"structured": r"equilateral triangles", "braced": r"diagonals: sides"}.items():
        mesh = st.make_mesh(SHEET, mesh_type, "20 mm")
        found = st.DEFINITIONS["lattice"].springs(mesh, rubber, 1e-3)
        inside, outline = shown(row + r" \| ([\d.]+) E t \| ([\d.]+) E t")
        assert set(np.round(found.reference * found.relative / 5e3, 3)) == {inside, outline}
    assert shown(r"both diagonals: diagonals \| ([\d.]+) E t") == [outline]


def test_plane_stress_is_what_the_page_says():
    def young(shear, area):
        """Of a sheet, from the two that engines want."""
        return 4 * shear * (area + shear) / (area + 2 * shear)

    def of_a_sheet(ratio, area):
        return young(1 / (2 * (1 + ratio)), area(ratio))

    plane, solid = (lambda ratio: ratio / (1 - ratio**2)), (lambda ratio: ratio / ((1 + ratio) * (1 - 2 * ratio)))
    for ratio in (0.0, 0.3, 0.45, 0.5):
        assert of_a_sheet(ratio, plane) == pytest.approx(1)
        assert plane(ratio) == pytest.approx(2 / (2 * (1 + ratio)) * ratio / (1 - ratio))
    too_stiff = [100 * (of_a_sheet(ratio, solid) - 1) for ratio in (0.3, 0.45)]
    assert too_stiff == pytest.approx(shown(r"by (\d+) % at ν = 0.3, by (\d+) % at 0.45"), abs=0.5)
    assert shown(r"the sheet has (\d+) % of E at ν = 0.3") == [round(100 * of_a_sheet(0.3, lambda ratio: 0.0))]
    of_usd = young(1 / (1 - 0.3**2), 0.0)
    assert shown(r"([\d.]+) times too stiff at ν = 0.3") == [round(of_usd, 1)]
    assert plane(0.5) == pytest.approx(2 / (2 * 1.5))  # tri_ka = 2 tri_ke


def test_everything_that_is_typed_into_an_engine_stands_on_the_page_with_its_unit():
    others = [one for one in st.ENGINES.values() if one.program != "springtune" and one.name not in st.ENGINES.packages]
    typed = {(name, parameter.unit) for one in others for name, parameter in one.parameters.items()}
    lacking = [name for name, unit in typed if name not in PAGE or unit not in ("1", "") and f"[{unit}]" not in PAGE]
    assert not lacking


REPOSITORY = Path(__file__).parents[2]

MESHER = re.search(r"^netgen-mesher==(\S+)", (REPOSITORY / "requirements/run.txt").read_text(), re.MULTILINE)[1]
OTHER = f"the page's meshes are those of netgen {MESHER}; others have other particles"

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


FINEST = rows("On the finest mesh")
SOON = [row for row in FINEST if row[0].startswith(("`cook", "`hole"))]


@pytest.mark.skipif(version("netgen-mesher") != MESHER, reason=OTHER)
@pytest.mark.parametrize("row", slow_but(SOON, FINEST), ids=lambda row: row[0])
def test_errors_on_the_finest_mesh_are_those_of_the_page(row):
    shape, load, quantity = place(row[0])
    sizes = [one.mesh_size for one in study().shapes.scenes if one.shape == shape]
    size = told(row[3].removesuffix(" mm")) / 1e3
    assert size == pytest.approx(min(sizes))
    assert len(mesh(shape, min(sizes)).mesh.points) == told(row[4].replace(",", ""))
    for definition, cell in zip(DEFINITIONS, row[5:], strict=True):
        error = 100 * result(shape, load, min(sizes), definition).errors[quantity]
        assert told(cell) == pytest.approx(error, abs=SLACK[kind(shape, load, quantity)] + 0.005), definition
