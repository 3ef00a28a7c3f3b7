"""The neo-Hookean reference: its energy, closed forms, CalculiX's number and the limit of small strain."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from springtune.geometry import Beam
from springtune.materials import Material
from springtune.reference.finite_strain import FiniteStrainError, NeoHooke, solve_neo_hooke
from springtune.reference.small_strain import solve_small_strain

BLOCK = Beam("200x40", 0.2, 0.04, 1e-3)

gradients = st.tuples(*[st.floats(-0.25, 0.25)] * 4).map(lambda values: np.eye(2) + np.reshape(values, (2, 2)))


def at(f):
    return np.reshape(f, (2, 2, 1, 1))


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
@settings(max_examples=25, deadline=None)
@given(f=gradients, d=st.tuples(*[st.floats(-1, 1)] * 4))
def test_stress_and_tangent_are_derivatives(nu, plane, f, d):
    d = np.reshape(d, (2, 2))
    material = NeoHooke(nu, plane)
    stress = material.state(at(f)).stress[:, :, 0, 0]
    step = 1e-5
    slope = (energy(f + step * d, nu, plane) - energy(f - step * d, nu, plane)) / (2 * step)
    # Differences leave step^2 and rounding over the step; moduli are up to 17 E at nu = .49.
    assert slope == pytest.approx((stress * d).sum(), abs=2e-7)
    change = (material.state(at(f + step * d)).stress - material.state(at(f - step * d)).stress) / (2 * step)
    assert change == pytest.approx(material.state(at(f)).increment(at(d)), abs=2e-6)


@pytest.mark.parametrize("nu", [0.3, 0.49, 0.5])
def test_small_strain_is_the_limit(nu):
    material = Material("any", 1e6, nu)
    for kind, force in (("face", -2e-3), ("axial", 4e-5)):
        finite = solve_neo_hooke(BLOCK, material, force, kind=kind)
        small = solve_small_strain(BLOCK, material, force, kind=kind)
        # Strains of 1e-5 and the coarse elements' error at the corners.
        assert finite.displacement == pytest.approx(small.displacement, rel=2e-4)


def test_traction_of_calculix():
    found = solve_neo_hooke(BLOCK, Material("rubber", 1e6, 0.49), 0.4, kind="axial")
    # CPS8 of 2 mm, neo-Hooke, NLGEOM: 2.00747 mm, 1e-4 too stiff at the corners as in small strain.
    assert found.displacement == pytest.approx(2.00747e-3, rel=2e-4)
    assert found.error_estimate <= 1e-4


def test_incompressible_bar_stretches_as_by_hand():
    """Far from the clamp uniaxial tension: P = E/3 (l - l^-2); clamped at one end of a long bar."""
    bar = Beam("bar", 0.08, 0.01, 1e-3)
    stretch = 1.5
    force = 1e6 / 3 * (stretch - stretch**-2) * bar.height * bar.thickness
    found = solve_neo_hooke(bar, Material("rubber", 1e6, 0.5), force, kind="axial")
    assert found.displacement == pytest.approx(0.5 * bar.length, rel=0.02)


def test_profile_is_symmetric_and_holds_both_displacements():
    found = solve_neo_hooke(BLOCK, Material("rubber", 1e6, 0.49), -20.0, follower=True)
    assert found.positions[[0, -1]].tolist() == [0, 1]
    assert np.allclose(found.profile, found.profile[::-1], rtol=1e-12)
    assert found.displacement == found.profile[len(found.profile) // 2]
    assert found.profile.min() < found.mean_displacement < found.profile.max()


def test_what_cannot_be_solved_says_so():
    with pytest.raises(ValueError, match="plane strain of 'rubber' needs a Poisson's ratio below 0.5"):
        solve_neo_hooke(BLOCK, Material("rubber", 1e6, 0.5), -20.0, plane="strain")
    with pytest.raises(FiniteStrainError, match=r"200x40, rubber: no equilibrium beyond .* % of the load"):
        solve_neo_hooke(BLOCK, Material("rubber", 1e6, 0.49), 1e5, kind="axial")
