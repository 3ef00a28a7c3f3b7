"""Meshes: geometry that holds for any size, quality figures, and files."""

import subprocess
import sys

import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from springtune.mesh import (
    MESH_TYPES,
    Mesh,
    MeshError,
    alternating,
    braced,
    free,
    isosceles,
    lattice,
    quality,
    read_beam_mesh,
    read_mesh,
    right,
    signed_areas,
    structured,
    write_mesh,
)

boxes = {
    "length": st.floats(0.02, 0.3),
    "height": st.floats(0.01, 0.05),
    "size": st.floats(2e-3, 9e-3),
}


@pytest.mark.parametrize("mesh_type", MESH_TYPES)
@settings(max_examples=15, deadline=None)
@given(**boxes)
def test_any_box_is_covered_once(mesh_type, length, height, size):
    mesh = MESH_TYPES[mesh_type](length, height, size)
    for corners in mesh.cells.values():
        assert (signed_areas(mesh.points, corners) > 0).all()
    assert mesh.area == pytest.approx(length * height, rel=1e-12)
    assert not mesh.inverted(mesh.points)
    # Euler's formula of a disc, diagonals left out, and each edge at one or two cells.
    sides = len(mesh.edges) - 2 * len(mesh.quads)
    assert len(mesh.points) - sides + len(mesh.triangles) + len(mesh.quads) == 1
    assert set(np.unique(mesh.cells_per_edge)) <= {1, 2}
    outline = sum(mesh.edge_lengths[mesh.on_outline])
    assert outline == pytest.approx(2 * (length + height), rel=1e-12)
    for axis, end in ((0, length), (1, height)):
        for value in (0.0, end):
            assert len(mesh.outline_edges(axis, value)) >= 1


@pytest.mark.parametrize(("size", "particles"), [(5e-3, 415), (2e-3, 2436), (1e-3, 9470)])
def test_structured_has_the_rows_of_the_paper_beam(size, particles):
    """Counts of the same network in another program."""
    mesh = structured(0.2, 0.04, size)
    assert len(mesh.points) == particles
    assert quality(mesh)["minimum_angle"] > 29  # half triangles at the ends


def test_rows_are_equilateral_where_they_fit():
    height = 4 * np.sqrt(3) / 2 * 5e-3
    mesh = structured(0.05, height, 5e-3)
    corners = mesh.points[mesh.triangles]
    whole = np.isclose(signed_areas(mesh.points, mesh.triangles), np.sqrt(3) / 4 * 25e-6)
    sides = np.linalg.norm(corners[whole] - np.roll(corners[whole], 1, axis=1), axis=2)
    # 4 rows of 10 triangles on one base and 9 on the other; the two halves at each row's ends are cut.
    assert whole.sum() == 4 * (10 + 9)
    assert np.allclose(sides, 5e-3, rtol=1e-12)


def test_lattice_is_equilateral_throughout():
    mesh = lattice(7, 5, 2.0)
    assert np.allclose(mesh.edge_lengths, 2.0, rtol=1e-14)
    assert quality(mesh) == pytest.approx({"minimum_angle": 60.0, "edge_length_spread": 0.0}, abs=1e-10)


@pytest.mark.parametrize("size", [5e-3, 2e-3])
def test_free_has_the_imposed_size_on_its_outline_and_is_delaunay(size):
    mesh = free(0.1, 0.02, size)
    outline = mesh.edge_lengths[mesh.cells_per_edge == 1]
    assert np.allclose(outline, size, rtol=1e-9)
    other = Delaunay(mesh.points).simplices
    ours, theirs = ({tuple(sorted(corners)) for corners in triangles.tolist()} for triangles in (mesh.triangles, other))
    assert ours == theirs
    assert quality(mesh)["minimum_angle"] > 30


def test_free_is_the_same_mesh_in_another_process():
    code = (
        "import hashlib; from springtune.mesh import free; m = free(0.1, 0.02, 2e-3);"
        "print(hashlib.sha256(m.points.tobytes() + m.triangles.tobytes()).hexdigest())"
    )
    runs = {
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout for _ in "ab"
    }
    assert len(runs) == 1


def test_quality_of_a_right_isosceles_triangle():
    mesh = Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([[0, 1, 2]]))
    lengths = np.array([1.0, 1.0, np.sqrt(2)])
    expected = {"minimum_angle": 45.0, "edge_length_spread": lengths.std() / lengths.mean()}
    assert quality(mesh) == pytest.approx(expected)


@pytest.mark.parametrize("mesh_type", MESH_TYPES)
def test_file_keeps_every_digit(tmp_path, mesh_type):
    mesh = MESH_TYPES[mesh_type](0.1, 0.02, 5e-3)
    write_mesh(tmp_path / "mesh.vtu", mesh)
    again = read_mesh(tmp_path / "mesh.vtu")
    assert (again.points == mesh.points).all()
    assert (again.triangles == mesh.triangles).all() and (again.quads == mesh.quads).all()
    kinds = {"braced": ["quad"]}.get(mesh_type, ["triangle"])
    assert [block.type for block in meshio.read(tmp_path / "mesh.vtu").cells] == kinds
    assert [path.name for path in tmp_path.iterdir()] == ["mesh.vtu"]


SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
HALVES = [("triangle", np.array([[0, 1, 2], [0, 2, 3]]))]


@pytest.mark.parametrize(
    ("points", "cells", "message"),
    [
        (SQUARE, [("line", np.array([[0, 1]]))], "no cell block 'triangle' or 'quad'; write"),
        (SQUARE, [("tetra", np.array([[0, 1, 2, 3]]))], "has cells 'tetra'; write linear triangles"),
        (SQUARE + [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0.1]], HALVES, "leave the plane"),
        (SQUARE * [1, 0, 1], HALVES, "no area"),
    ],
)
def test_files_that_are_no_plane_mesh_are_refused(tmp_path, points, cells, message):
    path = tmp_path / "mesh.vtu"
    meshio.Mesh(points, cells).write(path)
    with pytest.raises(MeshError, match=f"mesh.vtu: .*{message}"):
        read_mesh(path)


def test_unreadable_file_is_refused(tmp_path):
    for name, content in (("mesh.txt", "nothing"), ("mesh.vtu", "nothing"), ("mesh.msh", "$MeshFormat")):
        (tmp_path / name).write_text(content)
        with pytest.raises(MeshError, match=f"{name}: meshio cannot read it.*; convert it"):
            read_mesh(tmp_path / name)


@pytest.mark.parametrize(("ending", "name"), [("vtu", "vtu"), ("msh", "gmsh22"), ("inp", "abaqus"), ("vtk", "vtk")])
@pytest.mark.parametrize("mesh_type", ["free", "braced"])
def test_a_beam_may_come_from_any_format(tmp_path, ending, name, mesh_type):
    mesh = MESH_TYPES[mesh_type](0.1, 0.02, 5e-3)
    # Elsewhere, in mm, with a particle of no cell and with lines on the outline; the first cell clockwise.
    points = np.column_stack([1e3 * mesh.points + [7.0, -3.0], np.zeros(len(mesh.points))])
    points = np.vstack([points, [[50.0, 10.0, 0.0]]])
    kind, cells = ("quad", mesh.quads.copy()) if len(mesh.quads) else ("triangle", mesh.triangles.copy())
    cells[0] = cells[0][::-1]
    path = tmp_path / f"beam.{ending}"
    meshio.Mesh(points, [("line", mesh.outline_edges(1, 0.0)), (kind, cells)]).write(path, file_format=name)
    found = read_beam_mesh(path, 0.1, 0.02, unit=1e-3)
    # Formats in text keep some twelve digits.
    assert np.allclose(found.points, mesh.points, rtol=0, atol=1e-10)
    assert len(found.edges) == len(mesh.edges)
    assert (signed_areas(found.points, next(iter(found.cells.values()))) > 0).all()
    for axis, end in ((0, 0.1), (1, 0.02)):
        for value in (0.0, end):
            assert len(found.outline_edges(axis, value)) == len(mesh.outline_edges(axis, value))


def test_a_mesh_that_does_not_fill_its_beam_is_refused(tmp_path):
    mesh = MESH_TYPES["free"](0.1, 0.02, 5e-3)
    path = tmp_path / "beam.vtu"
    write_mesh(path, mesh)
    with pytest.raises(MeshError, match="extends over 100 x 20 mm, its beam over 200 x 40 mm; correct the unit"):
        read_beam_mesh(path, 0.2, 0.04)
    corner = (mesh.triangles == np.argmin(mesh.points.sum(axis=1) - 0.05)).any(axis=1)
    inner = mesh.triangles[~(mesh.points[mesh.triangles, 1] < 1e-9).any(axis=1) | corner]
    missing = np.delete(mesh.triangles, np.flatnonzero((mesh.points[mesh.triangles, 1] > 1e-9).all(axis=1))[0], axis=0)
    assert len(inner) < len(mesh.triangles)
    write_mesh(path, Mesh(mesh.points, missing))
    with pytest.raises(MeshError, match="cover .* % of the box or overlap"):
        read_beam_mesh(path, 0.1, 0.02)
    write_mesh(path, Mesh(mesh.points, np.vstack([mesh.triangles, mesh.triangles[:1]])))
    with pytest.raises(MeshError, match="overlap"):
        read_beam_mesh(path, 0.1, 0.02)


@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_isosceles_rows_have_the_shape_for_their_poisson_ratio(nu):
    mesh = isosceles(0.2, 0.04, 2e-3, nu)
    x, y = np.abs(mesh.points[mesh.edges[:, 1]] - mesh.points[mesh.edges[:, 0]]).T
    slanted = (x > 1e-9) & (y > 1e-9)
    # Rows and cells are whole numbers: 22 and 28 rows, 100 cells.
    assert (x[slanted] / y[slanted]) ** 2 == pytest.approx(nu, rel=0.02)


def test_springs_of_squares():
    mesh = right(0.03, 0.02, 0.01)
    assert (len(mesh.points), len(mesh.triangles), len(mesh.edges)) == (12, 12, 23)
    falling = mesh.points[mesh.edges[:, 1]] - mesh.points[mesh.edges[:, 0]]
    assert not ((falling > 1e-9).any(axis=1) & (falling < -1e-9).any(axis=1)).any()  # all diagonals rise
    mixed = alternating(0.03, 0.02, 0.01)
    degree = np.bincount(mixed.edges.ravel())
    assert sorted(set(degree)) == [2, 3, 5, 8] or set(degree) <= {2, 3, 4, 5, 8}
    both = braced(0.03, 0.02, 0.01)
    assert (len(both.quads), len(both.edges), both.on_outline.sum()) == (6, 17 + 12, 10)


def test_quads_turn_inside_out_corner_by_corner():
    mesh = braced(0.01, 0.01, 0.01)
    assert not mesh.inverted(mesh.points)
    pushed = mesh.points.copy()
    pushed[mesh.quads[0, 0]] = [0.008, 0.008]  # past the diagonal: the area stays positive
    assert signed_areas(pushed, mesh.quads)[0] > 0
    assert mesh.inverted(pushed)
