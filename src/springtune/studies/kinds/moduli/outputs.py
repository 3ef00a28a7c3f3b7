"""Figures and tables that compare definitions, and what the page to browse shows of their moduli."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ...config.kind import Output
from ...output.browse import Plot, View

if TYPE_CHECKING:
    from ...config.model import Study


def figures(loads: Iterable[object], mesh_types: Iterable[object]) -> dict[str, dict[str, object]]:
    """Figures by stem: moduli, errors against mesh size by load, and heat maps by mesh type, of the scenes of beams."""
    found: dict[str, dict[str, object]] = {"definitions_moduli": {}}
    found |= {f"definitions_size_{load}": {"load": load} for load in loads}
    return found | {f"definitions_loads_{mesh_type}": {"mesh_type": mesh_type} for mesh_type in mesh_types}


def _figures(study: "Study") -> dict[str, dict[str, object]]:
    loads = dict.fromkeys(scene.load for scene in study.scenes)
    return figures(loads, dict.fromkeys(scene.mesh.mesh_type for scene in study.scenes))


def _lack(study: "Study") -> str:
    return "" if study.parts["moduli"] else "compares moduli and no grid has them; add 'moduli: true' to a grid"


OUTPUTS = (
    Output(
        "definitions",
        "comparison of definitions",
        figures=_figures,
        plot="studies.kinds.moduli.figures:definitions",
        texts={"which_definition.md": "studies.kinds.moduli.figures:decision"},
        lack=_lack,
    ),
)

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
