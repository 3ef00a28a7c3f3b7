"""Figures and the page of the experiments on stability, and what the page to browse shows of them."""

from collections.abc import Collection

from ...config.kind import Output
from ...output.browse import Plot, View


def figures(experiments: Collection[str]) -> dict[str, dict[str, object]]:
    """Figures of experiments, by stem."""
    return {f"stability_{name}": {} for name in ("maps", "strains") if name in experiments}


OUTPUTS = (
    Output(
        "stability",
        "experiments on stability, with a page",
        figures=lambda study: figures({name for name, _ in study.parts["stability"]}),
        plot="studies.kinds.stability.figures:stability",
        texts={"stability.md": "studies.kinds.stability.figures:page"},
        shows="experiments",
    ),
)

VIEWS = (
    View(
        "/stability",
        "Stability",
        "Experiments on time steps, damping, poor meshes, large strains and buckling.",
        (
            Plot("largest stable step, measured and predicted", "dt_limit_measured", "dt_limit_predicted",
                 "definition", along="mesh_size", log="xy", selection={"integrator": "central-difference"}),
            Plot("what a run makes of noise", "behaviour", "map_damping_ratio", "step_ratio", "map"),
            Plot("energy of a run", "energy", "sample", "integrator"),
            Plot("steps to rest over damping", "steps_to_rest", "critical_ratio", log="xy"),
            Plot("truncated conjugate gradients", "truncated_error", "implicit_steps", "cg_iterations", log="xy"),
            Plot("stable step with a sliver", "sliver_step_limit", "sliver_angle", "definition", log="xy"),
            Plot("stable step with particles moved", "perturbed_step_limit", "perturbation", "definition"),
            Plot("what became of large strains", "strain_status", "strain", "definition", "map"),
            Plot("displacement at large strains", "strain_displacement", "strain", "definition"),
            Plot("stiff and soft parts: error and its estimate", "contrast_error", "stiffness_contrast", log="xy",
                 beside=(("stiffness_contrast", "contrast_estimate", "estimate"),)),
            Plot("Young's modulus near nu = 0.5", "poisson_modulus_error", "stressed_poisson_ratio", "definition"),
            Plot("single and double precision", "precision_error", "scale", "precision", log="xy"),
            Plot("buckling load of a column", "buckling_load", "rows", "definition"),
            Plot("path of a shallow arch", "arch_load", "arch_deflection", "definition", along="arch_point"),
            Plot("seconds of the experiments", "experiment_seconds", "experiment", "definition", "map"),
        ),
    ),
)  # fmt: skip
