"""The table of Sobol indices."""

import numpy as np

from .names import QUANTITIES


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.scenes.tables.tables`."""
    if "sobol" not in tree:
        return []
    found, rows = tree["sobol"].to_dataset(), []
    for place in np.argwhere(found.base_samples.values > 0):
        cell = found.isel(dict(zip(found.base_samples.dims, place)))
        quantity = str(cell["quantity"].values)
        if quantity == "best_stiffness" and any(row["quantity"] == quantity and row["load"] == str(cell["load"].values)
                                                for row in rows):  # fmt: skip
            continue  # of no definition
        definition = "" if quantity == "best_stiffness" else str(cell["definition"].values)
        for parameter in found.parameter.values:
            one = cell.sel(parameter=parameter)
            row = {
                "quantity": quantity,
                "load": str(cell["load"].values),
                "definition": definition,
                "parameter": parameter,
            }
            for order in ("first_order", "total_order"):
                row |= {name: float(one[name]) for name in (order, f"{order}_low", f"{order}_high")}
            rows.append(row | {"base_samples": int(cell.base_samples)})
    about = f"{QUANTITIES['displacement'].capitalize()}, {QUANTITIES['deformation_error']} and "
    about += f"{QUANTITIES['best_stiffness']}"
    note = (
        f"{about}: shares of their variance by each parameter alone (first order) and in all that it takes part in "
        f"(total order). Bands: {found.attrs['bands']}. Failures: {found.attrs['failures']}."
    )
    return [{"stem": "sobol", "title": "Sobol indices", "note": note, "rows": rows}]
