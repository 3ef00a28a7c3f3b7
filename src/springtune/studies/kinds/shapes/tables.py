"""The table of shapes: each quantity of each scene beside its reference and others' numbers."""

from ...output.dataset import STATUS
from .variables import SCENE_AXES


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.scenes.tables.tables`."""
    if "shapes" not in tree:
        return []
    data, rows = tree["shapes"].to_dataset(), []
    sources = []
    for place in _asked(data):
        cell = data.sel(place)
        for name in data.quantity.values.tolist():
            one = cell.sel(quantity=name)
            kind = str(one.quantity_kind.item())
            if not kind:
                continue
            if one.source.item():
                sources.append(f"{place['shape']}, {name}: {one.source.item()}")
            unit = str(one.quantity_units.item())
            rows.append(
                {name: place[name] for name in ("shape", "load")}
                | {"quantity": name, "definition": place["definition"], "kinematics": place["kinematics"]}
                | {"material": place["material"], "mesh_type": place["mesh_type"]}
                | {"mesh_size_mm": 1e3 * place["mesh_size"], "particles": float(one.particles)}
                | {"value": float(one.value), "reference": float(one.reference_value)}
                | {"expected": float(one.expected_value), "units": unit}
                | {"error_percent": 100 * float(one.error)}
                | {"expected_error_percent": 100 * float(one.expected_error)}
                | {"reference_error_estimate_percent": 100 * float(one.reference_error_estimate)}
                | {"status": STATUS[int(one.status)], "message": str(one.message.item())}
            )
    note = (
        "Quantities of interest of the networks, in SI units; the reference is small-strain plane stress by converged "
        "finite elements on the same shape, and errors are signed: (network − reference) / |reference|, and the same "
        "against the expected values that others give."
    )
    told = "; ".join(dict.fromkeys(sources))
    return [{"stem": "shapes", "title": "Shapes", "note": f"{note} Sources: {told}." if told else note, "rows": rows}]


def _asked(data):
    """Labels of the scenes that were asked for."""
    stacked = data.status.transpose(*SCENE_AXES)
    labels = [stacked[name].values.tolist() for name in SCENE_AXES]
    for place in zip(*stacked.values.nonzero()):
        yield {name: label[number] for name, label, number in zip(SCENE_AXES, labels, place)}
