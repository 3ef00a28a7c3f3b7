r"""Post-processing of references: fields, limits of small strain, scales of unit problems.

A cantilever's end under a dead load deflects by :math:`4/35\,\alpha^2` less than in small strain, where it turns by
:math:`\alpha/2`, with :math:`\alpha = F L^2 / (E I)` (elastica).

The unit problem has lengths over half the height and stresses over the traction. Only the aspect ratio, Poisson's ratio
and the kind of load remain, so beams share it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..problem.loads import LoadKind
from ..problem.materials import Material
from ..problem.shapes import Beam


@dataclass(frozen=True)
class BeamField:
    """Displacements of a beam that a reference finds.

    - `displacement`, `error_estimate`: Displacement of the load [m], and a bound on its relative error [1]; of the
      middle of a pressed side an estimate.
    - `mean_displacement`: Mean displacement of the loaded side along the force [m].
    - `displacements` (n_x, n_y, 2): On the grid `x`, `y` at rest [m], denser near the outline.
    """

    displacement: float
    mean_displacement: float
    error_estimate: float
    x: np.ndarray
    y: np.ndarray
    displacements: np.ndarray

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return displacements [m] at rest points (n, 2) [m] of the beam, see `interpolate`."""
        return interpolate(self.x, self.y, self.displacements, points)


MOST_ROTATION_EFFECT = 0.01
"""Largest effect of finite rotation on a displacement, relative, with which a reference of small strain applies."""

MOST_STRAIN = 0.15  # largest strain for a small-strain reference; the paper's beams stretch by 5 %, its block by 11 %

FAR_STRAIN = 1.0  # strain from which it alone is told: the small-strain rotation beside it says nothing

JUDGED_AREA_SHARE = 0.95
"""Share of a body in which rotations and strains are at most those that it is judged by: corners are singular."""


def rotation_and_strain(x: np.ndarray, y: np.ndarray, displacements: np.ndarray) -> tuple[float, float]:
    """Return the rotation [rad] and principal strain [1] that 95 % of a body do not exceed, in small strain."""
    middle = [(displacements[:, 1:] + displacements[:, :-1]) / 2, (displacements[1:] + displacements[:-1]) / 2]
    by_x = np.diff(middle[0], axis=0) / np.diff(x)[:, None, None]
    by_y = np.diff(middle[1], axis=1) / np.diff(y)[None, :, None]
    areas = np.multiply.outer(np.diff(x), np.diff(y)).ravel()
    return most_rotation_and_strain(np.stack([by_x, by_y], axis=-1).reshape(-1, 2, 2), areas)


def most_rotation_and_strain(gradients: np.ndarray, areas: np.ndarray) -> tuple[float, float]:
    """Return `rotation_and_strain` of `gradients` (n, 2, 2), by component and coordinate, with `areas` (n,)."""
    by_x, by_y = gradients[..., 0], gradients[..., 1]
    rotation = np.abs(by_x[..., 1] - by_y[..., 0]) / 2
    mean, half = (by_x[..., 0] + by_y[..., 1]) / 2, (by_x[..., 0] - by_y[..., 1]) / 2
    strain = np.abs(mean) + np.hypot(half, (by_x[..., 1] + by_y[..., 0]) / 2)
    return _area_quantile(rotation, areas), _area_quantile(strain, areas)


def _area_quantile(values: np.ndarray, areas: np.ndarray) -> float:
    """Value that most of a body does not exceed, see `JUDGED_AREA_SHARE`."""
    order = np.argsort(values)
    # A hair less: where cells of some number make up the share exactly, rounding shall not ask for one more.
    reached = np.searchsorted(np.cumsum(areas[order]), JUDGED_AREA_SHARE * areas.sum() * (1 - 1e-9))
    return float(values[order[min(int(reached), len(order) - 1)]])


def elastica(load: float) -> float:
    r"""Return the end deflection of a cantilever under a dead load across it, over its length [1].

    `load` is :math:`\alpha = F L^2 / (E I)` >= 0. With the turn :math:`\psi` of the end, :math:`p^2 = (1 + \sin\psi)/2`
    and :math:`\sin\varphi = 1/(\sqrt 2 p)` (Bisshopp and Drucker, Quart. Appl. Math. 3:272, 1945)

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
    may_matter = abs(strain) < FAR_STRAIN and 4 / 35 * (2 * rotation) ** 2 > MOST_ROTATION_EFFECT
    if may_matter and -(effect := rotation_effect(rotation)) > MOST_ROTATION_EFFECT:
        reasons.append(f"it turns by {abs(rotation):.2g} rad, and a cantilever that turns so far deflects by "
                       f"{-100 * effect:.2g} % less than in small strain")  # fmt: skip
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


def interpolate(x: np.ndarray, y: np.ndarray, displacements: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Interpolate displacements (n_x, n_y, 2) on an ascending grid at points (n, 2) inside, by cubic splines.

    On the grid of a `ReferenceSolution` within 1e-5 of the largest one; the error is mostly at a clamp's corners.
    """
    from scipy.interpolate import RectBivariateSpline  # here: whoever wants the outline alone does without

    return np.stack([RectBivariateSpline(x, y, displacements[:, :, axis]).ev(*points.T) for axis in range(2)], axis=1)


def outline(x: np.ndarray, y: np.ndarray, displacements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the grid points on the outline, in order around it and not closed, and their displacements (n, 2) [m]."""
    n_x, n_y = len(x), len(y)
    i = np.concatenate([np.arange(n_x), np.full(n_y - 1, n_x - 1), np.arange(n_x - 2, -1, -1), np.zeros(n_y - 2, int)])
    j = np.concatenate([np.zeros(n_x, int), np.arange(1, n_y), np.full(n_x - 1, n_y - 1), np.arange(n_y - 2, 0, -1)])
    return np.stack([x[i], y[j]], axis=1), displacements[i, j]


def field_error(mesh: Any, displacements: np.ndarray, reference: np.ndarray) -> float:
    """Return the L2 difference of displacement fields (n_points, 2) over the norm of the reference's [1]."""
    fields = displacements - reference, reference
    difference, size = (mesh.particle_areas @ (field**2).sum(axis=1) for field in fields)
    return float(np.sqrt(difference / size))


def unit_problem(beam: Beam, material: Material, kind: LoadKind) -> tuple[float, float, LoadKind]:
    """Aspect ratio [1], Poisson's ratio [1] and kind of load."""
    return float(f"{beam.length / beam.height:.12g}"), material.in_plane.poisson_ratio, kind


def unit_scales(beam: Beam, material: Material, kind: LoadKind) -> tuple[float, float]:
    """Return the unit problem's scales: half the height, and that times the traction of 1 N over E [m]."""
    side = kind.side_length(beam)
    return beam.height / 2, beam.height / 2 / (side * beam.thickness * material.in_plane.young_modulus)
