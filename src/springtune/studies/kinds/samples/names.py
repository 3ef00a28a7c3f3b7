"""What samples are made of: parameters, distributions, designs and what is asked of them."""

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
"""Parameters of a sampled scene: kind of quantity, what it is, and its unit."""

DISTRIBUTION_KEYS = {
    "uniform": ("from", "to"),
    "log-uniform": ("from", "to"),
    "triangular": ("from", "mode", "to"),
    "normal": ("mean", "deviation"),
}
"""Distributions by name: the keys that each needs."""

SOBOL_INDICES = "sobol-indices"
"""The design whose rows differ in one parameter from each other, by which indices are estimated."""

DESIGNS = (SOBOL_INDICES, "sobol", "latin-hypercube")
"""How samples are drawn."""

DROP, WITHHOLD = "drop", "withhold"

FAILURES = (DROP, WITHHOLD)
"""What becomes of indices where scenes have no value."""

FIRST_ROLES = ("A", "B")
"""Roles of the first rows of each base sample of `SOBOL_INDICES`; those of the others name what they take from B."""

QUANTITIES = {
    "displacement": "displacement of the network",
    "deformation_error": "deformation error",
    "best_stiffness": "uniform stiffness without an error",
}
"""What indices and main effects are of."""

SMALLEST_SIZE = 8
"""Smallest size of a sample."""

BASE_ROWS = 64
"""Base samples of a task, at most; a task of a design of indices has some hundred rows of them."""

MOST_SOLVED = 1024
"""Rows of a sample, at most, whose references are solved one by one where they cannot be interpolated."""

PLAIN_ROWS = 512
"""Rows of a task, at most, where a base sample is one row."""


def rows_each(design: str, varied: int) -> int:
    """Rows of the sample for each base sample.

    Examples
    --------
    >>> rows_each("sobol-indices", 6), rows_each("sobol", 6)
    (8, 1)
    """
    return varied + 2 if design == SOBOL_INDICES else 1


def blocks(design: str, size: int) -> list[tuple[int, int]]:
    """First base sample of each task, and that after its last: those of a size begin with those of half the size.

    Examples
    --------
    >>> blocks("sobol-indices", 16), blocks("sobol-indices", 32)
    ([(0, 8), (8, 16)], [(0, 8), (8, 16), (16, 32)])
    """
    most = BASE_ROWS if design == SOBOL_INDICES else PLAIN_ROWS
    ends = [0, SMALLEST_SIZE]
    while ends[-1] < size:
        ends.append(ends[-1] + min(ends[-1], most))
    return list(zip(ends[:-1], ends[1:]))
