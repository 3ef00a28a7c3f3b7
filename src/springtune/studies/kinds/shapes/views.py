"""What the page to browse shows of shapes."""

from ...output.browse import Plot, View

VIEWS = (
    View(
        "/shapes",
        "Shapes",
        "Quantities of interest of bodies of any outline: networks beside converged references on the same shape, and "
        "beside the numbers of others.",
        (
            Plot("error over particles", "error", "particles", "definition", along="mesh_size", ascending=True,
                 log="xy"),
            Plot("error over seconds", "error", "solve_seconds", "definition", along="mesh_size", ascending=True,
                 log="xy"),
            Plot("errors of definitions by quantity", "error", "quantity", "definition", "map"),
            Plot("errors of definitions on shapes", "error", "shape", "definition", "map"),
            Plot("difference to what others give", "expected_error", "particles", "definition", along="mesh_size",
                 ascending=True, log="xy"),
            Plot("what became of the scenes", "status", "mesh_size", "definition", "map"),
        ),
    ),
    View(
        "/shape_fields",
        "Networks of shapes",
        "Positions and displacements of all particles, of each shape and load.",
        (
            Plot(
                "places of the particles at rest", "y", "x", shows="points", along="particle", equal=True,
                beside=(("outline_x", "outline_y", "outline"),),
            ),
            Plot("displacements along x", "displacement_x", "x", "definition", "points", "particle"),
            Plot("displacements along y", "displacement_y", "x", "definition", "points", "particle"),
        ),
    ),
)  # fmt: skip
