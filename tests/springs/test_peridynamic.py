"""Bonds beyond the next neighbours: their energy, and where there are any."""

import numpy as np
import pytest

import springtune as st
from springtune.mechanics.continuum import PatchTest
from springtune.mesh.formats import write_mesh
from springtune.mesh.rows import lattice
from springtune.mesh.sheets import bonded

from patches import disturbed, patch


@pytest.mark.parametrize("mesh_type", ["structured", "free", "braced"])
@pytest.mark.parametrize("shells", [0, 1, 2, 3])
def test_bonds_of_peridynamics_have_the_energy_of_a_sheet(mesh_type, shells):
    """Of even strains the mean over all directions is exact, with any shells and any outline: sum k L^2 = 3 E t A."""
    mesh = patch(mesh_type)
    if shells:
        mesh = bonded(mesh, (shells + 0.01) * mesh.edge_lengths.min())
    springs = st.DEFINITIONS["peridynamic"].springs(mesh, st.Material(1.0, 1 / 3), 1.0)
    total = (springs.relative * springs.reference * mesh.edge_lengths**2).sum()
    assert total == pytest.approx(3 * mesh.area, rel=1e-9) and (springs.relative > 0).all()


@pytest.mark.parametrize("mesh_type", ["right", "structured"])
@pytest.mark.parametrize("shells", [2, 3])
def test_bonds_do_not_depend_on_the_place_of_a_mesh(mesh_type, shells):
    """Around a notch, whose sides and corner bonds touch in particles."""
    mesh = st.MESH_TYPES[mesh_type](0.05, 0.03, 0.005)
    x, y = mesh.points[mesh.triangles].mean(axis=1).T
    used, corners = np.unique(mesh.triangles[(x < 0.025) | (y < 0.015)], return_inverse=True)
    mesh = st.Mesh(mesh.points[used], corners.reshape(-1, 3))
    found = set()
    for turn in (0.0, 0.1, 1.0, np.pi / 2, 3.0):
        for size in (1.0, 1e-3, 1e3):
            other = disturbed(mesh, turn, size)
            found.add(len(bonded(other, shells * other.edge_lengths.max()).edges))
    assert len(found) == 1


def test_peridynamics_inside_a_sheet():
    """Far from the outline a sheet of two shells has E and nu = 1/3; near it bonds are cut, and E and G miss some."""
    mesh = lattice(60, 40, 1.0)
    joined = bonded(mesh, 2.01)
    springs = st.DEFINITIONS["peridynamic"].springs(joined, st.Material(1.0, 1 / 3), 1.0)
    middle = np.argmin(((mesh.points - mesh.points.mean(axis=0)) ** 2).sum(axis=1))
    here = (joined.edges == middle).any(axis=1)
    assert here.sum() == 18  # 6 neighbours, 6 at sqrt(3), 6 at 2
    ways = np.diff(mesh.points[joined.edges[here]], axis=1)[:, 0]
    x, y = (ways / np.linalg.norm(ways, axis=1, keepdims=True)).T
    weight = 0.5 * springs.relative[here] * (ways**2).sum(axis=1) / mesh.particle_areas[middle]
    assert (weight * x**4).sum() == pytest.approx(9 / 8, rel=1e-9)  # E / (1 - nu^2)
    assert (weight * x**2 * y**2).sum() == pytest.approx(3 / 8, rel=1e-9)
    young, ratio = PatchTest(joined).axial(springs)
    assert abs(young - 1) < 0.02 and abs(ratio - 1 / 3) < 0.01  # 40 rows: an outline of two shells is a tenth


def test_bonds_do_not_cross_what_is_no_body():
    """Of a sheet with a slot none joins its two lips; a bond between neighbours is no second spring."""
    points = np.array([[x, y] for y in range(4) for x in range(7)], dtype=float)
    quads = np.array([[i + 7 * j, i + 1 + 7 * j, i + 8 + 7 * j, i + 7 + 7 * j] for j in range(3) for i in range(6)])
    slot = (quads[:, 0] // 7 == 1) & (quads[:, 0] % 7 < 5)
    mesh = bonded(st.Mesh(points, np.zeros((0, 3), dtype=int), quads[~slot]), 2.3)
    ends = points[mesh.edges]
    lips = (ends[:, :, 0] < 5).all(axis=1) & (ends[:, :, 1].min(axis=1) <= 1) & (ends[:, :, 1].max(axis=1) >= 2)
    assert not lips.any() and len(mesh.bonds)
    assert ((ends[:, :, 1] == 3).all(axis=1) & (np.ptp(ends[:, :, 0], axis=1) == 2)).sum() == 5  # along a side
    assert len(np.unique(mesh.edges, axis=0)) == len(mesh.edges)
    assert (mesh.cells_per_edge == 0).sum() == len(mesh.bonds)
    with pytest.raises(st.MeshError, match="a mesh file has no place for"):
        write_mesh("bonds.vtu", mesh)
