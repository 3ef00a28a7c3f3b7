"""What the page to browse shows of samples."""

from ...output.views import Plot, View

VIEWS = (
    View(
        "/samples",
        "Samples",
        "Scenes whose parameters are drawn from distributions: a point each.",
        (
            Plot("error by mesh size", "deformation_error", "sample_mesh_size", "definition", "points", along="sample"),
            Plot("error by height", "deformation_error", "height", "definition", "points", along="sample"),
            Plot("error by Poisson's ratio", "deformation_error", "poisson_ratio", "definition", "points",
                 along="sample"),
            Plot("best stiffness by Young's modulus", "best_stiffness", "young_modulus", "", "points", along="sample",
                 log="xy"),
        ),
    ),
    View(
        "/sobol",
        "What matters",
        "Sobol indices: shares of a quantity's variance by each parameter alone, and in all that it takes part in.",
        (
            Plot("total order", "total_order", "parameter", "definition", "points",
                 selection={"quantity": "deformation_error"}),
            Plot("first order", "first_order", "parameter", "definition", "points",
                 selection={"quantity": "deformation_error"}),
            Plot("total order by quantity", "total_order", "parameter", "quantity", "map"),
        ),
    ),
    View(
        "/effects",
        "Main effects",
        "Means of a quantity over one parameter, whatever the others are.",
        (
            Plot("main effect", "main_effect", "parameter_value", "definition", along="bin",
                 selection={"quantity": "deformation_error"}),
        ),
    ),
)  # fmt: skip
