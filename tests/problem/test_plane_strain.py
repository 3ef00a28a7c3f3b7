"""Plane strain: closed forms of patches, lattices, rings and beams, and CalculiX."""

import numpy as np
import pytest
from scipy.optimize import root

import springtune as st
from springtune.mechanics.network import Network
from springtune.prediction.choices import references
from springtune.problem.loads import AXIAL
from springtune.reference.finite_shapes import solve_finite_shape
from springtune.reference.finite_strain import solve_finite_strain
from springtune.reference.shapes import solve_shape

from problems import asked, outline, pulled

BEAM = st.Beam("200 mm", "40 mm")
STEEL = st.Material("210 GPa", 0.3, plane="strain", name="steel")
LATTICE = st.Material("210 GPa", 0.25, plane="strain", name="lattice")


def by_lame(material):
    """Stiffness of Hooke's law in three dimensions without strain across."""
    young, nu = material.young_modulus, material.poisson_ratio
    first, shear = young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))
    return np.array([[first + 2 * shear, first, 0], [first, first + 2 * shear, 0], [0, 0, shear]])


@pytest.mark.parametrize("nu", [0.0, 0.25, 0.3, 0.49])
def test_constants_in_the_plane_are_hookes_law_without_strain_across(nu):
    """Saint-Venant and Kirchhoff's law takes the same stiffness, by Green's strains, and so its lambda of 3-D."""
    material = st.Material(2.0, nu, plane="strain")
    np.testing.assert_allclose(material.in_plane.plane_stress, by_lame(material), rtol=1e-9)
    assert material.in_plane.in_plane == material.in_plane
    assert st.Material(2.0, nu).in_plane == st.Material(2.0, nu)


@pytest.mark.parametrize("name", ["delingette", "patch-fit", "energy-fit", "element-fit", "van-gelder"])
def test_definitions_take_the_constants_of_the_plane(name):
    mesh, sheet = st.make_mesh(BEAM, "free", "10 mm"), STEEL.in_plane
    ours, alike = (st.DEFINITIONS[name].springs(mesh, one, 1e-3, given(name, mesh, one)) for one in (STEEL, sheet))
    np.testing.assert_array_equal(ours.reference * ours.relative, alike.reference * alike.relative)


def given(name, mesh, material):
    from springtune.springs.identification import patch_cases

    return patch_cases(mesh, material, 1e-3) if st.DEFINITIONS[name].needs else None


def test_linear_triangles_have_the_moduli_of_plane_strain():
    found = st.moduli(st.make_mesh(BEAM, "free", "10 mm"), STEEL, "delingette")
    np.testing.assert_allclose(found.stiffness, by_lame(STEEL), rtol=1e-9, atol=1e-9 * 210e9)
    assert abs(found.young_modulus_error) < 1e-9
    assert found.poisson_ratio == pytest.approx(0.3 / 0.7)


def equilateral(count, side):
    """Parallelogram of equilateral triangles."""
    i, j = np.divmod(np.arange((count + 1) ** 2), count + 1)
    points = side * np.stack([i + 0.5 * j, np.sqrt(3) / 2 * j], axis=1)
    low = np.flatnonzero((i < count) & (j < count))
    right, up = low + count + 1, low + 1
    return st.Mesh(points, np.concatenate([np.stack([low, right, up], 1), np.stack([right, right + 1, up], 1)]))


def test_springs_alone_are_exact_at_a_ratio_of_one_quarter():
    """On an equilateral lattice, whose area energy vanishes: K_A = lambda - G."""
    mesh = equilateral(6, 0.005)
    springs = st.DEFINITIONS["area"].springs(mesh, LATTICE, 1e-3)
    assert springs.energies == ()
    np.testing.assert_allclose(springs.reference, np.sqrt(3) / 2 * 224e9 * 1e-3)
    found = st.moduli(mesh, LATTICE, "lattice")
    assert abs(found.young_modulus_error) < 1e-9
    assert abs(found.shear_modulus_error) < 1e-9
    assert found.poisson_ratio == pytest.approx(1 / 3)
    stiff = st.DEFINITIONS["area"].springs(mesh, STEEL, 1e-3)
    lame = by_lame(STEEL)
    np.testing.assert_allclose(stiff.reference * stiff.energies[0].modulus, (lame[0, 1] - lame[2, 2]) * 1e-3)


def test_a_reference_is_that_of_calculix():
    """8.62447 mm by 200 x 40 elements CPE8, which are too stiff at the corners of the clamp."""
    scene = st.Scene(BEAM, st.make_mesh(BEAM, "structured", "5 mm"), STEEL, "traction", "400 kN", kinematics="linear")
    assert 1e3 * scene.reference().displacement == pytest.approx(8.62447, rel=1e-4)


def test_a_slender_beam_bends_by_the_modulus_of_the_plane():
    beam = st.Beam("1000 mm", "10 mm")
    found, known = (references(beam, one, ["bending"])["bending"].value for one in (STEEL, STEEL.in_plane))
    assert found == known
    thin = references(beam, st.Material("210 GPa", 0.3), ["bending"])["bending"].value
    assert found / thin == pytest.approx(1 - 0.3**2, rel=2e-4)  # shear bends it, too


def test_a_ring_under_pressure_widens_as_lame_says():
    """A quarter of a thick pipe; the mean of u cos over the bore is 2 / pi of the radial displacement."""
    inner, outer, pressure = 0.01, 0.03, 1e6
    corners = [(inner, 0.0), (outer, 0.0), (0.0, outer), (0.0, inner)]
    sides = outline(*zip(corners, ("lower", "outer", "left", "bore"), (None, (0.0, 0.0)) * 2))
    rollers, bore = [st.Support("lower", y=0.0), st.Support("left", x=0.0)], asked(bore="displacement bore x")
    burst = st.LoadCase("burst", rollers, pressures=[st.Pressure("bore", pressure)], quantities=bore)
    found = solve_shape(st.Shape("pipe", 1e-3, sides, loads={"burst": burst}), burst, {"": STEEL}).values["bore"]
    young, nu, square = 210e9, 0.3, inner**2 / (outer**2 - inner**2)
    widened = (1 + nu) / young * pressure * square * ((1 - 2 * nu) * inner + outer**2 / inner)
    assert found == pytest.approx(2 / np.pi * widened, rel=1e-6)


@pytest.mark.parametrize("force", [0.01, 8.0])
def test_a_reference_at_finite_strain_takes_the_plane_of_its_material(force):
    rubber = st.Material("1 MPa", 0.45, plane="strain")
    ours = solve_finite_strain(BEAM, rubber, force, AXIAL)
    asked = solve_finite_strain(BEAM, st.Material("1 MPa", 0.45), force, AXIAL, plane="strain")
    assert ours.displacement == asked.displacement
    if force < 1:
        small = st.Scene(BEAM, st.make_mesh(BEAM, "right", "20 mm"), rubber, "traction", force).reference()
        assert ours.displacement == pytest.approx(small.displacement, rel=1e-3)


def test_coupled_triangles_have_saint_venants_energy_in_three_dimensions():
    """Of Green's strain without a part across the plane: lambda/2 (tr G)^2 + mu G : G, at any strain."""
    mesh, clay = st.make_mesh(st.Beam(0.1, 0.02), "free", "5 mm"), st.Material(2e6, 0.45, plane="strain")
    springs = st.DEFINITIONS["delingette"].springs(mesh, clay, 1e-3)
    network = Network(mesh, np.zeros(mesh.points.shape, dtype=bool), springs.relative, springs.energies)
    gradient = np.array([[1.4, 0.3], [-0.2, 0.7]])
    green = 0.5 * (gradient.T @ gradient - np.eye(2))
    first, shear = 2e6 * 0.45 / (1.45 * 0.1), 2e6 / 2.9
    energy = (0.5 * first * np.trace(green) ** 2 + shear * np.sum(green**2)) * 1e-3 * mesh.area
    found = springs.reference * network.energy_over_k(mesh.points @ (gradient - np.eye(2)).T)
    assert found == pytest.approx(energy, rel=1e-9)


def test_a_shape_at_finite_strain_is_in_the_plane_of_its_material():
    """An even pull between rollers: neo-Hooke's stresses of stretches a along, b across and 1 out of the plane."""
    rubber, length, height, force = st.Material(1e6, 0.4, plane="strain"), 0.1, 0.04, 20.0
    shear, bulk = 1e6 / 2.8, 1e6 / 0.6

    def stresses(stretches):
        volume, total = np.prod(stretches), 1 + np.sum(stretches**2)
        even = shear * volume ** (-2 / 3) * (stretches - total / (3 * stretches))
        return even + bulk * (volume - 1) * stretches[::-1] - [force / (height * 1e-3), 0]

    case = pulled(force, 0.0, supports=(st.Support("left", x=0.0), st.Support("lower", y=0.0)))
    shape = st.Shape.rectangle(length, height, loads={"pull": case})
    found = solve_finite_shape(shape, case, {"": rubber}).values["end"]
    assert found == pytest.approx((root(stresses, [1.3, 0.8], tol=1e-12).x[0] - 1) * length, rel=1e-9)
    sheet = solve_finite_shape(shape, case, {"": rubber}, law="st-venant").values["end"]
    stretched = root(
        lambda a: a * (a**2 - 1) / 2 * rubber.in_plane.young_modulus - force / (height * 1e-3), 1.3, tol=1e-12
    )
    assert sheet == pytest.approx((stretched.x[0] - 1) * length, rel=1e-9)
