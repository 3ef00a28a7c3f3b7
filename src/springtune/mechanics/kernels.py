r"""Compiled inner loops of explicit time steps.

.. math:: v \leftarrow d \, v + g \, (p - r(u) - c(v)), \qquad u \leftarrow u + h \, v

with the step over the mass in g, 0 for held directions. In single precision all arrays and numbers are single.

Particles advance in blocks, a block by several steps (a pass) before distant ones, so that its numbers stay in a core's
cache; several threads take passes in turns (pipelined temporal blocking, Wittmann, Hager and Wellein,
10.1109/IPDPSW.2010.5470813). Results and the order of summation do not depend on threads or block size.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numba import config, types
from numba.extending import intrinsic

from ..linalg.kernels import compiled

CHECKS_BEFORE_YIELD = 1000  # checks of another thread, some microseconds, before a waiting thread yields its core

PROGRESS_STRIDE = 8  # array entries between progress counters of threads: a cache line, against false sharing


@contextmanager
def packed() -> Iterator[None]:
    """Context in which numba vectorises both coordinates: faster, with the same digits."""
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


_store_release: Any = intrinsic(_release)  # store the first number of an array after all previous writes (release)

_load_acquire: Any = intrinsic(_acquire)  # load the first number of an array before all later reads (acquire)


@compiled
def _follow(progress: np.ndarray, thread: int, number: int, block: int, blocks: int, distance: int) -> bool:
    """Wait until the pass before is far enough ahead; return False if it never will be."""
    threads = len(progress) - 1
    if threads == 1 or number == 0:
        return True
    ahead = (number - 1) % threads
    least = (number - 1) // threads * blocks + min(blocks, block + 1 + distance)
    looks = 0
    while _load_acquire(progress[ahead]) < least:
        looks += 1
        if looks > CHECKS_BEFORE_YIELD:
            if _load_acquire(progress[threads]):
                return False
            _yield()
    return True


@compiled
def _passes(count: int, size: int, depth: int, bandwidth: int) -> tuple[int, int]:
    """Return the blocks of a pass, and by how many blocks the next pass stays behind."""
    return (count + (depth - 1) * bandwidth + size - 1) // size, (depth * bandwidth + size - 1) // size


@compiled
def _part(block: int, size: int, behind: int, count: int) -> tuple[int, int]:
    """Rows of a block, from one to before another, at a distance behind the first step."""
    first = block * size - behind
    return min(max(first, 0), count), min(max(first + size, 0), count)


@compiled
def _pull(
    rx: float, ry: float, lx: float, ly: float, length: float, stiffness: float
) -> tuple[float, float, float, float]:
    """Spring's vector, length, and force over length, from its ends' relative displacement and its vector at rest."""
    x, y = lx + rx, ly + ry
    now = np.sqrt(x * x + y * y)
    # Elongation as (l^2 - L^2) / (l + L): no digits are lost at small strain.
    square = (lx + x) * rx + (ly + y) * ry
    return x, y, now, stiffness * square / ((now + length) * now)


@compiled
def advance_springs(
    thread: int, network: Any, numbers: Any, u: np.ndarray, v: np.ndarray, steps: int, depth: int, progress: np.ndarray
) -> None:
    """Advance springs with their length law and a damper each, in the passes of a thread.

    Shapes: `first`, `second`, `lengths`, `stiffness`, `dampers` (n_springs,), ends in ascending order, `dampers`
    perhaps empty; `rest` (2, n_springs); `gain` g, `load`, `force` at start and end (n_points, 2); `room` (4, most
    springs of a block) is scratch space; `u`, `v` (1, n_points, 2) the state [m, m/s]. `keep` is d [1].
    """
    pointers, first, second, rest, lengths, stiffness, dampers, gain, load, force, room = network
    keep, step, size, bandwidth = numbers
    u, v, damped, count, threads = u[0], v[0], len(dampers) > 0, len(gain), len(progress) - 1
    ax, ay, bx, by = room[0], room[1], room[2], room[3]
    blocks, distance = _passes(count, size, depth, bandwidth)
    for number in range(thread, (steps + depth - 1) // depth, threads):
        for block in range(blocks):
            if not _follow(progress, thread, number, block, blocks, distance):
                return
            for done in range(min(depth, steps - number * depth)):
                begin, end = _part(block, size, done * bandwidth, count)
                start, stop = np.int64(pointers[begin]), np.int64(pointers[end])
                for n in range(stop - start):
                    i, j = first[start + n], second[start + n]
                    ax[n] = u[j, 0] - u[i, 0]
                    ay[n] = u[j, 1] - u[i, 1]
                    if damped:
                        bx[n] = v[j, 0] - v[i, 0]
                        by[n] = v[j, 1] - v[i, 1]
                if damped:
                    for n in range(stop - start):
                        e = start + n
                        x, y, now, pull = _pull(ax[n], ay[n], rest[0, e], rest[1, e], lengths[e], stiffness[e])
                        pull += dampers[e] * (x * bx[n] + y * by[n]) / (now * now)
                        ax[n], ay[n] = pull * x, pull * y
                else:
                    for n in range(stop - start):
                        e = start + n
                        x, y, now, pull = _pull(ax[n], ay[n], rest[0, e], rest[1, e], lengths[e], stiffness[e])
                        ax[n], ay[n] = pull * x, pull * y
                for n in range(stop - start):
                    i, j = first[start + n], second[start + n]
                    px, py = ax[n], ay[n]
                    force[i, 0] += px
                    force[i, 1] += py
                    force[j, 0] -= px
                    force[j, 1] -= py
                for i in range(begin, end):
                    vx, vy = keep * v[i, 0] + gain[i, 0] * force[i, 0], keep * v[i, 1] + gain[i, 1] * force[i, 1]
                    v[i, 0], v[i, 1] = vx, vy
                    u[i, 0], u[i, 1] = u[i, 0] + step * vx, u[i, 1] + step * vy
                    force[i, 0], force[i, 1] = load[i, 0], load[i, 1]
            _store_release(progress[thread], number // threads * blocks + block + 1)


@compiled
def advance_matrix(
    thread: int, network: Any, numbers: Any, u: np.ndarray, v: np.ndarray, steps: int, depth: int, progress: np.ndarray
) -> None:
    """Advance a linear network in the passes of a thread; `u` and, with dampers, `v` alternate between two states."""
    pointers, indices, stiffness, dampers, gain, load = network
    keep, step, size, bandwidth = numbers
    damped, count, threads = len(dampers) > 0, len(gain), len(progress) - 1
    blocks, distance = _passes(count, size, depth, bandwidth)
    for number in range(thread, (steps + depth - 1) // depth, threads):
        for block in range(blocks):
            if not _follow(progress, thread, number, block, blocks, distance):
                return
            for done in range(min(depth, steps - number * depth)):
                at = number * depth + done
                a, b = at % len(u), (at + 1) % len(u)
                c, d = at % len(v), (at + 1) % len(v)
                begin, end = _part(block, size, done * bandwidth, count)
                for i in range(begin, end):
                    total = load[i]
                    for n in range(pointers[i], pointers[i + 1]):
                        total -= stiffness[n] * u[a, indices[n]]
                    if damped:
                        for n in range(pointers[i], pointers[i + 1]):
                            total -= dampers[n] * v[c, indices[n]]
                    v[d, i] = keep * v[c, i] + gain[i] * total
                    u[b, i] = u[a, i] + step * v[d, i]
            _store_release(progress[thread], number // threads * blocks + block + 1)
