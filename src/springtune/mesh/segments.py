"""Edges as segments in the plane: pairs that are near each other, winding numbers, places in words."""

from collections.abc import Sequence

import numpy as np

MOST_PAIRS = 4_000_000
"""Pairs of edges that are compared at a time."""


def nearer(points: np.ndarray, edges: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return pairs of disjoint edges nearer than their reaches (n,) together [m], and their distances [m]."""
    start, end = points[edges[:, 0]], points[edges[:, 1]]
    # Along a direction in which few sides of shapes run, an edge overlaps few others.
    along = np.stack([start, end]) @ np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    low, high = along.min(axis=0) - reach[:, None], along.max(axis=0) + reach[:, None]
    order = np.argsort(low[:, 0], kind="stable")
    counts = np.searchsorted(low[order, 0], high[order, 0], side="right") - np.arange(len(order)) - 1
    before = np.concatenate([[0], np.cumsum(counts)])
    found = []
    begin = 0
    while begin < len(order):
        stop = max(begin + 1, int(np.searchsorted(before, before[begin] + MOST_PAIRS, side="right")) - 1)
        here = counts[begin:stop]
        first = np.repeat(np.arange(begin, stop), here)
        second = first + 1 + np.arange(len(first)) - np.repeat(before[begin:stop] - before[begin], here)
        one, other = order[first], order[second]
        near = (low[one, 1] <= high[other, 1]) & (low[other, 1] <= high[one, 1])
        near &= (edges[one][:, :, None] != edges[other][:, None, :]).all(axis=(1, 2))
        one, other = one[near], other[near]
        distances = _edge_distances(start[one], end[one], start[other], end[other])
        close = distances <= reach[one] + reach[other]
        found.append((one[close], other[close], distances[close]))
        begin = stop
    one, other, distances = (np.concatenate(parts) for parts in zip(*found))
    return one, other, distances


def _edge_distances(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Distance of each edge from a to b from the one from c to d [m]."""

    def left(one: np.ndarray, two: np.ndarray, three: np.ndarray) -> np.ndarray:
        (x, y), (u, v) = (two - one).T, (three - one).T
        return np.asarray(x * v - y * u)

    def away(point: np.ndarray, one: np.ndarray, two: np.ndarray) -> np.ndarray:
        along = two - one
        share = np.clip(((point - one) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        return np.asarray(np.linalg.norm(point - one - share[:, None] * along, axis=1))

    crossing = (left(a, b, c) * left(a, b, d) < 0) & (left(c, d, a) * left(c, d, b) < 0)
    distance = np.min([away(a, c, d), away(b, c, d), away(c, a, b), away(d, a, b)], axis=0)
    return np.where(crossing, 0.0, distance)


def winding(points: np.ndarray, edges: np.ndarray, point: np.ndarray) -> int:
    """Return how often edges wind counter-clockwise about a point off them."""
    start, end = points[edges[:, 0]] - point, points[edges[:, 1]] - point
    left = start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]
    up = (start[:, 1] <= 0) & (end[:, 1] > 0) & (left > 0)
    down = (start[:, 1] > 0) & (end[:, 1] <= 0) & (left < 0)
    return int(up.sum()) - int(down.sum())


def in_words(points: Sequence[float] | np.ndarray) -> str:
    """Middle of one or more points, in words."""
    return "({:.6g}, {:.6g}) mm".format(*(1e3 * np.reshape(points, (-1, 2)).mean(axis=0)))


def edge_in_words(points: np.ndarray, ends: Sequence[int] | np.ndarray) -> str:
    """Both ends of an edge, in words."""
    return f"from {in_words(points[ends[0]])} to {in_words(points[ends[1]])}"
