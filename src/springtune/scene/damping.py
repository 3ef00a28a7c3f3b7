"""Dampers of a scene that give its loaded mode a measured decay, over mass, over stiffness and along springs."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..mechanics.dynamics import Motion
from ..problem.quantities import positive
from ..safe_io.tables import Tabled, number_text
from .single import Scene

Numbers = float | str | Sequence[float | str] | np.ndarray
"""A number of one measured mode, or two of two."""

MEASURES: dict[str, tuple[float, Callable[[float], float]]] = {
    "decrement": (np.inf, lambda value: value / np.hypot(2 * np.pi, value)),
    "ratio": (1.0, lambda value: value),
    "loss_factor": (2.0, lambda value: value / 2),
}
"""Measures of a decay: what they are below, and the damping ratio that they mean."""

SAME_MODE = 0.01
"""Relative difference of frequencies that no note is made of."""


@dataclass(frozen=True, repr=False, eq=False)
class Damping(Tabled):
    """Dampers that give the loaded mode of a scene a damping ratio.

    Attributes
    ----------
    scene : Scene
    ratio : float
        Damping ratio of the loaded mode [1].
    mass_damping : float
        Alpha, over mass [1/s]: alone it gives that ratio. A mode of n times the frequency gets the ratio over n.
        Rigid motion is damped, too.
    stiffness_damping : float
        Beta, over stiffness [s]: alone it gives that ratio. A mode of n times the frequency gets n times the ratio.
        Rigid motion is free.
    rayleigh : tuple of float
        Alpha [1/s] and beta [s] that act together: of two measured modes; of one, half of each.
    stiffness_factor : float
        What all stiffnesses must be multiplied by, or the density divided by, to have the measured period [1]; 1 where
        no period was given.
    notes : tuple of str
        What else to know.

    See Also
    --------
    damping_of : Makes it.

    Notes
    -----
    A mode of frequency w has the damping ratio alpha / (2 w) + beta w / 2. With a ratio x its logarithmic decrement
    is 2 pi x / sqrt(1 - x^2).

    Examples
    --------
    >>> import springtune as st
    >>> beam, rubber = st.Beam("100 mm", "10 mm"), st.Material("1 MPa", 0.45, density="1100 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "structured", "5 mm"), rubber, "bending", "1 mN")
    >>> damping = st.damping_of(scene, decrement=0.3)
    >>> print(f"{damping.frequency:.1f} rad/s, {damping.period:.3f} s, ratio {damping.ratio:.4f}")
    37.4 rad/s, 0.168 s, ratio 0.0477
    >>> print(f"{damping.mass_damping:.2f} 1/s or {1e3 * damping.stiffness_damping:.2f} ms")
    3.57 1/s or 2.55 ms

    One dashpot for each spring, in proportion to its stiffness, or one damper for each particle:

    >>> bool(abs(damping.dashpots - damping.stiffness_damping * st.SpringNet.from_scene(scene).stiffness).max() < 1e-12)
    True
    >>> f"{1e6 * damping.particle_dampers.max():.0f} uN s/m"
    '98 uN s/m'
    """

    scene: Scene = field(repr=False)
    ratio: float
    mass_damping: float
    stiffness_damping: float
    rayleigh: tuple[float, float]
    stiffness_factor: float = 1.0
    notes: tuple[str, ...] = ()

    @cached_property
    def _motion(self) -> Motion:
        return _loaded(self.scene)

    @property
    def frequency(self) -> float:
        """Frequency of the loaded mode of the scene, without damping [rad/s]."""
        return self._motion.loaded_frequency

    @property
    def period(self) -> float:
        """Period of the loaded mode of the scene with this damping [s]."""
        return 2 * np.pi / (self.frequency * np.sqrt(1 - self.ratio**2))

    @property
    def decrement(self) -> float:
        """Logarithmic decrement of the loaded mode [1].

        Examples
        --------
        >>> import springtune as st
        >>> beam, rubber = st.Beam("100 mm", "10 mm"), st.Material("1 MPa", 0.45, density="1100 kg/m^3")
        >>> scene = st.Scene(beam, st.make_mesh(beam, "structured", "5 mm"), rubber, "bending", "1 mN")
        >>> f"{st.damping_of(scene, ratio=0.05).decrement:.4f}"
        '0.3146'
        """
        return float(2 * np.pi * self.ratio / np.sqrt(1 - self.ratio**2))

    @property
    def particle_dampers(self) -> np.ndarray:
        """Damper of each particle over mass, ``alpha m`` [N s/m], shape (n_points,)."""
        return self.mass_damping * np.asarray(self.scene.statement.masses())

    @cached_property
    def dashpots(self) -> np.ndarray:
        """Dashpot of each spring that alone gives the ratio [N s/m], shape (n_springs,).

        They are in proportion to stiffness, ``beta k``. Springs that push get none, and the others more. All have the
        same where the definition has energies alone.
        """
        network = self.scene.network
        shares = np.maximum(network.stiffness, 0.0)
        if not shares.any():
            shares = np.ones_like(shares)
        frequency, shape = self._motion.loaded_mode
        matrix = Motion(network, self._motion.inertia[:, 0], dampers=shares).damper_matrix
        return self.scene.springs.reference * 2 * self.ratio * frequency / (shape @ (matrix @ shape)) * shares

    def options(self, over: str) -> dict[str, Any]:
        """Options of `Scene.motion` that damp it.

        Parameters
        ----------
        over : str
            ``"mass"``, ``"springs"`` (dashpots), or ``"both"``, as `rayleigh`.

        Returns
        -------
        dict of str to float or ndarray

        Raises
        ------
        ValueError
            If the choice is unknown.

        Examples
        --------
        Let go of, a beam comes back to a share of exp(-0.9) after three periods, less what its fast modes had:

        >>> import numpy as np
        >>> import springtune as st
        >>> beam, rubber = st.Beam("100 mm", "10 mm"), st.Material("1 MPa", 0.45, density="1100 kg/m^3")
        >>> mesh = st.make_mesh(beam, "structured", "5 mm")
        >>> scene = st.Scene(beam, mesh, rubber, "bending", "1 mN", kinematics="linear")
        >>> damping, bent = st.damping_of(scene, decrement=0.3), scene.solve()
        >>> motion = scene.motion(released=True, **damping.options("springs"))
        >>> run = motion.run("implicit-midpoint", damping.period / 200, 600, start=bent.displacements)
        >>> share = scene.displacement_of(run.displacements) / bent.displacement
        >>> f"{share:.2f}, exp(-0.9) = {np.exp(-0.9):.2f}"
        '0.39, exp(-0.9) = 0.41'
        """
        known = {"mass": (self.mass_damping, 0.0), "springs": (0.0, self.stiffness_damping), "both": self.rayleigh}
        if over not in known:
            raise ValueError(f"over: {over!r} is unknown; give one of {', '.join(known)}")
        alpha, beta = known[over]
        dampers = beta / self.stiffness_damping * self.dashpots / self.scene.springs.reference
        return {"mass_damping": alpha} | ({"dampers": dampers} if beta else {})

    def implicit_euler(self, step: float | str) -> "Damping":
        """Return what is left to type where implicit Euler takes the steps, which damps by itself.

        Parameters
        ----------
        step : float or str
            [s]

        Returns
        -------
        Damping
            Of the ratio that the scheme lacks.

        Raises
        ------
        ValueError
            If the step is so long that the scheme alone damps more than was measured.

        Notes
        -----
        A step h of implicit Euler has the matrix ``M + h C + h^2 K``: it damps as a stiffness damping of h, and a mode
        of frequency w by the ratio w h / 2. That is more than was measured where h is above `stiffness_damping`.

        Examples
        --------
        At sixty frames a second no damper is small enough for a beam that swings six times a second:

        >>> import springtune as st
        >>> beam, rubber = st.Beam("100 mm", "10 mm"), st.Material("1 MPa", 0.45, density="1100 kg/m^3")
        >>> scene = st.Scene(beam, st.make_mesh(beam, "structured", "5 mm"), rubber, "bending", "1 mN")
        >>> damping = st.damping_of(scene, decrement=0.3)
        >>> try:
        ...     damping.implicit_euler(1 / 60)
        ... except ValueError as error:
        ...     print(error)
        step: 16.7 ms of implicit Euler alone damp by a ratio of 0.312, not 0.0477; take 7 substeps or more of it
        >>> f"{1e3 * damping.implicit_euler('1 ms').stiffness_damping:.2f} ms"
        '1.55 ms'
        """
        length = positive(step, "time", "step")
        left = 1 - length / self.stiffness_damping
        if left <= 0:
            substeps = int(np.ceil(length / self.stiffness_damping))
            raise ValueError(
                f"step: {1e3 * length:.3g} ms of implicit Euler alone damp by a ratio of "
                f"{self.frequency * length / 2:.3g}, not {self.ratio:.3g}; take {substeps} substeps or more of it"
            )
        alpha, beta = self.rayleigh
        return replace(
            self,
            ratio=left * self.ratio,
            mass_damping=left * self.mass_damping,
            stiffness_damping=left * self.stiffness_damping,
            rayleigh=(alpha, beta - length) if beta > length else (left * self.mass_damping, 0.0),
        )

    def _rows(self) -> Iterator[tuple[str, str]]:
        alpha, beta = self.rayleigh
        yield "damping ratio", f"{self.ratio:.4g}, logarithmic decrement {self.decrement:.4g}"
        yield "loaded mode", f"{self.frequency / (2 * np.pi):.4g} Hz, period {number_text(self.period, 's')}"
        yield "over mass", f"{self.mass_damping:.4g} 1/s; damps slow modes and rigid motion most"
        yield "over stiffness", f"{1e3 * self.stiffness_damping:.4g} ms; damps fast modes most, rigid motion not"
        yield "together", f"{alpha:.4g} 1/s and {1e3 * beta:.4g} ms"
        least, most = self.dashpots.min(), self.dashpots.max()
        yield "dashpots", f"{least:.4g} to {most:.4g} N s/m, in place of over stiffness"
        yield "implicit Euler", f"damps as much by itself in steps of {1e3 * self.stiffness_damping:.4g} ms"
        yield "notes", "; ".join(self.notes)


def damping_of(
    scene: Scene,
    *,
    decrement: Numbers | None = None,
    ratio: Numbers | None = None,
    loss_factor: Numbers | None = None,
    period: Numbers | None = None,
    at: Numbers | None = None,
) -> Damping:
    r"""Dampers of a scene from a measured decay.

    Parameters
    ----------
    scene : Scene
        Of materials that have a density.
    decrement : float, optional
        Logarithmic decrement: of a peak over the next one on the same side, the natural logarithm [1]. See `fit_decay`.
    ratio : float, optional
        Damping ratio, in its place: below 1 [1].
    loss_factor : float, optional
        Loss factor tan delta of the material, in its place: below 2 [1].
    period : float or str, optional
        Time between such peaks [s]. Damping is for the scene's own period all the same; what makes the two agree is in
        `Damping.stiffness_factor`.
    at : float or str, optional
        Frequency at which the loss factor was measured [Hz].

    Returns
    -------
    Damping

    Raises
    ------
    ValueError
        If none or several of the measures are given, a number is out of its range, or no Rayleigh damping has the
        ratios of two modes; or if the scene has no masses, or is unstable at rest. The message says what to give.

    See Also
    --------
    fit_decay : Period and decrement from a measured swing.

    Notes
    -----
    All numbers may be pairs, of two measured modes: then their periods are needed, or the frequencies of two loss
    factors. The first mode is the loaded one. Alpha and beta solve ``ratio = alpha / (2 w) + beta w / 2`` for both.

    At resonance a loss factor is twice the damping ratio. The mode is that of small swings about rest: gravity or a
    load that stays shifts it.

    Examples
    --------
    A beam of rubber swings in 0.19 s where the scene does in 0.17 s:

    >>> import springtune as st
    >>> beam, rubber = st.Beam("100 mm", "10 mm"), st.Material("1 MPa", 0.45, density="1100 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "structured", "5 mm"), rubber, "bending", "1 mN")
    >>> damping = st.damping_of(scene, decrement=0.3, period="0.19 s")
    >>> print(*damping.notes[0].split("; "), sep="\n")
    the measured period is 1.13 times the scene's
    multiply stiffnesses by 0.784 or the density by 1.28, and ask again

    Two modes, and one number too few:

    >>> both = st.damping_of(scene, ratio=(0.05, 0.08), period=("0.21 s", "0.034 s"))
    >>> f"alpha {both.rayleigh[0]:.2f} 1/s, beta {1e3 * both.rayleigh[1]:.2f} ms"
    'alpha 2.85 1/s, beta 0.64 ms'
    >>> try:
    ...     st.damping_of(scene, ratio=(0.05, 0.08), period="0.21 s")
    ... except ValueError as error:
    ...     print(error)
    period: '0.21 s' and ratio are not as many; give one for each mode, or two of two
    """
    name, ratios = _ratios({"decrement": decrement, "ratio": ratio, "loss_factor": loss_factor})
    timed, given, wrong, other = ("at", at, "period", period) if name == "loss_factor" else ("period", period, "at", at)
    if other is not None:
        raise ValueError(f"{wrong}: {other!r} does not go with {name}; give {timed} in its place")
    values = [] if given is None else _values(timed, given)
    if len(values) != len(ratios) and (values or len(ratios) == 2):
        raise ValueError(f"{timed}: {given!r} and {name} are not as many; give one for each mode, or two of two")
    if scene.network.rest_factor.negative_pivots:
        raise ValueError(
            f"definition '{scene.definition.name}': is unstable at rest, so that nothing swings; take another "
            "definition or mesh"
        )
    own = _loaded(scene).loaded_frequency
    alpha, beta, factor = ratios[0] * own, ratios[0] / own, 1.0
    if timed == "at":
        measured = [2 * np.pi * positive(one, "frequency", timed) for one in values]
    else:
        measured = [2 * np.pi / positive(one, "time", timed) / np.sqrt(1 - x**2) for one, x in zip(values, ratios)]
        factor = (measured[0] / own) ** 2 if measured else 1.0
        measured = [one / np.sqrt(factor) for one in measured]  # as damping goes with the scene's own mode
    first = ratios[0]
    if len(ratios) == 2:
        alpha, beta = _rayleigh(name, ratios, measured)
        first = (alpha / own + beta * own) / 2
    return Damping(scene, first, 2 * first * own, 2 * first / own, (alpha, beta), factor, _notes(factor, measured, own))


def _loaded(scene: Scene) -> Motion:
    """Motion of a scene under its load at rest, also of one that turns."""
    return scene.motion(released=True, load=scene.forces / scene.springs.reference)


def _values(name: str, given: Numbers) -> list[Any]:
    """One or two values."""
    values = list(given) if isinstance(given, list | tuple | np.ndarray) else [given]
    if len(values) not in (1, 2):
        raise ValueError(f"{name}: {given!r} is neither one value nor two; give one for each measured mode")
    return values


def _ratios(given: dict[str, Numbers | None]) -> tuple[str, list[float]]:
    """Name of the measure that is given, and the damping ratios that it means."""
    known = {name: value for name, value in given.items() if value is not None}
    if len(known) != 1:
        said = " and ".join(f"{name}={value!r}" for name, value in known.items()) or "nothing was measured"
        raise ValueError(f"{', '.join(given)}: {said}; give one of them, such as decrement=0.3")
    [(name, value)] = known.items()
    most, ratio = MEASURES[name]
    numbers = [np.nan if isinstance(one, str | bool) else float(one) for one in _values(name, value)]
    if not all(0 < one < most for one in numbers):
        raise ValueError(f"{name}: {value!r} is not a number above zero and below {most:g}; give one")
    return name, [ratio(one) for one in numbers]


def _rayleigh(name: str, ratios: list[float], frequencies: list[float]) -> tuple[float, float]:
    """Alpha [1/s] and beta [s] that give two modes their ratios."""
    share = frequencies[1] / frequencies[0]
    if abs(share - 1) > SAME_MODE:
        matrix = [[0.5 / frequency, 0.5 * frequency] for frequency in frequencies]
        alpha, beta = np.linalg.solve(matrix, ratios).tolist()
        if alpha >= 0 and beta >= 0:
            return alpha, beta
    low, high = sorted((ratios[0] / share, ratios[0] * share))
    raise ValueError(
        f"{name}: damping ratios of {ratios[0]:.3g} and {ratios[1]:.3g}, of frequencies that are as 1 to {share:.3g}, "
        f"and with damping over mass and stiffness the second ratio is {low:.3g} to {high:.3g}; give one mode"
    )


def _notes(factor: float, measured: list[float], own: float) -> tuple[str, ...]:
    """What a measured period says of the stiffness, and the frequency of a loss factor of what it is for."""
    longer = 1 / np.sqrt(factor)
    if abs(longer - 1) > SAME_MODE:
        remedy = f"multiply stiffnesses by {factor:.3g} or the density by {1 / factor:.3g}, and ask again"
        return (f"the measured period is {longer:.3g} times the scene's; {remedy}",)
    if len(measured) == 1 and abs(measured[0] / own - 1) > SAME_MODE:
        there, here = measured[0] / (2 * np.pi), own / (2 * np.pi)
        return (
            f"the loss factor is of {there:.3g} Hz, and the loaded mode at {here:.3g} Hz; give the one of {here:.3g}",
        )
    return ()
