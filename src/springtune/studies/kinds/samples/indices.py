"""Sobol indices and main effects of what was computed of a sample."""

from dataclasses import dataclass

import numpy as np

RESAMPLES = 1000
"""Bootstrap samples."""

LEVEL = 0.95
"""Share of the bootstrap samples within a band."""

BOOTSTRAP_SEED = 0

DRAWN_TOGETHER = 1 << 21
"""Most numbers of base samples, of all bootstrap samples that are drawn together: 16 MB of them."""

NEGLIGIBLE = 1e-12
"""Standard deviation over the largest value up to which a quantity does not vary: what varies is rounding."""


@dataclass(frozen=True)
class Indices:
    """First- and total-order Sobol indices, shape (n_parameters,), and their bands, shape (2, n_parameters)."""

    first: np.ndarray
    total: np.ndarray
    first_band: np.ndarray
    total_band: np.ndarray
    rows: int


def sobol_indices(at_a: np.ndarray, at_b: np.ndarray, at_ab: np.ndarray, least: float = 0.0) -> Indices:
    r"""Sobol indices from values at the rows of Saltelli's design.

    Parameters
    ----------
    at_a, at_b : ndarray of float, shape (n,)
        Values at the rows A and B.
    at_ab : ndarray of float, shape (n_parameters, n)
        Values at A with each parameter of B in turn.

    Returns
    -------
    Indices
        NaN where there are fewer than two base samples, or the values do not vary.

    Notes
    -----
    With the variance V of A and B together, first-order indices are :math:`\overline{f_B (f_{AB} - f_A)} / V`, the
    total ones :math:`\tfrac12 \overline{(f_A - f_{AB})^2} / V`: table 2, (b) and (f), of Saltelli et al., Comput. Phys.
    Commun. 181:259 (2010). scipy's ``sobol_indices`` has the same, but takes no other number of base samples than a
    power of two, and a bootstrap that is another one each time. Bands are between percentiles of base samples drawn
    with replacement, those of a seed.

    Examples
    --------
    Of x + 2 y, uniform from 0 to 1, x has a fifth of the variance:

    >>> from scipy.stats import qmc
    >>> a, b = np.split(qmc.Sobol(4, seed=0).random(256), 2, axis=1)
    >>> of = lambda x, y: x + 2 * y
    >>> found = sobol_indices(of(*a.T), of(*b.T), np.array([of(b[:, 0], a[:, 1]), of(a[:, 0], b[:, 1])]))
    >>> found.first.round(2).tolist(), found.total.round(2).tolist()
    ([0.2, 0.8], [0.2, 0.8])
    """
    count, rows = at_ab.shape
    none = np.full(count, np.nan)
    both = np.concatenate([at_a, at_b])
    largest = np.abs(both).max(initial=0.0)
    if rows < 2 or not largest > 0 or not np.std(both / largest) > max(NEGLIGIBLE, least / largest):
        return Indices(none, none, np.stack([none, none]), np.stack([none, none]), rows)
    # Less their mean, or the sums would lose digits; over their size, or squares might not be numbers.
    at_a, at_b, at_ab, both = at_a / largest, at_b / largest, at_ab / largest, both / largest
    mean, size = both.mean(), both.std()
    at_a, at_b, at_ab = (at_a - mean) / size, (at_b - mean) / size, (at_ab - mean) / size
    # Of each base sample what all means are of: 2 n_parameters of the indices, and two of the variance.
    terms = np.concatenate([at_b * (at_ab - at_a), 0.5 * (at_a - at_ab) ** 2, [(at_a + at_b) / 2],
                            [(at_a**2 + at_b**2) / 2]])  # fmt: skip
    random = np.random.default_rng(BOOTSTRAP_SEED)
    parts, together = [terms.mean(axis=1)[None]], max(1, DRAWN_TOGETHER // rows)
    for begin in range(0, RESAMPLES, together):
        resamples = range(begin, min(begin + together, RESAMPLES))
        drawn = [np.bincount(random.integers(rows, size=rows), minlength=rows) for _ in resamples]
        parts.append(np.array(drawn, dtype=float) @ terms.T / rows)
    means = np.concatenate(parts)
    found = means[:, : 2 * count] / (means[:, -1] - means[:, -2] ** 2)[:, None]
    ends = np.quantile(found[1:], [(1 - LEVEL) / 2, (1 + LEVEL) / 2], axis=0)
    return Indices(found[0, :count], found[0, count:], ends[:, :count], ends[:, count:], rows)


def main_effect(parameter: np.ndarray, values: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean of a quantity over one parameter, whatever the others are.

    Parameters
    ----------
    parameter, values : ndarray of float, shape (n,)
        Of points that are independent of each other; NaN where there is no value.

    Returns
    -------
    centre, mean, error : ndarray of float, shape (bins,)
        Mean of the parameter and of the values in each part, and the standard error of this.

    Examples
    --------
    >>> x = np.linspace(0, 1, 8)
    >>> [part.round(2).tolist() for part in main_effect(x, 2 * x, 2)[:2]]
    [[0.21, 0.79], [0.43, 1.57]]
    """
    parts = np.array_split(np.argsort(parameter, kind="stable"), bins)
    found = np.full((3, bins), np.nan)
    for place, part in enumerate(parts):
        there = part[np.isfinite(values[part])]
        if len(there):
            found[:2, place] = parameter[there].mean(), values[there].mean()
            found[2, place] = values[there].std(ddof=1) / np.sqrt(len(there)) if len(there) > 1 else np.nan
    return found[0], found[1], found[2]
