"""Displacement over uniform stiffness: one equilibrium path serves all stiffnesses and forces of one sign."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..mechanics.series import LinearPath, StablePath
from ..problem.compare import Best, best_stiffness, deformation_error, error_text
from ..problem.loads import LoadKind
from ..problem.quantities import Status
from ..registry import hook
from ..safe_io import Tabled
from ..springs.base import Springs
from ..springs.lattice import COEFFICIENT, predicted_stiffness, uniform
from .mesh_cache import MeshCache

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .single import Scene

USUAL_RATIOS = tuple(COEFFICIENT * np.linspace(0.4, 1.6, 61))
"""Stiffnesses of a curve over E t [1], where none are given."""


CurvePath = LinearPath | StablePath  # equilibrium path over force over stiffness

LEAST_RATIO = 1e-9  # least ratio of a stiffness; the largest is one over it [1]


def follow(cache: MeshCache, kind: LoadKind, kinematics: str, loads: np.ndarray) -> CurvePath:
    """Equilibrium path of springs of one stiffness, as far as `loads` need it: force over stiffness [m], one sign."""
    problem = cache.problem(kind, Springs(1.0, uniform(cache.mesh)))
    return (LinearPath if kinematics == "linear" else StablePath)(problem, cache.measured(kind), loads)


def meeting_stiffness(path: CurvePath, force: float, stiffness: np.ndarray, reference: float, objection: str) -> Best:
    """Find the stiffness at which a path's displacement is the reference [m]; stiffnesses in N/m, force in N."""
    if objection:
        return Best(np.nan, Status.FAILED, f"{objection}; take a smaller force or linear kinematics")
    best = best_stiffness(stiffness, path.values, path.stable, reference, lambda one: path.value(force / one))
    if isinstance(path, LinearPath) and best.status is Status.SOLVED:
        # In proportion: to the last digit the same from all points of a curve.
        return replace(best, stiffness=path.value(force) / reference)
    return best


def incomplete_reason(path: CurvePath, force: float) -> str:
    """Return why a curve is not solved at all its stiffnesses, or an empty string."""
    if path.stable.all():
        return ""
    reason = path.end or "not followed beyond its turning point"
    return f"{reason}: solved from {abs(force) / path.stable_to:.6g} N/m" if path.stable_to else reason


@dataclass(frozen=True, repr=False)
class Curve(Tabled):
    """A sensitivity curve: displacement of a scene over uniform stiffness.

    Attributes
    ----------
    stiffness : ndarray of float, shape (n,)
        [N/m]
    displacement : ndarray of float, shape (n,)
        Of the load [m]; NaN where the path from rest does not get there.
    error : ndarray of float, shape (n,)
        Signed deformation error [1].
    stable : ndarray of bool, shape (n,)
        Whether the path from rest gets there and is stable all the way.
    message : str
        Why some are not stable; empty where all are.
    best_stiffness : float
        Stiffness of the stable equilibrium without error [N/m]; NaN without one.
    best_status, best_message : Status, str
        Why `best_stiffness` is NaN.
    predicted_stiffness : float
        By closed form [N/m], see `springtune.springs.lattice.predicted_stiffness`; NaN for loads that have none.
    title : str

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("200 mm", "30 mm"), st.Material("210 GPa", 0.3)
    >>> scene = st.Scene(beam, st.make_mesh(beam, "structured", "5 mm"), steel, "traction", "300 kN")
    >>> curve = st.sensitivity(scene, [0.5, 0.7, 0.9])
    >>> (100 * curve.error).round(1).tolist()
    [51.8, 8.5, -15.6]
    >>> print(f"no error at {curve.best_stiffness:.4g} N/m: {curve.best_status}")
    no error at 1.595e+08 N/m: solved
    >>> curve.plot().get_ylabel()
    'Deformation error [%]'
    """

    stiffness: np.ndarray
    displacement: np.ndarray
    error: np.ndarray
    stable: np.ndarray
    message: str
    best_stiffness: float
    best_status: Status
    best_message: str
    predicted_stiffness: float
    title: str

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "of", self.title
        yield "stiffness", f"{self.stiffness[0]:.4g} to {self.stiffness[-1]:.4g} N/m"
        yield "error", " to ".join(map(error_text, self.error[self.stable][[0, -1]])) if self.stable.any() else ""
        yield "stable", f"{self.stable.sum()} of {len(self.stable)}"
        yield "reason", self.message
        yield "no error at", self.best_message or f"{self.best_stiffness:.4g} N/m"
        yield "predicted", "" if np.isnan(self.predicted_stiffness) else f"{self.predicted_stiffness:.4g} N/m"

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the error over the stiffness.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional

        Returns
        -------
        matplotlib.axes.Axes
        """
        return hook("drawing").draw_curve(ax, self)


def sensitivity(scene: "Scene", stiffness_ratios: ArrayLike | None = None) -> Curve:
    """Displacement of a scene over uniform stiffness, and where it meets the reference; see `mechanics.series`.

    Parameters
    ----------
    scene : Scene
        Its definition is not used; a force that follows its side, in nonlinear kinematics, has no curve.
    stiffness_ratios : array_like of float, optional
        Stiffnesses over E t [1], above zero; 61 from 0.4 to 1.6 times sqrt(3)/2 without.

    Returns
    -------
    Curve

    Raises
    ------
    ValueError
        If a stiffness is not above zero, or the force follows its side.

    Examples
    --------
    >>> import springtune as st
    >>> beam = st.Beam("200 mm", "30 mm")
    >>> mesh = st.make_mesh(beam, "structured", "5 mm")
    >>> curve = st.sensitivity(st.Scene(beam, mesh, st.Material("210 GPa", 0.3), "traction", "300 kN"))
    >>> print(f"{curve.best_stiffness:.3g} N/m, closed form {curve.predicted_stiffness:.3g} N/m")
    1.6e+08 N/m, closed form 1.59e+08 N/m
    """
    if not hasattr(scene, "follower"):
        raise ValueError(f"scene: {scene!r} is not of a beam; give one such as springtune.Scene(beam, mesh, ...)")
    if scene.follower:
        raise ValueError(f"load: {scene.load!r} turns with its side, and has no curve; take linear kinematics")
    try:
        given = USUAL_RATIOS if stiffness_ratios is None else stiffness_ratios
        ratios = np.sort(np.asarray(given, dtype=float).ravel())
    except (TypeError, ValueError, OverflowError):
        ratios = np.zeros(0)
    if not len(ratios) or not ((ratios > LEAST_RATIO) & (ratios < 1 / LEAST_RATIO)).all():
        raise ValueError("stiffness_ratios: not all above zero; give stiffnesses over E t such as [0.5, 0.8, 1.1]")
    beam, kind, force = scene.beam, scene.kind, scene.force
    stiffness = ratios * scene.material.in_plane.young_modulus * beam.thickness
    path = follow(scene.cache, kind, scene.kinematics, force / stiffness)
    try:
        reference, objection = scene.reference_values()["displacement"], scene.objection
    except RuntimeError as error:
        reference, objection = np.nan, f"no reference: {error}"
    faces = np.concatenate([scene.mesh.outline_edges(1, value) for value in (0.0, scene.mesh.points[:, 1].max())])
    edge = float(np.median(np.abs(np.diff(scene.mesh.points[faces, 0]))))
    best = meeting_stiffness(path, force, stiffness, reference, objection)
    predicted = predicted_stiffness(scene.material, beam, edge, scene.load)
    off, why = deformation_error(path.values, reference), incomplete_reason(path, force)
    title, found = f"{beam.label}, {scene.load} of {abs(force):g} N", (best.stiffness, best.status, best.message)
    return Curve(stiffness, path.values, off, path.stable, why, *found, predicted, title)
