"""Connected parts of a mesh, and their supports against rigid motions."""

import numpy as np


def connected(edges: np.ndarray, count: int) -> np.ndarray:
    """Return the number of each of `count` points' connected part; `edges` has shape (n_edges, 2).

    Examples
    --------
    >>> connected(np.array([[0, 2], [3, 1]]), 5).tolist()
    [0, 1, 0, 1, 2]
    """
    from scipy.sparse import coo_array  # here, since studies are read without scipy
    from scipy.sparse.csgraph import connected_components

    below = np.zeros(count, dtype=bool)
    below[np.maximum(*edges.T)] = True
    if below.sum() == count - 1:  # each point but the first is joined to one before it, as in rows
        return np.zeros(count, dtype=np.int32)
    joined = coo_array((np.ones(len(edges)), edges.T), shape=(count, count))
    return np.asarray(connected_components(joined, directed=False)[1])


def check_held(points: np.ndarray, edges: np.ndarray, held: np.ndarray, where: str) -> None:
    """Refuse supports that leave a connected body free to move, unless all its points are held.

    `points` (n_points, 2) [m], `edges` (n_edges, 2), `held` (n_points, 2).
    """
    components = connected(edges, len(points))
    count = components.max() + 1
    for number in range(count):
        of_body = components == number if count > 1 else slice(None)
        free = "" if held[of_body].all() else free_motion(points[of_body], held[of_body])
        if free:
            x, y = 1e3 * points[of_body].mean(axis=0)
            body = (
                "the body"
                if count == 1
                else f"one of the {count} bodies that are not joined, at ({x:.6g}, {y:.6g}) mm,"
            )
            raise ValueError(f"{where}: its supports leave {body} free to {free}; hold it")


def free_motion(points: np.ndarray, held: np.ndarray) -> str:
    """Return a rigid motion that supports leave free, in words, or an empty string.

    `points` (n_points, 2) [m], `held` (n_points, 2).

    Examples
    --------
    >>> free_motion(np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[True, True], [False, False]]))
    'turn about (0, 0) mm'
    """
    middle = points.mean(axis=0)
    x, y = ((points - middle) / (np.ptp(points, axis=0).max() or 1.0)).T
    across, along = -y[held[:, 0]], x[held[:, 1]]
    rows = np.zeros((len(across) + len(along), 3))
    rows[: len(across), 0], rows[len(across) :, 1], rows[:, 2] = 1.0, 1.0, np.concatenate([across, along])
    sizes, motions = np.linalg.eigh(rows.T @ rows)
    if sizes[0] > 1e-12 * max(sizes[-1], 1.0):
        return ""
    if sizes[1] <= 1e-12 * max(sizes[-1], 1.0):
        return "move and turn"
    u, v, turn = motions[:, 0]
    if abs(turn) > 1e-6:
        size = np.ptp(points, axis=0).max()
        about = middle + np.array([-v, u]) / turn * size
        x0, y0 = 1e3 * np.where(np.abs(about) > 1e-9 * size, about, 0.0)
        return f"turn about ({x0:.6g}, {y0:.6g}) mm"
    return "move along " + ("x" if abs(v) < 1e-6 else "y" if abs(u) < 1e-6 else f"({u:.3g}, {v:.3g})")
