"""Residuals of tests: which values are no measurements, and whether the others are random.

Arrays: values (n_places, n_components), columns (n_places, n_components, n), places (n_places,) or (n_places, 2).
"""

import numpy as np
from scipy.spatial import KDTree

OUTLIER_DEVIATIONS = 5.0
"""Deviations from which on a value is no measurement; more of few values."""

FEWEST_POINTS = 10
"""Places from which on their residuals are looked at."""

DEVIATION_OVER_MEDIAN = 1.4826
"""Standard deviation over the median of magnitudes."""

CORRELATION_DEVIATIONS = 2.75
"""Deviations of the correlation of neighbours from which on it is no chance."""


def find_measurements(values: np.ndarray, columns: np.ndarray, places: np.ndarray, floor: float) -> np.ndarray:
    """Return which places are measurements: others repeat a value that does not fit, or are far from all near."""
    count = len(places)
    if count < FEWEST_POINTS:
        return np.ones(count, bool)
    spread = np.abs(values - np.median(values, axis=0))
    begin = (spread <= 100 * np.median(spread, axis=0)).all(axis=1) & ((values != 0).any(axis=1) | (places.ndim == 1))
    begin = begin if begin.sum() >= FEWEST_POINTS else np.ones(count, bool)
    table = columns[begin].reshape(-1, columns.shape[-1])
    sizes, wanted, weights = np.linalg.norm(table, axis=0) + 1e-300, values[begin].ravel(), np.ones(table.shape[:1])
    for _ in range(30):
        found = np.linalg.lstsq(table / sizes * weights[:, None], wanted * weights, rcond=1e-9)[0] / sizes
        apart = np.abs(wanted - table @ found)
        weights = np.maximum(apart, 1e-3 * np.median(apart) + 1e-300) ** -0.5
    apart, limit = values - columns @ found, OUTLIER_DEVIATIONS * (1 + FEWEST_POINTS / count)
    far = np.abs(apart) > limit * np.maximum(DEVIATION_OVER_MEDIAN * np.median(np.abs(apart[begin]), axis=0), floor)
    gone = np.zeros(count, bool)
    for number in range(values.shape[1] * (places.ndim - 1)):  # of fields
        _, group, sizes = np.unique(values[:, number], return_inverse=True, return_counts=True)
        gone |= ((sizes > 2) & (np.bincount(group, far[:, number]) >= sizes / 2))[group]
    rest = np.flatnonzero(~gone)
    if len(rest) >= FEWEST_POINTS:
        near = _nearest(places[rest])[1][:, 1:]
        alone = np.abs(apart[rest] - np.median(apart[rest][near], axis=1))
        own = np.maximum(DEVIATION_OVER_MEDIAN * np.median(alone, axis=0), floor)
        gone[rest[(far[rest] & (alone > limit * own)).any(axis=1)]] = True
    return ~gone


def _nearest(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances and numbers of the nearest places of each, itself first; loads of curves are counted."""
    one = places.ndim == 1
    at = np.argsort(np.argsort(places, kind="stable"))[:, None] if one else places
    return KDTree(at).query(at, k=min(len(at), 5 if one else 9))


def correlation_excess(residual: np.ndarray, places: np.ndarray) -> float:
    """Correlation of neighbours less what chance may yield; above 0 residuals are not random."""
    if len(places) < FEWEST_POINTS or not residual.any():
        return -1.0
    if places.ndim == 1:
        order = np.argsort(places, kind="stable")
        pairs = np.stack([order[:-1], order[1:]])
    else:
        near = _nearest(places)[1][:, :5]
        pairs = np.unique(np.sort([np.repeat(near[:, 0], 4), near[:, 1:].ravel()], axis=0), axis=1)
    found = (residual[pairs[0]] * residual[pairs[1]]).mean() / (residual**2).mean()
    return float(found - CORRELATION_DEVIATIONS / np.sqrt(pairs.shape[1] * residual.shape[1]))
