"""Figures and table of shapes, and what the page to browse shows of them."""

from typing import TYPE_CHECKING, Any

from ...config.kind import Output, stem
from ...output.browse import Plot, View, particle_plots

if TYPE_CHECKING:
    import xarray as xr

    from ...config.model import Study

MESH_AXES = ("shape", "mesh_type", "mesh_size")
CASE_AXES = ("shape", "material", "load")
SCENE_AXES = (*MESH_AXES, "material", "load", "definition", "kinematics")
"""Dimensions of the group ``/shapes``."""

MADE = "free"
"""Mesh type of shapes with an outline: Delaunay triangles inside it."""

OWN_FILE = "file"
"""Mesh type of a shape whose mesh is that of its file."""

DRAWING = "shapes"
"""Output that is made of whole networks."""

OVERVIEW = "shapes_overview"
"""Stem of the figure of all quantities."""

ERRORS, DEFORMED = "shapes_errors", "shapes_deformed"
"""First parts of the stems of the figures of a shape under a load."""


def mesh_name(one: Any) -> str:
    """Readable name of a scene's mesh."""
    return f"{one.shape}_{one.mesh_type}" + (f"_{1e3 * one.mesh_size:.9g}mm" if one.mesh_size else "")


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
        "/shapes_finite_strain",
        "Shapes at finite strain",
        "Errors of networks that have a law at finite strain, against references of that law.",
        (
            Plot("error over mesh size", "error", "mesh_size", "definition", log="xy"),
            Plot("errors of definitions by quantity", "error", "quantity", "definition", "map"),
            Plot("quantities of the references", "reference_value", "load", "law"),
        ),
    ),
    View(
        "/shape_fields",
        "Networks of shapes",
        "Positions and displacements of all particles, of each shape and load.",
        particle_plots("outline"),
    ),
)  # fmt: skip


LABEL_COLUMNS = ("shape", "load", "quantity", "definition", "kinematics", "material", "mesh_type")
"""First columns: what a value is of."""

ERRORS_SHOWN = ("error", "expected_error", "reference_error_estimate")


def tables(tree: "xr.DataTree") -> list[dict[str, Any]]:
    """Tables of the page, see `springtune.studies.kinds.scenes.tables.tables`."""
    # Here, since a plan does without xarray.
    from ...output.dataset import STATUS
    from ...output.selection import records
    from ...output.tables import listed

    if "shapes" not in tree:
        return []
    data = tree["shapes"].to_dataset()
    present = (data.status != 0).transpose(*SCENE_AXES) & (data.quantity_kind != "")
    present = present.transpose(*SCENE_AXES, "quantity")
    columns = {"mesh_size_mm": ("mesh_size", 1e3), "particles": ("particles", 1), "value": ("value", 1)}
    columns |= {"reference": ("reference_value", 1), "expected": ("expected_value", 1), "units": ("quantity_units", 1)}
    columns |= {f"{name}_percent": (name, 100) for name in ERRORS_SHOWN}
    columns |= {name: (name, 1) for name in ("status", "message")}
    rows = [row | {"status": STATUS[row["status"]]} for row in listed(data, present, LABEL_COLUMNS, columns)]
    cited = (one for one in records(data, present, ["source"]) if one["source"])
    sources = dict.fromkeys(f"{one['shape']}, {one['quantity']}: {one['source']}" for one in cited)
    strained = tree.attrs.get("plane_strain")
    note = (
        "Quantities of interest of the networks, in SI units; the reference is small-strain plane stress "
        f"{f'(plane strain of {strained}) ' if strained else ''}by converged finite elements on the same shape, and "
        "errors are signed: (network − reference) / |reference|, and the same against the expected values that others "
        "give."
    )
    told = "; ".join(sources)
    return [{"stem": "shapes", "title": "Shapes", "note": f"{note} Sources: {told}." if told else note, "rows": rows}]
