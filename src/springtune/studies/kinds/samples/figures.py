"""Figures of samples: which parameter matters, and how."""

from functools import partial

import numpy as np

from ...output import labels, style
from ...output.selection import choose, group, labels_of, sign_of_errors
from .designs import PARAMETERS

PARAMETER_WORDS = {"relative_mesh_size": "mesh size / height", "young_modulus": "Young's modulus"}
PARAMETER_WORDS |= {"poisson_ratio": "Poisson's ratio"}
"""Names of parameters on an axis, where they are not their own."""

UNIT_SCALES = {"m": (1e3, "mm"), "Pa": (1e-9, "GPa"), "N": (1.0, "N"), "1": (1.0, "")}
"""What values are multiplied with, and the unit then."""

QUANTITY_AXES = {
    "deformation_error": ("deformation error", 100.0, "%"),
    "displacement": ("displacement", 1e3, "mm"),
    "best_stiffness": ("best stiffness", 1.0, "N/m"),
}
"""Name of each quantity on an axis, what its values are multiplied with, and the unit then."""

INDEX_ENDS = -0.3, 1.5
"""Ends of the axis of Sobol indices at most, whose bands may go farther."""

SMALL_MODULUS = 1e9
"""Young's modulus up to which the unit is MPa [Pa]."""


def _is_logarithmic(values):
    """Whether parts of a distribution that are equally probable are more evenly spaced on a logarithmic axis."""
    spacings = [np.diff(of(values)) for of in ((np.log, np.asarray) if (values > 0).all() else (np.asarray,))]
    spreads = [spacing.std() / spacing.mean() for spacing in spacings]
    return spreads[0] < 0.5 * spreads[-1]


def _unit(name, values):
    """What a parameter's values are multiplied with, and its unit."""
    if name == "young_modulus" and np.nanmax(values) <= SMALL_MODULUS:
        return 1e-6, "MPa"
    return (1e-3, "kN") if name == "force" and np.nanmin(values) >= 1e3 else UNIT_SCALES[PARAMETERS[name][2]]


def _words(name):
    return PARAMETER_WORDS.get(name, name.replace("_", " "))


def _axis(text, unit):
    return f"{text} [{unit}]" if unit else text


def _titled(samples, load, what):
    """Title of a figure."""
    words = f"{load.capitalize()}, {samples.attrs['mesh_type']} meshes, {samples.attrs['kinematics']} kinematics"
    return f"{words}: {what}"


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
    asked = found.base_samples + found.base_samples_without > 0
    load = choose(asked.any("quantity"), load=load)["load"]
    found, asked = found.sel(load=load), asked.sel(load=load)
    names, order, shown = found.parameter.values.tolist(), found["definition"].values.tolist(), {}
    for quantity in (name for name in QUANTITY_AXES if name in found["quantity"].values):
        for definition in labels_of(asked.sel(quantity=[quantity]), "definition"):
            alone = quantity == "best_stiffness"  # of uniform springs alone
            title = QUANTITY_AXES[quantity][0] + ("" if alone else f", {definition}")
            look = "0.35" if alone else style.line(order.index(definition))["color"]
            shown.setdefault(title, (found.sel(quantity=quantity, definition=definition), look))
    bands = found[[name for name in found if name.endswith(("_low", "_high"))]].to_array()
    low, high = max(min(0.0, bands.min()), INDEX_ENDS[0]), min(max(1.0, bands.max()), INDEX_ENDS[1])

    def draw(panel, part):
        indices, colour = part
        # Total order pale and wide, first order full and narrow.
        for name, wide, alpha, shift in (("total_order", 0.76, 0.3, 0.2), ("first_order", 0.36, 1.0, -0.2)):
            values, *ends = (indices[f"{name}{end}"].values for end in ("", "_low", "_high"))
            places = np.arange(len(names))
            panel.barh(places, np.maximum(np.nan_to_num(values), 0), wide, color=colour, alpha=alpha, linewidth=0)
            panel.hlines(places + shift, *ends, color="k", linewidth=0.8)
        panel.set(xlim=(low - 0.02, high + 0.02), ylim=(len(names) - 0.45, -0.55), xlabel="share of the variance")
        panel.set_yticks(range(len(names)), [_words(name) for name in names])
        panel.tick_params(axis="y", length=0)
        panel.grid(False, axis="y")
        if not np.isfinite(indices.first_order.values).any():
            none = "no base sample of which all scenes have a value"
            labels.say(panel, "does not vary" if int(indices.base_samples) else none, bare=False)
        return [], ""

    note = "full: first order, pale: total order; lines: bootstrap bands, 95 %" + ", cut off" * bool(
        bands.min() < low or bands.max() > high
    )
    size, lost = samples.attrs["size"], int(found.base_samples_without.max())
    note += f"; {size} base samples" + f", up to {lost} left out: a scene has no value" * bool(lost)
    columns = max(1, min(4, len(order)))
    title, height = _titled(samples, load, "Sobol indices"), 0.21 * len(names) + 0.8
    return labels.small_multiples(ax, shown, columns, height, title, draw, sharey=True, said=note)


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
        for definition in definitions:
            one, look = effects.sel(parameter=name, definition=definition), style.line(every.index(definition))
            mean, error = (factor * one[which].values for which in ("main_effect", "main_effect_error"))
            label = "uniform springs" if quantity == "best_stiffness" else definition
            panel.plot(by * values, mean, label=label, **look | {"marker": ""})
            ends = mean - 2 * error, mean + 2 * error
            panel.fill_between(by * values, *ends, color=look["color"], alpha=0.15, linewidth=0)
        panel.margins(x=0.05)
        if _is_logarithmic(values):
            panel.set(xscale="log")
            style.plain(panel, "x")
        else:
            panel.locator_params(axis="x", nbins=4)
        panel.set(xlabel=_axis(_words(name), of), ylabel=_axis(text, unit))
        return [], "no scene has a value"

    shown = {_words(name): name for name in effects.parameter.values.tolist()}
    title = _titled(samples, load, f"mean {text} over each parameter alone")
    note = _lacking(samples.sel(load=load), definitions, quantity)
    return labels.small_multiples(ax, shown, 3, 1.9, title, draw, sharey=True, said=note)


def _lacking(samples, definitions, quantity):
    """How many scenes the means lack, and of how many the reference does not apply; bands."""
    status = samples.status.sel(definition=definitions)
    unsolved, beyond = int((status != 1).sum()), int(np.sum(samples.get("reference_applies", 1) == 0))
    said = ["bands: two standard errors", sign_of_errors(samples) if quantity == "deformation_error" else ""]
    if unsolved:
        said.append(f"without {unsolved} of {status.size} scenes, which are not solved")
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
