"""Position-based dynamics: Mueller, Heidelberger, Hennix and Ratcliff, J. Vis. Commun. Image R. 18, 2007.

A warning rather than a tool: its stiffness s is the share of a spring's stretch that an iteration takes away. One
spring, with w the sum of its ends' inverse masses, n iterations and steps of h, rests as if it had

    k = ((1 - s)^-n - 1) / (w h^2)    [N/m], so    s = 1 - (1 + k w h^2)^(-1/n).

A net of springs then tends to our equilibrium as h^2, at any n, but not as n grows: with A = M^-1 times the tangent of
springs of ``ln(1 + k w h^2) / w``, a linear net rests where ``(exp(A) - 1) u = h^2 M^-1 f``.
"""

import numpy as np

from ..handover.net import SpringNet
from .base import Parameter, Setting, Textbook, engine, project_springs, refuse_pushing_springs


def shares(net: SpringNet, setting: Setting) -> np.ndarray:
    """Stiffness of position-based dynamics for each spring of a net [1]; 0 where both ends are held."""
    weights = np.where(net.held, 0, 1 / net.masses[:, None])[net.springs].sum(axis=1)
    along = (net.points[net.springs[:, 1]] - net.points[net.springs[:, 0]]) / net.rest_lengths[:, None]
    grown = net.stiffness * setting.step**2 * np.einsum("ij,ij->i", weights, along**2)
    return -np.expm1(-np.log1p(grown) / setting.iterations)


@engine(
    "pbd",
    order=10,
    parameters={"stiffness": Parameter("1", "1 - (1 + k w h^2)^(-1/n), w = 1/m_i + 1/m_j; h the step, n iterations")},
    typed=lambda net, setting: {"stiffness": shares(net, setting)},
    of_setting=True,
    measured="falls as the step squared; iterations alone end elsewhere",
    source="Mueller 2007",
)
class PositionBased(Textbook):
    """Position-based dynamics: shares of stretches, which mean another stiffness at each setting; a warning."""

    def __init__(self, net: SpringNet, setting: Setting, damping: float) -> None:
        refuse_pushing_springs(net, "no share of a stretch is negative")
        super().__init__(net, setting, damping)
        self.shares = shares(net, setting)[net.stiffness != 0].astype(self.dtype)

    def solve(self, y: np.ndarray) -> np.ndarray:
        """Project the inertial positions: no constraint is compliant."""
        none = np.zeros_like(self.lengths)
        project_springs(y, self.weights, self.springs, self.lengths, self.shares, none, none.copy(), self.iterations)
        return y
