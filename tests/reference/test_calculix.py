"""The references of beams and of shapes against CalculiX, a program with which they share nothing."""

from dataclasses import replace

import numpy as np
import pytest

import shapes_of_others as others
import springtune as st
from springtune.problem.loads import AXIAL, BENDING, FACE, SHEAR
from springtune.reference import calculix
from springtune.reference.finite_shapes import solve_finite_shape
from springtune.reference.finite_strain import solve_finite_strain
from springtune.reference.shapes import solve_shape
from springtune.reference.small_strain import solve_small_strain

from tables import cases

PULLED = (st.Quantity("end", "displacement", "right", "x"),)

NEEDED = "needs CalculiX (ccx; Debian package calculix-ccx)"
pytestmark = [pytest.mark.slow, pytest.mark.skipif(not calculix.program(), reason=NEEDED)]


def graded(share, power):
    """Shares of a side from 0 to 1, denser towards both ends."""
    return np.where(share < 0.5, (2 * share) ** power / 2, 1 - (2 - 2 * share) ** power / 2)


def mapped(count, across, place, power=1.0):
    """Serendipity quadrilaterals on the image of a unit square, and its nodes' coordinates on that square."""
    square, elements = calculix.quadratic_mesh(count, across, 1.0)
    # Middles stay in the middle between corners, or the elements would be singular themselves.
    square = square / [count, across]
    if power != 1:
        for axis, n in enumerate((count, across)):
            ends = graded(np.arange(n + 1) / n, power)
            square[:, axis] = np.interp(square[:, axis] * n, np.arange(n + 1), ends)
    return np.round(place(*square.T), 12), elements, square  # 20 columns is what CalculiX reads of a number


def pressed(points, side, vectors):
    """Nodal forces of an even load per length along ordered nodes of quadratic sides, by Simpson's rule."""
    forces = np.zeros(points.shape)
    for first, middle, last in zip(side[:-2:2], side[1:-1:2], side[2::2]):
        a, b, c = points[[first, middle, last]]
        # Gauss points of the curve of each side.
        for t, weight in zip(*np.polynomial.legendre.leggauss(3)):
            values = np.array([t * (t - 1) / 2, 1 - t * t, t * (t + 1) / 2])
            tangent = np.array([t - 0.5, -2 * t, t + 0.5]) @ np.array([a, b, c])
            forces[[first, middle, last]] += weight * np.outer(values, vectors(tangent))
    return forces


def on(square, axis, value):
    """Nodes on a side of the square, in order along it."""
    nodes = np.flatnonzero(np.abs(square[:, axis] - value) < 1e-9)
    return nodes[np.argsort(square[nodes, 1 - axis])]


def mean(points, side, values):
    """Mean of nodal values along a side, by length."""
    shares = pressed(points, side, lambda tangent: np.full(2, np.hypot(*tangent)))[:, 0]
    return float(shares @ values / shares.sum())


def displaced(shape, points, elements, material, load, held):
    """Displacements by a sheet of a hundredth of the thickness and of the load.

    CalculiX makes solids of plane elements, which in a thick one shear where the strain across them changes.
    """
    load = np.vectorize(lambda force: float(f"{0.01 * force:.12g}"))(load)
    thickness = float(f"{0.01 * shape.thickness:.12g}")
    return calculix.solve(points, elements, "CPS8", material, thickness, load, held)


def odd_slope(places, values):
    """Slope at zero of an odd function, by a polynomial through its values beside it."""
    near = places < 0.6
    powers = places[near, None] ** np.arange(1, 12, 2)
    return np.linalg.lstsq(powers, values[near], rcond=None)[0][0]


def test_cook():
    shape, material = others.ALL["cook"]

    def place(s, t):
        lower, upper = 44 * s, 44 + 16 * s
        return np.stack([48 * s, lower + t * (upper - lower)], axis=1)

    points, elements, square = mapped(80, 80, place, power=2.2)
    held = np.zeros(points.shape, dtype=bool)
    held[on(square, 0, 0.0)] = True
    side = on(square, 0, 1.0)
    load = pressed(points, side, lambda tangent: np.array([0.0, np.hypot(*tangent)]) / 16)
    theirs = displaced(shape, points, elements, material, load, held)
    ours = solve_shape(shape, shape.loads["shear"], material, tolerance=1e-5)
    assert mean(points, side, theirs[:, 1]) == pytest.approx(ours.values["mean-tip"], rel=1e-4)
    middle = side[len(side) // 2]
    np.testing.assert_allclose(points[middle], [48, 52])
    assert theirs[middle, 1] == pytest.approx(ours.values["tip"], rel=1e-4)
    np.testing.assert_allclose(ours.at(points), theirs, rtol=0, atol=1e-4 * np.abs(theirs).max())


@pytest.mark.parametrize("seed", [62, 160])
def test_sectors_whose_triangles_once_folded(seed):
    shape = others.random_sector(seed)
    first, second, third = (segment.start for segment in shape.outline[:3])
    inner, outer, angle = first[0], second[0], np.arctan2(third[1], third[0])

    def place(s, t):
        radius, turn = inner + s * (outer - inner), t * angle
        return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)

    points, elements, square = mapped(48, 96, place, power=2.2)
    held = np.zeros(points.shape, dtype=bool)
    held[on(square, 1, 1.0)] = True
    load = 1e5 * shape.thickness * pressed(points, on(square, 0, 0.0), lambda way: np.array([way[1], -way[0]]))
    material = st.Material(1e9, 0.3)
    theirs = displaced(shape, points, elements, material, load, held)
    ours = solve_shape(shape, shape.loads["press"], material, tolerance=1e-5)
    for axis, name in enumerate("xy"):
        assert mean(points, on(square, 1, 0.0), theirs[:, axis]) == pytest.approx(ours.values[name], rel=1e-4)


SIZE, RADIUS = 0.05, 0.01  # of `others.holed_plate` [m]


def quarter_plate(columns, rows, traction):
    """Points, elements, square and supports of a plate with a hole, the upper half of its right side, and the pull."""

    def place(s, t):
        """From the hole to the upper and right sides, around the corner between these."""
        angle = (1 - s) * np.pi / 2
        ring = RADIUS * np.stack([np.cos(angle), np.sin(angle)])
        box = SIZE * np.stack([np.minimum(1, 2 * s), np.minimum(1, 2 - 2 * s)])
        return (ring + t**1.5 * (box - ring)).T

    points, elements, square = mapped(columns, rows, place)
    held = np.zeros(points.shape, dtype=bool)
    held[on(square, 0, 1.0), 1] = held[on(square, 0, 0.0), 0] = True
    right = on(square, 1, 1.0)
    right = right[len(right) // 2 :]
    load = pressed(points, right, lambda way: np.array([traction * np.hypot(*way), 0.0]))
    return points, elements, square, held, right, load


def test_a_plate_with_a_hole():
    shape, material = others.holed_plate()
    points, elements, square, held, right, load = quarter_plate(64, 48, 10e6 * shape.thickness)
    theirs = displaced(shape, points, elements, material, load, held)
    ours = solve_shape(shape, shape.loads["pull"], material)
    assert mean(points, right, theirs[:, 0]) == pytest.approx(ours.values["end"], rel=1e-4)
    np.testing.assert_allclose(ours.at(points), theirs, rtol=0, atol=1e-4 * np.abs(theirs).max())
    # The stress at the top of the hole by the displacements along it, x = r sin of the angle from there.
    hole = on(square, 1, 0.0)
    s, moved = square[hole, 0] * np.pi / 2, theirs[hole, 0]
    strain = odd_slope(s, moved) / RADIUS
    assert material.young_modulus * strain == pytest.approx(ours.values["top-of-the-hole"], rel=1e-3)


def test_rubber_with_a_hole():
    """Neo-Hooke at some 30 % strain, beside the hole at 80 %."""
    shape, material = others.holed_plate()[0], st.Material(1e6, 0.4, name="rubber")
    force = 0.3e6 * SIZE * shape.thickness
    case = replace(shape.loads["pull"], tractions=(st.Traction("right", (force, 0.0)),), quantities=PULLED)
    points, elements, _, held, right, load = quarter_plate(32, 24, force / SIZE)
    theirs = calculix.solve(points, elements, "CPS8", material, shape.thickness, load, held, finite=True)
    ours = solve_finite_shape(replace(shape, loads={"pull": case}), case, {"": material})
    assert mean(points, right, theirs[:, 0]) == pytest.approx(ours.values["end"], rel=1e-3)
    np.testing.assert_allclose(ours.at(points), theirs, rtol=0, atol=2e-3 * np.abs(theirs).max())


def theirs_of(beam, material, force, size, kind=AXIAL, finite=False):
    """Displacement of the loaded side [m] by serendipity quadrilaterals (CPS8) of even size [m]."""
    points, elements = calculix.quadratic_mesh(beam.length, beam.height, size)
    upper = kind in (SHEAR, FACE)
    along, axis = int(upper), 1 if kind in (BENDING, FACE) else 0
    value = beam.height if upper else beam.length
    shares = calculix.side_weights(points, along, value)
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


BEAM = st.Beam(0.2, 0.04, 1e-3, "200x40")


@cases
def test_small_strain(kind, force, nu, size, close):
    """Even elements are too stiff at the corners of the clamp."""
    material = st.Material(210e9, nu, name="any")
    theirs = theirs_of(BEAM, material, force, size, kind)
    ours = solve_small_strain(BEAM, material, force, kind=kind).displacement
    assert theirs == pytest.approx(ours, rel=close)
    assert kind == FACE or theirs < ours


@cases
def test_finite_strain(kind, force, length, size):
    beam, material = st.Beam(length, 0.04, 1e-3, "beam"), st.Material(1e6, 0.4, name="rubber")
    theirs = theirs_of(beam, material, force, size, kind, finite=True)
    ours = solve_finite_strain(beam, material, force, kind=kind)
    # Even elements, too stiff at the corners: 5e-5 to 3e-4 as measured, in shear at five times the length of a clamp.
    assert theirs == pytest.approx(ours.displacement, rel=1e-3 if kind == SHEAR else 5e-4)
    assert abs(theirs) < abs(ours.displacement)


@pytest.mark.parametrize("nu", [0.3, 0.49])
@pytest.mark.parametrize("kind", [AXIAL, BENDING, SHEAR, FACE])
def test_plane_strain(kind, nu):
    """By elements CPE8 of even size, too stiff at the corners of the clamp, which are sharper towards nu = 0.5."""
    material = st.Material(210e9, nu, name="steel", plane="strain")
    coarse, fine = (theirs_of(BEAM, material, 400e3, size, kind) for size in (4e-3, 2e-3))
    if kind == AXIAL and nu == 0.3:
        assert fine * 1e3 == pytest.approx(8.62447, abs=1e-5)
    ours = solve_small_strain(BEAM, material, 400e3, kind=kind).displacement
    assert coarse < fine < ours
    assert fine == pytest.approx(ours, rel=3e-4 if nu == 0.3 else 4e-3)
    assert ours - fine < 0.5 * (ours - coarse)


def test_plane_strain_at_finite_strain():
    material = st.Material(1e6, 0.4, name="rubber", plane="strain")
    theirs = theirs_of(BEAM, material, 2.0, 2.5e-3, AXIAL, finite=True)
    assert theirs == pytest.approx(solve_finite_strain(BEAM, material, 2.0, kind=AXIAL).displacement, rel=5e-4)
