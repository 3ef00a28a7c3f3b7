"""Base of the textbook solvers: a step from the inertial position, and the velocity after it.

A solver that begins at ``y = x + h v + h^2 f / m`` and stops early rests too far along the load.
"""

import numpy as np

from ..handover.net import SpringNet
from ..handover.simulation import ENERGY_WORDS, VALUES
from ..linalg.kernels import compiled
from .base import SPRING_STIFFNESS, EngineError, Parameter, Setting


@compiled
def spring_between(x, weights, i, j):  # type: ignore[no-untyped-def]
    """Direction of a spring from i to j, its length, and the sum of its ends' inverse masses along it."""
    dx, dy = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1]
    length = np.sqrt(dx * dx + dy * dy)
    dx, dy = dx / length, dy / length
    total = (weights[i, 0] + weights[j, 0]) * dx * dx + (weights[i, 1] + weights[j, 1]) * dy * dy
    return dx, dy, length, total


@compiled
def stretch_spring(x, weights, i, j, dx, dy, change):  # type: ignore[no-untyped-def]
    """Move the ends of a spring apart along its direction, by a change times their inverse masses."""
    x[i, 0] -= weights[i, 0] * change * dx
    x[i, 1] -= weights[i, 1] * change * dy
    x[j, 0] += weights[j, 0] * change * dx
    x[j, 1] += weights[j, 1] * change * dy


@compiled
def project_springs(x, weights, springs, lengths, shares, compliance, multipliers, iterations):  # type: ignore[no-untyped-def]
    """Project all springs some times, by a share of what each asks for; compliance is over the squared step."""
    for _ in range(iterations):
        for e in range(len(lengths)):
            i, j = springs[e]
            dx, dy, length, total = spring_between(x, weights, i, j)
            total += compliance[e]
            if total == 0:  # both ends are held
                continue
            change = shares[e] * (lengths[e] - length - compliance[e] * multipliers[e]) / total
            multipliers[e] += change
            stretch_spring(x, weights, i, j, dx, dy, change)


class Textbook:
    """Session of implicit Euler steps ``M (x - y) / h^2 + dW/dx = 0`` from ``y = x + h v + h^2 f / m``.

    All arrays are (n_points, 2), of the setting's precision; `weights` are inverse masses, 0 where held.
    """

    def __init__(self, net: SpringNet, setting: Setting, damping: float) -> None:
        assert net.masses is not None  # of a scene that moves
        dtype = np.dtype(setting.precision or "float64")
        self.dtype, self.h = dtype, dtype.type(setting.step)
        self.substeps, self.iterations = setting.substeps, setting.iterations
        self.velocity_share = dtype.type(1 / (1 + damping * setting.step))
        self.points = (net.points - net.points.mean(axis=0)).astype(dtype)  # small numbers lose least by rounding
        self.weights = np.where(net.held, 0, 1 / net.masses[:, None]).astype(dtype)
        self.push = (setting.step**2 * np.where(net.held, 0, net.forces / net.masses[:, None])).astype(dtype)
        self.inertia = (net.masses / setting.step**2).astype(dtype)
        self.x, self.v = self.points.copy(), np.zeros_like(self.points)
        there = net.stiffness != 0
        self.springs = net.springs[there]
        self.lengths, self.stiffness = net.rest_lengths[there].astype(dtype), net.stiffness[there].astype(dtype)

    def solve(self, y: np.ndarray) -> np.ndarray:
        """Return the positions at the end of a step from the inertial ones, which it may change."""
        raise NotImplementedError

    def advance(self, frames: int) -> None:
        """Take a number of frames."""
        with np.errstate(over="ignore", invalid="ignore"):
            for _ in range(frames * self.substeps):
                before = self.x
                self.x = self.solve(before + self.h * self.v + self.push)
                self.v = self.velocity_share / self.h * (self.x - before)

    def displacements(self) -> np.ndarray:
        """Displacement of each particle [m]."""
        return (self.x - self.points).astype(float)


def refuse_pushing_springs(net: SpringNet, why: str) -> None:
    """Refuse springs of negative stiffness."""
    if np.any(net.stiffness < 0):
        why = f"has springs of negative stiffness, and {why}; take 'patch' or 'lattice', or engine 'implicit-cg'"
        raise EngineError(f"definition '{net.header['definition']}': {why}")


def energy_parameters(*kinds: str) -> dict[str, Parameter]:
    """Parameters of a solver that takes stiffnesses and values of kinds of energies as a net has them."""
    return {"stiffness": SPRING_STIFFNESS} | {
        f"{kind} {name}": Parameter(unit, f"{name} of {ENERGY_WORDS[kind]}, as of the net")
        for kind in kinds
        for name, unit in VALUES[kind].items()
    }
