"""Springs of each cell by least squares, none negative."""

from itertools import combinations

import numpy as np


def least_squares(products: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return the non-negative springs k of each cell that minimise ``k . products . k - 2 wanted . k``.

    `products` (n_cells, n_springs, n_springs) are scalar products of unit springs' effects, `wanted` (n_cells,
    n_springs) those with the wanted effect.
    """
    pairs = wanted.shape[1]
    # All sets of springs that may be other than zero are few: the best one with no negative stiffness is the answer.
    best, cost = np.zeros(wanted.shape), np.zeros(len(wanted))
    open_cells = np.arange(len(wanted))
    for size in range(pairs, 0, -1):
        for chosen in combinations(range(pairs), size):
            places = np.array(chosen)
            found = np.linalg.solve(
                products[open_cells][:, places[:, None], places], wanted[open_cells][:, places, None]
            )[..., 0]
            trial = -(found * wanted[open_cells][:, places]).sum(axis=1)
            better = (found >= 0).all(axis=1) & (trial < cost[open_cells])
            where = open_cells[better]
            cost[where] = trial[better]
            best[where] = 0.0
            best[where[:, None], places] = found[better]
            if size == pairs:  # without a constraint at work no other set is better
                open_cells = open_cells[~better]
                if not len(open_cells):
                    return best
    return best
