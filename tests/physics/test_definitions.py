"""Each definition against the moduli that it must have: closed forms where there are any, else measured tables."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from springtune.mechanics.moduli import PatchTest, ends, mean_gradient
from springtune.mechanics.network import Network
from springtune.mesh import MESH_TYPES, ROW_HEIGHT, Mesh, lattice, signed_areas
from springtune.problem.geometry import Beam
from springtune.problem.materials import Material, Rubber
from springtune.springs import DEFINITIONS, DefinitionError, Springs, definition
from springtune.springs.base import not_negative
from springtune.springs.element_fit import least_squares
from springtune.springs.identification import Misfit, patch_cases
from springtune.springs.lattice import predicted_stiffness
from springtune.springs.searched import adjoint
from springtune.studies.runs import driver, store
from springtune.studies.runs.task_costs import TaskCosts

HEIGHT, SIZE = 20e-3, 2e-3
RATIOS = (0.3, 1 / 3, 0.49)
EVERY_RATIO = (0.0, 0.2, 0.25, 0.3, 1 / 3, 0.45, 0.49, 0.5)


def patch(mesh_type, length=0.1):
    """Mesh of ten cells over the height: of the exact lattice for rows of triangles, on which closed forms hold."""
    size = HEIGHT / (10 * ROW_HEIGHT) if mesh_type == "structured" else SIZE
    if mesh_type != "structured" and not mesh_type.startswith("isosceles"):
        return MESH_TYPES[mesh_type](length, HEIGHT, size)
    row_height = MESH_TYPES[mesh_type].row_height * size
    return lattice(round(length / size), round(HEIGHT / row_height), size, row_height)


def errors(name, mesh, nu):
    """Error of E and G [1], and the effective Poisson's ratio."""
    material = Material(1.0, nu, name="unit")
    springs = DEFINITIONS[name].springs(mesh, material, 1.0)
    young, ratio = PatchTest(mesh).axial(springs)
    shear = PatchTest(mesh).shear(springs)
    return young * springs.reference - 1, ratio, shear * springs.reference * 2 * (1 + nu) - 1


# -- closed forms ------------------------------------------------------------------------------------------------------

ON_LATTICE = {
    # name: E over the asked one
    "uniform": lambda nu: 1.1,  # 1 + sqrt(3)/2 a/H = 1 + 1/rows
    "oriented": lambda nu: 1.0,
    "lattice": lambda nu: 1.0,
    "lloyd": lambda nu: 1.0,
    "van-gelder": lambda nu: 1.0,
    "van-gelder-general": lambda nu: (3 - nu) / (3 * (1 - nu**2)),
    "delingette-tensile": lambda nu: (10 - 6 * nu) / (9 * (1 - nu**2)),
    "element-fit": lambda nu: 8 / (9 * (1 - nu**2)),
    "patch": lambda nu: 1.0,
}


@pytest.mark.parametrize("nu", EVERY_RATIO)
@pytest.mark.parametrize("name", ON_LATTICE)
def test_springs_alone_on_the_lattice(name, nu):
    young, ratio, _ = errors(name, patch("structured"), nu)
    assert 1 + young == pytest.approx(ON_LATTICE[name](nu), rel=1e-9)
    assert ratio == pytest.approx(1 / 3, rel=1e-9)  # Cauchy's relation: whatever was asked


@pytest.mark.parametrize("nu", EVERY_RATIO)
@pytest.mark.parametrize("name", ["area", "angular", "delingette", "neo-hooke", "patch-area"])
def test_any_poisson_ratio_is_exact_on_the_lattice(name, nu):
    young, ratio, shear = errors(name, patch("structured"), nu)
    assert (young, ratio, shear) == pytest.approx((0, nu, 0), abs=1e-9)


@pytest.mark.parametrize(
    "name", sorted({name for name, one in DEFINITIONS.items() if one.needs != "cases"} - {"adjoint"})
)
@pytest.mark.parametrize("factor", [2.0**-12, 2.0**12])
def test_stiffnesses_do_not_depend_on_the_size_of_the_sheet(name, factor):
    """In the plane no length enters E t; powers of two round nothing."""
    law = Rubber((1 / 6,)) if name == "yeoh" else Material(1.0, 1 / 3, name="unit")
    mesh = MESH_TYPES["structured" if 3 in DEFINITIONS[name].cells else "braced"](0.03, 0.01, 2.5e-3)
    if name == "axis-exact":
        mesh = MESH_TYPES["braced"](0.03, 0.01, 2.5e-3)
    one, other = (
        DEFINITIONS[name].springs(Mesh(size * mesh.points, mesh.triangles, mesh.quads), law, 1.0, 1.0)
        for size in (1.0, factor)
    )
    assert other.reference == pytest.approx(one.reference, rel=1e-12)
    np.testing.assert_allclose(other.relative, one.relative, rtol=1e-9)
    assert one.evaluations == other.evaluations and (one.evaluations == 0) != name.startswith("patch")
    assert name != "patch" or one.evaluations == 1


def test_ends_of_rows_carry_what_a_strip_of_their_area_does():
    """Half triangles at the ends of rows: each gives its edge across its area over the square of it."""
    mesh = MESH_TYPES["isosceles-0.3"](0.03, 0.01, 2e-3)
    relative = DEFINITIONS["axis-exact"].springs(mesh, Material(1.0, 0.3, name="unit"), 1.0).relative
    across = np.abs(np.diff(mesh.points[mesh.edges, 0])[:, 0]) < 1e-9
    areas = mesh.sum_to_edges({3: np.repeat(signed_areas(mesh.points, mesh.triangles)[:, None], 3, axis=1)})
    assert across.sum() > 4 and mesh.on_outline[across].all()
    np.testing.assert_allclose(relative[across], (areas / mesh.edge_lengths**2)[across], rtol=1e-9)


@pytest.mark.parametrize("name", ["delingette", "delingette-tensile"])
def test_delingettes_springs_are_those_of_the_lattice_where_nothing_couples(name):
    """At nu = 1/3 on equilateral triangles; 2 L^2 k are spring constants at rest."""
    mesh, material = patch("structured"), Material(3.0, 1 / 3, name="any")
    ours, theirs = (DEFINITIONS[one].springs(mesh, material, 2.0) for one in (name, "lattice"))
    np.testing.assert_allclose(ours.reference * ours.linear_springs, theirs.reference * theirs.relative, rtol=1e-9)


def test_definitions_are_what_they_are_declared_to_be():
    """One stiffness, a stress across the load, the law at finite strain: asked of the springs themselves."""
    uniform, lateral, lawful = set(), set(), set()
    for name, one in DEFINITIONS.items():
        if one.needs == "cases":
            continue
        mesh = MESH_TYPES["braced" if 4 in one.cells else "alternating"](0.03, 0.01, 2.5e-3)
        law = Rubber((1 / 6,)) if name == "yeoh" else Material(1.0, 0.3, name="unit")
        found = one.springs(mesh, law, 1.0, 1.0)
        if not found.energies and np.ptp(found.relative) == 0:
            uniform.add(name)
        if found.lateral:
            lateral.add(name)
        # Of all, a law of rubber alone has no energy inside out.
        if any(not np.isfinite(energy.value(-2.0 * mesh.points * [1, 0])) for energy in found.energies):
            lawful.add(name)
    asked = {name: one for name, one in DEFINITIONS.items() if one.needs != "cases"}
    assert uniform == {name for name, one in asked.items() if one.uniform}
    assert lateral == {name for name, one in asked.items() if one.uniaxial}
    assert lawful == {name for name, one in asked.items() if one.finite_strain}


@pytest.mark.parametrize("nu", EVERY_RATIO)
@pytest.mark.parametrize("mesh_type", ["free", "right", "alternating", "isosceles-0.3"])
def test_delingette_is_exact_on_every_mesh(mesh_type, nu):
    young, ratio, shear = errors("delingette", patch(mesh_type), nu)
    assert (young, ratio, shear) == pytest.approx((0, nu, 0), abs=1e-9)


@pytest.mark.parametrize("nu", EVERY_RATIO)
def test_area_is_exact_on_squares_with_both_diagonals(nu):
    young, ratio, shear = errors("area", patch("braced"), nu)
    assert (young, ratio, shear) == pytest.approx((0, nu, 0), abs=1e-9)


@settings(max_examples=15)
@given(nu=st.floats(0, 0.5), shape=st.floats(0.75, 1.33))
def test_rectangles(nu, shape):
    columns = 12
    mesh = MESH_TYPES["braced"](columns * shape * SIZE, HEIGHT, SIZE)
    stretched = Mesh(mesh.points * [columns * shape * SIZE / mesh.points[:, 0].max(), 1], mesh.triangles, mesh.quads)
    for name in ("area", "baudet-corrected"):
        young, ratio, shear = errors(name, stretched, nu)
        assert (young, ratio, shear) == pytest.approx((0, nu, 0), abs=1e-9)
    _, _, shear = errors("flechon", stretched, nu)
    assert shear == pytest.approx(0, abs=1e-9)
    young, ratio, _ = errors("lattice", stretched, nu)
    assert (young, ratio) == pytest.approx((0, 1 / 3), abs=1e-9)


@pytest.mark.parametrize("nu", [0.2, 0.3, 1 / 3, 0.45, 0.49, 0.5])
def test_axis_exact_on_squares(nu):
    young, ratio, shear = errors("axis-exact", patch("braced"), nu)
    assert (young, ratio, 1 + shear) == pytest.approx((0, nu, 2 * nu / (1 - nu)), abs=1e-9)


@pytest.mark.parametrize(("mesh_type", "nu"), [("isosceles-0.3", 0.3), ("isosceles-0.5", 0.5), ("structured", 1 / 3)])
def test_axis_exact_on_rows_made_for_it(mesh_type, nu):
    young, ratio, shear = errors("axis-exact", patch(mesh_type), nu)
    assert (young, ratio, 1 + shear) == pytest.approx((0, nu, 2 * nu / (1 - nu)), abs=1e-9)


@pytest.mark.parametrize("name", ["uniform", "lattice", "van-gelder", "element-fit", "delingette-tensile", "patch"])
def test_mesh_fixes_poisson_ratio_of_rows(name):
    """Only the row springs carry a load along the rows: nu = (a / 2h)^2."""
    assert errors(name, patch("isosceles-0.5"), 0.2)[1] == pytest.approx(0.5, rel=1e-9)
    assert errors(name, patch("right"), 0.2)[1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("mesh_type", ["structured", "free", "right", "alternating", "braced", "isosceles-0.5"])
@pytest.mark.parametrize("name", ["patch", "patch-area"])
def test_patch_makes_young_modulus_exact_on_any_mesh(name, mesh_type):
    assert errors(name, patch(mesh_type), 0.45)[0] == pytest.approx(0, abs=1e-9)


# -- measured tables (E and G in %, effective nu) for nu = .3, 1/3, .49 -----------------------------------------------

TABLE = {
    ("structured", "density"): ((5.6, 5.6, 5.6), (0.333, 0.333, 0.333), None),
    ("right", "uniform"): ((-4.7, -4.7, -4.7), (0, 0, 0), None),
    ("right", "lattice"): ((-13.4, -13.4, -13.4), (0, 0, 0), None),
    ("right", "van-gelder"): ((0, 0, 0), (0, 0, 0), None),
    ("right", "van-gelder-general"): ((9.9, 12.5, 31.6), (0, 0, 0), None),
    ("right", "delingette-tensile"): ((48.3, 50, 65.1), (0, 0, 0), None),
    ("right", "element-fit"): ((16.3, 18.5, 36), (0, 0, 0), None),
    ("right", "density"): ((-19.9, -19.9, -19.9), (0, 0, 0), None),
    ("right", "oriented"): ((0, 0, 0), (0, 0, 0), None),
    ("right", "area"): ((-17, -13.4, -0.4), (-0.066, 0, 0.285), None),
    ("right", "angular"): ((-13, -13.4, -34.9), (0.025, 0, -0.346), None),
    ("alternating", "uniform"): ((22.7, 22.7, 22.7), None, None),
    ("alternating", "lattice"): ((13.8, 13.8, 13.8), (0.314, 0.314, 0.314), None),
    ("alternating", "van-gelder"): ((19.1, 19.1, 19.1), (0.191, 0.191, 0.191), None),
    ("alternating", "van-gelder-general"): ((25.6, 28, 46), (0.143, 0.137, 0.109), None),
    ("alternating", "delingette-tensile"): ((77.5, 78.7, 91.9), (0.197, 0.191, 0.162), None),
    ("alternating", "element-fit"): ((27.5, 30.1, 49.8), (0.097, 0.098, 0.101), None),
    ("alternating", "density"): ((3.1, 3.1, 3.1), None, None),
    ("alternating", "oriented"): ((-1.3, -1.3, -1.3), None, None),
    ("alternating", "area"): ((13.9, 13.8, 13.4), (0.283, 0.314, 0.464), None),
    ("alternating", "angular"): ((10.6, 13.8, 35), (0.303, 0.314, 0.357), None),
    ("braced", "uniform"): ((38.9, 38.9, 38.9), None, (125.2, 130.9, 158.1)),
    ("braced", "lattice"): ((0, 0, 0), (0.333, 0.333, 0.333), (-2.5, 0, 11.75)),
    ("braced", "lloyd"): ((-11.8, -11.8, -11.8), (0.412, 0.412, 0.412), (13.75, 16.7, 30.4)),
    ("braced", "element-fit"): ((-16.4, -14.8, -2.4), (0.402, 0.404, 0.413), (4.1, 9.5, 44.6)),
    ("braced", "baudet"): ((-1.7, 0, 6.8), (0.345, 0.333, 0.288), (0, 0, 0)),
    ("braced", "axis-exact"): ((0, 0, 0), (0.3, 0.333, 0.49), (-14.3, 0, 92.2)),
}


@pytest.mark.parametrize(("mesh_type", "name"), TABLE)
def test_measured_moduli(mesh_type, name):
    youngs, ratios, shears = TABLE[mesh_type, name]
    found = np.array([errors(name, patch(mesh_type), nu) for nu in RATIOS])
    assert 100 * found[:, 0] == pytest.approx(youngs, abs=0.1)
    if ratios:
        assert found[:, 1] == pytest.approx(ratios, abs=1e-3)
    if shears:
        assert 100 * found[:, 2] == pytest.approx(shears, abs=0.1)


@pytest.mark.parametrize("name", ["lattice", "van-gelder", "area", "angular", "delingette-tensile"])
def test_free_meshes_are_a_few_percent_off(name):
    """Disorder, some 3 %, does not vanish with the mesh size; measured on netgen's meshes of a/H = .1."""
    young, ratio, _ = errors(name, patch("free"), 0.3)
    assert abs(young) < 0.035
    assert ratio == pytest.approx(0.3 if name in ("area", "angular") else 1 / 3, abs=0.025)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**31), springs=st.integers(1, 6))
def test_least_squares_of_cells_are_those_of_lawson_and_hanson(seed, springs):
    generator = np.random.default_rng(seed)
    columns, goals = generator.standard_normal((20, 7, springs)), generator.standard_normal((20, 7))
    found = least_squares(columns.transpose(0, 2, 1) @ columns, np.einsum("nij,ni->nj", columns, goals))
    expected = [nnls(one, goal)[0] for one, goal in zip(columns, goals)]
    np.testing.assert_allclose(found, expected, atol=1e-9)


# -- patch tests -------------------------------------------------------------------------------------------------------


@given(gradient=st.tuples(*[st.floats(-1, 1)] * 4))
@settings(max_examples=20)
def test_mean_gradient_of_an_affine_field(gradient):
    gradient = np.reshape(gradient, (2, 2))
    for mesh_type in ("free", "braced"):
        mesh = MESH_TYPES[mesh_type](0.03, 0.01, 2e-3)
        assert np.allclose(mean_gradient(mesh, mesh.points @ gradient.T), gradient, atol=1e-12)


def test_ends_of_straight_and_staggered_meshes():
    mesh = lattice(5, 3)
    left, right = ends(mesh)
    assert left.tolist() == [0, 6, 12, 18] and right.tolist() == [5, 11, 17, 23]
    mesh = MESH_TYPES["free"](0.03, 0.01, 2e-3)
    for found, x in zip(ends(mesh), (0.0, 0.03)):
        assert found.tolist() == np.flatnonzero(mesh.points[:, 0] == x).tolist()


# -- refusals ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name, definition in DEFINITIONS.items() if definition.cells != (3, 4)])
def test_cells_that_a_definition_cannot_have_are_refused(name):
    definition = DEFINITIONS[name]
    mesh = MESH_TYPES["braced" if definition.cells == (3,) else "structured"](0.03, 0.01, 2e-3)
    with pytest.raises(DefinitionError, match="needs (triangles|rectangles).*mesh type"):
        definition.springs(mesh, Material(1.0, 0.3, name="unit"), 1.0)


@pytest.mark.parametrize("thickness", [0.0, -1.0, True, "1 mm", np.nan, np.inf])
def test_what_is_no_thickness_is_refused(thickness):
    with pytest.raises(DefinitionError, match="thickness: .* is not a number above zero"):
        DEFINITIONS["lattice"].springs(lattice(2, 2), Material(1.0, 0.3), thickness)


@pytest.mark.parametrize("reference", [0.0, np.inf, np.nan, True, "1 N/m"])
def test_what_is_no_reference_stiffness_is_refused(reference):
    with pytest.raises(DefinitionError, match="reference stiffness .* is not a number above zero"):
        Springs(reference, np.ones(3))


@pytest.mark.parametrize("relative", [[1.0], np.ones((2, 1)), np.array([1.0, np.nan]), np.array([np.inf])], ids=repr)
def test_what_are_no_relative_stiffnesses_is_refused(relative):
    with pytest.raises(DefinitionError, match=r"(?s)relative stiffnesses .* are not finite"):
        Springs(1.0, relative)


UNIFORM = {"paper", "calibrated", "uniform", "density", "oriented"}


def test_what_definitions_without_a_word_can_do():
    """All that the decorator takes for granted, and that a wrong default would change without a word."""
    assert DEFINITIONS["lattice"].cells == (3, 4)
    assert {name for name, one in DEFINITIONS.items() if one.finite_strain} == {"neo-hooke", "yeoh"}
    assert {name for name, one in DEFINITIONS.items() if one.uniform} == UNIFORM
    assert all(DEFINITIONS[name].anisotropic for name in ("adjoint", "annealed", "evolved", "paper"))


@pytest.mark.parametrize("name", ["lattice", "patch", "patch-fit", "element-fit", "energy-fit", "area", "delingette"])
def test_springs_are_as_stiff_as_the_sheet_is_thick(name):
    mesh, steel = MESH_TYPES["structured"](0.03, 0.01, 2.5e-3), Material(210e9, 0.3, name="steel")
    thin, thick = (DEFINITIONS[name].springs(mesh, steel, thickness) for thickness in (1e-3, 3e-3))
    # The product is rounded twice.
    np.testing.assert_allclose(thick.reference * thick.relative, 3 * thin.reference * thin.relative, rtol=1e-14)


def test_springs_of_no_stiffness_are_springs_and_none_is_their_measure():
    assert Springs(1.0, np.array([0.0, 1.0])).spring_ratio == np.inf
    assert Springs(1.0, np.array([0.5, 4.0])).spring_ratio == 8.0
    assert not_negative(np.array([0.0, 1.0])).tolist() == [0.0, 1.0]


@pytest.mark.parametrize("wrong", [{"cells": (5,)}, {"cells": ()}, {"cells": "34"}, {"needs": "luck"}], ids=repr)
def test_what_is_no_declaration_is_refused(wrong):
    with pytest.raises(ValueError, match="definition 'none of ours': .*; give"):
        definition("none of ours", **wrong)(lambda mesh, material, thickness: None)
    assert "none of ours" not in DEFINITIONS


def test_rounding_does_not_choose_the_corner_that_is_held():
    """A regular polygon has two lowest corners of equal x + y; coordinates differ by rounding among processors."""
    angles, noise = np.arange(12) * np.pi / 6, np.random.default_rng(1)
    points = np.vstack([np.zeros(2), np.column_stack([np.cos(angles), np.sin(angles)])])
    triangles = np.array([[0, i + 1, (i + 1) % 12 + 1] for i in range(12)])
    held = {
        patch_cases(
            Mesh(points * (1 + noise.uniform(-1e-15, 1e-15, points.shape)), triangles),
            Material(1.0, 0.3, name="unit"),
            1.0,
        )[0].held.tobytes()
        for _ in range(20)
    }
    assert len(held) == 1


@pytest.mark.parametrize("corner", [[0.5, 0.0], [0.0, 0.5], [0.5, 0.5]], ids=str)
def test_quadrilaterals_that_are_no_rectangles_are_refused(corner):
    """Opposite sides may be equal and diagonals not, as of a sheared square, or the other way round."""
    square, sheared = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]), np.array([[0, 0], [1, 0], [1.5, 1], [0.5, 1.0]])
    quads = np.array([[0, 1, 2, 3]])
    moved = square + [[0, 0], [0, 0], corner, [0, 0]]
    for points in (moved, sheared, np.array([[0, 0], [1, 0], [0.8, 1], [0.2, 1.0]])):
        with pytest.raises(DefinitionError, match="needs rectangles and the mesh has other quadrilaterals"):
            DEFINITIONS["baudet"].springs(Mesh(points, np.zeros((0, 3), int), quads), Material(1.0, 0.3), 1.0)


def test_slender_rectangles_are_refused():
    mesh = MESH_TYPES["braced"](0.04, 0.01, 2e-3)
    slender = Mesh(mesh.points * [2.5, 1], mesh.triangles, mesh.quads)
    for name in ("baudet", "flechon", "lattice", "axis-exact"):
        with pytest.raises(DefinitionError, match="negative stiffness"):
            DEFINITIONS[name].springs(slender, Material(1.0, 0.3, name="unit"), 1.0)
    with pytest.raises(DefinitionError, match=r"needs squares.*of 5 x 2 mm"):
        DEFINITIONS["lloyd"].springs(slender, Material(1.0, 0.3, name="unit"), 1.0)


@pytest.mark.parametrize(
    ("name", "nu", "ratio"), [("lattice", 0.3, 3**0.5), ("baudet", 0.5, 3.5**0.5), ("axis-exact", 0.25, 2.0)]
)
def test_sides_without_stiffness_are_not_refused_by_rounding(name, nu, ratio):
    """In whatever unit: before, rounding of the coordinates decided which of these meshes are taken."""
    mesh = MESH_TYPES["braced"](0.04, 0.01, 2e-3)
    for factor in np.random.default_rng(1).uniform(0.1, 10, 20):
        scaled = Mesh(mesh.points * [ratio * factor, factor], mesh.triangles, mesh.quads)
        made = DEFINITIONS[name].springs(scaled, Material(1.0, nu, name="unit"), 1.0)
        assert (made.relative == 0).sum() == 20 * 6  # the edges along x


@pytest.mark.parametrize(("ratio", "taken"), [(1.015, True), (1.025, False), (0.975, False)])
def test_lloyds_squares_may_be_off_by_two_percent(ratio, taken):
    mesh = MESH_TYPES["braced"](0.04, 0.01, 2e-3)
    nearly = Mesh(mesh.points * [ratio, 1], mesh.triangles, mesh.quads)
    if taken:
        assert DEFINITIONS["lloyd"].springs(nearly, Material(1.0, 0.3, name="unit"), 1.0).relative.min() > 0
    else:
        with pytest.raises(DefinitionError, match="needs squares"):
            DEFINITIONS["lloyd"].springs(nearly, Material(1.0, 0.3, name="unit"), 1.0)


def test_axis_exact_refuses_rectangles_that_are_turned():
    mesh = patch("braced")
    turned = Mesh(mesh.points @ [[0.8, 0.6], [-0.6, 0.8]], mesh.triangles, mesh.quads)
    with pytest.raises(DefinitionError, match="sides along x and y"):
        DEFINITIONS["axis-exact"].springs(turned, Material(1.0, 0.3, name="unit"), 1.0)


def test_obtuse_triangles_are_refused_where_they_make_a_spring_negative():
    mesh = lattice(6, 4, row_height=0.3)
    with pytest.raises(DefinitionError, match="negative stiffness.*obtuse"):
        DEFINITIONS["van-gelder-general"].springs(mesh, Material(1.0, 0.5, name="unit"), 1.0)


def test_axis_exact_names_the_rows_that_it_needs():
    with pytest.raises(DefinitionError, match=r"nu = 0.333 and the material 0.49; use rows of height 0.7143 mm"):
        DEFINITIONS["axis-exact"].springs(lattice(5, 4, 1e-3), Material(1.0, 0.49, name="unit"), 1.0)
    with pytest.raises(DefinitionError, match="isosceles"):
        DEFINITIONS["axis-exact"].springs(MESH_TYPES["free"](0.03, 0.01, 2e-3), Material(1.0, 0.3, name="unit"), 1.0)
    with pytest.raises(DefinitionError, match="above 0"):
        DEFINITIONS["axis-exact"].springs(patch("braced"), Material(1.0, 0.0, name="unit"), 1.0)


def test_axis_exact_names_the_row_that_is_furthest_off():
    """One row of another height: of nu = 0.2 among rows of 0.45."""
    mesh = lattice(5, 4, 1e-3)
    rows = np.rint(mesh.points[:, 1] / mesh.points[:, 1].max() * 4).astype(int)
    heights = 0.5e-3 / np.sqrt([0.46, 0.2, 0.45, 0.44])
    uneven = Mesh(np.stack([mesh.points[:, 0], np.append(0, np.cumsum(heights))[rows]], axis=1), mesh.triangles)
    with pytest.raises(DefinitionError, match=r"nu = 0.2 and the material 0.45;.*for bases of 1 mm"):
        DEFINITIONS["axis-exact"].springs(uneven, Material(1.0, 0.45, name="unit"), 1.0)


@pytest.mark.parametrize(("load", "excess"), [("traction", 1), ("compression", 1), ("bending", 3)])
def test_predicted_stiffness_is_that_of_the_lattice_less_the_full_outlines(load, excess):
    beam, material = Beam(0.2, 0.04, 1e-3, "200x40"), Material(3e9, 0.3, name="any")
    inside = np.sqrt(3) / 2 * 3e9 * 1e-3
    expected = inside / (1 + excess * np.sqrt(3) / 2 * 5e-3 / 0.04)
    assert predicted_stiffness(material, beam, 5e-3, load) == pytest.approx(expected, rel=1e-12)
    assert all(np.isnan(predicted_stiffness(material, beam, 5e-3, one)) for one in ("pressure", "follower-pressure"))


# -- identification ----------------------------------------------------------------------------------------------------


def test_gradient_of_the_misfit_is_exact():
    mesh = MESH_TYPES["free"](0.03, 0.01, 2.5e-3)
    material = Material(5.0, 0.45, name="any")
    misfit = Misfit(mesh, material, 2.0, patch_cases(mesh, material, 2.0))
    generator = np.random.default_rng(1)
    here, direction = 0.3 * generator.standard_normal((2, len(mesh.edges)))
    _, slope = misfit.evaluate(here)
    difference = (misfit(here + 1e-5 * direction) - misfit(here - 1e-5 * direction)) / 2e-5
    assert difference == pytest.approx(slope @ direction, rel=1e-7)


def test_a_network_that_does_not_move_misses_half_of_each_case():
    """J = 1/2 sum |u - u*|^2 / |u*|^2 at u = 0, which springs 1e12 times as stiff as asked come near to."""
    mesh, material = MESH_TYPES["free"](0.03, 0.01, 2.5e-3), Material(5.0, 0.45, name="any")
    misfit = Misfit(mesh, material, 2.0, patch_cases(mesh, material, 2.0))
    assert misfit(np.full(len(mesh.edges), np.log(1e12))) == pytest.approx(3 / 2, rel=1e-9)
    assert misfit.evaluations == 1


STANDING = {"on a side": [[1, 0], [0, 1]], "on a corner": [[0.5, 1], [-0.5, 1]], "leaning": [[-0.2, 1], [-0.6, 0.9]]}


@pytest.mark.parametrize("sides", STANDING.values(), ids=STANDING)
def test_patch_cases_are_met_by_linear_triangles(sides):
    """Their displacements are linear, so a network equal to linear triangles has no misfit, however the body stands."""
    mesh, material = MESH_TYPES["free"](0.03, 0.01, 2.5e-3), Material(5.0, 0.45, name="any")
    mesh = Mesh(mesh.points @ sides + [0.05, 0.0], mesh.triangles)
    springs = DEFINITIONS["delingette"].springs(mesh, material, 2.0)
    for case in patch_cases(mesh, material, 2.0):
        network = Network(mesh, case.held, springs.relative, springs.energies)
        found = network.expand(network.rest_factor.solve(network.reduce(case.forces / springs.reference)))
        assert np.abs(found - case.displacements).max() <= 1e-11 * np.abs(case.displacements).max()
        assert np.abs(case.forces.sum(axis=0)).max() <= 1e-12 * np.abs(case.forces).max()


@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_adjoint_reaches_poisson_ratios_that_springs_cannot(nu):
    mesh, material = MESH_TYPES["free"](0.04, 0.0133, 2.5e-3), Material(1.0, nu, name="unit")
    springs = adjoint(mesh, material, 1.0)
    young, ratio = PatchTest(mesh).axial(springs)
    assert young * springs.reference == pytest.approx(1, abs=0.03)
    # 150 particles: with 373 of them .307 and .484 have been reached.
    assert ratio == pytest.approx(nu, abs=0.04)
    assert springs.spring_ratio <= 100.0 * 2  # bounds of ten each way, about outline springs of half weight
    assert 10 < springs.evaluations <= 450


@pytest.mark.parametrize("name", ["annealed", "evolved"])
def test_searches_are_repeatable_and_better_than_their_start(name):
    mesh, material = MESH_TYPES["free"](0.03, 0.01, 5e-3), Material(1.0, 0.45, name="unit")
    cases = patch_cases(mesh, material, 1.0)
    first, second = (DEFINITIONS[name].function(mesh, material, 1.0, cases, 200) for _ in "ab")
    assert (first.relative == second.relative).all()
    assert first.evaluations <= 200
    misfit = Misfit(mesh, material, 1.0, cases)
    assert misfit(np.log(first.relative / misfit.start)) < misfit(np.zeros(len(mesh.edges)))


@pytest.mark.slow
def test_adjoint_reaches_in_two_seconds_what_annealing_does_not_in_3000_evaluations():
    mesh, material = MESH_TYPES["free"](0.04, 0.01, 1.15e-3), Material(1.0, 0.3, name="unit")
    cases = patch_cases(mesh, material, 1.0)
    misfit = Misfit(mesh, material, 1.0, cases)
    found = {
        "adjoint": DEFINITIONS["adjoint"].springs(mesh, material, 1.0),
        "annealed": DEFINITIONS["annealed"].function(mesh, material, 1.0, cases, 3000),
    }
    left = {name: misfit(np.log(springs.relative / misfit.start)) for name, springs in found.items()}
    assert left["adjoint"] < 0.5 * left["annealed"]


# -- the stage ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mesh_type", ["structured", "isosceles-0.3", "braced"])
def test_stage_measures_the_mesh_that_is_made(tmp_path, mesh_type):
    """Rows fitted to a box are no exact lattice: on 100 x 20 mm at 2 mm, E is off by +3.3 % and nu is .356."""
    box = {"length": 0.1, "height": HEIGHT}
    asked = [{"key": "one", "definition": "lattice", "poisson_ratio": 0.3}]
    patch = {"name": "one", "mesh": box | {"mesh_type": mesh_type, "mesh_size": SIZE}, "tasks": asked}
    driver.run("studies.kinds.moduli.solve", {"folder": str(tmp_path), "files": [patch]}, TaskCosts())
    found = store.read(tmp_path / "one.h5", ["one"])["one"]
    young, ratio, shear = errors("lattice", MESH_TYPES[mesh_type](**box, size=SIZE), 0.3)
    measured = found["young_modulus_error"], found["effective_poisson_ratio"], found["shear_modulus_error"]
    assert measured == pytest.approx((young, ratio, shear), rel=1e-9)
    if mesh_type == "structured":
        assert measured[:2] == pytest.approx((0.033, 0.356), abs=5e-4)
