"""What is made of samples."""

from typing import TYPE_CHECKING

from ...config.kind import Output, stem
from .names import SOBOL_INDICES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from ...config.model import Study


def _lack(study: "Study") -> str:
    return "" if study.parts["samples"] else "shows sampled scenes and the study has none; add a section 'samples'"


def _lack_indices(study: "Study") -> str:
    sample = study.parts["samples"]
    if sample and sample.design != SOBOL_INDICES:
        return f"shows Sobol indices, which a design '{sample.design}' has not; give design: {SOBOL_INDICES}"
    return _lack(study)


def _each_load(name: str) -> "Callable[[Study], Mapping[str, Mapping[str, object]]]":
    def figures(study: "Study") -> "Mapping[str, Mapping[str, object]]":
        sample = study.parts["samples"]
        return {stem(name, {"load": load}): {"load": load} for load in sample.loads} if sample else {}

    return figures


OUTPUTS = (
    Output(
        "sobol",
        "the figure of Sobol indices of samples",
        figures=_each_load("sobol"),
        plot="studies.kinds.samples.figures:sobol",
        job="samples",
        lack=_lack_indices,
    ),
    Output(
        "effects",
        "the figure of main effects of samples",
        figures=_each_load("effects"),
        plot="studies.kinds.samples.figures:effects",
        job="samples",
        lack=_lack,
    ),
)
