"""Definitions compared: effective against asked Poisson's ratio, error against mesh size, and errors by load."""

import numpy as np

from ...output import style
from ...output.dataset import most_requested
from ...output.selection import choose, group, labels_of
from .outputs import figures

DEFINITION_FAMILIES = (
    ("uniform", "van-gelder", "lattice", "element-fit"),
    ("area", "angular", "delingette", "adjoint"),
    ("baudet", "baudet-corrected", "flechon", "axis-exact"),
)
"""Definitions in the order in which lines take their looks; the others come after."""

FLOOR = 1e-5
"""Smallest error drawn on a logarithmic axis [1]; below is rounding and the reference's own error."""


def definitions(tree):
    """Figures that compare definitions: moduli, errors against mesh size by load, and heat maps by mesh type.

    Parameters
    ----------
    tree : xarray.DataTree

    Yields
    ------
    tuple
        Stem, function that plots, and selection.
    """
    root = group(tree, "/")
    for stem, selection in figures(root["load"].values.tolist(), root.mesh_type.values.tolist()).items():
        if "load" in selection:
            yield stem, plot_definitions_size, _main(root, ("beam", "kinematics", "material"), selection)
        elif "mesh_type" in selection:
            yield stem, plot_definitions_loads, _main(root, ("beam", "kinematics"), selection)
        else:
            yield stem, plot_moduli, {}


def _main(root, names, selection):
    """Labels that most scenes of a study have; where a selection has none of these, those that most of its own have."""
    chosen = selection | {name: most_requested(root, name) for name in names}
    if (root.status.sel(chosen) != 0).any():
        return chosen
    root = root[["status"]].sel({name: [label] for name, label in selection.items()})
    for name in names:
        chosen[name] = most_requested(root, name)
        root = root.sel({name: [chosen[name]]})
    return chosen


def _looks(names):
    """Look of the line of each definition."""
    order = [name for family in DEFINITION_FAMILIES for name in family]
    order += [name for name in names if name not in order]
    return {name: style.line(number) for number, name in enumerate(order)}


def _panels(ax, types, height):
    """Figure, or None, and one panel a mesh type, at most four in a row, with room for a legend under each."""
    if ax is not None and not hasattr(ax, "subplots"):
        figure, axes = style.panels(ax, ncols=len(types), figsize=(1, 1))
        return None, axes
    columns = min(4, max(1, len(types)))
    rows = max(1, -(-len(types) // columns))
    figure, axes = style.panels(ax, rows, columns, sharey=True, figsize=(0.8 + 2.55 * columns, 0.5 + height * rows))
    for panel in axes.flat[len(types) :]:
        panel.set_visible(False)
    return figure, axes


def _arrange(figure, axes, legend, title):
    """Place panels of `_panels`; `legend` is the room under each [inch]."""
    if figure is None:
        return
    panel = (style.size(figure)[1] - 0.5) / len(axes)
    hspace = (legend + 0.2) / (panel - legend - 0.2)
    style.arrange(figure, left=0.62, right=0.1, bottom=legend, top=0.6, wspace=0.06, hspace=hspace, title=title)


def _legend(panel):
    """Legend under a panel; a panel without lines says why."""
    if not panel.get_legend_handles_labels()[0]:
        panel.text(0.5, 0.5, "not solved on every mesh size", transform=panel.transAxes, ha="center", va="center")
        return
    place = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.24)}
    panel.legend(**place, fontsize=5.4, ncols=2, handlelength=2.0, columnspacing=0.6)


def _grouped(curves):
    """Curves by label: those that are one line to the eye share it."""
    groups = {}
    for name, values in curves.items():
        groups.setdefault(tuple(np.round(values, 3)), []).append(name)
    for names in groups.values():
        label = ", ".join(names[:2]) + (f" +{len(names) - 2}" if len(names) > 2 else "")
        yield names[0], label, curves[names[0]]


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
    types = labels_of(moduli.status == 1, "mesh_type") or labels_of(moduli.status != 0, "mesh_type")
    looks = _looks(moduli.definition.values)
    wanted = moduli.poisson_ratio.values
    figure, axes = _panels(ax, types, 3.1)
    for panel, mesh_type in zip(axes.flat, types):
        panel.plot([0, 0.5], [0, 0.5], color="0.75", linewidth=3, zorder=0, label="as asked")
        curves = {}
        for definition in moduli.definition.values:
            here = moduli.sel(mesh_type=mesh_type, definition=definition)
            sizes = np.flatnonzero((here.status == 1).any("poisson_ratio").values)
            if len(sizes):
                curves[definition] = here.effective_poisson_ratio.values[sizes[0]]
        for definition, label, found in _grouped(curves):
            panel.plot(wanted, found, label=label, **looks[definition])
        panel.set(title=mesh_type, xlim=(-0.01, 0.51), ylim=(-0.4, 0.65), xlabel="asked for")
        _legend(panel)
    for panel in axes[:, 0]:
        panel.set_ylabel("effective")
    _arrange(figure, axes, 1.15, "Effective Poisson's ratio against the one asked for")
    return axes.ravel()[: len(types)]


@style.styled
def plot_definitions_size(data, ax=None, *, beam=None, material=None, load=None, kinematics=None):
    """Field error against mesh size with fitted rates, a panel a mesh type, a line a definition.

    Definitions that are one line to the eye share it.

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
    '200x40, steel, traction: error of the displacement field in L2, fitted rate in brackets'
    """
    root = group(data, "/")
    chosen = choose(root.status != 0, beam=beam, material=material, load=load, kinematics=kinematics)
    root = root.sel(chosen)
    error = root.field_error
    types = labels_of(np.isfinite(error).all("mesh_size"), "mesh_type") or labels_of(root.status != 0, "mesh_type")
    looks = _looks(root.definition.values)
    figure, axes = _panels(ax, types, 3.5)
    for panel, mesh_type in zip(axes.flat, types):
        every = error.sel(mesh_type=mesh_type).transpose("definition", "mesh_size").values
        full = np.isfinite(every).all(axis=1)
        curves = {name: 100 * np.maximum(row, FLOOR) for name, row in zip(root.definition.values[full], every[full])}
        sizes = 1e3 * root.mesh_size.values
        for definition, label, values in _grouped(curves):
            if len(sizes) > 1:
                label += f" ({np.polyfit(np.log(sizes), np.log(values), 1)[0]:.1f})"
            panel.loglog(sizes, values, label=label, **looks[definition])
        panel.set(title=mesh_type, xlabel="Mesh size [mm]")
        panel.set_xticks(sizes, [f"{size:g}" for size in sizes])
        panel.minorticks_off()
        _legend(panel)
    for panel in axes[:, 0]:
        panel.set_ylabel("Error [%]")
    title = f"{chosen['beam']}, {chosen['material']}, {chosen['load']}"
    _arrange(figure, axes, 1.5, f"{title}: error of the displacement field in L2, fitted rate in brackets")
    return axes.ravel()[: len(types)]


@style.styled
def plot_definitions_loads(data, ax=None, *, beam=None, mesh_type=None, materials=None, kinematics=None):
    """Heat map of the deformation error, definition by load, each on its finest mesh, a panel a material.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its root.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as materials; by default a new figure, with a bar of colours.
    beam, mesh_type, kinematics : str, optional
        Labels of the scenes. One that is not given must leave no choice.
    materials : sequence of str, optional
        By default of those with most scenes three, from the lowest to the highest Poisson's ratio.

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
    >>> [panel.get_title(loc="left") for panel in axes]
    ['steel', 'rubber']
    >>> [tick.get_text() for tick in axes[0].get_xticklabels()]
    ['traction', 'compression', 'pressure']
    """
    root = group(data, "/")
    chosen = choose(root.status != 0, beam=beam, mesh_type=mesh_type, kinematics=kinematics)
    root = root.sel(chosen)
    solved = root.status == 1
    if materials is None:
        materials = _spread(root, solved)
    for material in materials:
        choose(root.status != 0, material=material)
    if solved.any():
        root = root.isel(definition=np.flatnonzero(solved.any(["mesh_size", "load", "material"])))
    names, loads = root.definition.values, root["load"].values
    figsize = (2.1 + 1.35 * len(materials), 1.35 + 0.23 * len(names))
    figure, axes = style.panels(ax, ncols=len(materials), sharey=True, figsize=figsize)
    axes = axes[0]
    for panel, material in zip(axes, materials):
        here = root.deformation_error.sel(material=material).transpose("mesh_size", "definition", "load").values
        error = np.full(here.shape[1:], np.nan)
        for values in 100 * here[::-1]:  # the finest mesh that each was solved on stays
            error = np.where(np.isfinite(values), values, error)
        shade = np.log10(np.clip(np.abs(error), 0.1, 100))
        image = panel.imshow(shade, cmap="YlOrBr", vmin=-1, vmax=2, aspect="auto")
        for row, column in np.argwhere(np.isfinite(error)):
            size = abs(error[row, column])
            text = f"{error[row, column]:+.{0 if size >= 9.95 else 1 if size >= 0.095 else 2}f}"
            colour = "white" if shade[row, column] > 1.2 else "k"
            panel.text(column, row, text, ha="center", va="center", fontsize=6, color=colour)
        panel.set_xticks(range(len(loads)), loads)
        panel.xaxis.set_tick_params(rotation=90, labelsize=7)
        panel.set_yticks(range(len(names)), names)
        panel.set_title(material, fontsize=8)
        panel.grid(False)
    if figure is not None:
        width, height = style.size(figure)
        bar = figure.add_axes([1 - 0.55 / width, 0.85 / height, 0.1 / width, 1 - 1.4 / height])
        figure.colorbar(image, cax=bar, ticks=[-1, 0, 1, 2]).set_ticklabels(["0.1", "1", "10", "100"])
        title = f"{chosen['beam']}, {chosen['mesh_type']}: deformation error [%]"
        style.arrange(figure, left=1.3, right=0.65, bottom=0.85, top=0.55, wspace=0.08, title=title)
    return axes


def _spread(root, solved):
    """Materials of which most loads are there; of these the first, the middle and the last by Poisson's ratio."""
    counts = solved.any("mesh_size").sum(["definition", "load"]).values
    full = np.flatnonzero(counts > 0.5 * counts.max() if counts.any() else counts == 0)
    order = full[np.argsort(root.material_poisson_ratio.values[full], kind="stable")]
    return root.material.values[[*dict.fromkeys((order[0], order[len(order) // 3], order[-1]))]].tolist()
