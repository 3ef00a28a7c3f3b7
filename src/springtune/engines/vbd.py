"""Vertex block descent: Chen, Liu, Yang and Yuksel, ACM TOG 43(4), 2024.

An iteration visits the particles in their order; each takes a step of Newton's method for the implicit Euler step's
energy. What is negative across pressed springs and triangles is left out of the blocks, and stays in the forces.

What few iterations leave behind depends on where they begin:

- `vbd-inertia` begins at the inertial position, as Newton's solver does. It rests too far along the load.
- `vbd` has the adaptive guess of the paper: of the load's acceleration the share that the last step has followed. It
  rests in our equilibrium at any number of iterations; few only make it come there late.
"""

from typing import Any

import numpy as np

from ..handover.net import SpringNet
from ..linalg.kernels import compiled
from ..mesh.cells import no_cells
from .base import Setting, Textbook, energy_parameters, engine, refuse_pushing_springs


@compiled
def _spring(x, here, there, length, stiffness, block):  # type: ignore[no-untyped-def]
    """Add force on an end of a spring and second derivatives xx, xy, yy to its block."""
    dx, dy = x[there, 0] - x[here, 0], x[there, 1] - x[here, 1]
    now = np.sqrt(dx * dx + dy * dy)
    across = stiffness * (now - length) / now
    block[0] += across * dx
    block[1] += across * dy
    across = max(across, across - across)
    along = (stiffness - across) / (now * now)
    block[2] += across + along * dx * dx
    block[3] += along * dx * dy
    block[4] += across + along * dy * dy


@compiled
def _squares(x, cell, corner, squares, tensile, coupling, block):  # type: ignore[no-untyped-def]
    """Add force and second derivatives of a corner of a triangle of squared lengths, see `_spring`."""
    i, j, k = cell[corner], cell[(corner + 1) % 3], cell[corner - 1]
    # Sides opposite j and k meet in i; that opposite i does not move with it.
    jx, jy, kx, ky = x[i, 0] - x[k, 0], x[i, 1] - x[k, 1], x[i, 0] - x[j, 0], x[i, 1] - x[j, 1]
    ix, iy = x[j, 0] - x[k, 0], x[j, 1] - x[k, 1]
    a, b, c = corner, (corner + 1) % 3, corner - 1
    qi = ix * ix + iy * iy - squares[a]
    qj = jx * jx + jy * jy - squares[b]
    qk = kx * kx + ky * ky - squares[c]
    pull_j = tensile[b] * qj + coupling[a] * qk + coupling[c] * qi
    pull_k = tensile[c] * qk + coupling[a] * qj + coupling[b] * qi
    block[0] -= pull_j * jx + pull_k * kx
    block[1] -= pull_j * jy + pull_k * ky
    across = max(pull_j + pull_k, pull_j - pull_j)
    tj, tk, both = tensile[b] + tensile[b], tensile[c] + tensile[c], coupling[a] + coupling[a]
    block[2] += across + tj * jx * jx + tk * kx * kx + (both + both) * jx * kx
    block[3] += tj * jx * jy + tk * kx * ky + both * (jx * ky + kx * jy)
    block[4] += across + tj * jy * jy + tk * ky * ky + (both + both) * jy * ky


@compiled
def _area(x, cell, corner, double, modulus, block):  # type: ignore[no-untyped-def]
    """Add force and second derivatives of a cell's area; `double` is 2 rest areas, `modulus` is over 4 rest areas."""
    corners, twice = len(cell), -double
    for c in range(corners):
        i, j = cell[c], cell[(c + 1) % corners]
        # From one corner, since areas are small beside squares of positions.
        ax, ay = x[i, 0] - x[cell[0], 0], x[i, 1] - x[cell[0], 1]
        twice += ax * (x[j, 1] - x[cell[0], 1]) - ay * (x[j, 0] - x[cell[0], 0])
    after, before = cell[(corner + 1) % corners], cell[corner - 1]
    gx, gy = x[after, 1] - x[before, 1], x[before, 0] - x[after, 0]
    block[0] -= modulus * twice * gx
    block[1] -= modulus * twice * gy
    block[2] += modulus * gx * gx
    block[3] += modulus * gx * gy
    block[4] += modulus * gy * gy


@compiled
def _sweeps(x, y, inertia, weights, springs, squares, triangles, quads, iterations):  # type: ignore[no-untyped-def]
    """Visit all particles in order, several times; a group has pointers, places, cells, and two or three values."""
    block = np.empty(5, x.dtype)
    for _ in range(iterations):
        for i in range(len(x)):
            block[0], block[1] = inertia[i] * (y[i, 0] - x[i, 0]), inertia[i] * (y[i, 1] - x[i, 1])
            block[2], block[3], block[4] = inertia[i], 0, inertia[i]
            for place in springs[1][springs[0][i] : springs[0][i + 1]]:
                e = place // 2
                _spring(x, i, springs[2][e, 1 - place % 2], springs[3][e], springs[4][e], block)
            for place in squares[1][squares[0][i] : squares[0][i + 1]]:
                e = place // 3
                _squares(x, squares[2][e], place % 3, squares[3][e], squares[4][e], squares[5][e], block)
            for group in (triangles, quads):
                for place in group[1][group[0][i] : group[0][i + 1]]:
                    e = place // group[2].shape[1]
                    _area(x, group[2][e], place % group[2].shape[1], group[3][e], group[4][e], block)
            if weights[i, 0] == 0:
                block[0], block[2], block[3] = 0, 1, 0
            if weights[i, 1] == 0:
                block[1], block[3], block[4] = 0, 0, 1
            determinant = block[2] * block[4] - block[3] * block[3]
            x[i, 0] += (block[4] * block[0] - block[3] * block[1]) / determinant
            x[i, 1] += (block[2] * block[1] - block[3] * block[0]) / determinant
    return x


VERTEX_LAWS = ("area", "biquadratic")  # energies besides springs

COMMON_ATTRIBUTES: dict[str, Any] = {
    "laws": VERTEX_LAWS,
    "parameters": energy_parameters(*VERTEX_LAWS),
    "measured": "1e-6, twenty scenes",
    "source": "Chen 2024",
}


@engine("vbd-inertia", order=41, **COMMON_ATTRIBUTES)
class Inertial(Textbook):
    """Vertex block descent from the inertial position."""

    adaptive = False
    """Whether a step begins at the adaptive guess, or at the inertial position."""

    def __init__(self, net: SpringNet, setting: Setting, damping: float) -> None:
        refuse_pushing_springs(net, "blocks need positive ones")
        super().__init__(net, setting, damping)
        self.last = self.v
        self.sizes = np.maximum((self.push**2).sum(axis=1, keepdims=True), np.finfo(self.dtype).tiny) / self.h
        given = {
            (one.kind, one.cells.shape[1]): (one.cells, *(one.values[name] for name in one.units))
            for one in net.energies
        }
        none = np.empty((0, 3))
        cells, rest, *moduli = given.get(("biquadratic", 3), (no_cells(3), none, none, none))
        self.groups = [self._group(self.springs, self.lengths, self.stiffness), self._group(cells, rest**2, *moduli)]
        for corners in (3, 4):
            cells, rest, modulus = given.get(("area", corners), (no_cells(corners), np.empty(0), np.empty(0)))
            self.groups.append(self._group(cells, 2 * rest, modulus / (4 * rest)))

    def _group(self, cells: np.ndarray, *values: np.ndarray) -> tuple[Any, ...]:
        """Places of each particle in cells, and the cells' values."""
        order = np.argsort(cells.ravel(), kind="stable")
        pointers = np.searchsorted(cells.ravel()[order], np.arange(len(self.x) + 1))
        return pointers, order, np.ascontiguousarray(cells, np.int64), *(one.astype(self.dtype) for one in values)

    def solve(self, y: np.ndarray) -> np.ndarray:
        """Sweep from the guess."""
        x = y.copy()
        if self.adaptive:
            followed = ((self.v - self.last) * self.push).sum(axis=1, keepdims=True) / self.sizes
            x -= (1 - np.clip(followed, 0, 1)) * self.push
            self.last = self.v
        return _sweeps(x, y, self.inertia, self.weights, *self.groups, self.iterations)


@engine("vbd", order=40, **COMMON_ATTRIBUTES)
class Adaptive(Inertial):
    """Vertex block descent from its paper's adaptive guess: at rest exact with any number of iterations."""

    adaptive = True
