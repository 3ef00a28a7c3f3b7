"""Samples: points of the unit cube, and the continuous parameters of scenes that distributions make of them.

The first half of a sample of twice the size is the sample, bit for bit.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

PARAMETERS = {
    "length": ("length", "extent along x", "m"),
    "height": ("length", "extent along y", "m"),
    "thickness": ("length", "extent out of the plane", "m"),
    "mesh_size": ("length", "asked length of an edge", "m"),
    "relative_mesh_size": ("", "asked length of an edge over the height", "1"),
    "young_modulus": ("stress", "Young's modulus", "Pa"),
    "poisson_ratio": ("", "Poisson's ratio", "1"),
    "force": ("force", "magnitude of the force", "N"),
}
"""Parameters of a sampled scene: dimension, meaning and unit."""

SOBOL_INDICES = "sobol-indices"  # the design for Sobol indices: rows of a base sample differ in one parameter

DESIGNS = (SOBOL_INDICES, "sobol")

SMALLEST_SIZE = 8

MOST_SALTELLI_SAMPLES = 64  # most base samples of a task for Sobol indices, each of several rows

MOST_SOBOL_POINTS = 512  # most points of a task of plain Sobol points


def blocks(design: str, size: int) -> list[tuple[int, int]]:
    """First base sample of each task, and the one after its last. The tasks of half the size come first.

    >>> blocks("sobol-indices", 16), blocks("sobol-indices", 32)
    ([(0, 8), (8, 16)], [(0, 8), (8, 16), (16, 32)])
    """
    most = MOST_SALTELLI_SAMPLES if design == SOBOL_INDICES else MOST_SOBOL_POINTS
    ends = [0, SMALLEST_SIZE]
    while ends[-1] < size:
        ends.append(ends[-1] + min(ends[-1], most))
    return list(zip(ends[:-1], ends[1:]))


def points(dimensions: int, seed: int, first: int, last: int) -> np.ndarray:
    """Draw scrambled Sobol points `first` to `last` of the unit cube, shape (last - first, dimensions).

    >>> bool((points(2, 1, 0, 16)[8:] == points(2, 1, 8, 16)).all())
    True
    """
    from scipy.stats import qmc  # here: it costs half a second

    engine = qmc.Sobol(dimensions, scramble=True, seed=np.random.default_rng(seed))
    if first:
        engine.fast_forward(first)
    return np.asarray(engine.random(last - first))


def quantile(distribution: Mapping[str, Any], shares: np.ndarray) -> np.ndarray:
    """Return the quantiles of a distribution.

    >>> spread = {"distribution": "log-uniform", "low": 1.0, "high": 100.0}
    >>> quantile(spread, np.array([0.0, 0.5, 1.0])).round(9).tolist()
    [1.0, 10.0, 100.0]
    """
    from scipy import stats

    name, low, high = distribution["distribution"], distribution["low"], distribution["high"]
    if name == "fixed":
        return np.full_like(shares, low)
    if name == "uniform":
        frozen = stats.uniform(low, high - low)
    elif name == "log-uniform":
        frozen = stats.loguniform(low, high)
    elif name == "triangular":
        frozen = stats.triang((distribution["mode"] - low) / (high - low), low, high - low)
    else:
        mean, deviation = distribution["mean"], distribution["deviation"]
        frozen = stats.truncnorm((low - mean) / deviation, (high - mean) / deviation, mean, deviation)
    # Rounding must not leave the range that was checked.
    return np.clip(frozen.ppf(shares), low, high)


def varied(parameters: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Names of the parameters that are not fixed, in their order."""
    return [name for name, one in parameters.items() if one["distribution"] != "fixed"]


def roles(design: str, names: Iterable[str]) -> list[str]:
    """Name the rows of a base sample, as A, B, AB_length, AB_force."""
    return ["A", "B", *(f"AB_{name}" for name in names)] if design == SOBOL_INDICES else ["A"]


def draw(
    design: str, seed: int, parameters: Mapping[str, Mapping[str, Any]], first: int, last: int
) -> dict[str, np.ndarray]:
    """Draw the parameters of the scenes of some base samples, with `mesh_size`, shape (n_rows,); see `roles`.

    AB_i is A with parameter i of B (Saltelli et al., Comput. Phys. Commun. 181:259, 2010).
    """
    names, pair = varied(parameters), design == SOBOL_INDICES
    count = len(names)
    shares = points(count * (2 if pair else 1), seed, first, last)
    table = np.repeat(shares[:, None, :count], len(roles(design, names)), axis=1)
    if pair:
        table[:, 1] = other = shares[:, count:]
        for axis in range(count):
            table[:, 2 + axis, axis] = other[:, axis]
    table = table.reshape(-1, count)
    found = {
        name: quantile(one, table[:, names.index(name)] if name in names else np.zeros(len(table)))
        for name, one in parameters.items()
    }
    if "mesh_size" not in found:
        found["mesh_size"] = found["relative_mesh_size"] * found["height"]
    return found


def problem_key(interpolant: str, aspect_ratio: float, nu: float) -> str:
    """Key of a reference that is solved alone, in the file of the interpolant that could not be built.

    Not in `interpolate`: a dataset would depend on all code that solves references.
    """
    return f"{interpolant} {float(aspect_ratio)!r} {float(nu)!r}"
