"""What is made of the benchmark."""

from ..base import Output

PAGE = "speed.md"


def figures(scenes):
    """Figures of the benchmark, by stem."""
    found = {f"benchmark_{scene}": {"scene": scene} for scene in scenes}
    return found | {
        "benchmark_rates": {},
        "benchmark_costs": {"scene": next(iter(scenes), None)},
        "benchmark_curve": {},
    }


def _lack(study):
    return "" if study.parts["benchmark"] else "shows a benchmark and the study has none; add a section 'benchmark'"


OUTPUTS = (
    Output(
        "benchmark",
        "figures and the page of the benchmark",
        figures=lambda study: figures(study.axes.get("scene", ())),
        plot="kinds.benchmark.figures:benchmark",
        tables=lambda study: [PAGE],
        write="kinds.benchmark.tables",
        lack=_lack,
    ),
)
