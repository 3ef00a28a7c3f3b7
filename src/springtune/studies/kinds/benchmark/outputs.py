"""Figures and the page of the benchmark, and what the page to browse shows of it."""

from collections.abc import Sequence

from ...config.kind import Output
from ...output.browse import Plot, View


def figures(scenes: Sequence[object]) -> dict[str, dict[str, object]]:
    """Figures of the benchmark, by stem."""
    return {f"benchmark_{scene}": {"scene": scene} for scene in scenes}


OUTPUTS = (
    Output(
        "benchmark",
        "run time against error, with a page",
        figures=lambda study: figures(study.axes.get("scene", ())),
        plot="studies.kinds.benchmark.figures:benchmark",
        texts={"speed.md": "studies.kinds.benchmark.figures:page"},
        shows="a benchmark",
    ),
)

VIEWS = (
    View(
        "/benchmark",
        "Benchmark",
        "Error against run time, from nothing to the displacement, of every approach: what is left and low is better.",
        (
            Plot("error over seconds", "error", "seconds", "approach", along="mesh_size", log="xy"),
            Plot("assured error over seconds", "assured_error", "seconds", "approach", along="mesh_size", log="xy"),
            Plot("seconds over unknowns", "seconds", "unknowns", "approach", along="mesh_size", log="xy"),
            Plot("error over mesh size", "error", "mesh_size", "approach", log="xy"),
            Plot("what became of the cases", "status", "mesh_size", "approach", "map"),
            Plot("springs a second of explicit steps", "spring_updates", "mesh_size", "thread_count", log="x"),
        ),
    ),
)  # fmt: skip
