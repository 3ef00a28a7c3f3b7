"""Pieces of a sample, see `springtune.studies.kinds.division`."""

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from ...runs.bundles import Costs
from .plan import drawn_blocks, seconds_of

if TYPE_CHECKING:
    from ...config.model import Study
    from ..division import Division, Name


def pieces(study: "Study", costs: Costs, division: "Division") -> "dict[Name, float]":
    """Seconds of each piece: of a task's base samples, or of all."""
    sample = study.parts["samples"]
    return division.of_section({ends: seconds_of(sample, ends, costs) for ends in drawn_blocks(sample)})


def take(study: "Study", names: "Iterable[Name]") -> "Study":
    """The study with some of its pieces alone; what is estimated from all rows of a sample is left to the whole one."""
    sample, wanted = study.parts["samples"], set(names)
    blocks = tuple(ends for ends in drawn_blocks(sample) if ends in wanted)
    return replace(study, parts=study.parts | {"samples": replace(sample, blocks=blocks) if blocks else ()})
