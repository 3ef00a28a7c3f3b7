"""Shear and rotational springs beside axial ones, and LAMMPS's volume factor: what they are, and their moduli."""

from functools import partial

import numpy as np
import pytest

import springtune as st
from periodic import periodic_delaunay
from springtune.mechanics.energies import AngleEnergy, BiquadraticEnergy
from springtune.mesh.rows import lattice
from springtune.springs.ielsm import angle_moduli
from springtune.springs.normal_shear import slip_form

from patches import errors, patch
from problems import free_network
from tables import cases

NAMES = ("normal-shear", "ielsm", "many-body")
ANY_RATIO = (-0.9, -0.5, 0.0, 0.2, 0.3, 1 / 3, 0.49, 0.5)


def some_triangles(seed=3):
    """Acute and obtuse triangles of all directions."""
    return periodic_delaunay(np.random.default_rng(seed).uniform(size=(60, 2)), 1.0, 1.0)


BESIDES = [("ielsm", mesh_type) for mesh_type in ("free", "right", "alternating", "isosceles-0.3")]


@pytest.mark.parametrize("nu", ANY_RATIO)
@pytest.mark.parametrize(("name", "mesh_type"), [*((name, "structured") for name in NAMES), *BESIDES])
def test_moduli_are_exact(name, mesh_type, nu):
    young, ratio, shear = errors(name, patch(mesh_type), nu)
    assert (young, ratio, shear) == pytest.approx((0, nu, 0), abs=1e-9)


@pytest.mark.parametrize("nu", [-0.5, 0.0, 0.2, 0.3, 0.49])
@cases
def test_moduli_on_other_meshes_are_within_a_band(name, mesh_type, band, nu):
    """Of a/H = 0.1: E, nu and G."""
    young, ratio, shear = errors(name, patch(mesh_type), nu)
    assert (np.abs([young, ratio - nu, shear]) < band).all()
    assert abs(young) > 1e-3  # not exact: the band says something


@pytest.mark.parametrize("name", NAMES)
def test_rotation_meets_no_resistance(name):
    mesh = st.MESH_TYPES["free"](0.03, 0.01, 2.5e-3)
    network = free_network(mesh, st.DEFINITIONS[name].springs(mesh, st.Material(1.0, 0.2), 1.0))
    resisted = np.abs(network.forces_over_k(1e-3 * mesh.points)).max()  # a stretch of a thousandth
    for angle in (1e-6, 0.3, 2.0):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        assert np.abs(network.forces_over_k(mesh.points @ turn.T - mesh.points)).max() < 1e-9 * resisted
    assert resisted > 0


def test_a_shear_spring_resists_the_strain_across_its_side():
    """``k/2 (L n.e.s)^2`` of each side, summed by hand, for strains that are even in a triangle."""
    mesh, _ = some_triangles()
    rng = np.random.default_rng(1)
    stiffness = rng.uniform(0.5, 1.0, (len(mesh.triangles), 3))
    form = slip_form(mesh, stiffness)
    own, mixed = form[:, [0, 1, 2], [0, 1, 2]], form[:, [1, 2, 0], [2, 0, 1]]
    energy = BiquadraticEnergy(mesh.points, mesh.triangles, own, mixed)
    here = mesh.points[mesh.triangles]
    sides = np.roll(here, 1, axis=1) - np.roll(here, -1, axis=1)
    across = np.stack([-sides[..., 1], sides[..., 0]], axis=2) / np.linalg.norm(sides, axis=2)[..., None]
    for _ in range(5):
        gradient = np.eye(2) + 0.3 * rng.standard_normal((2, 2))
        green = 0.5 * (gradient.T @ gradient - np.eye(2))
        slips = np.einsum("tia,ab,tib->ti", sides, green, across)
        expected = 0.5 * (stiffness * slips**2).sum()
        assert energy.value(mesh.points @ (gradient - np.eye(2)).T) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("nu", [-0.9, 0.0, 0.3, 0.5])
@pytest.mark.parametrize("part", [0.0, 0.4, 1.0])
def test_any_part_of_the_area_constraint_may_be_shear_springs(nu, part):
    """Axial, shear and rotational springs together are the linear triangle, whatever the shear springs take of it."""
    mesh, _ = some_triangles()
    bulk, shear = 1 / (2 * (1 - nu)), 1 / (2 * (1 + nu))
    slip = part * bulk * (1 - 3 * nu) / (1 + nu)
    angles = AngleEnergy(mesh.points, mesh.triangles, angle_moduli(mesh, bulk, shear, slip))
    here = mesh.points[mesh.triangles]
    a, b = np.roll(here, -1, axis=1) - here, np.roll(here, 1, axis=1) - here
    cotangents = (a * b).sum(axis=2) / (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
    form = slip_form(mesh, slip * cotangents)
    slips = BiquadraticEnergy(mesh.points, mesh.triangles, form[:, [0, 1, 2], [0, 1, 2]], form[:, [1, 2, 0], [2, 0, 1]])
    mine = st.Springs(1.0, mesh.sum_to_edges({3: bulk * cotangents}), (angles, slips))
    theirs = st.DEFINITIONS["delingette"].springs(mesh, st.Material(1.0, nu), 1.0)
    tangents = [one.reference * free_network(mesh, one).tangent().toarray() for one in (mine, theirs)]
    assert np.abs(tangents[0] - tangents[1]).max() < 1e-9 * np.abs(tangents[1]).max()


def test_on_the_lattice_rotational_springs_are_those_of_angular_and_with_shear_springs_there_are_none():
    mesh, nu = lattice(6, 4, 2e-3), 0.2
    mine, theirs = (st.DEFINITIONS[name].springs(mesh, st.Material(1.0, nu), 1.0) for name in ("ielsm", "angular"))
    assert mine.reference == pytest.approx(theirs.reference, rel=1e-9)
    np.testing.assert_allclose(mine.relative, theirs.relative, rtol=1e-9)
    np.testing.assert_allclose(
        mine.energies[0].modulus, np.repeat(theirs.energies[0].modulus[:, None], 3, axis=1), rtol=1e-9
    )
    bulk, shear = 1 / (2 * (1 - nu)), 1 / (2 * (1 + nu))
    none = angle_moduli(mesh, bulk, shear, bulk * (1 - 3 * nu) / (1 + nu))
    assert np.abs(none).max() < 1e-9 * np.abs(angle_moduli(mesh, bulk, shear)).max()


def test_sides_opposite_right_angles_have_no_axial_spring():
    """Rounding of cot 90 degrees is no spring; the diagonals' are left out of files."""
    mesh = patch("right")
    springs = st.DEFINITIONS["ielsm"].springs(mesh, st.Material(1.0, 0.3), 1.0)
    diagonal = mesh.edge_lengths > 1.2 * mesh.edge_lengths.min()
    assert (springs.relative[diagonal] == 0).all() and (springs.relative[~diagonal] > 0.5 * 3**0.5 / 2).all()


def test_delaunay_triangles_have_no_negative_axial_spring_inside():
    mesh, copied = some_triangles()
    springs = st.DEFINITIONS["ielsm"].springs(mesh, st.Material(1.0, 0.3), 1.0)
    ends = np.sort(copied[mesh.edges], axis=1) @ [len(mesh.points), 1]
    _, pairs = np.unique(ends, return_inverse=True)
    assert springs.relative.min() < 0 < np.bincount(pairs, springs.relative).min()  # with its copy across the outline


# -- LAMMPS's volume factor --------------------------------------------------------------------------------------------


def lammps_stress(edges, vectors, count, area, k, factor, strain):
    """Stress [N/m] of a strained lattice by the force between bonded particles in LAMMPS's manual, two-dimensional."""
    moved = vectors @ (np.eye(2) + strain).T
    rest, now = (np.linalg.norm(one, axis=1) for one in (vectors, moved))
    volumes, rests = (np.bincount(edges.ravel(), np.repeat(one**2, 2), count) for one in (now, rest))
    both, both_rest = (one[edges].sum(axis=1) for one in (volumes, rests))
    repulsion = k * (rest - now) + factor * (np.sqrt(both / both_rest) - now / rest)
    forces = np.zeros((count, 2))
    pairs = (-repulsion / now)[:, None] * moved
    np.add.at(forces, edges[:, 0], pairs)
    np.add.at(forces, edges[:, 1], -pairs)
    assert np.abs(forces).max() < 1e-6 * np.abs(pairs).max()  # at rest: an even strain is the equilibrium
    return np.einsum("ea,eb->ab", pairs, moved) / area


def periodic_lattice(columns, rows, edge=1.0):
    """Particles of an equilateral lattice of one period; `rows` are even."""
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    points = edge * np.stack([(i + 0.5 * (j % 2)).ravel(), (j * 3**0.5 / 2).ravel()], axis=1)
    return points, columns * edge, rows * edge * 3**0.5 / 2


@pytest.mark.parametrize("nu", [-0.5, 0.0, 0.2, 1 / 3, 0.45])
@pytest.mark.parametrize("edge", [1.0, 0.25])
def test_lammps_volume_factor_has_the_moduli_that_it_is_given(nu, edge):
    """With E t = 1; ``a_v`` is a times the shear stiffness of 'normal-shear'."""
    points, length, height = periodic_lattice(6, 4, edge)
    mesh, copied = periodic_delaunay(points, length, height)
    k, factor = 1 / (3**0.5 * (1 - nu)), edge * (1 - 3 * nu) / (3**0.5 * (1 - nu**2))
    # Each edge once: copies have the same ends and vector.
    ends, vectors = copied[mesh.edges], np.diff(mesh.points[mesh.edges], axis=1)[:, 0]
    turn = np.where(ends[:, 0] > ends[:, 1], -1, 1)[:, None]
    rows = np.column_stack([np.sort(ends, axis=1), (turn * vectors / edge).round(6)])
    _, once = np.unique(rows, axis=0, return_index=True)
    assert len(once) == 3 * len(points)
    size = 1e-6
    strains = size * np.array([[[1, 0], [0, 0]], [[0, 0], [0, 1]], [[0, 0.5], [0.5, 0]]])
    stress = partial(lammps_stress, ends[once], vectors[once], len(points), mesh.area, k, factor)
    stresses = [stress(strain) / size for strain in strains]
    stiffness = np.array([[one[0, 0], one[1, 1], one[0, 1]] for one in stresses])
    np.testing.assert_allclose(stiffness, st.Material(1.0, nu).plane_stress, atol=2e-5)  # of second order in the strain
