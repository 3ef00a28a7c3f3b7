"""Bands for meshes that are too large to be solved, from coarser ones of their type."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from math import inf, sqrt
from typing import Any

import numpy as np

from ..mesh.types import MESH_TYPES
from ..problem.geometry import Beam
from ..problem.materials import Material
from ..safe_io.tables import TabledList
from .choices import (
    CASES,
    Choice,
    References,
    best_of,
    check_beam,
    check_loads,
    references,
    trial,
    worst_of,
)

BANDS_FROM = 10_000
"""Particles of the finest mesh for a band."""

FEWEST_CELLS = 4
"""Cells across a beam above which errors change regularly with the mesh size."""

COARSER, TRIED = 6, 30
"""Meshes for a band, and sizes to choose each of them from."""

MARGIN, LEAST_MARGIN, LEAST_OF_ERROR = 1.0, 5e-4, 0.05
"""Margin at either end of a band: over its width, least margin [1], and least margin over the error."""


def extrapolate(
    mesh_type: str,
    size: float,
    beam: Beam,
    material: Material,
    known: References | None = None,
    most: int = BANDS_FROM,
    *,
    loads: Iterable[str] = CASES,
) -> tuple[list[Choice], list[float]]:
    """Choices for a mesh size [m] too large to solve, as bands from coarser meshes, and the sizes of these meshes [m].

    The error of a network depends on the shape of its cells, which are stretched to fit the beam. It changes about in
    proportion to the mesh size or to a higher power of it. A band holds the errors on meshes whose sizes cover an
    octave, with cells that are stretched a little more and a little less than those asked for, and what a straight line
    through them gives. Its width is added at either end, a twentieth of an error at least.
    """
    check_beam(beam)
    finest = sqrt(beam.length * beam.height / most)
    while MESH_TYPES[mesh_type].particles(beam.length, beam.height, finest) > most:
        finest *= 1.02
    if 2 * finest > min(beam.length, beam.height) / FEWEST_CELLS:
        raise ValueError(
            f"a mesh of {1e3 * size:.6g} mm is too large to be solved here, and coarser ones that are not have less "
            f"than {FEWEST_CELLS} cells across beam '{beam.name}'; make it a scene of a study"
        )
    parts = np.geomspace(finest, 2 * finest, COARSER * TRIED).reshape(COARSER, TRIED)
    sizes = [_like(mesh_type, beam, size, part, sign) for part, sign in zip(parts, COARSER // 2 * (1, -1))]
    loads = check_loads(loads)
    known = references(beam, material, loads) if known is None else known
    made = (MESH_TYPES[mesh_type](beam.length, beam.height, one) for one in sizes)
    trials = [trial(beam, mesh, material, known, loads=loads) for mesh in made]

    measured = {}
    for name in trials[0].names:
        each = [one.measured(name) for one in trials]
        if any(one is None for one in each):
            continue  # also where it has the springs of another one on some of the meshes
        energies, worst = bool(each[-1] and each[-1][0]), inf
        if all(one and one[1] < inf for one in each):
            errors = [one.errors(name) for one in trials]
            worst = worst_of(band((one[load] for one in errors), sizes, size, own=LEAST_OF_ERROR) for load in errors[0])
        measured[name] = energies, worst
    best = best_of(measured, trials[0].known)
    choices = [_band([one.choice(name) for one in trials], sizes, size) for name in best]
    return TabledList(replace(one, tried=trials[0].tried) for one in choices), sizes


def _like(mesh_type: str, beam: Beam, size: float, sizes: np.ndarray, sign: int) -> float:
    """Mesh size with the closest cell stretch, on one side of it if possible."""
    stretch, box = MESH_TYPES[mesh_type].stretch, (beam.length, beam.height)
    apart = sign * np.array([stretch(*box, one) / stretch(*box, size) - 1 for one in sizes])
    return float(sizes[np.argmin(np.where(apart >= -1e-9, np.abs(apart), 1 + np.abs(apart)))])


def band(
    numbers: Iterable[Any], sizes: list[float], size: float, least: float = LEAST_MARGIN, own: float = 0.0
) -> tuple[float, float]:
    """Band of a number at a size, from those at other sizes."""
    values = np.array([*numbers], dtype=float)
    values = np.append(values, np.polyval(np.polyfit(sizes, values, 1), size))
    low, high = values.min(), values.max()
    margin = MARGIN * (high - low)
    if margin > 1e-9:  # what is exact is so on every mesh
        margin = max(margin, least, own * np.abs(values).max())
    return float(low - margin), float(high + margin)


def _band(choices: list[Choice], sizes: list[float], size: float) -> Choice:
    """Bands of a definition at a size, from choices on meshes of other sizes."""
    own = partial(band, sizes=sizes, size=size)
    failures: dict[str, str] = {}
    for choice in choices:
        failures |= choice.failures
    return replace(
        choices[0],
        inside=own((choice.inside for choice in choices), least=0.0),
        outline=own((choice.outline for choice in choices), least=0.0),
        errors={
            load: own((choice.errors[load] for choice in choices), own=LEAST_OF_ERROR) for load in choices[0].errors
        },
        young_modulus_error=own(choice.young_modulus_error for choice in choices),
        poisson_ratio=own(choice.poisson_ratio for choice in choices),
        extra="" if failures else _band_in_words([choice.extra.split(" ") for choice in choices]),
        failures=failures,
    )


def _band_in_words(texts: list[list[str]]) -> str:
    """One text for several that differ in their numbers, given as lists of words."""
    merged = []
    for words in zip(*texts):
        ends = [words[0]] if len(set(words)) == 1 else [min(words, key=float), max(words, key=float)]
        merged.append(" to ".join(ends))
    return " ".join(merged)
