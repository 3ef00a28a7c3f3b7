"""What is made of the benchmark."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...config.kind import Output

if TYPE_CHECKING:
    from ...config.model import Study

PAGE = "speed.md"


def figures(scenes: Sequence[object]) -> dict[str, dict[str, object]]:
    """Figures of the benchmark, by stem."""
    found: dict[str, dict[str, object]] = {f"benchmark_{scene}": {"scene": scene} for scene in scenes}
    return found | {
        "benchmark_rates": {},
        "benchmark_costs": {"scene": next(iter(scenes), None)},
        "benchmark_curve": {},
    }


def _lack(study: "Study") -> str:
    return "" if study.parts["benchmark"] else "shows a benchmark and the study has none; add a section 'benchmark'"


OUTPUTS = (
    Output(
        "benchmark",
        "figures and the page of the benchmark",
        figures=lambda study: figures(study.axes.get("scene", ())),
        plot="studies.kinds.benchmark.figures:benchmark",
        tables=lambda study: [PAGE],
        write="studies.kinds.benchmark.tables",
        lack=_lack,
    ),
)
