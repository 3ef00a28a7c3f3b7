r"""Limits of a small-strain reference for a network at large deformation.

A cantilever under a dead end load is the elastica :math:`\theta'' = -\alpha \cos\theta`, :math:`\alpha = F L^2 / (E
I)`. Its end deflects by :math:`4/35\,\alpha^2` less than in small strain, where it turns by :math:`\alpha/2`;
`elastica` has the closed form at any load.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

MOST_EFFECT = 0.01
"""Largest effect of finite rotation on a displacement, relative, with which a reference of small strain applies."""

MOST_STRAIN = 0.15
"""Largest strain for a small-strain reference; the paper's beams stretch by 5 %, its block by 11 %."""

SHARE = 0.95
"""Share of a body in which rotations and strains are at most those that it is judged by: corners are singular."""


def rotation_and_strain(x: np.ndarray, y: np.ndarray, displacements: np.ndarray) -> tuple[float, float]:
    """Return the rotation [rad] and principal strain [1] that 95 % of a body do not exceed, in small strain.

    `x` (n_x,) and `y` (n_y,) are an ascending grid [m], with `displacements` (n_x, n_y, 2) [m].
    """
    middle = [(displacements[:, 1:] + displacements[:, :-1]) / 2, (displacements[1:] + displacements[:-1]) / 2]
    by_x = np.diff(middle[0], axis=0) / np.diff(x)[:, None, None]
    by_y = np.diff(middle[1], axis=1) / np.diff(y)[None, :, None]
    areas = np.multiply.outer(np.diff(x), np.diff(y)).ravel()
    return most_rotation_and_strain(np.stack([by_x, by_y], axis=-1).reshape(-1, 2, 2), areas)


def most_rotation_and_strain(gradients: np.ndarray, areas: np.ndarray) -> tuple[float, float]:
    """Return `rotation_and_strain` of displacement `gradients` (n, 2, 2) [1] with their `areas` (n,) [m2].

    Axes of gradients: component, then coordinate.
    """
    by_x, by_y = gradients[..., 0], gradients[..., 1]
    rotation = np.abs(by_x[..., 1] - by_y[..., 0]) / 2
    mean, half = (by_x[..., 0] + by_y[..., 1]) / 2, (by_x[..., 0] - by_y[..., 1]) / 2
    strain = np.abs(mean) + np.hypot(half, (by_x[..., 1] + by_y[..., 0]) / 2)
    return _exceeded_rarely(rotation, areas), _exceeded_rarely(strain, areas)


def _exceeded_rarely(values: np.ndarray, areas: np.ndarray) -> float:
    """Value that most of a body does not exceed, see `SHARE`."""
    order = np.argsort(values)
    # A hair less: where cells of some number make up the share exactly, rounding shall not ask for one more.
    reached = np.searchsorted(np.cumsum(areas[order]), SHARE * areas.sum() * (1 - 1e-9))
    return float(values[order[min(int(reached), len(order) - 1)]])


def elastica(load: float) -> float:
    r"""Return the end deflection of a cantilever under a dead load across it, over its length [1].

    `load` is :math:`\alpha = F L^2 / (E I)` [1], at least 0. With the turn :math:`\psi` of the end, :math:`p^2 = (1 +
    \sin\psi)/2` and :math:`\sin\varphi = 1/(\sqrt 2 p)` (Bisshopp and Drucker, Quart. Appl. Math. 3:272, 1945)

    .. math:: \sqrt\alpha = K(p) - F(p, \varphi), \qquad
        w / L = 1 - \tfrac{2}{\sqrt\alpha} (E(p) - E(p, \varphi)).
    """
    if load < 1e-4:
        return load / 3 * (1 - 4 / 35 * load**2)
    from scipy.optimize import brentq  # here: few beams turn as far
    from scipy.special import ellipeinc, ellipkinc

    def parts(turn: float, integral: Callable[[float, float], float]) -> float:
        parameter = (1 + np.sin(turn)) / 2
        return integral(np.pi / 2, parameter) - integral(np.arcsin(np.sqrt(0.5 / parameter)), parameter)

    turn = brentq(lambda turn: parts(turn, ellipkinc) - np.sqrt(load), 0.0, np.pi / 2 * (1 - 1e-12), xtol=1e-15)
    return float(1 - 2 / np.sqrt(load) * parts(turn, ellipeinc))


def rotation_effect(rotation: float) -> float:
    """Return the relative effect of finite rotation on a slender cantilever's deflection; end rotation in rad."""
    load = 2 * abs(rotation)
    return 3 * elastica(load) / load - 1 if load else 0.0


def beyond_linear(rotation: float, strain: float) -> str:
    """Return why a small-strain reference of this rotation [rad] and strain [1] does not fit nonlinear kinematics."""
    reasons = []
    # The first term of the series bounds the effect: most beams do without the elastica, and without importing it.
    if 4 / 35 * (2 * rotation) ** 2 > MOST_EFFECT and -(effect := rotation_effect(rotation)) > MOST_EFFECT:
        reasons.append(f"it turns by {abs(rotation):.2g} rad, where finite rotation takes {-100 * effect:.2g} % off "
                       "a cantilever's deflection")  # fmt: skip
    if abs(strain) > MOST_STRAIN:
        reasons.append(f"its strain is {100 * abs(strain):.2g} %")
    return f"the linear reference does not apply: {', and '.join(reasons)}" if reasons else ""


def objection(result: dict[str, Any], force: float, kinematics: str) -> str:
    """Return why a network under a force [N] is not compared with, or fitted to, a reference."""
    if "displacement" not in result:
        return f"no reference: {result['message']}"
    if kinematics == "linear":
        return ""
    return beyond_linear(force * result["rotation"], force * result["strain"])
