"""Estimate Sobol indices and main effects from the values of a sample."""

from dataclasses import dataclass

import numpy as np

RESAMPLES = 1000
"""Bootstrap samples."""

LEVEL = 0.95
"""Share of bootstrap samples within a band."""

BOOTSTRAP_SEED = 0

DRAWN_TOGETHER = 1 << 21
"""Most base samples drawn at once for bootstrap samples: 16 MB."""

NEGLIGIBLE = 1e-12
"""Smallest standard deviation over the largest value that is more than rounding."""


@dataclass(frozen=True)
class Indices:
    """First- and total-order Sobol indices, shape (n_parameters,), and their bands, shape (2, n_parameters)."""

    first: np.ndarray
    total: np.ndarray
    first_band: np.ndarray
    total_band: np.ndarray
    rows: int


def sobol_indices(at_a: np.ndarray, at_b: np.ndarray, at_ab: np.ndarray, least: float = 0.0) -> Indices:
    r"""Return Sobol indices from values at the rows of Saltelli's design; NaN without variation above `least`.

    `at_a` and `at_b` are values at the rows A and B, shape (n,); `at_ab` those at A with each parameter of B in turn,
    shape (n_parameters, n). With the variance V of A and B together, first-order indices are
    :math:`\overline{f_B (f_{AB} - f_A)} / V`, total ones :math:`\tfrac12 \overline{(f_A - f_{AB})^2} / V`: table 2,
    (b) and (f), of Saltelli et al., Comput. Phys. Commun. 181:259 (2010). Bands are percentiles of bootstrap samples of
    base samples. scipy's ``sobol_indices`` takes only powers of two, and its bootstrap has no seed.

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
    both = np.concatenate([at_a, at_b])
    largest = np.abs(both).max(initial=0.0)
    if rows < 2 or not largest > 0 or not np.std(both / largest) > max(NEGLIGIBLE, least / largest):
        none = np.full(count, np.nan)
        return Indices(none, none, np.stack([none, none]), np.stack([none, none]), rows)
    # Standardized: else sums would lose digits, and squares might overflow.
    mean, size = (both / largest).mean(), (both / largest).std()
    at_a, at_b, at_ab = ((values / largest - mean) / size for values in (at_a, at_b, at_ab))
    # Terms of each base sample whose means are taken: 2 n_parameters for the indices, two for the variance.
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


def main_effect(parameter: np.ndarray, values: np.ndarray, bins: int) -> np.ndarray:
    """Return means of parameter and values, and the standard error of the latter, of bins with as many points each.

    Shape (3, bins). Points have to be independent; their values are NaN where there is none.

    Examples
    --------
    >>> x = np.linspace(0, 1, 8)
    >>> main_effect(x, 2 * x, 2)[:2].round(2).tolist()
    [[0.21, 0.79], [0.43, 1.57]]
    """
    found = np.full((3, bins), np.nan)
    for place, part in enumerate(np.array_split(np.argsort(parameter, kind="stable"), bins)):
        there = part[np.isfinite(values[part])]
        if len(there):
            found[:2, place] = parameter[there].mean(), values[there].mean()
            found[2, place] = values[there].std(ddof=1) / np.sqrt(len(there)) if len(there) > 1 else np.nan
    return found
