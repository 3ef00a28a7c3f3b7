"""Period and decrement of a measured swing, see `fit_decay`."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..safe_io.inputs import csv_rows, numbers
from ..safe_io.tables import Tabled
from .quantities import positive

LEAST_POINTS, MOST_MISFIT, POINTS_A_PERIOD = 12, 0.5, 4.0
"""Least points of a decay, the misfit from which they are no damped swing [1], and least points a period."""

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
        If a file cannot be read, points are too few, in all or a period, or no numbers, or they are no swing that
        decays.

    Notes
    -----
    ``exp(-a t) (A cos w t + B sin w t) + C`` by least squares: A, B and C linearly for each a and w. The period is
    2 pi / w, and the decrement a times it. Errors are for noise that is the same and independent in all points.
    Even times of less than 4/3 points a period look like a slow swing, and cannot be told from one.

    Examples
    --------
    >>> import numpy as np
    >>> import springtune as st
    >>> times, rng = np.linspace(0, 1, 200), np.random.default_rng(0)
    >>> moved = 3 * np.exp(-1.5 * times) * np.cos(30 * times + 1) + rng.normal(0, 0.1, 200)
    >>> decay = st.fit_decay(times, moved)
    >>> print(f"{decay.period:.4f} s +- {decay.period_error:.4f}; {decay.decrement:.3f} +- {decay.decrement_error:.3f}")
    0.2096 s +- 0.0002; 0.319 +- 0.005
    """
    from scipy.optimize import least_squares

    if isinstance(times, str | Path):
        t, x = _read(times)
    else:
        t, x = np.asarray(times, dtype=float), np.asarray(displacements, dtype=float)
    if t.ndim != 1 or t.shape != x.shape or len(t) < LEAST_POINTS:
        raise ValueError(f"times: have shape {t.shape}, displacements {x.shape}; give {LEAST_POINTS} points or more")
    if not (np.isfinite([t, x]).all() and (np.diff(t) > 0).all()):
        raise ValueError("times: are not ascending, or a value is no finite number; sort the points and leave gaps out")
    t, x = t - t[0], (x - x.mean()) / (np.std(x) or 1.0)  # the search ends at a gradient that is small beside 1

    def left(guess: np.ndarray) -> np.ndarray:
        """What a wave of this decay and frequency leaves of the points, its amplitudes fitted."""
        wave = np.exp((1j * guess[1] - guess[0]) * t)
        basis = np.stack([wave.real, wave.imag, np.ones_like(t)], axis=1)
        return x - basis @ np.linalg.lstsq(basis, x, rcond=None)[0]

    even = np.interp(np.linspace(0, t[-1], len(t)), t, x)
    peak = max(1, int(np.abs(np.fft.rfft(even, 8 * len(t))).argmax()))
    start = 2 * np.pi * peak / (8 * t[-1])
    best = least_squares(left, (0.05 * start, start), bounds=([-5 / t[-1], 0], np.inf), x_scale=start, xtol=1e-12)
    decay, frequency = best.x
    misfit = np.sqrt(2 * best.cost / len(x))
    if not decay > 0 or misfit > MOST_MISFIT or frequency * t[-1] < 2 * np.pi:
        raise ValueError("displacements: are no swing that decays, over a period or more; give those of one free mode")
    period, decrement = 2 * np.pi / frequency, 2 * np.pi * decay / frequency
    if (points := period * (len(t) - 1) / t[-1]) < (1 - 1e-6) * POINTS_A_PERIOD:
        faster = f"{points:.2g} points a period of {period:.3g} s, which a faster swing would give, too"
        raise ValueError(f"times: have {faster}; take {POINTS_A_PERIOD:g} points a period or more")
    covariance = 2 * best.cost / (len(t) - 5) * np.linalg.inv(best.jac.T @ best.jac)
    slopes = np.array([[0, -period / frequency], [period, -decrement / frequency]])
    errors = np.sqrt(np.diag(slopes @ covariance @ slopes.T))
    return Decay(*map(float, (period, decrement, *errors, misfit)))


def _read(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and displacements [m] of a CSV file."""
    (line, head), *rows = csv_rows(path, ValueError, COLUMNS_OF_DECAY)
    units = re.findall(r"\[(.+?)\]", ",".join(head))
    if not len(units) == len(head) == 2:
        raise ValueError(f"'{path}', line {line}: {','.join(head)!r} is no head of a decay; {COLUMNS_OF_DECAY}")
    scales = [positive(f"1 {unit}", kind, f"'{path}', head") for unit, kind in zip(units, ("time", "length"))]
    times, moved = np.array(numbers(path, rows, head, ValueError)).reshape(-1, 2).T
    return scales[0] * times, scales[1] * moved
