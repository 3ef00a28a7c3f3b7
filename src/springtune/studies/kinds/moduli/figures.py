"""Figures that compare definitions: moduli, errors over mesh sizes and by load."""

import numpy as np

from springtune.safe_io.escapes import no_mathematics

from ...output import labels, style
from ...output.dataset import most_requested
from ...output.drawing import BEYOND_SMALL_STRAIN, NO_RESULT, NOT_ASKED, error_text, heat_map
from ...output.selection import choose, group, labelled_beam, labels_of, sign_of_errors, unswept
from .outputs import figures

FLOOR = 1e-5
"""Smallest error drawn on a logarithmic axis [1]; smaller ones are rounding and the reference's own error."""

MOST_NAMED = 6
"""Most named lines in a panel of errors against mesh size; the others are grey."""

BASELINE = "uniform"
"""The definition that is named beside the best ones."""


def definitions(tree):
    """Figures that compare definitions: moduli, errors against mesh size by load, and heat maps by mesh type."""
    root = unswept(group(tree, "/"))
    asked = root.status != 0
    for stem, selection in figures(labels_of(asked, "load"), labels_of(asked, "mesh_type")).items():
        if "load" in selection:
            yield stem, plot_definitions_size, _main(root, ("beam", "kinematics", "material"), selection)
        elif "mesh_type" in selection:
            yield stem, plot_definitions_loads, _main(root, ("beam", "kinematics"), selection)
        else:
            yield stem, plot_moduli, {}


def _main(root, names, selection):
    """A selection, and of further dimensions the labels with most of its scenes."""
    chosen, root = dict(selection), root[["status"]].sel({name: [label] for name, label in selection.items()})
    for name in names:
        chosen[name] = most_requested(root, name)
        root = root.sel({name: [chosen[name]]})
    return chosen


def _by_mesh_type(ax, present, title, draw):
    """A panel a mesh type; `draw` returns notes, and what to say without lines."""
    names = {name: name for name in labels_of(present, "mesh_type")}
    return labels.small_multiples(ax, names, 2, 1.95, title, draw)


def _statuses(flags):
    """Count the cells of each status, in words."""
    found = labels.statuses(flags).items()
    return ", ".join(f"{name} ({count})" for name, count in found) or "none was asked for"


@style.styled
def plot_moduli(data, ax=None):
    """Effective Poisson's ratio against the one asked for, a panel a mesh type, each on its finest patch.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/moduli``.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as mesh types; by default a new figure.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_mesh_types,)
        One a mesh type.

    Raises
    ------
    ValueError
        If the dataset has no moduli, or ``ax`` is not as many Axes as mesh types.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_moduli(tree)
    >>> [panel.get_title(loc="left") for panel in axes]
    ['structured', 'free']
    >>> axes[0].get_xlabel(), axes[0].get_ylabel()
    ('asked for', 'effective')
    """
    moduli = group(data, "moduli")
    title = "Effective Poisson's ratio against the one asked for; grey: as asked"
    return _by_mesh_type(ax, moduli.status != 0, title, lambda panel, name: _moduli(panel, moduli.sel(mesh_type=name)))


def _moduli(panel, here):
    """Draw the moduli of one mesh type, see `_by_mesh_type`."""
    panel.set(xlabel="asked for", ylabel="effective")
    curves, lacking, wanted = {}, [], here.poisson_ratio.values
    for definition in here.definition.values:
        one = here.sel(definition=definition)
        sizes = np.flatnonzero((one.status == 1).any("poisson_ratio").values)
        if len(sizes):
            curves[str(definition)] = one.effective_poisson_ratio.values[sizes[0]]
        elif (one.status != 0).any():
            lacking.append(str(definition))
    low, high = wanted.min(), max(wanted.max(), wanted.min() + 1e-3)
    panel.plot([low, high], [low, high], color="0.8", linewidth=3.5, zorder=0)
    panel.set_xlim(low - 0.02, high + 0.02)
    values = np.concatenate([[low, high], *curves.values()])
    bottom, top = np.clip([np.nanmin(values) - 0.03, np.nanmax(values) + 0.03], -0.45, 0.75)
    panel.set_ylim(min(bottom, low - 0.03), max(top, high + 0.03))
    for number, names in enumerate(labels.alike(curves, 0.012)):
        panel.plot(wanted, curves[names[0]], label=", ".join(names), **style.line(number))
    said = [f"no moduli: {', '.join(lacking)}"] if lacking else []
    return said, f"No definition has moduli here: {_statuses(here.status.values)}."


@style.styled
def plot_definitions_size(data, ax=None, *, beam=None, material=None, load=None, kinematics=None):
    """Field error against mesh size with fitted rates, a panel a mesh type, a line a definition.

    Definitions that look like one line share it. Only the best and `uniform` have names; the others are grey.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its root.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as mesh types; by default a new figure.
    beam, material, load, kinematics : str, optional
        Labels of the scenes. One that is not given must leave no choice.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_mesh_types,)
        One a mesh type.

    Raises
    ------
    ValueError
        If the selection leaves a choice, or nothing, or ``ax`` is not as many Axes as mesh types.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_definitions_size(tree, beam="200x40", material="steel", load="traction", kinematics="linear")
    >>> [panel.get_title(loc="left") for panel in axes]
    ['structured', 'free']
    >>> axes[0].figure.get_suptitle()
    '200x40 mm, steel, traction: error of the displacement field in L2, fitted rate in brackets'
    """
    root = unswept(group(data, "/"))
    chosen = choose(root.status != 0, beam=beam, material=material, load=load, kinematics=kinematics)
    root = root.sel(chosen)
    title = f"{labelled_beam(root, chosen['beam'])}, {chosen['material']}, {chosen['load']}"
    rates = ", fitted rate in brackets" if len(labels_of(root.status != 0, "mesh_size")) > 1 else ""
    title = f"{title}: error of the displacement field in L2{rates}"
    values = root.field_error.values
    values = 100 * np.maximum(values[np.isfinite(values)], FLOOR)
    limits = (0.7 * values.min(), 1.4 * values.max()) if len(values) else None

    def draw(panel, name):
        drawn = _field_errors(panel, root.field_error.sel(mesh_type=name), root.status.sel(mesh_type=name))
        panel.set(ylabel="Error [%]", ylim=limits)
        style.plain(panel, "y")
        return drawn

    return _by_mesh_type(ax, root.status != 0, title, draw)


def _field_errors(panel, error, status):
    """Draw the errors of one mesh type, see `_by_mesh_type`: the best definitions and the baseline have names."""
    asked = labels_of(status != 0, "mesh_size")
    error = error.sel(mesh_size=asked)
    every, flags = (one.transpose("definition", ...).values for one in (error, status.sel(mesh_size=asked)))
    sizes, names = 1e3 * error.mesh_size.values, error.definition.values
    known = np.isfinite(every)
    curves = {str(name): 100 * np.maximum(row, FLOOR) for name, row, there in zip(names, every, known) if there.any()}
    panel.set(yscale="log")
    places = dict(zip(curves, labels.sizes_axis(panel, sizes, len(curves))))
    if not curves:
        return [], f"No definition has a field error here: {_statuses(flags)}."
    together = labels.alike({name: np.log(values) for name, values in curves.items()}, 0.01)
    together.sort(key=lambda one: np.nanmean(np.log(curves[one[0]])))
    base, named = next((one for one in together if BASELINE in one), None), together[:MOST_NAMED]
    if base is not None and base not in named:
        named[-1] = base
    others = [name for one in together if one not in named for name in one]
    for name in others:
        panel.plot(places[name], curves[name], color="0.75", linewidth=0.6, marker=".", markersize=2, zorder=1)
    order = names.tolist()
    for one in named:
        values, look = curves[one[0]], style.line(order.index(one[0]))
        there = np.flatnonzero(np.isfinite(values))
        label = ", ".join(one)
        if len(there) > 1:
            rate = np.polyfit(np.log(sizes[there]), np.log(values[there]), 1)[0]
            label += f" ({rate:.1f})".replace("-0.0", "0.0").replace("-", "−")
        panel.plot(places[one[0]], values, label=label, **look)
    lacking = [str(name) for name, there, flag in zip(names, known, flags) if not there.any() and (flag > 0).any()]
    said = {"grey": others, "no error": lacking}
    return [f"{what}: {', '.join(own)}" for what, own in said.items() if own], ""


@style.styled
def plot_definitions_loads(data, ax=None, *, beam=None, mesh_type=None, materials=None, kinematics=None):
    """Heat map of the deformation error, definition by load, each on its finest mesh, a panel a material.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its root.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as materials; by default a new figure.
    beam, mesh_type, kinematics : str, optional
        Labels of the scenes. One that is not given must leave no choice.
    materials : sequence of str, optional
        By default three of those with most scenes, from the lowest to the highest Poisson's ratio.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_materials,)
        One a material.

    Raises
    ------
    ValueError
        If the selection leaves a choice, or nothing, or ``ax`` is not as many Axes as materials.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_definitions_loads(tree, beam="200x40", mesh_type="free", kinematics="linear")
    >>> [panel.get_title(loc="left").partition(", ν = ")[0] for panel in axes]
    ['steel', 'rubber']
    >>> [tick.get_text() for tick in axes[0].get_xticklabels()]
    ['traction', 'compression', 'pressure']
    """
    root = unswept(group(data, "/"))
    chosen = choose(root.status != 0, beam=beam, mesh_type=mesh_type, kinematics=kinematics)
    root = root.sel(chosen)
    solved = root.status == 1
    materials = _spread(root, solved) if materials is None else materials
    for material in materials:
        choose(root.status != 0, material=material)
    if solved.any():
        root = root.sel(definition=labels_of(solved, "definition"))
    root = root.sel(load=labels_of(root.status != 0, "load"))
    names, loads = root.definition.values.tolist(), root["load"].values.tolist()
    place = ("mesh_size", "definition", "load")
    beyond = root.reference_applies == 0 if "reference_applies" in root else root.status < 0

    def draw(panel, material):
        cells, error = root.sel(material=material), np.full((len(names), len(loads)), np.nan)
        doubted = beyond.sel(material=material).any([name for name in beyond.dims if name not in ("material", "load")])
        for values in 100 * cells.deformation_error.transpose(*place).values[::-1]:  # the finest solved mesh stays
            error = np.where(np.isfinite(values), values, error)
        asked = (cells.status != 0).any("mesh_size").transpose(*place[1:]).values
        texts = np.where(asked, NO_RESULT, NOT_ASKED).astype(object)
        for row, column in np.argwhere(np.isfinite(error)):
            texts[row, column] = error_text(error[row, column]) + "*" * bool(doubted[column])
        heat_map(panel, error, texts)
        panel.set_xticks(range(len(loads)), map(no_mathematics, loads))
        panel.xaxis.set_tick_params(rotation=90, labelsize=style.SMALL)
        panel.set_yticks(range(len(names)), map(no_mathematics, names))
        return [], ""

    shown = {}
    for material in materials:
        ratio = f"ν = {float(root.material_poisson_ratio.sel(material=material)):g}"
        shown[ratio if material == ratio.replace("ν = ", "nu-") else f"{material}, {ratio}"] = material
    flags = root.status.sel(material=materials).values
    said = [sign_of_errors(root), f"{NO_RESULT}: no result" * bool((flags > 1).any())]
    said += [f"{NOT_ASKED}: not asked for" * bool((flags == 0).any())]
    said += [f"*: {BEYOND_SMALL_STRAIN}" * bool(beyond.sel(material=materials).any())]
    title = (
        f"{labelled_beam(root, chosen['beam'])}, {chosen['mesh_type']}: deformation error [%] on the finest mesh solved"
    )
    said, height = "; ".join(filter(None, said)), 1.2 + 0.165 * len(names)
    return labels.small_multiples(ax, shown, len(shown), height, title, draw, sharey=True, said=said)


def _spread(root, solved):
    """The first, middle and last material by Poisson's ratio, of those with most loads."""
    counts = solved.any("mesh_size").sum(["definition", "load"]).values
    full = np.flatnonzero(counts > 0.5 * counts.max() if counts.any() else counts == 0)
    order = full[np.argsort(root.material_poisson_ratio.values[full], kind="stable")]
    return root.material.values[[*dict.fromkeys((order[0], order[len(order) // 3], order[-1]))]].tolist()
