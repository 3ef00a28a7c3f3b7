"""The table of Sobol indices."""

import numpy as np

from .outputs import QUANTITIES


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.scenes.tables.tables`."""
    if "sobol" not in tree:
        return []
    found, rows = tree["sobol"].to_dataset(), {}
    for place in np.argwhere(found.base_samples.values > 0):
        cell = found.isel(dict(zip(found.base_samples.dims, place)))
        quantity, load, definition = (str(cell[name].values) for name in ("quantity", "load", "definition"))
        definition = "" if quantity == "best_stiffness" else definition  # it is the same for all definitions
        for parameter in found.parameter.values:
            one = cell.sel(parameter=parameter)
            labels = {"quantity": quantity, "load": load, "definition": definition, "parameter": parameter}
            orders = [f"{order}_order{end}" for order in ("first", "total") for end in ("", "_low", "_high")]
            values = {name: float(one[name]) for name in orders}
            rows.setdefault(tuple(labels.values()), labels | values | {"base_samples": int(cell.base_samples)})
    first, second, third = QUANTITIES.values()
    note = (
        f"{first.capitalize()}, {second} and {third}: shares of their variance by each parameter alone (first order) "
        f"and in all that it takes part in (total order). Bands: {found.attrs['bands']}. "
        f"Failures: {found.attrs['failures']}."
    )
    return [{"stem": "sobol", "title": "Sobol indices", "note": note, "rows": list(rows.values())}]
