"""Pieces of the experiments on stability, see `springtune.studies.kinds.division`."""

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from ...runs.bundles import Costs

if TYPE_CHECKING:
    from ...config.model import Study
    from ..division import Division, Name


def pieces(study: "Study", costs: Costs, division: "Division") -> "dict[Name, float]":
    """Seconds of each piece: of an experiment with a definition, or of all."""
    return division.of_section({(one.name, one.definition): costs.of(one.name) for one in study.parts["stability"]})


def take(study: "Study", names: "Iterable[Name]") -> "Study":
    """The study with some of its pieces alone."""
    wanted = set(names)
    chosen = tuple(one for one in study.parts["stability"] if (one.name, one.definition) in wanted)
    return replace(study, parts=study.parts | {"stability": chosen})
