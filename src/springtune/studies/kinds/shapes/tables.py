"""The table of shapes: each quantity of each scene beside its reference and others' numbers."""

from ...output.dataset import STATUS
from ...output.selection import cells
from .variables import SCENE_AXES

LABEL_COLUMNS = ("shape", "load", "quantity", "definition", "kinematics", "material", "mesh_type")
"""First columns: what a value is of."""


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.scenes.tables.tables`."""
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
