"""Sheets of any anisotropy, and bodies of several materials: closed forms, linear triangles, what springs cannot."""

from functools import partial

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as some

import springtune as st
from periodic import affine_stiffness
from springtune.mechanics.continuum import PatchTest
from springtune.mesh.cells import signed_areas
from springtune.mesh.rows import lattice
from springtune.springs.parts import derive_by_parts

from problems import free_network
from tables import cases, slow_but

THICKNESS = 2e-3
PLY = st.AnisotropicMaterial.orthotropic("140 GPa", "10 GPa", 0.3, "5 GPa", name="ply")
BOARD = st.AnisotropicMaterial("9 GPa", "4 GPa", "1.5 GPa", "2 GPa", name="board")


def random_stiffness(generator, scale=1e9):
    """Symmetric, positive definite, its eigenvalues within two decades."""
    turned, _ = np.linalg.qr(generator.standard_normal((3, 3)))
    return scale * turned * 10 ** generator.uniform(-1, 1, 3) @ turned.T


def random_mesh(generator):
    """Free triangles of any shape: each particle moved by up to a third of the shortest edge at it."""
    mesh = st.MESH_TYPES["free"](0.02, 0.01, 3e-3)
    moved = mesh.points + mesh.edge_lengths.min() / 3 * generator.uniform(-0.7, 0.7, mesh.points.shape)
    return st.Mesh(moved, mesh.triangles)


def braced(ratio, turn=0.0):
    """Rectangles with both diagonals, so many times as long as high, turned."""
    mesh = st.MESH_TYPES["braced"](0.02, 0.01, 2e-3)
    c, s = np.cos(turn), np.sin(turn)
    return st.Mesh(mesh.points * [ratio, 1] @ np.array([[c, s], [-s, c]]), mesh.triangles, mesh.quads)


def affine(name, mesh, material):
    """Stiffness in plane stress of a definition's network, were all particles to follow an even strain [Pa]."""
    springs = st.DEFINITIONS[name].springs(mesh, material, THICKNESS)
    return affine_stiffness(mesh, springs) * springs.reference / THICKNESS


def differ(found, wanted):
    return np.abs(found - wanted).max() / np.abs(wanted).max()


@pytest.mark.parametrize("ratio", [0.8, 1.0, 1.2])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
def test_flechons_areas_complete_the_bulk_modulus(ratio, nu):
    """E / (2 (1 - nu)), and G."""
    found = affine("flechon", braced(ratio), st.Material(3.0, nu))
    assert (found[0, 0] + found[1, 1] + 2 * found[0, 1]) / 4 == pytest.approx(3 / (2 * (1 - nu)), rel=1e-9)
    assert found[2, 2] == pytest.approx(3 / (2 * (1 + nu)), rel=1e-9)


# -- exact constructions -----------------------------------------------------------------------------------------------


@settings(max_examples=12)
@given(seed=some.integers(0, 2**31))
def test_delingette_at_rest_is_the_linear_triangle_of_any_material(seed):
    generator = np.random.default_rng(seed)
    mesh, elasticity = random_mesh(generator), random_stiffness(generator)
    springs = st.DEFINITIONS["delingette"].springs(mesh, st.AnisotropicMaterial.of(elasticity), THICKNESS)
    ours = springs.reference * free_network(mesh, springs).tangent().toarray()
    expected = np.zeros(ours.shape)
    for corners, area in zip(mesh.triangles, signed_areas(mesh.points, mesh.triangles)):
        sides = mesh.points[corners[[2, 0, 1]]] - mesh.points[corners[[1, 2, 0]]]
        slopes = np.stack([-sides[:, 1], sides[:, 0]]) / (2 * area)
        strain = np.zeros((3, 6))
        strain[0, ::2] = strain[2, 1::2] = slopes[0]
        strain[1, 1::2] = strain[2, ::2] = slopes[1]
        places = np.stack([2 * corners, 2 * corners + 1], axis=1).ravel()
        expected[np.ix_(places, places)] += THICKNESS * area * strain.T @ elasticity @ strain
    assert np.linalg.norm(ours - expected) <= 1e-9 * np.linalg.norm(expected)


@settings(max_examples=15)
@given(seed=some.integers(0, 2**31), amplitude=some.floats(1e-5, 5e-4))
def test_delingette_is_saint_venant_kirchhoff_of_any_material_at_any_strain(seed, amplitude):
    generator = np.random.default_rng(seed)
    mesh, elasticity = random_mesh(generator), random_stiffness(generator)
    springs = st.DEFINITIONS["delingette"].springs(mesh, st.AnisotropicMaterial.of(elasticity), THICKNESS)
    moved = amplitude * generator.standard_normal(mesh.points.shape)
    rest, now = mesh.points[mesh.triangles], (mesh.points + moved)[mesh.triangles]
    rest, now = ((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1) for corners in (rest, now))
    gradient = now @ np.linalg.inv(rest)
    green = 0.5 * (gradient.transpose(0, 2, 1) @ gradient - np.eye(2))
    strain = np.stack([green[:, 0, 0], green[:, 1, 1], 2 * green[:, 0, 1]], axis=1)
    density = 0.5 * np.einsum("ni,ij,nj->n", strain, elasticity, strain)
    expected = THICKNESS * (density * signed_areas(mesh.points, mesh.triangles)).sum()
    # Green's strain is a difference of numbers of order one: its rounding over the strain, some 0.01.
    assert springs.reference * springs.energies[0].value(moved) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", ["delingette", "delingette-tensile", "element-fit", "energy-fit"])
@pytest.mark.parametrize("nu", [-0.3, 0.0, 0.3, 0.5])
def test_isotropic_constants_give_the_isotropic_springs(name, nu):
    mesh, steel = st.MESH_TYPES["free"](0.02, 0.01, 3e-3), st.Material(210e9, nu)
    theirs = st.DEFINITIONS[name].springs(mesh, steel, THICKNESS)
    ours = st.DEFINITIONS[name].springs(mesh, st.AnisotropicMaterial.of(steel.plane_stress), THICKNESS)
    for one, other in zip(
        (ours.relative, *(energy.tensile for energy in ours.energies)),
        (theirs.relative, *(energy.tensile for energy in theirs.energies)),
    ):
        wanted = theirs.reference * other
        assert np.abs(ours.reference * one - wanted).max() <= 1e-9 * np.abs(wanted).max()


@settings(max_examples=30)
@example(1.0, 17.0, 0.5, 0.0, 1.0, 0.8131451486559444)
@given(
    along=some.floats(1, 50), across=some.floats(1, 50), shear=some.floats(0.1, 3), coupling=some.floats(-0.9, 0.9),
    ratio=some.floats(0.5, 2), turn=some.floats(-3, 3),
)  # fmt: skip
def test_orthotropic_rectangles_have_all_four_constants(along, across, shear, coupling, ratio, turn):
    """Affine energies to rounding, wherever no spring is negative; and the network relaxes to nothing else."""
    mesh = braced(ratio, turn)
    material = st.AnisotropicMaterial(along, across, coupling * min(along, across), shear).rotated(turn)
    try:
        found = affine("orthotropic", mesh, material)
    except st.DefinitionError as error:
        assert "negative stiffness" in str(error)
        own = material.rotated(-turn)
        rest = own.C12 - own.C66
        assert min(own.C11 - rest - own.C66 * ratio**2, own.C22 - rest - own.C66 / ratio**2) < 1e-9 * along
        return
    assert differ(found, material.plane_stress) <= 1e-9
    springs = st.DEFINITIONS["orthotropic"].springs(mesh, material, THICKNESS)
    relaxed = PatchTest(mesh).stiffness(springs) * springs.reference / THICKNESS
    assert differ(relaxed, material.plane_stress) <= 1e-9


def test_orthotropic_squares_have_the_closed_form():
    mesh = braced(1.0)
    springs = st.DEFINITIONS["orthotropic"].springs(mesh, BOARD, THICKNESS)
    stiffness, cells = springs.reference * springs.relative, mesh.cell_edges[4]
    inside = (mesh.cells_per_edge[cells[:, :4]] == 2).all(axis=1)  # sides that two squares share
    wanted = THICKNESS * np.array([7.5e9, 2.5e9, 7.5e9, 2.5e9, 2e9, 2e9])  # C11 - C12, C22 - C12, C66
    assert inside.any()
    assert stiffness[cells[inside]] == pytest.approx(np.tile(wanted, (inside.sum(), 1)), rel=1e-9)
    assert springs.reference * springs.energies[0].modulus == pytest.approx(THICKNESS * (1.5e9 - 2e9), rel=1e-9)


@settings(max_examples=20)
@given(along=some.floats(1, 20), across=some.floats(0.6, 20), shear=some.floats(0.2, 0.99))
def test_springs_alone_are_exact_for_cauchy_materials_on_rows_made_for_them(along, across, shear):
    """C12 = C66: rows of height a/2 sqrt(C22 / C12), and rectangles of a ratio between two bounds."""
    shear *= np.sqrt(along * across)
    material = st.AnisotropicMaterial(along, across, shear, shear)
    rows = lattice(5, 4, 1e-3, 0.5e-3 * np.sqrt(across / shear))
    springs = st.DEFINITIONS["energy-fit"].springs(rows, material, THICKNESS)
    assert springs.relative.min() >= 0
    whole = PatchTest(rows).stiffness(springs) * springs.reference / THICKNESS
    assert differ(whole, material.plane_stress) <= 1e-9
    rectangles = braced((along / across) ** 0.25)  # between sqrt(C12 / C22) and sqrt(C11 / C12), their geometric mean
    assert differ(affine("energy-fit", rectangles, material), material.plane_stress) <= 1e-9


def test_energy_fit_is_the_least_of_relative_energies():
    """Every other set of springs of a triangle has the larger norm, negative ones excluded."""
    generator = np.random.default_rng(2)
    triangle = st.Mesh(np.array([[0, 0], [1, 0.1], [0.3, 0.9]]), np.array([[0, 1, 2]]))
    for material in (BOARD, PLY, PLY.rotated("30 deg")):
        values, vectors = np.linalg.eigh(material.plane_stress)
        root = vectors / np.sqrt(values) @ vectors.T

        def norm(stiffness, root=root):
            return np.linalg.norm(root @ stiffness @ root - np.eye(3))

        springs = st.DEFINITIONS["energy-fit"].springs(triangle, material, THICKNESS)
        best = norm(affine_stiffness(triangle, springs) * springs.reference / THICKNESS)
        ones = [type(springs)(1.0, row) for row in np.eye(3)]
        unit = [affine_stiffness(triangle, one) * springs.reference / THICKNESS for one in ones]
        for _ in range(200):
            other = np.abs(springs.relative + 0.1 * springs.relative.max() * generator.standard_normal(3))
            assert norm(np.einsum("i,ijk->jk", other, unit)) >= best * (1 - 1e-9)


@settings(max_examples=40)
@given(
    along=some.floats(1, 10), across=some.floats(1, 10), coupling=some.floats(0.05, 0.9), shear=some.floats(0.05, 1),
    mesh=some.sampled_from([braced(1.0), braced(1.5), lattice(2, 2), st.MESH_TYPES["free"](0.02, 0.01, 4e-3)]),
)  # fmt: skip
def test_no_springs_alone_are_nearer_than_the_bound(along, across, coupling, shear, mesh):
    """On whatever mesh, before anything relaxes, some strain's energy is off by |C12 - C66| / (C66 + sqrt(C11 C22))."""
    mean = np.sqrt(along * across)
    material = st.AnisotropicMaterial(along, across, coupling * mean, shear * mean)
    values, vectors = np.linalg.eigh(material.plane_stress)
    root = vectors / np.sqrt(values)
    for name in ("energy-fit", "element-fit"):
        found = affine(name, mesh, material)
        error = np.abs(np.linalg.eigvalsh(root.T @ found @ root) - 1).max()
        assert error >= abs(coupling - shear) / (shear + 1) - 1e-9


# -- moduli ------------------------------------------------------------------------------------------------------------


@settings(max_examples=10)
@given(seed=some.integers(0, 2**31))
def test_outline_stiffness_is_that_of_linear_triangles_on_any_mesh(seed):
    generator = np.random.default_rng(seed)
    mesh, material = random_mesh(generator), st.AnisotropicMaterial.of(random_stiffness(generator))
    found = st.moduli(mesh, material, "delingette")
    assert found.stiffness_error <= 1e-9
    assert np.isnan([found.young_modulus_error, found.poisson_ratio, found.shear_modulus_error]).all()


@pytest.mark.parametrize("name", ["lattice", "van-gelder", "element-fit", "energy-fit", "uniform", "patch"])
def test_springs_alone_obey_cauchy_and_relax_below_the_affine_stiffness(name):
    mesh = st.MESH_TYPES["free"](0.04, 0.02, 3e-3)
    springs = st.DEFINITIONS[name].springs(mesh, st.Material(1.0, 0.3), 1.0)
    upper, found = affine_stiffness(mesh, springs), PatchTest(mesh).stiffness(springs)
    assert upper[0, 1] == pytest.approx(upper[2, 2], rel=1e-9)
    values = np.linalg.eigvalsh(upper - found)
    assert values.min() >= -1e-9 * upper.max() and values.max() > 1e-4 * upper.max()


def test_springs_of_stress_that_depends_on_the_load_have_no_stiffness():
    mesh = braced(1.0)
    assert np.isnan(st.moduli(mesh, st.Material(1.0, 0.3), "baudet-corrected").stiffness).all()
    assert st.moduli(mesh, st.Material(1.0, 0.3), "area").stiffness_error <= 1e-9


def test_adjoint_brings_springs_alone_nearer_to_what_is_not_cauchy():
    mesh = st.MESH_TYPES["free"](0.04, 0.0133, 2.5e-3)
    fitted, searched = (st.moduli(mesh, BOARD, name).stiffness_error for name in ("energy-fit", "adjoint"))
    assert searched < 0.6 * fitted


# -- refusals ----------------------------------------------------------------------------------------------------------


def test_springs_that_are_just_not_there_are_no_negative_ones():
    """Isotropic, so C11 - C12 + C66 = 3 C66: no springs along sides of sqrt(3) to 1."""
    steel = st.Material(210e9, 0.3)
    edge = np.sqrt(3.0)
    for ratio in (edge, edge * (1 - 1e-15), edge * (1 + 1e-15)):
        springs = st.DEFINITIONS["orthotropic"].springs(braced(ratio), steel, THICKNESS)
        assert springs.relative.min() >= 0 and (springs.relative < 1e-9).any()
        assert differ(affine("orthotropic", braced(ratio), steel), steel.plane_stress) <= 1e-9


def test_orthotropic_is_exact_on_the_rectangles_that_its_refusal_names():
    """See tests/refused_calls.yaml: 1.155 to 3.279."""
    stiff = st.AnisotropicMaterial(9.0, 1.0, 1.2, 0.8)
    for ratio in (1.156, 3.278):
        assert differ(affine("orthotropic", braced(ratio), stiff), stiff.plane_stress) <= 1e-9


# -- several materials -------------------------------------------------------------------------------------------------


def halves(mesh, axis):
    """Two parts: cells beyond the middle along an axis are the part ``far``."""
    middle = 0.5 * (mesh.points[:, axis].min() + mesh.points[:, axis].max())
    far = {count: mesh.points[corners][..., axis].mean(axis=1) > middle for count, corners in mesh.cells.items()}
    return st.GroupedMesh(mesh, parts={"far": far})


def derived(name, grouped, main, far):
    """Springs of a definition on two parts of other materials."""
    return derive_by_parts(st.DEFINITIONS[name], grouped, {"": main, "far": far}, THICKNESS)


ADDITIVE = [name for name, one in st.DEFINITIONS.items() if not one.needs and not one.uniaxial]
NOT_ADDITIVE = {*"density oriented adjoint peridynamic force-balance best-springs".split()}
NOT_ADDITIVE |= {name for name in st.DEFINITIONS if name.startswith("patch")}
"""Definitions that count or test the springs of each part alone."""


@pytest.mark.parametrize("name", slow_but({*ADDITIVE} - {"adjoint"}, ADDITIVE))
def test_parts_of_equal_materials_are_one_body(name):
    cells = st.DEFINITIONS[name].cells
    mesh = st.MESH_TYPES["structured" if 3 in cells else "braced"](0.04, 0.0104, 2e-3)  # six rows
    made = partial(st.Rubber, (1 / 6, -0.01, 1e-3)) if name == "yeoh" else partial(st.Material, 1.0, 1 / 3)
    one, other = made(name="one"), made(name="other")
    if name == "axis-exact":
        mesh = st.MESH_TYPES["braced"](0.04, 0.0104, 2e-3)
    whole = st.DEFINITIONS[name].springs(mesh, one, THICKNESS)
    parts = derive_by_parts(st.DEFINITIONS[name], halves(mesh, 1), {"": one, "far": other}, THICKNESS)
    ours, theirs = (one.reference * free_network(mesh, one).tangent().toarray() for one in (parts, whole))
    wrong = np.linalg.norm(ours - theirs) / np.linalg.norm(theirs)
    assert wrong <= (0.5 if name in NOT_ADDITIVE else 1e-9)
    assert (parts.linear_springs is None) == (whole.linear_springs is None)
    if whole.linear_springs is not None:
        linear = (one.reference * one.linear_springs for one in (parts, whole))
        np.testing.assert_allclose(*linear, rtol=1e-9, atol=1e-9 * THICKNESS)
    same = derive_by_parts(st.DEFINITIONS[name], halves(mesh, 1), {"": one, "far": one}, THICKNESS)
    assert (same.relative == whole.relative).all() and same.reference == whole.reference


STRIPS = {name: st.MESH_TYPES[name](0.04, 0.012, 2e-3) for name in ("right", "braced")}
STIFF = st.AnisotropicMaterial(7.0, 3.0, 0.0, 2.0)


@cases
def test_strips_of_two_materials_have_the_moduli_of_both(name, mesh, axis, main, far, wanted):
    springs = derived(name, halves(mesh, axis), main, far)
    young, ratio = PatchTest(mesh).axial(springs)
    assert (young * springs.reference / THICKNESS, ratio) == pytest.approx(wanted, abs=1e-8)


def test_rubber_of_two_tests_in_one_body_keeps_the_law_and_the_range_of_each():
    """Other numbers of terms and other ends of the data; an answer says of the part that is beyond its own."""
    mesh = st.MESH_TYPES["right"](0.04, 0.012, 2e-3)
    soft, stiff = st.Rubber((1e5,), largest=0.5, name="soft"), st.Rubber((2e5, -5e2, 40.0), largest=50.0, name="stiff")
    springs = derive_by_parts(st.DEFINITIONS["yeoh"], halves(mesh, 0), {"": soft, "far": stiff}, THICKNESS)
    (energy,) = springs.energies
    there = mesh.points[energy.corners][..., 0].mean(axis=1) > 0.02
    found = springs.reference / THICKNESS * energy.coefficients
    assert found[there] == pytest.approx(np.tile(stiff.coefficients, (there.sum(), 1)), rel=1e-9)
    assert found[~there] == pytest.approx(np.tile([1e5, 0, 0], ((~there).sum(), 1)), rel=1e-9)
    # I_1 - 3 of 50 % in one direction, the other held: 2.25 + 1 + 1 / 2.25 - 3.
    assert energy.objection(mesh.points * [0.5, 0]) == (
        f"extrapolated: {(~there).sum()} of {len(there)} triangles are stretched beyond the test data, to I1 - 3 = "
        "0.694 where the data end at 0.5"
    )
