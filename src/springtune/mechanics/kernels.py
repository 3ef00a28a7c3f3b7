r"""Compiled inner loops of explicit time steps.

Both advance displacements u and velocities v by many steps of

.. math:: v \leftarrow d \, v + g \, (p - r(u) - c(v)), \qquad u \leftarrow u + h \, v

with d given, and g for each direction: g holds the step over the mass, 0 where a direction is held, so that nothing is
allocated or branched on. In single precision all arrays and numbers are single.

Each call advances a part of the particles, in a thread of its own: force, velocity and displacement of a particle in
one pass. What parts read of each other is of the step before, so they wait for each other once a step. The forces on a
particle are summed in the order of the springs, whatever the parts, so that the numbers are the same for any number of
threads; a spring between two parts is computed by both.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numba import config, njit, types
from numba.extending import intrinsic

PATIENCE = 1000
"""Looks at another part, some microseconds, after which a waiting thread lets others have its core."""

STRIDE = 8
"""Numbers of a part in what tells its progress: a line of the cache, which no other part writes."""


def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiled when first called, and kept on disk where there is a place to write."""
    try:
        return njit(cache=True, error_model="numpy", nogil=True)(function)
    except RuntimeError:  # no folder to keep it in
        return njit(error_model="numpy", nogil=True)(function)


@contextmanager
def packed() -> Iterator[None]:
    """Context in which what numba compiles computes both coordinates at once, in less time, with the same digits."""
    options: Any = config
    before = options.SLP_VECTORIZE
    options.SLP_VECTORIZE = 1
    try:
        yield
    finally:
        options.SLP_VECTORIZE = before


_yield = types.ExternalFunction("sched_yield", types.int32())


def _release(context: Any, array: Any, value: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        builder.store_atomic(arguments[1], data, "release", 8)
        return context.get_dummy_value()

    return types.void(array, types.int64), code


def _acquire(context: Any, array: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.load_atomic(data, "acquire", 8)

    return types.int64(array), code


_tell: Any = intrinsic(_release)
"""Write the first number of an array after all that was written before."""

_told: Any = intrinsic(_acquire)
"""Read the first number of an array before all that is read after."""


@_compiled
def _meet(progress: np.ndarray, part: int, done: int) -> bool:
    """Wait until all parts have done so many steps; false where one never will."""
    parts = len(progress) - 1
    if parts == 1:
        return True
    _tell(progress[part], done)
    for other in range(parts):
        looks = 0
        while _told(progress[other]) < done:
            looks += 1
            if looks > PATIENCE:
                if _told(progress[parts]):
                    return False
                _yield()
    return True


@_compiled
def advance_springs(
    part: int,
    begin: int,
    end: int,
    ghosts: np.ndarray,
    pointers: np.ndarray,
    second: np.ndarray,
    rest: np.ndarray,
    lengths: np.ndarray,
    stiffness: np.ndarray,
    dampers: np.ndarray,
    gain: np.ndarray,
    load: np.ndarray,
    force: np.ndarray,
    keep: float,
    step: float,
    u: np.ndarray,
    v: np.ndarray,
    steps: int,
    progress: np.ndarray,
) -> None:
    """Steps of springs that keep their length law, each with a damper along it, for a part of the particles.

    A particle's force is whole, and nothing needs its displacement any more, when the springs are done whose other ends
    have smaller numbers, and then its own.

    Parameters
    ----------
    part, begin, end : int
        Number of the part, and its particles, from `begin` to before `end`.
    ghosts : ndarray of int, shape (n_ghosts,)
        Particles before `begin` that have springs to the part.
    pointers : ndarray of int, shape (n_ghosts + end - begin + 1,)
        First spring of each ghost, to the part alone, and of each particle, to particles of larger numbers.
    second : ndarray of int, shape (n_springs,)
        Other ends of these springs, in ascending order for each of the first ones.
    rest : ndarray, shape (n_springs, 2)
        Rest vectors [m].
    lengths, stiffness, dampers : ndarray, shape (n_springs,)
        Rest length [m], stiffness [1] and damping [s] over the reference stiffness; no dampers have length 0.
    gain, load, force : ndarray, shape (n_points, 2)
        g [s-1], load [m], and room for the forces.
    keep, step : float
        d [1] and step [s].
    u, v : ndarray, shape (1 or 2, n_points, 2)
        State [m, m/s], from one to the other in turns where there are two: u needs two if there are several parts, v
        if there are dampers, too.
    steps : int
    progress : ndarray of int64, shape (n_parts + 1, STRIDE)
        Steps that each part has done, zeros; the last row is not zero where a part has failed.
    """
    damped, count = len(dampers) > 0, len(ghosts)
    for i in range(begin, end):
        force[i, 0] = load[i, 0]
        force[i, 1] = load[i, 1]
    for done in range(steps):
        a, b = done % len(u), (done + 1) % len(u)
        c, d = done % len(v), (done + 1) % len(v)
        for row in range(len(pointers) - 1):
            ghost = row < count
            i = ghosts[row] if ghost else begin + row - count
            fx, fy = load[i, 0], load[i, 1]
            if not ghost:
                fx, fy = force[i, 0], force[i, 1]
            ux, uy = u[a, i, 0], u[a, i, 1]
            for e in range(pointers[row], pointers[row + 1]):
                j = second[e]
                rx, ry = u[a, j, 0] - ux, u[a, j, 1] - uy
                lx, ly = rest[e, 0], rest[e, 1]
                x, y = lx + rx, ly + ry
                length = np.sqrt(x * x + y * y)
                # Elongation as (l^2 - L^2) / (l + L): no digits are lost at small strain.
                square = (lx + x) * rx + (ly + y) * ry
                pull = stiffness[e] * square / ((length + lengths[e]) * length)
                if damped:
                    wx, wy = v[c, j, 0] - v[c, i, 0], v[c, j, 1] - v[c, i, 1]
                    pull += dampers[e] * (x * wx + y * wy) / (length * length)
                px, py = pull * x, pull * y
                fx += px
                fy += py
                if j < end:
                    force[j, 0] -= px
                    force[j, 1] -= py
            if not ghost:
                vx, vy = keep * v[c, i, 0] + gain[i, 0] * fx, keep * v[c, i, 1] + gain[i, 1] * fy
                v[d, i, 0], v[d, i, 1] = vx, vy
                u[b, i, 0], u[b, i, 1] = ux + step * vx, uy + step * vy
                force[i, 0], force[i, 1] = load[i, 0], load[i, 1]
        if not _meet(progress, part, done + 1):
            return


@_compiled
def advance_matrix(
    part: int,
    begin: int,
    end: int,
    pointers: np.ndarray,
    indices: np.ndarray,
    stiffness: np.ndarray,
    dampers: np.ndarray,
    gain: np.ndarray,
    load: np.ndarray,
    keep: float,
    step: float,
    u: np.ndarray,
    v: np.ndarray,
    steps: int,
    progress: np.ndarray,
) -> None:
    """Steps of a linear network for a part of the unknowns, from the rows of its stiffness and damping matrices.

    Parameters
    ----------
    part, begin, end : int
        Number of the part, and its unknowns, from `begin` to before `end`.
    pointers, indices : ndarray of int
        Sparsity of both.
    stiffness, dampers : ndarray, shape (n_entries,)
        Entries [1] and [s]; no dampers have length 0.
    gain, load : ndarray, shape (unknowns,)
    keep, step : float
        d [1] and step [s].
    u, v : ndarray, shape (2, unknowns) and (1 or 2, unknowns)
        State, from one to the other in turns where there are two: v needs two if there are dampers.
    steps : int
    progress : ndarray of int64, shape (n_parts + 1, STRIDE)
        As of `advance_springs`.
    """
    damped = len(dampers) > 0
    for done in range(steps):
        a, b = done % len(u), (done + 1) % len(u)
        c, d = done % len(v), (done + 1) % len(v)
        for i in range(begin, end):
            total = load[i]
            for n in range(pointers[i], pointers[i + 1]):
                total -= stiffness[n] * u[a, indices[n]]
            if damped:
                for n in range(pointers[i], pointers[i + 1]):
                    total -= dampers[n] * v[c, indices[n]]
            v[d, i] = keep * v[c, i] + gain[i] * total
            u[b, i] = u[a, i] + step * v[d, i]
        if not _meet(progress, part, done + 1):
            return
