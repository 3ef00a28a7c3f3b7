"""Figures and tables of the experiments on stability, and what the page to browse shows of them."""

from ...config.kind import Output


def _figures(study):
    asked = {name for name, _ in study.parts["stability"]}
    return {f"stability_{name}": {} for name in ("maps", "strains") if name in asked}


OUTPUTS = (
    Output(
        "stability",
        "experiments on stability",
        figures=_figures,
        plot="studies.kinds.stability.figures:stability",
        shows="experiments",
    ),
)


STABILITY_TABLES = {
    "limits": (
        "Largest stable steps",
        ("definition", "integrator", "damper", "damping_ratio"),
        {"mesh_size_mm": ("mesh_size", 1e3), "predicted_ns": ("dt_limit_predicted", 1e9),
         "measured_ns": ("dt_limit_measured", 1e9), "bound_of_particles_ns": ("dt_particle_bound", 1e9)},
    ),
    "rest": (
        "Backward Euler to rest, by iterations of its linear solver (0: direct)",
        ("cg_iterations", "implicit_steps"),
        {"mesh_size_mm": ("mesh_size", 1e3), "error_percent": ("truncated_error", 100)},
    ),
    "slivers": (
        "A sliver in the mesh",
        ("definition", "sliver_angle"),
        {"step_ns": ("sliver_step_limit", 1e9), "error_percent": ("sliver_error", 100)},
    ),
    "strains": (
        "Large strains",
        ("definition", "strain_load", "strain", "strain_message"),
        {"load_share": ("strain_load_share", 1), "negative_pivots": ("negative_pivots", 1)},
    ),
    "perturbation": (
        "Particles moved at random",
        ("definition", "perturbation", "perturbed_message"),
        {"step_ns": ("perturbed_step_limit", 1e9), "error_percent": ("perturbed_error", 100)},
    ),
    "buckling": (
        "Buckling load of a slender column",
        ("definition", "rows", "buckling_message"),
        {"buckling_load_N": ("buckling_load", 1), "euler_load_N": ("euler_load", 1)},
    ),
}  # fmt: skip
"""Tables by experiment: title, labels and texts, and columns with the factor on a variable."""


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.bodies.tables.tables`."""
    from ...output.dataset import table_rows  # here, since a plan does without xarray

    if "stability" not in tree:
        return []
    data, found = tree["stability"].to_dataset(), []
    for name, (title, names, columns) in STABILITY_TABLES.items():
        if name in data.experiment.values:
            first = next(variable for variable, _ in columns.values() if variable not in data.coords)
            rows = table_rows(data, data[first].notnull(), names, columns)
            found.append({"stem": f"stability_{name}", "title": title, "rows": rows})
    return found
