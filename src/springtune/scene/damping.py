"""Dampers of a scene that give its loaded mode a measured decay, over mass, over stiffness and along springs."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..mechanics.dynamics import Motion
from ..problem.quantities import positive
from ..safe_io.tables import Tabled, number_text
from .sheet import chosen
from .single import Scene

MEASURES: dict[str, Callable[[float], float]] = {
    "decrement": lambda value: value / np.hypot(2 * np.pi, value),
    "ratio": lambda value: value,
    "loss_factor": lambda value: value / 2,
}
"""Damping ratios that measures of a decay mean."""

SAME_MODE = 0.01
"""Relative difference of frequencies that no note is made of."""


@dataclass(frozen=True, repr=False, eq=False)
class Damping(Tabled):
    """Dampers that give the loaded mode of a scene a damping ratio.

    Attributes
    ----------
    scene : Scene
    motion : Motion
        Of the scene about rest, without damping.
    ratio : float
        Damping ratio of the loaded mode [1].
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

    >>> ratio = damping.dashpots / st.SpringNet.from_scene(scene).stiffness
    >>> bool(abs(ratio / damping.stiffness_damping - 1).max() < 1e-9)
    True
    >>> f"{1e6 * damping.particle_dampers.max():.0f} uN s/m"
    '98 uN s/m'

    Half of each of both, together:

    >>> print("{:.2f} 1/s and {:.4f} s".format(*damping.rayleigh))
    1.78 1/s and 0.0013 s
    """

    scene: Scene
    motion: Motion
    ratio: float
    stiffness_factor: float = 1.0
    notes: tuple[str, ...] = ()

    @property
    def frequency(self) -> float:
        """Frequency of the loaded mode of the scene, without damping [rad/s]."""
        return self.motion.loaded_frequency

    @property
    def mass_damping(self) -> float:
        """Alpha, over mass [1/s]: alone it gives the ratio.

        A mode of n times the frequency gets the ratio over n. Rigid motion is damped, too.
        """
        return 2 * self.ratio * self.frequency

    @property
    def stiffness_damping(self) -> float:
        """Beta, over stiffness [s]: alone it gives the ratio.

        A mode of n times the frequency gets n times the ratio. Rigid motion is free.
        """
        return 2 * self.ratio / self.frequency

    @property
    def rayleigh(self) -> tuple[float, float]:
        """Alpha [1/s] and beta [s] that act together: half of each."""
        return 0.5 * self.mass_damping, 0.5 * self.stiffness_damping

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
        stiffness = self.scene.network.stiffness
        shares = np.maximum(stiffness, 0.0) if (stiffness > 0).any() else np.ones_like(stiffness)
        shape = self.motion.loaded_mode[1]
        matrix = self.scene.motion(released=True, dampers=shares).damper_matrix
        return self.scene.springs.reference * 2 * self.ratio * self.frequency / (shape @ (matrix @ shape)) * shares

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
        alpha, beta = chosen(known, over, "over")
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
        of frequency w by the ratio w h / 2, to first order in w h. That is more than was measured where h is above
        `stiffness_damping`. What is left to type makes a decrement that is 3 to 9 % too small at w h = 0.3, and 10 to
        16 % at 0.6, for ratios up to 0.5: take steps of w h <= 0.1 for 3 %.

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
        step: implicit Euler alone has a ratio of 0.312, not 0.0477; take 7 substeps or more
        >>> f"{1e3 * damping.implicit_euler('1 ms').stiffness_damping:.2f} ms"
        '1.55 ms'
        """
        share = positive(step, "time", "step") / self.stiffness_damping
        if share >= 1:
            ratios, count = f"{share * self.ratio:.3g}, not {self.ratio:.3g}", int(share) + 1
            raise ValueError(f"step: implicit Euler alone has a ratio of {ratios}; take {count} substeps or more")
        return replace(self, ratio=(1 - share) * self.ratio)

    def _rows(self) -> Iterator[tuple[str, str]]:
        alpha, beta = self.rayleigh
        yield "damping ratio", f"{self.ratio:.4g}, logarithmic decrement {self.decrement:.4g}"
        yield "loaded mode", f"{self.frequency / (2 * np.pi):.4g} Hz, period {number_text(self.period, 's')}"
        yield "over mass", f"{self.mass_damping:.4g} 1/s; damps slow modes and rigid motion most"
        steps = f"{1e3 * self.stiffness_damping:.4g} ms, or steps of implicit Euler of that length"
        yield "over stiffness", f"{steps}; damps fast modes most, rigid motion not"
        yield "together", f"{alpha:.4g} 1/s and {1e3 * beta:.4g} ms"
        yield "dashpots", f"{self.dashpots.min():.4g} to {self.dashpots.max():.4g} N s/m, in place of over stiffness"
        yield "notes", "; ".join(self.notes)


def damping_of(
    scene: Scene,
    *,
    decrement: float | None = None,
    ratio: float | None = None,
    loss_factor: float | None = None,
    period: float | str | None = None,
    at: float | str | None = None,
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
        If none or several of the measures are given, a number is out of its range, or the scene has no masses or is
        unstable at rest. The message says what to give.

    See Also
    --------
    fit_decay : Period and decrement from a measured swing.

    Notes
    -----
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
    measured at 0.885 times the frequency of the loaded mode
    multiply stiffnesses by 0.784 or the density by 1.28, and ask again
    """
    given = {"decrement": decrement, "ratio": ratio, "loss_factor": loss_factor}
    known = {name: value for name, value in given.items() if value is not None}
    if len(known) != 1:
        raise ValueError(f"{', '.join(given)}: {len(known)} are given; give one of them, such as decrement=0.3")
    [(name, value)] = known.items()
    own = MEASURES[name](float(value)) if isinstance(value, int | float | np.number) else np.nan
    if not 0 < own < 1:
        raise ValueError(f"{name}: {value!r} does not mean a damping ratio above 0 and below 1; give a number")
    if (period if name == "loss_factor" else at) is not None:
        raise ValueError(f"{name}: {value!r} does not go with period={period!r}, at={at!r}; leave that out")
    if scene.network.rest_factor.negative_pivots:
        raise ValueError(f"definition '{scene.definition.name}': is unstable at rest; take another definition or mesh")
    motion = scene.motion(released=True, load=scene.forces / scene.springs.reference)  # also of a load that turns
    frequency, apart, factor, remedy = motion.loaded_frequency, 1.0, 1.0, ""
    if at is not None:
        apart = 2 * np.pi * positive(at, "frequency", "at") / frequency
        remedy = f"give the loss factor at {frequency / (2 * np.pi):.3g} Hz"
    if period is not None:
        apart = 2 * np.pi / positive(period, "time", "period") / np.sqrt(1 - own**2) / frequency
        factor = apart**2
        remedy = f"multiply stiffnesses by {factor:.3g} or the density by {1 / factor:.3g}, and ask again"
    note = f"measured at {apart:.3g} times the frequency of the loaded mode; {remedy}"
    return Damping(scene, motion, own, float(factor), (note,) if abs(apart - 1) > SAME_MODE else ())
