"""Polynomials of any degree on triangles with straight or curved sides.

Shape functions are hierarchical (Szabo and Babuska, Finite Element Analysis, 1991, chapter 6): one a corner, degree - 1
a side and the rest inside. Corners are numbered upwards, so that neighbours agree on a side's direction.
"""

from functools import lru_cache

import numpy as np
from numpy.polynomial.legendre import Legendre, legder, leggauss, legval

SIDE_CORNERS = ((0, 1), (1, 2), (0, 2))
"""Corners of the sides of a triangle whose corners are numbered upwards, from the lower number to the higher one."""

CORNER_GRADIENTS = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
"""Gradients of the corners' shape functions in the reference triangle."""


def function_counts(degree: int) -> tuple[int, int]:
    """Number of shape functions of a side and of the inside of a triangle."""
    return degree - 1, (degree - 1) * (degree - 2) // 2


def local_functions(lower: int, degree: int) -> np.ndarray:
    """Places of the shape functions of a lower degree among those of a degree, as in `shape_functions`."""
    (few, few_inside), (per_side, _) = function_counts(lower), function_counts(degree)
    sides = 3 + np.add.outer(per_side * np.arange(3), np.arange(few)).ravel()
    return np.concatenate([np.arange(3), sides, 3 + 3 * per_side + np.arange(few_inside)])


def _side_kernels(degree: int, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrated Legendre polynomials over (1 - t^2) / 4, and their derivatives; shape (n, degree - 1)."""
    values, slopes = [], []
    for k in range(2, degree + 1):
        coefficients = 4 * np.sqrt((2 * k - 1) / 2) / (k * (k - 1)) * legder([0] * (k - 1) + [1])
        values.append(legval(along, coefficients))
        slopes.append(legval(along, legder(coefficients)))
    return np.stack(values, axis=-1), np.stack(slopes, axis=-1)


def side_functions(degree: int, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return shape functions at `along` in [-1, 1] on a side, and slopes, (n, degree + 1): corners' first."""
    kernel, slope = _side_kernels(degree, along)
    bulge = (1 - along[:, None] ** 2) / 4
    ends = np.stack([(1 - along) / 2, (1 + along) / 2], axis=1)
    values = np.concatenate([ends, bulge * kernel], axis=1)
    constant = np.broadcast_to([-0.5, 0.5], ends.shape)
    return values, np.concatenate([constant, bulge * slope - along[:, None] / 2 * kernel], axis=1)


def shape_functions(degree: int, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return functions (n, n_functions) and gradients (n, n_functions, 2) in a triangle: corners, sides, inside."""
    corners = np.column_stack([1 - points.sum(axis=1), points])
    values, gradients = [corners], [np.broadcast_to(CORNER_GRADIENTS, (len(points), 3, 2))]

    def product_gradient(i: int, j: int) -> np.ndarray:
        return corners[:, i, None] * CORNER_GRADIENTS[j] + corners[:, j, None] * CORNER_GRADIENTS[i]

    for i, j in SIDE_CORNERS:
        kernel, slope = _side_kernels(degree, corners[:, j] - corners[:, i])
        product = corners[:, i] * corners[:, j]
        values.append(product[:, None] * kernel)
        gradients.append(
            kernel[..., None] * product_gradient(i, j)[:, None]
            + (product[:, None] * slope)[..., None] * (CORNER_GRADIENTS[j] - CORNER_GRADIENTS[i])
        )
    bubble = corners.prod(axis=1)
    bubble_gradient = (
        corners[:, 2, None] * product_gradient(0, 1) + (corners[:, 0] * corners[:, 1])[:, None] * (CORNER_GRADIENTS[2])
    )
    first, second = corners[:, 1] - corners[:, 0], 2 * corners[:, 2] - 1
    for total in range(degree - 2):
        for i in range(total + 1):
            one, other = Legendre.basis(i), Legendre.basis(total - i)
            a, b = one(first), other(second)
            values.append((bubble * a * b)[:, None])
            inner = (one.deriv()(first) * b)[:, None] * (CORNER_GRADIENTS[1] - CORNER_GRADIENTS[0])
            inner = inner + (2 * a * other.deriv()(second))[:, None] * CORNER_GRADIENTS[2]
            gradients.append(((a * b)[:, None] * bubble_gradient + bubble[:, None] * inner)[:, None])
    return np.concatenate(values, axis=1), np.concatenate(gradients, axis=1)


@lru_cache(maxsize=64)
def triangle_rule(exact: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 2) and weights, sum 1/2, by Gauss's rules in a square folded onto the reference triangle."""
    nodes, weights = leggauss(exact // 2 + 1)
    across, weights_across = leggauss((exact + 1) // 2 + 1)  # one degree more by the fold
    x, y = (nodes + 1) / 2, (across + 1) / 2
    points = np.stack([np.multiply.outer(1 - y, x).ravel(), np.repeat(y, len(x))], axis=1)
    return points, np.multiply.outer(weights_across / 2 * (1 - y), weights / 2).ravel()


@lru_cache(maxsize=64)
def tabulated(degree: int, exact: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return quadrature points and weights, exact to degree `exact`, and shape functions and gradients there."""
    points, weights = triangle_rule(exact)
    return points, weights, *shape_functions(degree, points)


@lru_cache(maxsize=64)
def side_fit(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return inner points of Lobatto's rule on a side, and the matrix from values there to side functions."""
    along = np.real(Legendre.basis(degree).deriv().roots())
    return along, np.linalg.inv(side_functions(degree, along)[0][:, 2:])
