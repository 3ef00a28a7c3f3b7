"""Orders of particles: of elimination, by nested dissection; of little bandwidth; and some spread over a mesh."""

import numpy as np
from scipy.sparse import csr_array

LEAF = 48
"""Particles of a part that is not cut any more."""


def nested_dissection(points: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return an elimination order of particles with little fill-in, every cut last.

    Parts are cut across their longer side at the median; particles beyond the cut that touch it separate the halves
    (A. George, SIAM J. Numer. Anal. 10:345, 1973). `points` (n_points, 2) [m]; `edges` (n_edges, 2) share matrix
    entries.
    """
    count, joined = len(points), _joined(len(points), edges)
    pointers, neighbours = joined.indptr, joined.indices
    order, low = np.empty(count, dtype=np.int64), np.zeros(count, dtype=bool)
    waiting = [(np.arange(count), 0)]
    while waiting:
        part, start = waiting.pop()
        if len(part) <= LEAF:
            order[start : start + len(part)] = part
            continue
        x, y = points[part, 0], points[part, 1]
        along, across = (x, y) if x.max() - x.min() >= y.max() - y.min() else (y, x)
        below = along < np.partition(along, len(part) // 2)[len(part) // 2]
        left, right = part[below], part[~below]
        if not len(left):  # all on one line across
            order[start : start + len(part)] = part[np.argsort(across, kind="stable")]
            continue
        low[left] = True
        lengths = pointers[right + 1] - pointers[right]
        # All neighbours of all particles of the right part, one after the other.
        places = np.repeat(pointers[right] - np.r_[0, np.cumsum(lengths)[:-1]], lengths) + np.arange(lengths.sum())
        touches = np.logical_or.reduceat(low[neighbours[places]], np.r_[0, np.cumsum(lengths)[:-1]])
        low[left] = False
        separator, right = right[touches], right[~touches]
        separator = separator[np.argsort(across[~below][touches], kind="stable")]
        order[start + len(part) - len(separator) : start + len(part)] = separator
        waiting += [(left, start), (right, start + len(left))]
    return order


def _joined(count: int, edges: np.ndarray) -> csr_array:
    """Neighbours of each particle, in a row."""
    first, second = edges.T
    ones = np.ones(2 * len(edges), dtype=np.int8)
    return csr_array((ones, (np.r_[first, second], np.r_[second, first])), shape=(count, count))


def narrow(count: int, edges: np.ndarray) -> np.ndarray:
    """Return an order of particles with a small bandwidth: unchanged, or reversed Cuthill-McKee.

    Only changed if that at least halves the bandwidth, the largest distance of an edge's ends.

    Examples
    --------
    A line whose particles are numbered from both ends in turns, and one that is in order:

    >>> narrow(6, np.array([[0, 2], [2, 4], [4, 5], [3, 5], [1, 3]])).tolist()
    [1, 3, 5, 4, 2, 0]
    >>> narrow(4, np.array([[0, 1], [1, 2], [2, 3]])).tolist()
    [0, 1, 2, 3]
    """
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    order = reverse_cuthill_mckee(_joined(count, edges), symmetric_mode=True)
    place = np.argsort(order)
    before, after = (int(np.abs(numbers[:, 0] - numbers[:, 1]).max(initial=0)) for numbers in (edges, place[edges]))
    return order if 2 * after <= before else np.arange(count)


def spread(points: np.ndarray, count: int) -> np.ndarray:
    """Return up to `count` particles spread over a mesh, in ascending order.

    Those next to the middles of parts, which are halved across their longer side.
    """
    parts = [np.arange(len(points))]
    while len(parts) < count and len(points) >= 2 * len(parts):
        halves = []
        for part in parts:
            along = points[part, np.ptp(points[part], axis=0).argmax()]
            order, middle = np.argsort(along, kind="stable"), len(part) // 2
            halves += [part[order[:middle]], part[order[middle:]]]
        parts = halves
    middles = (part[((points[part] - points[part].mean(axis=0)) ** 2).sum(axis=1).argmin()] for part in parts)
    return np.unique(list(middles))
