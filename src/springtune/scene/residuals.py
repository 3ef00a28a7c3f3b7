r"""Residuals of tests: which values are no measurements, which noise is not random, and how far intervals widen by it.

Noise of fields may be correlated over some distance, as of overlapping subsets of image correlation. Its correlation is
a share of :math:`e^{-d/l}` or :math:`e^{-(d/l)^2}` of the distance d, found by restricted likelihood. Arrays: values
(n_places, n_components), columns (n_places, n_components, n), places (n_places,) of curves and (n_places, 2) of fields.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

OUTLYING = 5.0
"""Deviations from which on a value is no measurement; more of few values."""

FEWEST_POINTS = 10
"""Places from which on their residuals are looked at."""

ROBUST = 1.4826
"""Standard deviation over the median of magnitudes."""

UNLIKELY = 2.75
"""Deviations of the correlation of neighbours from which on it is no chance."""

SHARES, REACHES, EXPONENTS = (0.25, 0.5, 0.75, 0.95, 0.999), 12, (1, 2)
"""Shares of correlated noise, numbers of distances l, and powers of d / l that are tried."""

FITTED, SUMMED = 300, 1500
"""Most places by which a correlation is found, and of which all pairs are summed."""


def measured(values: np.ndarray, columns: np.ndarray, places: np.ndarray, floor: float) -> np.ndarray:
    """Return which places (n,) are measurements: others repeat a value that does not fit, or are far from all near.

    What is measured is a combination of `columns`, fitted to least magnitudes, within some noise above `floor`.
    """
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
    apart, limit = values - columns @ found, OUTLYING * (1 + FEWEST_POINTS / count)
    far = np.abs(apart) > limit * np.maximum(ROBUST * np.median(np.abs(apart[begin]), axis=0), floor)
    gone = np.zeros(count, bool)
    for number in range(values.shape[1] * (places.ndim - 1)):  # of fields
        _, group, sizes = np.unique(values[:, number], return_inverse=True, return_counts=True)
        gone |= ((sizes > 2) & (np.bincount(group, far[:, number]) >= sizes / 2))[group]
    rest = np.flatnonzero(~gone)
    if len(rest) >= FEWEST_POINTS:
        near = _tree(places[rest])[1][:, 1:]
        alone = np.abs(apart[rest] - np.median(apart[rest][near], axis=1))
        own = np.maximum(ROBUST * np.median(alone, axis=0), floor)
        gone[rest[(far[rest] & (alone > limit * own)).any(axis=1)]] = True
    return ~gone


def _tree(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances and numbers of the nearest places of each, itself first; loads of curves are counted."""
    one = places.ndim == 1
    at = np.argsort(np.argsort(places, kind="stable"))[:, None] if one else places
    return KDTree(at).query(at, k=min(len(at), 5 if one else 9))


def excess(residual: np.ndarray, places: np.ndarray) -> float:
    """Correlation of neighbours less what chance may yield; above 0 residuals are not random."""
    if len(places) < FEWEST_POINTS or not residual.any():
        return -1.0
    if places.ndim == 1:
        order = np.argsort(places, kind="stable")
        pairs = np.stack([order[:-1], order[1:]])
    else:
        near = _tree(places)[1][:, :5]
        pairs = np.unique(np.sort([np.repeat(near[:, 0], 4), near[:, 1:].ravel()], axis=0), axis=1)
    found = (residual[pairs[0]] * residual[pairs[1]]).mean() / (residual**2).mean()
    return float(found - UNLIKELY / np.sqrt(pairs.shape[1] * residual.shape[1]))


class Noise(NamedTuple):
    """Noise of a field: a variance, of which a share is correlated over a reach [m]; the last value is of freedom."""

    variance: float = 1.0
    share: float = 0.0
    reach: float = 1.0
    power: int = 1
    freedom: float = np.inf

    def between(self, places: np.ndarray) -> np.ndarray:
        """Correlation of all pairs of places, of itself without what is not correlated."""
        return np.asarray(np.exp(-((cdist(places, places) / self.reach) ** self.power)))

    def sums(self, columns: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Covariance of sums of noise times columns (n, n_components, k), shape (k, k)."""
        table = columns.reshape(-1, columns.shape[-1])
        found = table.T @ table
        if self.share:
            some = np.random.default_rng(0).permutation(len(places))[:SUMMED]
            pairs = self.between(places[some]) - np.eye(len(some))
            part = sum(one.T @ pairs @ one for one in np.moveaxis(columns[some], 1, 0))
            found = found + self.share * len(places) * (len(places) - 1) / len(some) / (len(some) - 1) * part
        return np.asarray(self.variance * found)


def correlated(residual: np.ndarray, columns: np.ndarray, places: np.ndarray) -> Noise:
    """Noise of a field of which `residual` has no part along `columns`, by restricted likelihood."""
    order = np.random.default_rng(0).permutation(len(places))
    if len(order) > FITTED:  # half of them in places where the points are near each other
        near = KDTree(places).query(places[order[:5]], k=FITTED // 10)[1].ravel()
        order = np.unique([*near, *order[: FITTED // 2]])
    at, values, table = places[order], residual[order], np.moveaxis(columns[order], 1, 0)
    count, parts, basis = len(order), values.shape[1], table.reshape(-1, columns.shape[-1])
    left, sizes, _ = np.linalg.svd(basis, full_matrices=False)
    table = left[:, sizes > 1e-9 * sizes.max(initial=0)].reshape(parts, count, -1)
    freedom = max(parts * count - table.shape[-1], 1)
    extent, best = np.ptp(at, axis=0).max() or 1.0, (np.inf, Noise())
    least = max(np.median(KDTree(at).query(at, k=2)[0][:, 1]), 1e-3 * extent)  # points may be given twice
    for reach in np.geomspace(least / 2, extent / 2, REACHES):
        for power in EXPONENTS:
            pairs = Noise(reach=reach, power=power).between(at)
            for share in SHARES:
                lower = np.linalg.cholesky(share * pairs + (1 - share) * np.eye(count))
                stack = np.concatenate([values, *table], axis=1)
                whitened = solve_triangular(lower, stack, lower=True, check_finite=False)
                wanted = whitened[:, :parts].T.ravel()
                whole = whitened[:, parts:].reshape(count, parts, -1).transpose(1, 0, 2).reshape(len(wanted), -1)
                axes, triangle = np.linalg.qr(whole)
                variance = (wanted @ wanted - ((axes.T @ wanted) ** 2).sum()) / freedom
                cost = freedom * np.log(variance) + 2 * parts * np.log(np.diag(lower)).sum()
                cost += 2 * np.log(np.abs(np.diag(triangle))).sum()
                if cost < best[0]:
                    best = cost, Noise(variance, share, reach, power)
    noise = best[1]
    own = noise.share * noise.between(at) + (1 - noise.share) * np.eye(count)
    basis = table.reshape(-1, table.shape[-1])
    whole = np.kron(np.eye(parts), own)
    whole -= basis @ (basis.T @ whole)
    return noise._replace(freedom=float(np.trace(whole) ** 2 / (whole * whole.T).sum()))
