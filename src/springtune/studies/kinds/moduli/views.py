"""What the page to browse shows of effective moduli."""

from ...output.views import Plot, View

VIEWS = (
    View(
        "/moduli",
        "Definitions",
        "Effective moduli of each definition in a patch test: what a network is as a material, whatever its load.",
        (
            Plot("Poisson's ratio, effective over asked", "effective_poisson_ratio", "poisson_ratio", "definition"),
            Plot("errors of Young's modulus on mesh types", "young_modulus_error", "mesh_type", "definition", "map"),
            Plot("errors of the shear modulus on mesh types", "shear_modulus_error", "mesh_type", "definition", "map"),
            Plot("error of Young's modulus over Poisson's ratio", "young_modulus_error", "poisson_ratio", "definition"),
            Plot("seconds over mesh size", "definition_seconds", "mesh_size", "definition", log="xy"),
        ),
    ),
)
