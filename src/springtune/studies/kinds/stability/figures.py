"""Figures of the experiments on stability."""

import numpy as np
from matplotlib.colors import ListedColormap

from springtune.safe_io.escapes import no_mathematics

from ...output import labels, style
from ...output.dataset import STATUS
from ...output.selection import group, labels_of
from .outputs import figures

MAP_COLOURS = ("#f4f4f4", "#b5cfe3", "#d07a1f", "#4a0d1a")
"""Of stable, decaying, growing and NaN: darker from one to the next."""

STATUS_COLOURS = ("white", "#dce9f2", "#a9a9a9", "#4a0d1a", "#e0a458", "#5a5a5a")
"""Of the flags of a status."""

STRAIN_LOADS = {"axial": "Force on the end", "follower-pressure": "Pressure that follows a long face"}


def stability(tree):
    """Figures of the experiments that a dataset has."""
    plots = {"stability_maps": plot_stability_maps, "stability_strains": plot_stability_strains}
    for stem in figures(group(tree, "stability").experiment.values.tolist()):
        yield stem, plots[stem], {}


def _experiment(data, name):
    """The group ``/stability`` of a dataset that has an experiment."""
    data = group(data, "stability")
    done = data.experiment.values.tolist()
    if name not in done:
        raise ValueError(f"the dataset has no experiment {name!r}; it has {', '.join(map(repr, done))}")
    return data


@style.styled
def plot_stability_maps(data, ax=None):
    """What noise becomes over step and damping, a panel an integrator.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/stability``.
    ax : Figure or sequence of Axes, optional
        Where to plot; by default a new figure.

    Returns
    -------
    ndarray of matplotlib.axes.Axes
        One an integrator.

    Raises
    ------
    ValueError
        If the dataset has not the experiment, or ``ax`` has another number of Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_stability_maps(tree)
    >>> [panel.get_title(loc="left") for panel in axes]
    ['Central difference', 'Backward Euler']
    >>> axes[0].get_xscale(), axes[0].get_yscale()
    ('log', 'log')
    """
    data = _experiment(data, "maps")
    names = data.integrator.values
    figure, axes = style.panels(ax, ncols=len(names), sharey=True, figsize=(style.PAGE, 2.2))
    axes, x, y = axes[0], data.map_damping_ratio.values, data.step_ratio.values
    for panel, name in zip(axes, names):
        found = data.behaviour.sel(integrator=name).values
        panel.pcolormesh(x, y, found, cmap=ListedColormap(MAP_COLOURS), vmin=-0.5, vmax=3.5, shading="nearest")
        predicted = data.step_ratio_predicted.sel(integrator=name).values
        for look in ({"color": "black"}, {"color": "white", "linewidth": 0.5}):
            panel.plot(x, np.where(predicted < 100, predicted, np.nan), **look)
        title = name.replace("-", " ").capitalize().replace("euler", "Euler")
        panel.set(**style.LOGARITHMIC, ylim=(y.min(), y.max()))
        panel.set_title(title.replace("Central difference lagged", "Central, damping lags"), fontsize=style.SMALL)
        panel.grid(False)
        style.plain(panel, "x", "y")
        if not np.isfinite(found).any():
            labels.say(panel, "nothing was run", bare=False)
    axes[0].set_ylabel("Step over 2/ωₘₐₓ")
    keys = labels.swatches(dict(zip(("stable", "decaying", "growing", "NaN"), MAP_COLOURS)))
    keys.append(axes[0].plot([], [], color="black", label="predicted limit")[0])
    text = "Damping ratio of the highest mode, damping in proportion to mass"
    if figure is None:
        axes[0].set_xlabel(text)
        axes[-1].legend(handles=keys)
    else:
        figure.supxlabel(text, fontsize=8)
        figure.legend(handles=keys, loc="outside upper center", ncols=5)
    return axes


@style.styled
def plot_stability_strains(data, ax=None):
    """What becomes of large strains: a panel a load, a row a definition.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/stability``.
    ax : Figure or sequence of Axes, optional
        Where to plot; by default a new figure.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_loads,)
        One a load.

    Raises
    ------
    ValueError
        If the dataset has not the experiment, or ``ax`` has another number of Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_stability_strains(tree)
    >>> [panel.get_title(loc="left") for panel in axes]
    ['Force on the end', 'Pressure that follows a long face']
    >>> axes[-1].get_xlabel()
    'Strain of a linear sheet under the load [%]'
    """
    data = _experiment(data, "strains")
    names = labels_of(data["strain_load_share"].notnull(), "definition")
    loads, strains = data.strain_load.values, data.strain.values
    figure, axes = style.panels(
        ax, nrows=len(loads), sharex=True, figsize=(style.PAGE, 0.75 + len(loads) * (0.3 + 0.19 * max(len(names), 2)))
    )
    axes, seen = axes[:, 0], set()
    for panel, load in zip(axes, loads):
        panel.set_title(STRAIN_LOADS.get(load, load))
        panel.grid(False)
        if not names:
            labels.say(panel, "No definition was solved under this load.")
            continue
        here = data.sel(strain_load=load, definition=names)
        flags, pivots, share, messages = (here[name].transpose("definition", "strain").values for name in (
            "strain_status", "negative_pivots", "strain_load_share", "strain_message"))  # fmt: skip
        panel.pcolormesh(flags, cmap=ListedColormap(STATUS_COLOURS), vmin=-0.5, vmax=5.5, edgecolor="white")
        seen |= {round(flag) for flag in np.unique(flags)}
        for i, j in np.ndindex(flags.shape):
            text = f"{100 * share[i, j]:.0f} %" if share[i, j] < 1 else ""
            text = f"{pivots[i, j]:.0f}" if pivots[i, j] > 0 else text
            if flags[i, j] == 4 and not text:
                text = "f" if "flutters" in messages[i, j] else "path"
            colour = "white" if flags[i, j] in (3, 5) else "black"
            panel.text(j + 0.5, i + 0.5, text, ha="center", va="center", fontsize=style.SMALL, color=colour)
        panel.set_xticks(np.arange(len(strains)) + 0.5, [f"{100 * x:g}".replace("-", "−") for x in strains])
        panel.set_yticks(np.arange(len(names)) + 0.5, map(no_mathematics, names))
    axes[-1].set_xlabel("Strain of a linear sheet under the load [%]")
    kinds = {1: "solved", 3: "none found beyond that %",
             4: "unstable: negative pivots, limit point at % of the load, f: flutter, path: on the way"}  # fmt: skip
    kinds |= {flag: STATUS[flag].replace("_", " ") for flag in sorted(seen) if flag not in kinds}
    keys = labels.swatches({text: STATUS_COLOURS[flag] for flag, text in kinds.items() if flag in seen})
    if figure is None:
        axes[0].legend(handles=keys)
    elif keys:
        figure.legend(handles=keys, loc="outside lower center", ncols=len(keys), columnspacing=1.2)
    return axes
