"""Figures and table of samples: which parameter matters."""

import numpy as np

from ...output import style
from ...output.dataset import choose, group, labels_of

PARAMETER_WORDS = {"relative_mesh_size": "mesh size / height", "young_modulus": "Young's modulus"}
PARAMETER_WORDS |= {"poisson_ratio": "Poisson's ratio"}
"""Names of parameters on an axis, where they are not their own."""

INDEX_LIMITS = -0.3, 1.5  # ends of the axis of Sobol indices at most, whose bands may go farther


@style.styled
def plot_sobol(data, ax=None, *, load=None):
    """Sobol indices of a sample, one panel per quantity and definition.

    Parameters
    ----------
    data : xarray.DataTree
        A study's dataset.
    ax : Figure or sequence of Axes, optional
    load : str, optional

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_panels,)

    Raises
    ------
    ValueError
        If the dataset has no Sobol indices, the selection leaves a choice, or ``ax`` is not as many Axes as panels.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/sobol")
    >>> axes = st.plot_sobol(tree, load="traction")
    >>> [panel.get_title(loc="left") for panel in axes[:2]]
    ['deformation error, paper', 'deformation error, area']
    >>> [tick.get_text() for tick in axes[0].get_yticklabels()]
    ['height', 'force']
    """
    found, samples = group(data, "sobol", needs_tree=True), group(data, "samples", needs_tree=True)
    asked = found.base_samples + found.base_samples_without > 0
    load = choose(asked.any("quantity"), load=load)["load"]
    found, asked = found.sel(load=load), asked.sel(load=load)
    names, order, shown = found.parameter.values.tolist(), found["definition"].values.tolist(), {}
    for quantity in sorted(found["quantity"].values.tolist(), key=lambda name: name != "deformation_error"):
        for definition in labels_of(asked.sel(quantity=[quantity]), "definition"):
            uniform = quantity == "best_stiffness"  # of uniform springs alone
            title = quantity.replace("_", " ") + ("" if uniform else f", {definition}")
            look = "0.35" if uniform else style.line(order.index(definition))["color"]
            shown.setdefault(title, (found.sel(quantity=quantity, definition=definition), look))
    bands = found[[name for name in found if name.endswith(("_low", "_high"))]].to_array()
    low, high = max(min(0.0, bands.min()), INDEX_LIMITS[0]), min(max(1.0, bands.max()), INDEX_LIMITS[1])

    def draw(panel, part):
        indices, colour = part
        # Total order pale and wide, first order full and narrow.
        for name, wide, alpha, shift in (("total_order", 0.76, 0.3, 0.2), ("first_order", 0.36, 1.0, -0.2)):
            values, *ends = (indices[f"{name}{end}"].values for end in ("", "_low", "_high"))
            places = np.arange(len(names))
            panel.barh(places, np.maximum(np.nan_to_num(values), 0), wide, color=colour, alpha=alpha, linewidth=0)
            panel.hlines(places + shift, *ends, color="k", linewidth=0.8)
        panel.set(xlim=(low - 0.02, high + 0.02), ylim=(len(names) - 0.45, -0.55), xlabel="share of the variance")
        panel.set_yticks(range(len(names)), [PARAMETER_WORDS.get(name, name.replace("_", " ")) for name in names])
        panel.tick_params(axis="y", length=0)
        panel.grid(False, axis="y")
        if not np.isfinite(indices.first_order.values).any():
            none = "no base sample of which all scenes have a value"
            style.write_reason(panel, "does not vary" if int(indices.base_samples) else none, bare=False)
        return [], ""

    cut_off = ", cut off" * bool(bands.min() < low or bands.max() > high)
    note = f"full: first order, pale: total order; lines: bootstrap bands, 95 %{cut_off}"
    size, lost = samples.attrs["size"], int(found.base_samples_without.max())
    note += f"; {size} base samples" + f", up to {lost} left out: a scene has no value" * bool(lost)
    columns = max(1, min(4, len(order)))
    title = f"{load.capitalize()}, {samples.attrs['mesh_type']} meshes, {samples.attrs['kinematics']} kinematics"
    title, height = f"{title}: Sobol indices", 0.21 * len(names) + 0.8
    return style.small_multiples(ax, shown, columns, height, title, draw, sharey=True, note=note)


def sobol(tree):
    """Yield the figure of each load: stem, plot function and selection."""
    for load in labels_of((tree["samples"].to_dataset().status != 0).any("sample"), "load"):
        yield f"sobol_{load}", plot_sobol, {"load": load}


# -- tables ------------------------------------------------------------------------------------------------------------


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.bodies.tables.tables`."""
    if "sobol" not in tree:
        return []
    found = tree["sobol"].to_dataset()
    labels = ["quantity", "load", "definition", "parameter"]
    columns = [name for name in found.data_vars if name != "base_samples_without"]
    frame = found[columns].to_dataframe(dim_order=labels).reset_index()
    frame = frame[frame.base_samples > 0]
    frame["definition"] = frame["definition"].mask(frame["quantity"] == "best_stiffness", "")  # one of all definitions
    rows = frame.drop_duplicates(labels).to_dict("records")
    note = (
        "Displacement of the network, deformation error and uniform stiffness without an error: shares of their "
        "variance by each parameter alone (first order) and in all that it takes part in (total order). "
        f"Bands: {found.attrs['bands']}. Failures: {found.attrs['failures']}."
    )
    return [{"stem": "sobol", "title": "Sobol indices", "note": note, "rows": rows}]
