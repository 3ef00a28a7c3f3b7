"""The finite-element reference against CalculiX, a program with which it shares nothing."""

import numpy as np
import pytest

from springtune.problem.geometry import Beam
from springtune.problem.loads import AXIAL, BENDING, FACE, SHEAR
from springtune.problem.materials import Material
from springtune.reference import calculix
from springtune.reference.finite_strain import solve_finite_strain
from springtune.reference.small_strain import solve_small_strain

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not calculix.installed(), reason="needs CalculiX (ccx; Debian package calculix-ccx)"),
]


def theirs_of(beam, material, force, size, kind=AXIAL, finite=False):
    """Displacement of the loaded side [m] by serendipity quadrilaterals (CPS8) of even size [m]."""
    points, elements = calculix.quadratic_mesh(beam.length, beam.height, size)
    upper = kind in (SHEAR, FACE)
    along, axis = int(upper), 1 if kind in (BENDING, FACE) else 0
    value = beam.height if upper else beam.length
    shares = calculix.side_weights(points, along, 1 - along, value, quadratic=True)
    load, held = np.zeros(points.shape), np.zeros(points.shape, dtype=bool)
    load[:, axis] = force * shares
    held[points[:, along] == 0.0] = True
    if kind == SHEAR:  # the upper side stays level
        held[np.flatnonzero(shares), 1] = True
    found = calculix.solve(points, elements, "CPS8", material, beam.thickness, load, held, finite)[:, axis]
    if kind == FACE:  # its middle
        side = np.flatnonzero(shares)
        return float(np.interp(beam.length / 2, points[side, 0], found[side]))
    return float(shares @ found)


BEAM = Beam(0.2, 0.04, 1e-3, "200x40")


@pytest.mark.parametrize(("size", "printed"), [(5e-3, 9.49965), (2e-3, 9.50029)])
def test_steel(size, printed):
    material = Material(210e9, 0.3, name="steel")
    theirs = theirs_of(BEAM, material, 400e3, size)
    ours = solve_small_strain(BEAM, material, 400e3)
    # CalculiX prints six decimals of a mantissa, the value noted before has five decimals.
    assert theirs * 1e3 == pytest.approx(printed, abs=1e-5)
    assert theirs == pytest.approx(ours.displacement, rel=1e-4)
    assert theirs < ours.displacement  # even elements are too stiff at the corners


def test_nearly_incompressible_rubber():
    material = Material(1e6, 0.4999, name="rubber")
    theirs = theirs_of(BEAM, material, 0.4, 2e-3)
    ours = solve_small_strain(BEAM, material, 0.4)
    assert theirs * 1e3 == pytest.approx(1.98684, abs=1e-5)
    # The corners are sharper than those of steel, and even elements of 2 mm 1.6e-4 too stiff.
    assert theirs == pytest.approx(ours.displacement, rel=3e-4)
    assert theirs < ours.displacement


@pytest.mark.parametrize("kind", [BENDING, SHEAR])
@pytest.mark.parametrize(("nu", "close"), [(0.3, 3e-4), (0.4999, 1e-3)])
def test_transverse_loads(kind, nu, close):
    material = Material(210e9, nu, name="any")
    theirs = theirs_of(BEAM, material, 1e3, 2e-3, kind)
    ours = solve_small_strain(BEAM, material, 1e3, kind=kind)
    # Even elements of 2 mm, too stiff at the corners of the clamp; in shear it is four times as long.
    assert theirs == pytest.approx(ours.displacement, rel=close)
    assert theirs < ours.displacement


def test_pressed_block():
    material = Material(1e6, 0.49, name="rubber")
    theirs = theirs_of(BEAM, material, -20.0, 2.5e-3, FACE)
    ours = solve_small_strain(BEAM, material, -20.0, kind=FACE)
    assert theirs == pytest.approx(ours.displacement, rel=3e-4)


@pytest.mark.parametrize(
    ("kind", "force", "length", "size"),
    [
        (AXIAL, 2.0, 0.2, 2.5e-3),
        (AXIAL, -2.0, 0.2, 2.5e-3),
        (SHEAR, 7.0, 0.2, 2.5e-3),
        (BENDING, 0.1333, 0.2, 2.5e-3),  # F L^2 / (E I) = 1
        (BENDING, 0.0427, 0.5, 5e-3),  # 2
    ],
)
def test_finite_strain(kind, force, length, size):
    beam, material = Beam(length, 0.04, 1e-3, "beam"), Material(1e6, 0.4, name="rubber")
    theirs = theirs_of(beam, material, force, size, kind, finite=True)
    ours = solve_finite_strain(beam, material, force, kind=kind)
    # Even elements, too stiff at the corners: 5e-5 to 3e-4 as measured, in shear at five times the length of a clamp.
    assert theirs == pytest.approx(ours.displacement, rel=1e-3 if kind == SHEAR else 5e-4)
    assert abs(theirs) < abs(ours.displacement)
