r"""Compiled inner loops of explicit time steps.

Both advance displacements u and velocities v in place by many steps of

.. math:: v \leftarrow d \, v + g \, (p - r(u) - c(v)), \qquad u \leftarrow u + h \, v

with d and g given for each direction: g holds the step over the mass, 0 where a direction is held, so that nothing is
allocated or branched on. In single precision all arrays and the step are single.
"""

from collections.abc import Callable

import numpy as np
from numba import njit


def _compiled(function: Callable[..., None]) -> Callable[..., None]:
    """Compiled when first called, and kept on disk where there is a place to write."""
    try:
        return njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # no folder to keep it in
        return njit(error_model="numpy")(function)


@_compiled
def advance_springs(
    first: np.ndarray,
    second: np.ndarray,
    rest: np.ndarray,
    lengths: np.ndarray,
    stiffness: np.ndarray,
    dampers: np.ndarray,
    keep: np.ndarray,
    gain: np.ndarray,
    load: np.ndarray,
    u: np.ndarray,
    v: np.ndarray,
    force: np.ndarray,
    step: float,
    steps: int,
) -> None:
    """Steps of springs that keep their length law, each with a damper along it.

    Parameters
    ----------
    first, second : ndarray of int32, shape (n_springs,)
    rest : ndarray, shape (n_springs, 2)
        Rest vectors [m].
    lengths, stiffness, dampers : ndarray, shape (n_springs,)
        Rest length [m], stiffness [1] and damping [s] over the reference stiffness; no dampers have length 0.
    keep, gain, load, u, v, force : ndarray, shape (n_points, 2)
        d, g [s-1], load [m], state [m, m/s], and room for the forces.
    step : float
        [s]
    steps : int
    """
    damped = len(dampers) > 0
    for _ in range(steps):
        for i in range(len(force)):
            force[i, 0] = load[i, 0]
            force[i, 1] = load[i, 1]
        for e in range(len(first)):
            i, j = first[e], second[e]
            rx, ry = u[j, 0] - u[i, 0], u[j, 1] - u[i, 1]
            lx, ly = rest[e, 0], rest[e, 1]
            x, y = lx + rx, ly + ry
            length = (x * x + y * y) ** 0.5
            # Elongation as (l^2 - L^2) / (l + L): no digits are lost at small strain.
            square = (lx + x) * rx + (ly + y) * ry
            pull = stiffness[e] * square / ((length + lengths[e]) * length)
            if damped:
                wx, wy = v[j, 0] - v[i, 0], v[j, 1] - v[i, 1]
                pull += dampers[e] * (x * wx + y * wy) / (length * length)
            fx, fy = pull * x, pull * y
            force[i, 0] += fx
            force[i, 1] += fy
            force[j, 0] -= fx
            force[j, 1] -= fy
        for i in range(len(force)):
            v[i, 0] = keep[i, 0] * v[i, 0] + gain[i, 0] * force[i, 0]
            v[i, 1] = keep[i, 1] * v[i, 1] + gain[i, 1] * force[i, 1]
            u[i, 0] += step * v[i, 0]
            u[i, 1] += step * v[i, 1]


@_compiled
def advance_matrix(
    pointers: np.ndarray,
    indices: np.ndarray,
    stiffness: np.ndarray,
    dampers: np.ndarray,
    keep: np.ndarray,
    gain: np.ndarray,
    load: np.ndarray,
    u: np.ndarray,
    v: np.ndarray,
    force: np.ndarray,
    step: float,
    steps: int,
) -> None:
    """Steps of a linear network, from the rows of its stiffness and damping matrices.

    Parameters
    ----------
    pointers, indices : ndarray of int32
        Sparsity of both.
    stiffness, dampers : ndarray, shape (n_entries,)
        Entries [1] and [s]; no dampers have length 0.
    keep, gain, load, u, v, force : ndarray, shape (unknowns,)
    step : float
        [s]
    steps : int
    """
    damped = len(dampers) > 0
    for _ in range(steps):
        for i in range(len(u)):
            total = load[i]
            for n in range(pointers[i], pointers[i + 1]):
                total -= stiffness[n] * u[indices[n]]
            if damped:
                for n in range(pointers[i], pointers[i + 1]):
                    total -= dampers[n] * v[indices[n]]
            force[i] = total
        for i in range(len(u)):
            v[i] = keep[i] * v[i] + gain[i] * force[i]
            u[i] += step * v[i]
