"""Extended position-based dynamics: Macklin, Mueller and Chentanez, XPBD, Motion in Games 2016.

A spring is the constraint ``C = l - L``. An iteration visits one constraint after the other; each changes its
multiplier, zero as a step begins, by ``(-C - a lambda) / (sum of w |grad C|^2 + a)`` with ``a = 1 / (k h^2)``, inverse
masses w and the step h. Few iterations of small steps are better than many of large ones (Macklin et al., Small steps
in physics simulation, SCA 2019). The method follows later descriptions; these two papers were not read.

Areas, squared lengths and rubber are blocks of constraints, see `springtune.handover.xpbd`.
"""

from typing import Any

import numpy as np

from ..handover.net import SpringNet
from ..handover.xpbd import COMPLIANCE_UNITS, Blocks, blocks, compliances
from ..linalg.kernels import compiled
from .base import EngineError, Parameter, Setting, Textbook, engine, project_springs

BLOCK_KINDS = tuple(COMPLIANCE_UNITS)  # kinds of blocks; compiled loops take a kind's index

LEAST_AREA_RATIO = 0.05
"""Least area over that at rest; smaller or inverted triangles of rubber count as having it."""


@compiled
def _volume(trace, area, shear, bulk):  # type: ignore[no-untyped-def]
    """Logarithm of the volume of compressible rubber, by Newton's method."""
    v = 0.0
    for _ in range(8):
        pull, press, volume = trace * np.exp(-2 * v / 3), np.exp(4 * v / 3) / area**2, np.exp(v)
        slope = shear / 3 * (2 * press - pull) + bulk * volume * (volume - 1)
        curvature = shear / 9 * (2 * pull + 8 * press) + bulk * volume * (2 * volume - 1)
        v = max(v - slope / curvature, -0.6)
    return v


@compiled
def _rubber(positions, slopes, rest, area, growth, law, compressible, values, gradients):  # type: ignore[no-untyped-def]
    """Set the three constraints of a triangle of rubber and their gradients; `growth` is the gradient of its area."""
    across, turned, share = 0.0, 0.0, 1.0
    for c in range(3):
        across += positions[c, 0] * slopes[c, 0] - positions[c, 1] * slopes[c, 1]
        turned += positions[c, 0] * slopes[c, 1] + positions[c, 1] * slopes[c, 0]
    if compressible:
        share = np.exp(-_volume(across**2 + turned**2 + 2 * area, area, law[0], law[1]) / 3)
    r = area * share**2
    root = np.sqrt(2 * r + 1)
    values[0], values[1], values[2] = share * across, share * turned, (r - 1) * root / r
    rise = (root / r**2 + (r - 1) / (r * root)) * share**2
    for c in range(3):
        gradients[0, c, 0], gradients[0, c, 1] = share * slopes[c, 0], -share * slopes[c, 1]
        gradients[1, c, 0], gradients[1, c, 1] = share * slopes[c, 1], share * slopes[c, 0]
        gradients[2, c, 0], gradients[2, c, 1] = rise * (growth[c, 0] / rest), rise * (growth[c, 1] / rest)
    if not compressible:
        excess = values[0] ** 2 + values[1] ** 2 + values[2] ** 2
        scale = np.sqrt(1 + law[0] * excess + law[1] * excess**2)
        more = (law[0] + 2 * law[1] * excess) / scale
        for c in range(3):
            for d in range(2):
                whole = values[0] * gradients[0, c, d] + values[1] * gradients[1, c, d] + values[2] * gradients[2, c, d]
                for a in range(3):
                    gradients[a, c, d] = scale * gradients[a, c, d] + more * values[a] * whole
        values[0], values[1], values[2] = values[0] * scale, values[1] * scale, values[2] * scale


@compiled
def _project_cells(x, weights, kind, cells, rest, slopes, law, compliance, multipliers):  # type: ignore[no-untyped-def]
    """Project all blocks of a kind once; number by number, since operations on rows take seconds to compile."""
    size, corners = multipliers.shape[1], cells.shape[1]
    here, growth, values = np.empty((corners, 2), x.dtype), np.empty((corners, 2), x.dtype), np.empty(size, x.dtype)
    gradients, matrix = np.zeros((size, corners, 2), x.dtype), np.empty((size, size), x.dtype)
    for e in range(len(cells)):
        cell, area = cells[e], 0.0
        for c in range(corners):
            after, before = cell[(c + 1) % corners], cell[c - 1]
            here[c, 0], here[c, 1] = x[cell[c], 0] - x[cell[0], 0], x[cell[c], 1] - x[cell[0], 1]
            growth[c, 0], growth[c, 1] = 0.5 * (x[after, 1] - x[before, 1]), 0.5 * (x[before, 0] - x[after, 0])
            area += 0.5 * (here[c, 0] * growth[c, 0] + here[c, 1] * growth[c, 1])
        if kind == 0:
            values[0] = area - rest[e, 0]
            for c in range(corners):
                gradients[0, c, 0], gradients[0, c, 1] = growth[c, 0], growth[c, 1]
        elif kind == 1:
            for c in range(3):
                after, before = (c + 1) % 3, c - 1
                dx, dy = here[before, 0] - here[after, 0], here[before, 1] - here[after, 1]
                values[c] = dx * dx + dy * dy - rest[e, c]
                gradients[c, before, 0], gradients[c, before, 1] = 2 * dx, 2 * dy
                gradients[c, after, 0], gradients[c, after, 1] = -2 * dx, -2 * dy
        else:
            ratio = max(area / rest[e, 0], LEAST_AREA_RATIO)
            _rubber(here, slopes[e], rest[e, 0], ratio, growth, law[e], kind == 3, values, gradients)
        for a in range(size):
            for b in range(size):
                values[a] += compliance[e, a, b] * multipliers[e, b]
                matrix[a, b] = compliance[e, a, b]
                for c in range(corners):
                    for d in range(2):
                        matrix[a, b] += weights[cell[c], d] * gradients[a, c, d] * gradients[b, c, d]
        for a in range(size):  # elimination: the matrix is positive
            for b in range(a + 1, size):
                factor = matrix[b, a] / matrix[a, a]
                for c in range(a, size):
                    matrix[b, c] -= factor * matrix[a, c]
                values[b] -= factor * values[a]
        for a in range(size - 1, -1, -1):
            for b in range(a + 1, size):
                values[a] -= matrix[a, b] * values[b]
            values[a] /= matrix[a, a]
            multipliers[e, a] -= values[a]
            for c in range(corners):
                for d in range(2):
                    x[cell[c], d] -= weights[cell[c], d] * gradients[a, c, d] * values[a]


@engine(
    "xpbd",
    order=20,
    laws=BLOCK_KINDS,
    parameters={
        "compliance": Parameter("m/N", "1 / k of a spring"),
        "area compliance": Parameter("m3/N", "A0 / modulus, of C = A - A0"),
        "biquadratic compliance": Parameter(
            "m3/N", "inverse of [[k1, g3, g2], [g3, k2, g1], [g2, g1, k3]] / 2, tensile k, coupling g, of l^2 - L^2"
        ),
        "compressible compliance": Parameter("1/(N m)", "1 / (G t A0), G = E / (2 (1 + nu))"),
        "incompressible compliance": Parameter("1/(N m)", "3 / (E t A0)"),
    },
    typed=compliances,
    springs_first=True,
    measured="1e-6, twenty scenes; it falls as the step squared",
    source="Macklin 2016",
)
class ExtendedPositionBased(Textbook):
    """Extended position-based dynamics: springs as constraints with compliance, multipliers reset in each step."""

    def __init__(self, net: SpringNet, setting: Setting, damping: float) -> None:
        super().__init__(net, setting, damping)
        try:
            self.groups = [self._group(one) for one in blocks(net)]
        except ValueError as error:
            raise EngineError(str(error)) from None
        self.compliance = (1 / (self.stiffness * self.h**2)).astype(self.dtype)

    def _group(self, one: Blocks) -> tuple[Any, ...]:
        """Return the kind, cells and arrays of blocks in the order of `_project_cells`' arguments."""
        values = one.values
        rest = values["rest_length"] ** 2 if "rest_length" in values else values["rest_area"][:, None]
        law = values.get("stiffening", np.zeros((0, 2)))
        if one.kind == "compressible":
            law = np.column_stack([values["shear"], values["bulk"]]) / values["bulk"][:, None]
        parts = rest, values.get("rest_slope", np.zeros((0, 3, 2))), law, one.compliance / float(self.h) ** 2
        return BLOCK_KINDS.index(one.kind), one.cells, *(part.astype(self.dtype, "C") for part in parts)

    def solve(self, y: np.ndarray) -> np.ndarray:
        """Return the positions after all iterations, from the inertial ones."""
        whole, pulls = np.ones_like(self.lengths), np.zeros_like(self.lengths)
        groups = [(*one, np.zeros(one[-1].shape[:2], self.dtype)) for one in self.groups]
        rounds, each = (self.iterations, 1) if groups else (1, self.iterations)
        for _ in range(rounds):
            project_springs(y, self.weights, self.springs, self.lengths, whole, self.compliance, pulls, each)
            for group in groups:
                _project_cells(y, self.weights, *group)
        return y
