"""The neo-Hookean reference: its energy, closed forms, CalculiX's number and the limit of small strain."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy.optimize import brentq, minimize_scalar

import springtune as st
from springtune.problem.loads import AXIAL, BENDING, FACE, SHEAR
from springtune.problem.materials import Material
from springtune.problem.shapes import Beam
from springtune.reference import finite_strain
from springtune.reference.answers import elastica
from springtune.reference.finite_shapes import solve_finite_shape
from springtune.reference.finite_strain import FiniteStrainError, law_of, solve_finite_strain
from springtune.reference.shapes import solve_shape
from springtune.reference.small_strain import solve_small_strain

from problems import asked, outline
from tables import cases

BLOCK = Beam(0.2, 0.04, 1e-3, "200x40")

gradients = some.tuples(*[some.floats(-0.25, 0.25)] * 4).map(lambda values: np.eye(2) + np.reshape(values, (2, 2)))


def piola(material, f):
    """First Piola-Kirchhoff stress at a deformation gradient."""
    green = (f.T @ f - np.eye(2)) / 2
    xx, yy, xy = material.response(np.array([green[0, 0], green[1, 1], 2 * green[0, 1]])).stress
    return f @ np.array([[xx, xy], [xy, yy]])


def piola_change(material, f, d):
    """Its derivative along d, by the material's tangent."""
    green, change = (f.T @ f - np.eye(2)) / 2, (f.T @ d + d.T @ f) / 2
    found = material.response(np.array([green[0, 0], green[1, 1], 2 * green[0, 1]]))
    xx, yy, xy = found.stress
    d_xx, d_yy, d_xy = found.tangent @ np.array([change[0, 0], change[1, 1], 2 * change[0, 1]])
    return d @ np.array([[xx, xy], [xy, yy]]) + f @ np.array([[d_xx, d_xy], [d_xy, d_yy]])


def energy(f, nu, plane):
    """Energy density, its stretch across found by minimising over a fine bracket."""
    shear = 1 / (2 * (1 + nu))
    area = np.linalg.det(f)
    if nu == 0.5:
        return shear / 2 * ((f * f).sum() + area**-2 - 3)
    bulk = 1 / (3 * (1 - 2 * nu))

    def whole(across):
        volume = area * across
        return shear / 2 * (volume ** (-2 / 3) * ((f * f).sum() + across**2) - 3) + bulk / 2 * (volume - 1) ** 2

    if plane == "strain":
        return whole(1.0)
    return minimize_scalar(whole, bounds=(0.3 / area, 3.0 / area), method="bounded", options={"xatol": 1e-13}).fun


@pytest.mark.parametrize(
    ("nu", "plane"), [(0.3, "stress"), (0.49, "stress"), (0.5, "stress"), (0.3, "strain"), (0.49, "strain")]
)
@settings(max_examples=10)
@given(f=gradients, d=some.tuples(*[some.floats(-1, 1)] * 4))
def test_stress_and_tangent_are_derivatives(nu, plane, f, d):
    d = np.reshape(d, (2, 2))
    material = law_of(Material(1.0, nu), plane)
    stress = piola(material, f)
    step = 1e-5
    slope = (energy(f + step * d, nu, plane) - energy(f - step * d, nu, plane)) / (2 * step)
    # Differences leave step^2 and rounding over the step; moduli are up to 17 E at nu = .49.
    assert slope == pytest.approx((stress * d).sum(), abs=2e-7)
    change = (piola(material, f + step * d) - piola(material, f - step * d)) / (2 * step)
    assert change == pytest.approx(piola_change(material, f, d), abs=2e-6)


def test_nodes_of_one_line_may_differ_by_rounding():
    """One beam in 800 ended in an error: two nodes of a line were rounded to different digits."""
    found = solve_finite_strain(Beam(16.6756, 1.0, 1e-3, "b"), Material(1e9, 0.3, name="any"), 100.0, kind=AXIAL)
    # The bar's, less what the clamp takes: .01 of a height.
    assert found.displacement == pytest.approx(100.0 * 16.6756 / (1e9 * 1e-3), rel=1e-3)


def test_incompressible_bar_stretches_as_by_hand():
    """Far from the clamp uniaxial tension: P = E/3 (l - l^-2); clamped at one end of a long bar."""
    bar = Beam(0.08, 0.01, 1e-3, "bar")
    stretch = 1.5
    force = 1e6 / 3 * (stretch - stretch**-2) * bar.height * bar.thickness
    found = solve_finite_strain(bar, Material(1e6, 0.5, name="rubber"), force, kind=AXIAL)
    assert found.displacement == pytest.approx(0.5 * bar.length, rel=0.02)


@cases
def test_the_estimate_under_pressure_covers_the_error(plane, nu, aspect_ratio, strain, finer):
    """`finer`: the displacement by 14 elements over half the height, not 8, which leaves a fifth of the error."""
    beam, material = Beam(aspect_ratio * 0.02, 0.02, 1e-3, "any"), Material(1e6, nu, name="any")
    force = strain * 1e6 * beam.length * beam.thickness
    found = solve_finite_strain(beam, material, force, plane=plane, follower=True)
    assert abs(found.displacement / finer - 1) <= found.error_estimate


@cases
@pytest.mark.parametrize("aspect_ratio", [1, 30])
def test_small_strain_is_the_limit_of_any_shape(kind, stress, nu, aspect_ratio):
    beam, material = Beam(aspect_ratio * 0.01, 0.01, 1e-3, "any"), Material(1e6, nu, name="any")
    force = stress * 1e6 * beam.thickness * (beam.length if kind in (SHEAR, FACE) else beam.height)
    finite = solve_finite_strain(beam, material, force, kind=kind)
    small = solve_small_strain(beam, material, force, kind=kind)
    assert finite.displacement == pytest.approx(small.displacement, rel=1e-4)
    # It is an estimate of the elements' error; strains and turns of the order of 1e-6 come to 1e-6 besides.
    assert abs(finite.displacement / small.displacement - 1) <= finite.error_estimate + 1e-5


@cases
def test_slender_cantilevers_are_elasticas(nu, load):
    """The clamp shortens a beam by up to .014 of its height; as in small strain, which then takes shear along."""
    apart = []
    for slenderness in (25, 50):
        beam, material = Beam(slenderness * 0.01, 0.01, 1e-3, "b"), Material(1e9, nu, name="any")
        force = load * material.young_modulus * beam.thickness * beam.height**3 / 12 / beam.length**2
        finite = solve_finite_strain(beam, material, force, kind=BENDING)
        small = solve_small_strain(beam, material, force, kind=BENDING)
        assert finite.error_estimate <= 5e-5
        shortened = load * (3 * small.displacement / (load * beam.length)) ** (2 / 3)
        apart.append(finite.displacement / small.displacement / (3 * elastica(shortened) / shortened) - 1)
    # The fibres stretch by half the load over the slenderness, and what that does is of second order in it.
    assert abs(apart[1]) <= 0.5 * load / 50**2 + 2e-5
    assert abs(apart[1]) <= abs(apart[0]) / 3 + 2e-5


def test_bending_is_odd_in_the_force():
    rubber = Material(1e6, 0.45, name="rubber")
    up, down = (solve_finite_strain(BLOCK, rubber, force, kind=BENDING) for force in (0.02, -0.02))
    assert up.displacement == pytest.approx(-down.displacement, rel=1e-8)
    assert up.positions[[0, -1]].tolist() == [0, 1] and len(up.profile) == len(up.positions)


def test_a_wide_block_is_in_simple_shear():
    """Neo-Hooke's shear stress is linear in the shear: what is left of a tenth is its square, where the ends are."""
    wide, material = Beam(0.1, 0.01, 1e-3, "wide"), Material(1e6, 0.3, name="any")
    force = 0.1 * 1e6 / 2.6 * wide.length * wide.thickness
    finite, small = (solve(wide, material, force, kind=SHEAR) for solve in (solve_finite_strain, solve_small_strain))
    assert finite.displacement == pytest.approx(0.1 * wide.height, rel=0.06)
    assert 1e-4 < abs(finite.displacement / small.displacement - 1) < 0.1**2


def test_compression_shortens_more_than_it_stretches():
    pulled, pushed = (solve_finite_strain(BLOCK, Material(1e6, 0.5, name="rubber"), f, kind=AXIAL) for f in (1.0, -1.0))
    # P = E/3 (l - 1/l^2) = E (e - e^2 + ...): the even part of e(P) is + P^2 in tension, so -P is shorter by less.
    stress = 1.0 / (1e6 * 0.04e-3)
    even = (pulled.displacement + pushed.displacement) / 2 / BLOCK.length
    assert even == pytest.approx(stress**2, rel=0.1)


def test_a_reference_is_on_the_stable_path():
    """A pressure that pulls on a face and follows it has a largest value, some .2 E here, as in a balloon.

    Newton's method finds an equilibrium under three times as much, behind it.
    """
    beam, rubber = Beam("100 mm", "40 mm"), Material("1 MPa", 0.5, name="rubber")
    solve_finite_strain(beam, rubber, 0.15 * 1e6 * 0.1 * 1e-3, FACE, follower=True)
    with pytest.raises(FiniteStrainError, match="no stable path beyond 3[45]"):
        solve_finite_strain(beam, rubber, 0.6 * 1e6 * 0.1 * 1e-3, FACE, follower=True)


def test_a_finer_mesh_that_may_have_snapped_is_solved_again(monkeypatch):
    pull = partial(solve_finite_strain, Beam("20 mm", "40 mm"), RUBBER, 2.0, kind=AXIAL)
    found = pull()
    monkeypatch.setattr(finite_strain, "PATH_TOLERANCE", -1.0)
    again = pull()
    assert again.displacement == pytest.approx(found.displacement, rel=1e-9)
    assert again.error_estimate == pytest.approx(found.error_estimate, rel=1e-6)


RUBBER = st.Material("1 MPa", 0.5, name="rubber")
PLY = st.AnisotropicMaterial.orthotropic("1 MPa", "0.3 MPa", 0.3, "0.2 MPa", name="ply")
ROLLERS = st.Support("left", x=0), st.Support("lower", y=0)
CLAMP = (st.Support("left", x=0, y=0),)
END, AREA, ENERGY = asked(end="displacement right x", area="area", energy="energy")
LENGTH, HEIGHT, THICKNESS = 0.1, 0.04, 1e-3


def plate(case, holes=(), points=None):
    return st.Shape.rectangle(LENGTH, HEIGHT, holes=holes, points=points or {}, loads={case.name: case})


def solved(case, material=RUBBER, law="rubber", **shape):
    return solve_finite_shape(plate(case, **shape), case, {"": material}, law=law)


def pull(force, supports=ROLLERS, quantities=(END, AREA, ENERGY)):
    return st.LoadCase("pull", supports, [st.Traction("right", (force, 0))], quantities=quantities)


class TestEvenStrain:
    """Between rollers stress and strain are the same everywhere, and known."""

    force = 20.0
    stress = force / (HEIGHT * THICKNESS)

    def check(self, found, stretch, across):
        # 1e-9: polynomials hold an even strain, and Newton's method leaves the square of its last step, 1e-6.
        assert found.values["end"] == pytest.approx((stretch - 1) * LENGTH, rel=1e-9)
        assert found.values["area"] == pytest.approx((stretch * across - 1) * LENGTH * HEIGHT, rel=1e-9)

    def test_incompressible_rubber(self):
        """Stress at rest mu (a - a^-2), energy mu/2 (a^2 + 2/a - 3)."""
        shear = 1e6 / 3
        stretch = brentq(lambda a: shear * (a - a**-2) - self.stress, 1, 5)
        found = solved(pull(self.force))
        self.check(found, stretch, stretch**-0.5)
        energy = shear / 2 * (stretch**2 + 2 / stretch - 3) * LENGTH * HEIGHT * THICKNESS
        assert found.values["energy"] == pytest.approx(energy, rel=1e-9)

    def test_fitted_rubber(self):
        rubber = st.Rubber((0.15e6, -2e3, 100.0), name="fitted")

        def pulled(a):
            excess = a**2 + 2 / a - 3
            slope = sum(n * c * excess ** (n - 1) for n, c in enumerate(rubber.coefficients, 1))
            return 2 * slope * (a - a**-2) - self.stress

        stretch = brentq(pulled, 1, 5)
        self.check(solved(pull(self.force), rubber), stretch, stretch**-0.5)

    def test_orthotropic_sheet(self):
        """St. Venant and Kirchhoff: S = E_x E, stress at rest a S, contraction by Green's strains."""
        strain = brentq(lambda green: np.sqrt(1 + 2 * green) * 1e6 * green - self.stress, 0, 2)
        across = np.sqrt(1 - 2 * 0.3 * strain)
        found = solved(pull(self.force), PLY)
        self.check(found, np.sqrt(1 + 2 * strain), across)
        assert found.values["energy"] == pytest.approx(0.5e6 * strain**2 * LENGTH * HEIGHT * THICKNESS, rel=1e-9)

    def test_stress_is_force_over_the_length_now(self):
        probe = st.Quantity("probe", "stress", "middle", "xx")
        found = solved(pull(self.force, quantities=(END, AREA, probe)), points={"middle": (0.05, 0.02)})
        height = (found.values["area"] / LENGTH / HEIGHT + 1) / (found.values["end"] / LENGTH + 1) * HEIGHT
        assert found.values["probe"] == pytest.approx(self.force / (height * THICKNESS), rel=1e-9)

    def test_pressure_that_follows(self):
        """All around: equal stretches, mu (a - a^-5) = -p a."""
        pressure = -0.2e6
        sides = ("left", "right", "upper", "lower")
        held = st.Support("o", x=0, y=0), st.Support("p", y=0)
        case = st.LoadCase("suck", held, (), [st.Pressure(one, pressure, True) for one in sides], quantities=(AREA,))
        stretch = brentq(lambda a: 1e6 / 3 * (a - a**-5) + pressure * a, 1, 3)
        found = solved(case, points={"o": (0, 0), "p": (LENGTH, 0)})
        assert found.values["area"] == pytest.approx((stretch**2 - 1) * LENGTH * HEIGHT, rel=1e-9)


@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_a_beam_has_its_own_reference(nu):
    """Elements of another kind, on another mesh; within both estimates."""
    beam, rubber = st.Beam("100 mm", "40 mm"), st.Material("1 MPa", nu)
    mesh = st.make_mesh(beam, "structured", "10 mm")
    theirs = st.Scene(beam, mesh, rubber, "traction", "10 N", definition="neo-hooke").reference()
    ours = solved(pull(10.0, CLAMP), rubber)
    both = theirs.error_estimate + ours.error_estimates["end"]
    assert ours.values["end"] == pytest.approx(theirs.displacement, rel=both)


@pytest.mark.parametrize("law", ["rubber", "st-venant"])
@pytest.mark.parametrize("material", [RUBBER, PLY], ids=["rubber", "ply"])
def test_small_strain_is_the_limit(material, law):
    case = pull(1e-3, CLAMP, (END, ENERGY))
    small = solve_shape(plate(case), case, material)
    found = solved(case, material, law)
    # The strain is 2.5e-5: nonlinear terms are of that order; the other part are the estimates, 1e-3 together.
    for name, value in small.values.items():
        assert found.values[name] == pytest.approx(value, rel=1e-3)


def test_the_reaction_is_the_slope_of_the_energy():
    rim = st.Hole.circle(("50 mm", "20 mm"), "8 mm", "rim")

    def drawn(by):
        held = (*CLAMP, st.Support("right", x=by, y=0))
        case = st.LoadCase("draw", held, quantities=(ENERGY, st.Quantity("pull", "reaction", "right", "x")))
        return solved(case, holes=[rim]).values

    step = 1e-3
    slope = (drawn(0.03 + step)["energy"] - drawn(0.03 - step)["energy"]) / (2 * step)
    # Energies of three meshes at most differ by their estimates, up to 1e-4 here, of 0.16 J: 2 % of their difference.
    assert slope == pytest.approx(drawn(0.03)["pull"], rel=5e-3)


@cases
def test_errors_of_networks_vanish_with_the_mesh(definition, load):
    """A sheet with a hole at 30 % strain: with half the edges a quarter of the error is left, and at corners a half."""
    inflated = [st.Pressure("rim", "0.05 MPa", True)]
    cases = pull(8.0, CLAMP, (END, AREA)), st.LoadCase("inflate", CLAMP, (), inflated, quantities=(END, AREA))
    rim = st.Hole.circle(("50 mm", "20 mm"), "8 mm", "rim")
    shape = st.Shape.rectangle(LENGTH, HEIGHT, holes=[rim], loads={one.name: one for one in cases})
    meshes = [st.mesh_shape(shape, size) for size in ("5 mm", "2.5 mm")]
    scenes = [st.Scene(shape, mesh, RUBBER, load, definition=definition) for mesh in meshes]
    coarse, fine = (scene.solve() for scene in scenes)
    assert scenes[0].finite_strain and not scenes[0].objection
    least = 0.08 if load == "inflate" else 0.025  # of a rim with 20 edges
    assert abs(fine.error) < min(0.6 * abs(coarse.error), least)


def test_small_strain_stays_where_it_applies():
    case = pull(0.1, CLAMP, (END,))
    shape = plate(case)
    scene = partial(st.Scene, shape, st.mesh_shape(shape, "10 mm"), RUBBER, "pull")
    found = [scene(definition=name).finite_strain for name in ("neo-hooke", "delingette", "area")]
    assert found == [True, False, False]
    assert not scene(definition="neo-hooke", kinematics="linear").finite_strain


def test_parts_have_laws_of_their_own():
    """A stiff disc in rubber: networks tend to it; a disc of the same rubber makes no difference."""
    disc = st.Hole.circle(("50 mm", "20 mm"), "8 mm", part="disc")
    case = pull(8.0, CLAMP, (END,))
    shape = plate(case, holes=[disc])
    stiff = {"": RUBBER, "disc": st.Material("5 MPa", 0.3, name="stiff")}
    result = st.Scene(shape, st.mesh_shape(shape, "3 mm"), stiff, "pull", definition="neo-hooke").solve()
    assert abs(result.error) < 0.01 and result.scene.finite_strain
    alike, whole = solve_finite_shape(shape, case, dict.fromkeys(stiff, RUBBER)), solved(case)
    estimate = alike.error_estimates["end"] + whole.error_estimates["end"]
    assert alike.values["end"] == pytest.approx(whole.values["end"], rel=estimate)
    assert result.reference().values["end"] < 0.95 * whole.values["end"]


def test_what_is_not_stable_says_where_it_ends():
    case = st.LoadCase("push", CLAMP, [st.Traction("right", (-20, 0))], quantities=(END,))
    with pytest.raises(FiniteStrainError, match=r"shape '100x40', load 'push': no .* beyond .* % of the load"):
        solved(case)


def cook(force):
    sides = outline(((0, 0), ""), ((0.048, 0.044), "right"), ((0.048, 0.060), "upper"), ((0, 0.044), "left"))
    tip = asked(tip="displacement tip y", end="displacement right y")
    case = st.LoadCase("shear", CLAMP, [st.Traction("right", (0, force))], quantities=tip)
    return st.Shape("cook", THICKNESS, sides, points={"tip": (0.048, 0.060)}, loads={"shear": case}), case


@cases
def test_cooks_panel_of_rubber(force, tip, kept):
    """Estimates cover quadratic triangles of another program; from 2 N on the pressed corner of the clamp creases."""
    shape, case = cook(force)
    found = solve_finite_shape(shape, case, {"": RUBBER})
    off, estimate = np.abs(np.array(tip) - found.values["tip"]).max(), found.error_estimates["tip"]
    assert off <= max(estimate, 1e-3) * abs(found.values["tip"])
    assert bool(found.note) == kept == (estimate > 1e-3) and estimate < 0.01


def test_cooks_panel_collapses_as_triangles_get_finer():
    shape, case = cook(4.0)
    why = r"carry it all, and are pressed to 0\.\d+ of their area near \(.*, 4.*\) mm.* need not have a limit"
    with pytest.raises(FiniteStrainError, match=why):
        solve_finite_shape(shape, case, {"": RUBBER})
