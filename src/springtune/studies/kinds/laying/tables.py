"""The table of laid strips."""

import numpy as np

from ...output.selection import cells


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.scenes.tables.tables`."""
    if "laying" not in tree:
        return []
    laid, rows = tree["laying"].to_dataset(), []
    for place in cells(np.isfinite(laid.area_under_strip), ("loading", "friction", "mesh_size", "definition")):
        cell = laid.sel(place)
        rows.append(
            {name: place[name] for name in ("loading", "friction", "definition")}
            | {
                "mesh_size_mm": 1e3 * place["mesh_size"],
                "area_mm2": 1e6 * float(cell.area_under_strip),
                "area_error_percent": 100 * float(cell.area_error),
                "elongation_percent": 100 * float(cell.elongation),
                "reference_elongation_percent": 100 * float(cell.reference_elongation),
                "reference_elongation_known_to_points": 100 * float(cell.reference_elongation_error_estimate),
                "penetration_per_mesh_size": float(cell.penetration),
            }
        )
    x, y = laid.trapezoid_x.values, laid.trapezoid_y.values
    trapezoid = 0.5e6 * abs(float(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))))
    note = (
        "Area between strip and floor and elongation of the strip's lower fibre; the reference's is known to so many "
        "points: twice the spread of three meshes, since the trapezoid's corners catch between a strip's particles, "
        f"where depends on the mesh. The networks' own scatter as much. The trapezoid has {trapezoid:.4g} mm²."
    )
    return [{"stem": "laying", "title": "Laid strips", "note": note, "rows": rows}]
