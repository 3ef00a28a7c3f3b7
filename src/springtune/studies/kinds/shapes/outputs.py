"""Figures and table of shapes, and what the page to browse shows of them."""

from typing import TYPE_CHECKING, Any

from ...config.kind import Output, stem
from ...output.browse import Plot, View

if TYPE_CHECKING:
    import xarray as xr

    from ...config.model import Study

MESH_AXES = ("shape", "mesh_type", "mesh_size")
CASE_AXES = ("shape", "material", "load")
SCENE_AXES = (*MESH_AXES, "material", "load", "definition", "kinematics")
"""Dimensions of the group ``/shapes``."""

DRAWING = "shapes"
"""Output that is made of whole networks."""

OVERVIEW = "shapes_overview"
"""Stem of the figure of all quantities."""

ERRORS, DEFORMED = "shapes_errors", "shapes_deformed"
"""First parts of the stems of the figures of a shape under a load."""


def figures(cases: "list[dict[str, str]]") -> "dict[str, dict[str, str]]":
    """Figures by stem: of all quantities, and of each shape and load its errors and its networks."""
    found: dict[str, dict[str, str]] = {OVERVIEW: {}} if cases else {}
    for name in (ERRORS, DEFORMED):
        found |= {stem(name, one): one for one in cases}
    return found


def _cases(study: "Study") -> "list[dict[str, str]]":
    part = study.parts["shapes"]
    pairs = dict.fromkeys((one.shape, one.load) for one in part.scenes) if part else ()
    return [{"shape": shape, "load": load} for shape, load in pairs]


def stems(study: "Study") -> list[str]:
    """Stems of the tables on the page of all tables."""
    return ["shapes"] if study.parts["shapes"] else []


OUTPUTS = (
    Output(
        DRAWING,
        "figures of shapes: errors of their quantities, and their deformed networks (and the group `/shape_fields` "
        "behind them)",
        figures=lambda study: figures(_cases(study)),
        plot="studies.kinds.shapes.figures:shapes",
        usual=True,
    ),
)


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


LABEL_COLUMNS = ("shape", "load", "quantity", "definition", "kinematics", "material", "mesh_type")
"""First columns: what a value is of."""


def tables(tree: "xr.DataTree") -> list[dict[str, Any]]:
    """Tables of the page, see `springtune.studies.kinds.scenes.tables.tables`."""
    # Here, since a plan does without xarray.
    from ...output.dataset import STATUS
    from ...output.selection import cells

    if "shapes" not in tree:
        return []
    data, rows, sources = tree["shapes"].to_dataset(), [], {}
    for place in cells(data.status != 0, SCENE_AXES):
        cell = data.sel(place)
        for name in (one for one in data.quantity.values.tolist() if cell.quantity_kind.sel(quantity=one).item()):
            one = cell.sel(quantity=name)
            if one.source.item():
                sources[f"{place['shape']}, {name}: {one.source.item()}"] = None
            about = place | {"quantity": name}
            rows.append(
                {key: about[key] for key in LABEL_COLUMNS}
                | {"mesh_size_mm": 1e3 * place["mesh_size"], "particles": float(one.particles)}
                | {"value": float(one.value), "reference": float(one.reference_value)}
                | {"expected": float(one.expected_value), "units": str(one.quantity_units.item())}
                | {
                    f"{error}_percent": 100 * float(one[error])
                    for error in ("error", "expected_error", "reference_error_estimate")
                }
                | {"status": STATUS[int(one.status)], "message": str(one.message.item())}
            )
    note = (
        "Quantities of interest of the networks, in SI units; the reference is small-strain plane stress by converged "
        "finite elements on the same shape, and errors are signed: (network − reference) / |reference|, and the same "
        "against the expected values that others give."
    )
    told = "; ".join(sources)
    return [{"stem": "shapes", "title": "Shapes", "note": f"{note} Sources: {told}." if told else note, "rows": rows}]
