"""What the page to browse shows of the benchmark."""

from ...output.browse import Plot, View

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
            Plot("memory over unknowns", "peak_memory", "unknowns", "approach", along="mesh_size", log="xy"),
            Plot("what became of the cases", "status", "mesh_size", "approach", "map"),
            Plot("solvers of linear systems", "solver_seconds", "mesh_size", "linear_solver", log="xy"),
            Plot("a curve as one path, and as many solves", "curve_seconds", "curve_count", log="xy",
                 beside=(("curve_count", "separate_seconds", "as many separate solves"),)),
        ),
    ),
)  # fmt: skip
