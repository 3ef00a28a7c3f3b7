"""Extended position-based dynamics: Macklin, Mueller and Chentanez, XPBD, Motion in Games 2016.

A spring is the constraint ``C = l - L`` with compliance ``1 / k``. An iteration visits the constraints one after the
other; each changes its multiplier by ``(-C - a lambda) / (sum of w |grad C|^2 + a)`` with ``a = 1 / (k h^2)``.
Multipliers begin each step at zero. Few iterations of small steps are better than many of large ones (Macklin et al.,
Small steps in physics simulation, SCA 2019). Read: both papers' methods as they are described in later ones.
"""

import numpy as np

from ..handover.net import SpringNet
from .base import EngineError, Parameter, Session, Setting, engine
from .textbook import Textbook, compiled


@compiled
def _project(x, weights, springs, lengths, compliance, iterations):  # type: ignore[no-untyped-def]
    """Positions after iterations over all springs; compliance over the squared step."""
    multipliers = np.zeros_like(lengths)
    for _ in range(iterations):
        for e in range(len(lengths)):
            i, j = springs[e]
            dx, dy = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1]
            length = np.sqrt(dx * dx + dy * dy)
            dx, dy = dx / length, dy / length
            total = (weights[i, 0] + weights[j, 0]) * dx * dx + (weights[i, 1] + weights[j, 1]) * dy * dy
            if total == 0:
                continue
            change = (lengths[e] - length - compliance[e] * multipliers[e]) / (total + compliance[e])
            multipliers[e] += change
            x[i, 0] -= weights[i, 0] * change * dx
            x[i, 1] -= weights[i, 1] * change * dy
            x[j, 0] += weights[j, 0] * change * dx
            x[j, 1] += weights[j, 1] * change * dy
    return x


class _Session(Textbook):
    def __init__(self, net: SpringNet, setting: Setting, damping: float) -> None:
        super().__init__(net, setting, damping)
        if self.stiffness.min() < 0:
            raise EngineError(
                f"definition '{net.header['definition']}': has springs of negative stiffness, and no compliance is "
                "negative; take 'patch' or 'lattice', whose springs all pull"
            )
        self.compliance = (1 / (self.stiffness * self.h**2)).astype(self.kind)

    def solve(self, before: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Project the inertial positions."""
        found: np.ndarray = _project(y, self.weights, self.springs, self.lengths, self.compliance, self.iterations)
        return found


@engine("xpbd", order=20, parameters={"compliance": Parameter("m/N", "1 / k")}, implicit=True, source="Macklin 2016")
def session(net: SpringNet, setting: Setting, damping: float) -> Session:
    """Extended position-based dynamics: springs as constraints with compliance, multipliers reset in each step."""
    return _Session(net, setting, damping)
