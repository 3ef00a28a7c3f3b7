"""The reference of shapes against CalculiX, a program with which it shares nothing."""

import numpy as np
import pytest

import shapes_of_others as others
from springtune.reference import calculix
from springtune.reference.shapes import solve_shape

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not calculix.installed(), reason="needs CalculiX (ccx; Debian package calculix-ccx)"),
]


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
    nodes = np.flatnonzero(np.abs(square[:, axis] - value) < 1e-12)
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
    return calculix.solve(points, elements, "CPS8", material, 0.01 * shape.thickness, load, held)


def odd_slope(places, values):
    """Slope at zero of an odd function, by a polynomial through its values beside it."""
    near = places < 0.6
    powers = places[near, None] ** np.arange(1, 12, 2)
    return np.linalg.lstsq(powers, values[near], rcond=None)[0][0]


def test_cook():
    shape, material = others.cook()

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


def test_a_plate_with_a_hole():
    shape, material = others.holed_plate()
    load_case = shape.loads["pull"]
    size, radius = 0.05, 0.01

    def place(s, t):
        """From the hole to the upper and right sides, around the corner between these."""
        angle = (1 - s) * np.pi / 2
        ring = radius * np.stack([np.cos(angle), np.sin(angle)])
        box = size * np.stack([np.minimum(1, 2 * s), np.minimum(1, 2 - 2 * s)])
        return (ring + t**1.5 * (box - ring)).T

    points, elements, square = mapped(64, 48, place)
    held = np.zeros(points.shape, dtype=bool)
    held[on(square, 0, 1.0), 1] = held[on(square, 0, 0.0), 0] = True
    right = on(square, 1, 1.0)
    right = right[len(right) // 2 :]
    load = pressed(points, right, lambda way: np.array([10e6 * shape.thickness * np.hypot(*way), 0.0]))
    theirs = displaced(shape, points, elements, material, load, held)
    ours = solve_shape(shape, load_case, material)
    assert mean(points, right, theirs[:, 0]) == pytest.approx(ours.values["end"], rel=1e-4)
    np.testing.assert_allclose(ours.at(points), theirs, rtol=0, atol=1e-4 * np.abs(theirs).max())
    # The stress at the top of the hole by the displacements along it, x = r sin of the angle from there.
    hole = on(square, 1, 0.0)
    s, moved = square[hole, 0] * np.pi / 2, theirs[hole, 0]
    strain = odd_slope(s, moved) / radius
    assert material.young_modulus * strain == pytest.approx(ours.values["top-of-the-hole"], rel=1e-3)
