"""Period and decrement of a measured swing, see `fit_decay`."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..safe_io.inputs import csv_rows, two_numbers
from ..safe_io.tables import Tabled
from .quantities import positive

LEAST_POINTS = 12
"""Points that a decay is fitted to, at least."""

MOST_MISFIT = 0.5
"""Misfit from which points are no damped swing [1]."""

COLUMNS_OF_DECAY = "give two columns with a head such as 'time [s],displacement [mm]'"


@dataclass(frozen=True, repr=False)
class Decay(Tabled):
    """Damped swing that fits measured displacements.

    Attributes
    ----------
    period : float
        Time between peaks on the same side [s].
    decrement : float
        Natural logarithm of a peak over the next one on the same side [1].
    period_error, decrement_error : float
        Their standard errors [s], [1].
    misfit : float
        Root mean square of what is left, over that of the swing [1].

    Examples
    --------
    >>> import numpy as np
    >>> import springtune as st
    >>> times = np.linspace(0, 1, 200)
    >>> noise = np.random.default_rng(0).normal(0, 0.03, 200)
    >>> st.fit_decay(times, np.exp(-1.5 * times) * np.cos(30 * times) + noise)
    Decay(period: 0.2096 s +- 0.00015; decrement: 0.313 +- 0.0045; misfit: 7.0 %)
    """

    period: float
    decrement: float
    period_error: float
    decrement_error: float
    misfit: float

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "period", f"{self.period:.4g} s +- {self.period_error:.2g}"
        yield "decrement", f"{self.decrement:.4g} +- {self.decrement_error:.2g}"
        yield "misfit", f"{100 * self.misfit:.1f} %"


def fit_decay(times: np.ndarray | str | Path, displacements: np.ndarray | None = None) -> Decay:
    """Fit a damped cosine to a measured swing.

    Parameters
    ----------
    times : ndarray of float or str or Path
        Times of the points, ascending [s]; or a CSV file of times and displacements, with units in the head, such as
        ``time [ms],displacement [mm]``. Lines with # are comments.
    displacements : ndarray of float, optional
        Of one place, from any zero, in any unit.

    Returns
    -------
    Decay

    Raises
    ------
    ValueError
        If a file cannot be read, points are too few or no numbers, or they are no swing that decays.

    Notes
    -----
    ``exp(-a t) (A cos w t + B sin w t) + C`` by least squares: A, B and C linearly for each a and w. The period is
    2 pi / w, and the decrement a times it. Errors are for noise that is the same and independent in all points.

    Examples
    --------
    >>> import numpy as np
    >>> import springtune as st
    >>> times, rng = np.linspace(0, 1, 200), np.random.default_rng(0)
    >>> moved = 3 * np.exp(-1.5 * times) * np.cos(30 * times + 1) + rng.normal(0, 0.1, 200)
    >>> decay = st.fit_decay(times, moved)
    >>> print(f"{decay.period:.4f} s +- {decay.period_error:.4f}; {decay.decrement:.3f} +- {decay.decrement_error:.3f}")
    0.2096 s +- 0.0002; 0.319 +- 0.005

    Its decrement and period are what `damping_of` takes.
    """
    from scipy.optimize import least_squares

    if displacements is None:
        t, x = _read(times)  # type: ignore[arg-type]
    else:
        t, x = np.asarray(times, dtype=float), np.asarray(displacements, dtype=float)
    _check(t, x)
    begin, span = t[0], t[-1] - t[0]
    x = (x - x.mean()) / np.std(x)  # the search ends at a gradient that is small beside 1

    def columns(decay: float, frequency: float) -> np.ndarray:
        phase = frequency * (t - begin)
        shrunk = np.exp(-decay * (t - begin))
        return np.stack([shrunk * np.cos(phase), shrunk * np.sin(phase), np.ones_like(t)], axis=1)

    def left(guess: np.ndarray) -> np.ndarray:
        basis = columns(*guess)
        return x - basis @ np.linalg.lstsq(basis, x, rcond=None)[0]

    even = np.interp(np.linspace(t[0], t[-1], len(t)), t, x)
    spectrum = np.abs(np.fft.rfft(even, 8 * len(even)))
    start = 2 * np.pi * max(1, int(spectrum.argmax())) / (8 * span)
    guesses = [(share * start, start) for share in (0.01, 0.05, 0.2)]
    bounds = [(-5 / span, 0), (np.inf, np.inf)]
    best = min((least_squares(left, one, bounds=bounds, x_scale=start, xtol=1e-12) for one in guesses),
               key=lambda found: found.cost)  # fmt: skip
    decay, frequency = best.x
    misfit = np.sqrt(2 * best.cost / len(x))
    if not decay > 0 or misfit > MOST_MISFIT or frequency * span < 2 * np.pi:
        raise ValueError(
            "displacements: are no swing that decays over a period or more; give those of one mode that swings freely, "
            "from after it is let go"
        )
    period, decrement = 2 * np.pi / frequency, 2 * np.pi * decay / frequency
    covariance = 2 * best.cost / (len(t) - 5) * np.linalg.inv(best.jac.T @ best.jac)
    slopes = np.array([[0, -period / frequency], [period, -decrement / frequency]])
    errors = np.sqrt(np.diag(slopes @ covariance @ slopes.T))
    return Decay(*map(float, (period, decrement, *errors, misfit)))


def _check(t: np.ndarray, x: np.ndarray) -> None:
    """Refuse points that are no measurement of a swing."""
    if t.ndim != 1 or t.shape != x.shape or len(t) < LEAST_POINTS:
        raise ValueError(
            f"times: have the shape {t.shape}, and displacements {x.shape}; give {LEAST_POINTS} points or more of both"
        )
    if not (np.isfinite(t).all() and np.isfinite(x).all() and (np.diff(t) > 0).all()):
        raise ValueError("times: are not ascending, or a value is no finite number; sort the points and leave gaps out")
    if not np.ptp(x):
        raise ValueError(f"displacements: are all {x[0]:g}; give points of a swing")


def _read(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and displacements [m] of a CSV file."""
    rows = csv_rows(path, ValueError, COLUMNS_OF_DECAY)
    head = rows[0][1]
    units = [column.partition("[")[2].partition("]")[0] for column in head]
    if len(head) != 2 or not all(units):
        raise ValueError(f"'{path}', line {rows[0][0]}: {','.join(head)!r} is no head of a decay; {COLUMNS_OF_DECAY}")
    scales = [positive(f"1 {unit}", kind, f"'{path}', head") for unit, kind in zip(units, ("time", "length"))]
    times, moved = np.array(two_numbers(path, rows[1:], ValueError)).reshape(-1, 2).T
    return scales[0] * times, scales[1] * moved
