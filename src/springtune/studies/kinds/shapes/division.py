"""Pieces of the scenes of shapes of a study, see `springtune.studies.kinds.division`."""

from collections import defaultdict
from collections.abc import Collection, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from ...runs.bundles import Costs
from .plan import particles

if TYPE_CHECKING:
    from ...config.model import Study
    from ..division import Division, Name


def pieces(study: "Study", costs: Costs, division: "Division") -> "dict[Name, float]":
    """Seconds of each piece: of a shape under a load, which says what of it is drawn, or of all grids."""
    part = study.parts["shapes"]
    found: dict[Name, float] = defaultdict(float)
    for one in part.scenes:
        count = particles(part, one)
        found[one.shape, one.load] += costs.of("shape_scene", count) + costs.of(one.definition, count)
    for shape, _, load in part.referred:
        found[shape, load] += costs.of("shape_reference")
    return division.of_section(found)


def take(study: "Study", names: "Iterable[Name]") -> "Study":
    """The study with some of its pieces alone."""
    wanted = set(names)
    return of_shape_scenes(study, {one for one in study.parts["shapes"].scenes if (one.shape, one.load) in wanted})


def of_shape_scenes(study: "Study", chosen: "Collection[object]") -> "Study":
    """A study of a few scenes of shapes of another one, and of what these need."""
    part = study.parts["shapes"]
    scenes = tuple(scene for scene in part.scenes if scene in chosen) if part else ()
    if not scenes:
        return replace(study, parts=study.parts | {"shapes": ()})
    cases = {(one.shape, one.material, one.load) for one in scenes}
    names = {one.shape for one in scenes}
    found = replace(
        part,
        shapes=tuple(shape for shape in part.shapes if shape.name in names),
        scenes=scenes,
        referred=tuple(case for case in part.referred if case in cases),
    )
    return replace(study, parts=study.parts | {"shapes": found})
