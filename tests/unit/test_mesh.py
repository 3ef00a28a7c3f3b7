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
    free,
    lattice,
    quality,
    read_mesh,
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
    areas = signed_areas(mesh.points, mesh.triangles)
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(length * height, rel=1e-12)
    # Euler's formula of a disc, and each edge at one or two triangles.
    assert len(mesh.points) - len(mesh.edges) + len(mesh.triangles) == 1
    assert set(np.unique(mesh.cells_per_edge)) <= {1, 2}
    outline = sum(mesh.edge_lengths[mesh.cells_per_edge == 1])
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
    assert (again.points == mesh.points).all() and (again.triangles == mesh.triangles).all()
    assert [block.type for block in meshio.read(tmp_path / "mesh.vtu").cells] == ["triangle"]
    assert [path.name for path in tmp_path.iterdir()] == ["mesh.vtu"]


def test_file_without_triangles_is_refused(tmp_path):
    path = tmp_path / "quads.vtu"
    meshio.Mesh(np.eye(4, 3), [("quad", np.array([[0, 1, 2, 3]]))]).write(path)
    with pytest.raises(ValueError, match="quads.vtu.*triangle"):
        read_mesh(path)
