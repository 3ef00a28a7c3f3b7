"""Figures of the experiments on stability."""

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter

from ...output import style
from ...output.selection import group
from .outputs import figures

MAP_COLOURS = ("#dfe7ee", "#8db3a8", "#e09f3e", "#7a1f1f")
"""Of stable, decaying, growing and NaN."""

STATUS_COLOURS = ("white", "#8db3a8", "#cccccc", "#7a1f1f", "#e09f3e", "#14213d")
"""Of the flags of a status."""

STRAIN_LOADS = {"axial": "Force on the end", "follower-pressure": "Pressure that follows a long face"}


def stability(tree):
    """Figures of the experiments that a dataset has.

    Parameters
    ----------
    tree : xarray.DataTree

    Yields
    ------
    tuple
        Stem, function that plots, and selection.
    """
    for stem in figures(group(tree, "stability").experiment.values.tolist()):
        yield stem, PLOTS[stem], {}


def _experiment(data, name):
    """The group ``/stability`` of a dataset that has an experiment."""
    data = group(data, "stability")
    done = data.experiment.values.tolist()
    if name not in done:
        raise ValueError(f"the dataset has no experiment {name!r}; it has {', '.join(map(repr, done))}")
    return data


def _plain(panel, *axes):
    """Numbers such as 0.5, 2 and 300 in place of powers on a logarithmic axis that spans few of them."""
    for axis in axes:
        chosen = getattr(panel, f"{axis}axis")
        chosen.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        chosen.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:g}" if f"{value:e}"[0] in "25" else ""))


def _shown_definitions(data, name):
    """Definitions that have values of a variable."""
    values = data[name]
    there = values.notnull().any([dimension for dimension in values.dims if dimension != "definition"])
    return [str(label) for label in data.definition.values[there.values]]


@style.styled
def plot_stability_limits(data, ax=None):
    """Largest stable steps: measured against predicted, and over the mesh size.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/stability``.
    ax : Figure or sequence of two Axes, optional
        Where to plot; by default a new figure.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (2,)

    Raises
    ------
    ValueError
        If the dataset has not the experiment, or ``ax`` has another number of Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_stability_limits(tree)
    >>> [panel.get_title(loc="left") for panel in axes]
    ['Every explicit scheme, with and without damping', 'Undamped; dotted: bound from each particle']
    >>> [panel.get_xlabel() for panel in axes]
    ['predicted limit [ns]', 'mesh size [mm]']
    """
    data = _experiment(data, "limits")
    _, ((left, right),) = style.panels(ax, ncols=2, figsize=(8.0, 3.4), layout="constrained")
    predicted, measured = data.dt_limit_predicted, data.dt_limit_measured
    for number, name in enumerate(_shown_definitions(data, "dt_limit_predicted")):
        look = style.line(number) | {"linestyle": ""}
        ratio = (measured / predicted).sel(definition=name)
        left.plot(1e9 * predicted.sel(definition=name).values.ravel(), 100 * (ratio.values.ravel() - 1), **look,
                  markerfacecolor="none", label=name)  # fmt: skip
        size = data.mesh_size.values[np.isfinite(data.omega_max.sel(definition=name).values)]
        exact = predicted.sel(definition=name, integrator="central-difference", damper="mass", damping_ratio=0.0)
        right.plot(1e3 * size, 1e9 * exact.sel(mesh_size=size), **style.line(number), label=name)
        bound = data.dt_particle_bound.sel(definition=name, mesh_size=size)
        right.plot(1e3 * size, 1e9 * bound, color=look["color"], linewidth=0.8, linestyle=":")
    left.axhspan(-1, 1, color="0.93")
    left.set(xscale="log", xlabel="predicted limit [ns]", ylabel="measured less predicted limit [%]", ylim=(-2, 2),
             title="Every explicit scheme, with and without damping")  # fmt: skip
    right.set(**style.LOGARITHMIC, xlabel="mesh size [mm]", ylabel="largest stable step [ns]",
              title="Undamped; dotted: bound from each particle")  # fmt: skip
    right.legend()
    _plain(left, "x")
    _plain(right, "x", "y")
    return np.array([left, right])


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
    figure, (axes,) = style.panels(ax, ncols=len(names), sharey=True, figsize=(10.0, 3.2), layout="constrained")
    x, y = data.map_damping_ratio.values, data.step_ratio.values
    for panel, name in zip(axes, names):
        found = data.behaviour.sel(integrator=name).values
        panel.pcolormesh(x, y, found, cmap=ListedColormap(MAP_COLOURS), vmin=-0.5, vmax=3.5, shading="nearest")
        predicted = data.step_ratio_predicted.sel(integrator=name).values
        panel.plot(x, np.where(predicted < 100, predicted, np.nan), color="black")
        panel.set(**style.LOGARITHMIC, title=name.replace("-", " ").capitalize().replace("euler", "Euler"),
                  ylim=(y.min(), y.max()))  # fmt: skip
        panel.title.set_fontsize(8)
        panel.grid(False)
        _plain(panel, "y")
    text = "damping ratio of the highest mode, damping in proportion to mass"
    if figure is None:
        axes[0].set_xlabel(text)
    else:
        figure.supxlabel(text, fontsize=9)
    axes[0].set_ylabel(r"step over $2/\omega_{max}$")
    keys = [Patch(color=colour, label=name) for colour, name in zip(MAP_COLOURS, ("stable", "decaying", "growing",
                                                                                  "NaN"))]  # fmt: skip
    keys.append(axes[0].plot([], [], color="black", label="predicted limit")[0])
    if figure is None:
        axes[-1].legend(handles=keys)
    else:
        figure.legend(handles=keys, loc="outside upper center", ncols=5)
    return axes


@style.styled
def plot_stability_energy(data, ax=None):
    """Energy over many steps of each integrator, without damping.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/stability``.
    ax : Axes or Figure, optional
        Where to plot; by default a new figure.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        If the dataset has not the experiment.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_stability_energy(tree)
    >>> axes.get_title(loc="left")
    'A beam let go from its stretch, half of the limit, no damping'
    >>> axes.get_ylabel()
    'energy over its start'
    """
    data = _experiment(data, "drift")
    _, ((panel,),) = style.panels(ax, figsize=(6.4, 3.4), layout="constrained")
    for number, name in enumerate(data.integrator.values):
        if name == "central-difference-lagged":  # without damping it is central-difference
            continue
        text = f"{name}: drift {float(data.energy_drift.sel(integrator=name)):.1e}"
        values = data.energy.sel(integrator=name).values
        look = style.line(number) | {"marker": "", "linewidth": 0.8}
        panel.plot(np.linspace(0, 1, len(values)), values, **look, label=text)
    panel.set(xlabel="share of the run (explicit: 100 000 steps, implicit: 4000)", ylabel="energy over its start",
              title="A beam let go from its stretch, half of the limit, no damping", ylim=(0, 1.25))  # fmt: skip
    panel.legend(ncols=2, fontsize=7, loc="lower right", bbox_to_anchor=(1.0, 0.15))
    return panel


@style.styled
def plot_stability_rest(data, ax=None):
    """Steps to rest over damping, and the distance to rest of truncated solvers.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/stability``.
    ax : Figure or sequence of two Axes, optional
        Where to plot; by default a new figure.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (2,)

    Raises
    ------
    ValueError
        If the dataset has not the experiment, or ``ax`` has another number of Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_stability_rest(tree)
    >>> [panel.get_title(loc="left") for panel in axes]
    ['Central difference, .9 of the limit', 'Truncated conjugate gradients, 1 mm']
    >>> [panel.get_ylabel() for panel in axes]
    ['steps to rest within 0.1 %', 'distance from the static solution']
    """
    data = _experiment(data, "rest")
    _, ((left, right),) = style.panels(ax, ncols=2, figsize=(8.0, 3.3), layout="constrained")
    left.plot(data.critical_ratio, data.steps_to_rest, **style.line(0))
    left.axvline(1.0, color="0.6", linewidth=0.8)
    left.set(**style.LOGARITHMIC, title="Central difference, .9 of the limit")
    left.set(xlabel="damping over critical, lowest loaded mode", ylabel="steps to rest within 0.1 %")
    _plain(left, "x", "y")
    sizes = data.mesh_size.values[data.truncated_error.notnull().any(["cg_iterations", "implicit_steps"]).values]
    for number, count in enumerate(data.cg_iterations.values):
        text = f"{count} iterations" if count else "direct"
        error = data.truncated_error.sel(cg_iterations=count, mesh_size=sizes[0])
        right.plot(data.implicit_steps, np.maximum(error, 1e-15), **style.line(number), label=text)
    right.set(**style.LOGARITHMIC, xlabel="steps of backward Euler", ylabel="distance from the static solution",
              title=f"Truncated conjugate gradients, {1e3 * sizes[0]:g} mm")  # fmt: skip
    right.legend()
    return np.array([left, right])


@style.styled
def plot_stability_meshes(data, ax=None):
    """Stable step over the angle of a sliver and over moves of particles.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/stability``.
    ax : Figure or sequence of Axes, optional
        Where to plot; by default a new figure.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (2,) or (1,)
        Two, or one where no particles were moved.

    Raises
    ------
    ValueError
        If the dataset has not the experiment, or ``ax`` has another number of Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_stability_meshes(tree)
    >>> [panel.get_title(loc="left") for panel in axes]
    ['A sliver', 'Particles moved at random']
    >>> axes[0].get_xlabel()
    'smallest angle of one triangle [degree]'
    """
    data = _experiment(data, "slivers")
    perturbed = "perturbed_error" in data
    _, (axes,) = style.panels(ax, ncols=1 + perturbed, figsize=(8.0, 3.3), layout="constrained")
    panels = {"sliver": axes[0]} | ({"perturbed": axes[1]} if perturbed else {})
    for kind, panel in panels.items():
        dimension = {"sliver": "sliver_angle", "perturbed": "perturbation"}[kind]
        for number, name in enumerate(_shown_definitions(data, f"{kind}_step_limit")):
            limit = data[f"{kind}_step_limit"].sel(definition=name)
            panel.plot(data[dimension], limit / limit.isel({dimension: 0}), **style.line(number), label=name)
        panel.set(ylabel="stable step over that of the whole mesh", ylim=(0, 1.1))
    panels["sliver"].set(xscale="log", xlabel="smallest angle of one triangle [degree]", title="A sliver")
    panels["sliver"].invert_xaxis()
    panels["sliver"].legend()
    if perturbed:
        panels["perturbed"].set(xlabel="move of inner particles over mesh size", title="Particles moved at random")
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
    'strain of a linear sheet under the load [%]'
    """
    data = _experiment(data, "strains")
    names = _shown_definitions(data, "strain_load_share")
    loads = data.strain_load.values
    figure, axes = style.panels(
        ax, nrows=len(loads), sharex=True, layout="constrained",
        figsize=(8.0, 1.0 + len(loads) * (0.6 + 0.28 * len(names))),
    )  # fmt: skip
    axes = axes[:, 0]
    for panel, load in zip(axes, loads):
        found = data.strain_status.sel(strain_load=load, definition=names).values
        panel.pcolormesh(found, cmap=ListedColormap(STATUS_COLOURS), vmin=-0.5, vmax=5.5, edgecolor="white")
        pivots = data.negative_pivots.sel(strain_load=load, definition=names).values
        share = data.strain_load_share.sel(strain_load=load, definition=names).values
        messages = data.strain_message.sel(strain_load=load, definition=names).values
        for i, j in np.ndindex(found.shape):
            text = f"{pivots[i, j]:.0f}" if pivots[i, j] > 0 else f"{share[i, j]:.2f}" if share[i, j] < 1 else ""
            if found[i, j] == 4 and not text:
                text = "f" if "flutters" in messages[i, j] else "path"
            colour = "white" if found[i, j] in (3, 5) else "black"
            panel.text(j + 0.5, i + 0.5, text, ha="center", va="center", fontsize=7, color=colour)
        strains = data.strain.values
        panel.set_xticks(np.arange(len(strains)) + 0.5, [f"{100 * strain:g}" for strain in strains])
        panel.set_yticks(np.arange(len(names)) + 0.5, names)
        panel.grid(False)
        panel.set_title(STRAIN_LOADS[load])
    axes[-1].set_xlabel("strain of a linear sheet under the load [%]")
    unstable = "unstable: negative pivots, f: flutter, or the path to it"
    kinds = ((1, "solved"), (4, unstable), (3, "no equilibrium: share of the load reached"))
    keys = [Patch(color=STATUS_COLOURS[flag], label=text) for flag, text in kinds]
    if figure is None:
        axes[0].legend(handles=keys)
    else:
        figure.legend(handles=keys, loc="outside lower center", ncols=3)
    return axes


@style.styled
def plot_stability_buckling(data, ax=None):
    """Buckling load of a slender column, and a shallow arch by arc length.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/stability``.
    ax : Figure or sequence of two Axes, optional
        Where to plot; by default a new figure.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (2,)

    Raises
    ------
    ValueError
        If the dataset has not the experiment, or ``ax`` has another number of Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_stability_buckling(tree)
    >>> [panel.get_title(loc="left") for panel in axes]
    ['A column twenty times as long as high', 'A shallow arch by arc length; wide: unstable']
    >>> [panel.get_ylabel() for panel in axes]
    ["buckling load over Euler's, less 1 [%]", 'force [N]']
    """
    data = _experiment(data, "buckling")
    _, ((left, right),) = style.panels(ax, ncols=2, figsize=(8.0, 3.3), layout="constrained")
    names = _shown_definitions(data, "buckling_load")
    places = np.arange(len(names))
    for number, rows in enumerate(data.rows.values):
        ratio = (data.buckling_load.sel(rows=rows) / data.euler_load).sel(definition=names)
        left.bar(places + 0.4 * number - 0.2, 100 * (ratio - 1), 0.38, color=style.line(number)["color"],
                 label=f"{rows} rows")  # fmt: skip
    left.axhspan(-2, 2, color="0.9", zorder=0)
    left.set_xticks(places, names, rotation=20)
    left.set(ylabel="buckling load over Euler's, less 1 [%]", title="A column twenty times as long as high")
    left.legend()
    for number, name in enumerate(names):
        arch = data.sel(definition=name)
        look = style.line(number) | {"marker": ""}
        right.plot(1e3 * arch.arch_deflection, arch.arch_load, **look, label=name)
        unstable = arch.arch_load.where(arch.arch_negative_pivots > 0)
        right.plot(1e3 * arch.arch_deflection, unstable, color=look["color"], linewidth=4, alpha=0.25)
    peak = float(data.arch_load.where(data.arch_negative_pivots > 0).max())
    right.set(xlabel="deflection of the middle [mm]", ylabel="force [N]", ylim=(0, 2.2 * peak),
              title="A shallow arch by arc length; wide: unstable")  # fmt: skip
    return np.array([left, right])


PLOTS = {
    "stability_limits": plot_stability_limits,
    "stability_maps": plot_stability_maps,
    "stability_energy": plot_stability_energy,
    "stability_rest": plot_stability_rest,
    "stability_meshes": plot_stability_meshes,
    "stability_strains": plot_stability_strains,
    "stability_buckling": plot_stability_buckling,
}
"""What plots each figure."""
