"""Figures of samples: which parameter matters, and how."""

from functools import partial

import numpy as np

from ...output import labels, style
from ...output.selection import choose, group, labels_of, sign_of_errors

PARAMETER_AXES = {
    "length": ("length", 1e3, "mm"),
    "height": ("height", 1e3, "mm"),
    "thickness": ("thickness", 1e3, "mm"),
    "mesh_size": ("mesh size", 1e3, "mm"),
    "relative_mesh_size": ("mesh size / height", 1.0, ""),
    "young_modulus": ("Young's modulus", 1e-9, "GPa"),
    "poisson_ratio": ("Poisson's ratio", 1.0, ""),
    "force": ("force", 1.0, "N"),
}
"""Name of each parameter on an axis, what its values are multiplied with, and the unit then."""

QUANTITY_AXES = {
    "displacement": ("displacement", 1e3, "mm"),
    "deformation_error": ("deformation error", 100.0, "%"),
    "best_stiffness": ("best stiffness", 1.0, "N/m"),
}
"""The same of each quantity."""

COLUMNS = 4
"""Most panels side by side."""

SMALL_MODULUS = 1e9
"""Young's modulus up to which the unit is MPa [Pa]."""


def _is_logarithmic(values):
    """Whether parts of a distribution that are equally probable are more evenly spaced on a logarithmic axis."""
    spacings = [np.diff(of(values)) for of in ((np.log, np.asarray) if (values > 0).all() else (np.asarray,))]
    spreads = [spacing.std() / spacing.mean() for spacing in spacings]
    return spreads[0] < 0.5 * spreads[-1]


def _unit(name, values):
    """What a parameter's values are multiplied with, and its unit."""
    _, factor, unit = PARAMETER_AXES[name]
    if name == "young_modulus" and np.nanmax(values) <= SMALL_MODULUS:
        return 1e-6, "MPa"
    if name == "force" and np.nanmin(values) >= 1e3:
        return 1e-3, "kN"
    return factor, unit


def _axis(text, unit):
    return f"{text} [{unit}]" if unit else text


def _titled(samples, load, what):
    """Title of a figure."""
    words = f"{load.capitalize()}, {samples.attrs['mesh_type']} meshes, {samples.attrs['kinematics']} kinematics"
    return f"{words}: {what}"


def _panels_of_indices(data, load):
    """Quantity and definition of each panel; the best stiffness has one panel for all definitions."""
    asked = data.base_samples.sel(load=load) + data.base_samples_without.sel(load=load) > 0
    found = []
    for quantity in ("deformation_error", "displacement", "best_stiffness"):
        if quantity in data["quantity"].values:
            names = labels_of(asked.sel(quantity=[quantity]), "definition")
            found += [(quantity, name) for name in (names[:1] if quantity == "best_stiffness" else names)]
    return found


@style.styled
def plot_sobol(data, ax=None, *, load=None):
    """Sobol indices of a sample, a panel a quantity and definition.

    Parameters
    ----------
    data : xarray.DataTree
        A study's dataset.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as there are quantities and definitions; by default a new figure.
    load : str, optional
        Label of the load. One that is not given must leave no choice.

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
    found, samples = group(data, "sobol", alone=False), group(data, "samples", alone=False)
    asked = (found.base_samples + found.base_samples_without > 0).any("quantity")
    load = choose(asked, load=load)["load"]
    shown = _panels_of_indices(found, load)
    names = found.parameter.values.tolist()
    words = [PARAMETER_AXES[name][0] for name in names]
    columns = min(COLUMNS, max(1, sum(quantity == shown[0][0] for quantity, _ in shown)))
    limits, farther = _limits(found, shown, load)
    note = _note(found.sel(load=load), samples.attrs["size"]) + ("; arrows: bands go farther" if farther else "")
    order = found["definition"].values.tolist()

    def draw(panel, one):
        quantity, definition = one
        indices = found.sel(quantity=quantity, load=load, definition=definition)
        colour = "0.35" if quantity == "best_stiffness" else style.line(order.index(definition))["color"]
        _bars(panel, indices, colour, limits)
        panel.set(xlim=limits, xlabel="share of the variance")
        panel.set_yticks(range(len(names)), words)
        if not np.isfinite(indices.first_order.values).any():
            labels.say(panel, _why(indices), bare=False)
        return [], ""

    def titled(quantity, definition):
        return QUANTITY_AXES[quantity][0] + ("" if quantity == "best_stiffness" else f", {definition}")

    panels = {titled(*one): one for one in shown}
    title = _titled(samples, load, "Sobol indices")
    return labels.small_multiples(ax, panels, columns, 0.21 * len(names) + 0.8, title, draw, sharey=True, said=note)


def _why(one):
    """Why there are no indices of a quantity."""
    if int(one.base_samples):
        return "does not vary"
    return "no base sample of which all scenes have a value"


def _limits(found, shown, load):
    """Ends of the axis of all panels, from zero to one or farther within reason, and whether bands go beyond them."""
    cells = [found.sel(quantity=quantity, load=load, definition=name) for quantity, name in shown]
    ends = [np.nan_to_num(cell[f"{order}_order_{end}"].values)
            for cell in cells for order in ("first", "total") for end in ("low", "high")]  # fmt: skip
    low, high = min(0.0, *map(np.min, ends)), max(1.0, *map(np.max, ends))
    return (max(low, -0.3) - 0.02, min(high, 1.5) + 0.02), low < -0.32 or high > 1.52


def _bars(panel, indices, colour, limits):
    """Bars of the indices of one quantity: total order pale and wide, first order full and narrow, with bands."""
    for order, wide, alpha, shift in (("total_order", 0.76, 0.3, 0.2), ("first_order", 0.36, 1.0, -0.2)):
        values, low, high = (indices[f"{order}{end}"].values for end in ("", "_low", "_high"))
        places = np.arange(len(values))
        panel.barh(places, np.maximum(np.nan_to_num(values), 0), wide, color=colour, alpha=alpha, linewidth=0)
        panel.hlines(places + shift, low, high, color="k", linewidth=0.8)
        for marker, end, cut in (("<", limits[0], low < limits[0]), (">", limits[1], high > limits[1])):
            if cut.any():  # a layout makes no room for a line of no points
                ends = np.full(cut.sum(), end)
                panel.plot(ends, (places + shift)[cut], marker, color="k", markersize=3, clip_on=False)
    panel.set_ylim(len(places) - 0.45, -0.55)
    panel.tick_params(axis="y", length=0)
    panel.grid(False, axis="y")


def _note(found, size):
    """What bars and bands show, and the number of their base samples."""
    used, without = found.base_samples.values, found.base_samples_without.values
    text = "full: first order, pale: total order; lines: bootstrap bands, 95 %"
    lost = int(without.max())
    if not lost:
        return f"{text}; {size} base samples"
    some = used[used + without > 0]
    kept = f"{int(some.min())}" if some.min() == some.max() else f"{int(some.min())} to {int(some.max())}"
    return f"{text}; of {kept} of {size} base samples: up to {lost} have a scene without a value"


@style.styled
def plot_effects(data, ax=None, *, load=None, quantity="deformation_error"):
    """Main effects of a sample: the mean of a quantity over each parameter alone, a panel a parameter.

    Parameters
    ----------
    data : xarray.DataTree
        A study's dataset.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as there are parameters; by default a new figure.
    load : str, optional
        Label of the load. One that is not given must leave no choice.
    quantity : str, optional
        ``"deformation_error"``, ``"displacement"`` or ``"best_stiffness"``.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_parameters,)

    Raises
    ------
    ValueError
        If the dataset has no samples, the selection leaves a choice, or ``ax`` is not as many Axes as parameters.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/sobol")
    >>> axes = st.plot_effects(tree, load="traction")
    >>> [panel.get_xlabel() for panel in axes]
    ['height [mm]', 'force [N]']
    """
    effects, samples = group(data, "effects", alone=False), group(data, "samples", alone=False)
    asked = (samples.status != 0).any("sample")
    load = choose(asked, load=load)["load"]
    choose(effects.main_effect.notnull() | True, quantity=quantity)
    effects = effects.sel(load=load, quantity=quantity)
    definitions = labels_of(asked.sel(load=[load]), "definition")
    definitions = definitions[:1] if quantity == "best_stiffness" else definitions
    every = effects["definition"].values.tolist()
    text, factor, unit = QUANTITY_AXES[quantity]

    def draw(panel, name):
        values = effects.parameter_value.sel(parameter=name).values
        by, of = _unit(name, values)
        x = by * values
        for definition in definitions:
            one, look = effects.sel(parameter=name, definition=definition), style.line(every.index(definition))
            mean, error = (factor * one[which].values for which in ("main_effect", "main_effect_error"))
            label = "uniform springs" if quantity == "best_stiffness" else definition
            panel.plot(x, mean, label=label, **look | {"marker": ""})
            panel.fill_between(x, mean - 2 * error, mean + 2 * error, color=look["color"], alpha=0.15, linewidth=0)
        panel.margins(x=0.05)
        if _is_logarithmic(values):
            panel.set(xscale="log")
            style.plain(panel, "x")
        else:
            panel.locator_params(axis="x", nbins=4)
        panel.set(xlabel=_axis(PARAMETER_AXES[name][0], of), ylabel=_axis(text, unit))
        return [], "no scene has a value"

    shown = {PARAMETER_AXES[name][0]: name for name in effects.parameter.values.tolist()}
    title = _titled(samples, load, f"mean {text} over each parameter alone")
    note = _lacking(samples, load, definitions, quantity)
    return labels.small_multiples(ax, shown, 3, 1.9, title, draw, sharey=True, said=note)


def _lacking(samples, load, definitions, quantity):
    """How many scenes the means lack, and of how many the reference does not apply; bands."""
    scenes = samples.sel(load=load, definition=definitions)
    unsolved, every = int((scenes.status != 1).sum()), scenes.status.size
    said = ["bands: two standard errors"]
    if quantity == "deformation_error":
        said.append(sign_of_errors(samples.sel(load=load)))
    if unsolved:
        said.append(f"without {unsolved} of {every} scenes, which are not solved")
    beyond = int((samples.reference_applies.sel(load=load) == 0).sum()) if "reference_applies" in samples else 0
    if beyond:
        said.append(f"{beyond} of {samples.sizes['sample']} points are beyond small strain or without a reference, "
                    "so that their error is not the network's alone")  # fmt: skip
    return "; ".join(filter(None, said))


def _each_load(name, plot, tree):
    """Stem, function that plots, and selection of each figure."""
    for load in labels_of((tree["samples"].to_dataset().status != 0).any("sample"), "load"):
        yield f"{name}_{load}", plot, {"load": load}


sobol = partial(_each_load, "sobol", plot_sobol)
effects = partial(_each_load, "effects", plot_effects)
