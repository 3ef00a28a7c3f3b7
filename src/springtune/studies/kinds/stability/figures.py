"""Figures of the experiments on stability."""

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.ticker import NullLocator

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
    for stem in figures(group(tree, "stability").experiment.values.tolist()):
        yield stem, PLOTS[stem], {}


def _experiment(data, name):
    """The group ``/stability`` of a dataset that has an experiment."""
    data = group(data, "stability")
    done = data.experiment.values.tolist()
    if name not in done:
        raise ValueError(f"the dataset has no experiment {name!r}; it has {', '.join(map(repr, done))}")
    return data


def _curves(panel, x, curves, logarithmic=False):
    """Draw a line a name, those that are one to the eye as one: their ends, for names."""
    span = [np.log(np.abs(values)) if logarithmic else values for values in curves.values()]
    known = np.concatenate([values[np.isfinite(values)] for values in span]) if span else np.zeros(0)
    return labels.lines(panel, np.asarray(x), curves, 0.004 * np.ptp(known) if len(known) else 0.0, logarithmic)


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
    ['Every explicit scheme and damping', 'Undamped; dotted: bound from each particle']
    >>> [panel.get_xlabel() for panel in axes]
    ['Predicted limit [ns]', 'Mesh size [mm]']
    """
    data = _experiment(data, "limits")
    with labels.arranged(ax, ncols=2, figsize=(style.PAGE, 2.5), bottom=0.52) as (axes, ends):
        ends[axes[0, 1]] = _limits(data, *axes[0])
    return axes[0]


def _limits(data, left, right):
    """Draw the limits of each definition; ends of the lines on the right."""
    predicted = data.dt_limit_predicted
    names = labels_of(data["dt_limit_predicted"].notnull(), "definition")
    left.set(xscale="log", xlabel="Predicted limit [ns]", ylabel="Measured less predicted [%]",
             title="Every explicit scheme and damping")  # fmt: skip
    right.set(**style.LOGARITHMIC, xlabel="Mesh size [mm]", ylabel="Largest stable step [ns]",
              title="Undamped; dotted: bound from each particle")  # fmt: skip
    if not names:
        for panel in (left, right):
            labels.say(panel, "No limit was found: no definition was solved.")
        return []
    left.axhspan(-1, 1, color="0.92")
    labels.note(left, "markers as on the right; grey: 1 %")
    ends, furthest = [], 1.0
    for number, name in enumerate(names):
        look = style.line(number)
        ratio = 100 * ((data.dt_limit_measured / predicted).sel(definition=name).values.ravel() - 1)
        left.plot(1e9 * predicted.sel(definition=name).values.ravel(), ratio, **look | {"linestyle": ""},
                  markerfacecolor="none", label=name)  # fmt: skip
        furthest = np.nanmax(np.abs(ratio), initial=furthest)
        size = data.mesh_size.values[np.isfinite(data.omega_max.sel(definition=name).values)]
        exact = predicted.sel(definition=name, integrator="central-difference", damper="mass", damping_ratio=0.0)
        steps = 1e9 * exact.sel(mesh_size=size).values
        bound = 1e9 * data.dt_particle_bound.sel(definition=name, mesh_size=size).values
        ends += labels.line(right, 1e3 * size, steps, look, name)
        # A single size has no line, so that its bound is a mark.
        alone = {"marker": "_", "markersize": 9} if len(size) == 1 else {}
        right.plot(1e3 * size, bound, color=look["color"], linewidth=0.8, linestyle=":", **alone)
    left.set_ylim(-2 * furthest, 2 * furthest)
    sizes = 1e3 * np.array(labels_of(data.omega_max.notnull(), "mesh_size"))
    right.set_xlim(sizes.min() / 1.15, sizes.max() * 1.15)
    right.set_xticks(sizes, [f"{size:g}" for size in sizes])
    right.xaxis.set_minor_locator(NullLocator())
    style.plain(left, "x")
    style.plain(right, "y")
    return ends


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
    place = dict(left=0.45, right=0.08, bottom=0.42, top=0.55, across=0.1)
    style.arrange(figure, axes, **place)
    grid, axes, x, y = axes, axes[0], data.map_damping_ratio.values, data.step_ratio.values
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
    text = "Damping ratio of the highest mode, damping in proportion to mass"
    axes[0].set_ylabel("Step over 2/ωₘₐₓ")
    labels.settle(figure, grid, place | {"across": 0.04})
    keys = labels.swatches(dict(zip(("stable", "decaying", "growing", "NaN"), MAP_COLOURS)))
    keys.append(axes[0].plot([], [], color="black", label="predicted limit")[0])
    if figure is None:
        axes[0].set_xlabel(text)
        axes[-1].legend(handles=keys)
    else:
        figure.supxlabel(text, fontsize=8, y=0.05 / style.size(figure)[1], va="bottom")
        figure.legend(handles=keys, loc="upper center", ncols=5, borderaxespad=0.2)
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
    'Energy over its start'
    """
    data = _experiment(data, "drift")
    with labels.arranged(ax, figsize=(style.PAGE, 2.5), bottom=0.52) as (axes, ends):
        ends[axes[0, 0]] = _energy(data, axes[0, 0])
    return axes[0, 0]


def _energy(data, panel):
    """Draw the energy of each integrator; ends of the lines."""
    ends = []
    for number, name in enumerate(data.integrator.values):
        if name == "central-difference-lagged":  # without damping that is central-difference
            continue
        values = data.energy.sel(integrator=name).values
        look = style.line(number) | {"marker": "", "linewidth": 0.8}
        drift = f"{float(data.energy_drift.sel(integrator=name)):+.1e}".replace("-", "−")
        ends += labels.line(panel, np.linspace(0, 1, len(values)), values, look, name, f"{name}: drift {drift}")
    panel.set(xlabel="Share of the run", ylabel="Energy over its start", xlim=(0, 1),
              title="A beam let go from its stretch, half of the limit, no damping")  # fmt: skip
    if not ends:
        labels.say(panel, "No run has an energy.")
        return ends
    labels.note(panel, "explicit integrators take 100 000 steps, implicit ones 4000")
    panel.set_ylim(0, 1.1 * max(1.0, np.nanmax(data.energy.values)))
    return ends


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
    ['Central difference, 0.9 of the limit', 'Truncated conjugate gradients, 1 mm']
    >>> [panel.get_ylabel() for panel in axes]
    ['Steps to rest within 0.1 %', 'Distance from the static solution']
    """
    data = _experiment(data, "rest")
    with labels.arranged(ax, ncols=2, figsize=(style.PAGE, 2.4), bottom=0.4) as (axes, ends):
        ends[axes[0, 1]] = _rest(data, *axes[0])
    return axes[0]


def _rest(data, left, right):
    """Draw steps to rest, and the distance of truncated solvers: ends of the lines on the right."""
    left.set(**style.LOGARITHMIC, title="Central difference, 0.9 of the limit")
    left.set(xlabel="Damping over critical, lowest loaded mode", ylabel="Steps to rest within 0.1 %")
    if np.isfinite(data.steps_to_rest.values).any():
        left.plot(data.critical_ratio, data.steps_to_rest, **style.line(0))
        left.axvline(1.0, color="0.6", linewidth=0.8)
        style.plain(left, "x", "y")
    else:
        labels.say(left, "No run came to rest.")
    sizes = labels_of(data.truncated_error.notnull(), "mesh_size")
    right.set(**style.LOGARITHMIC, xlabel="Steps of backward Euler", ylabel="Distance from the static solution")
    if not sizes:
        right.set_title("Truncated conjugate gradients")
        labels.say(right, "No truncated solver was run.")
        return []
    right.set_title(f"Truncated conjugate gradients, {1e3 * sizes[0]:g} mm")
    error = np.maximum(data.truncated_error.sel(mesh_size=sizes[0]), 1e-15)
    names = {count: f"{count} iterations" if count else "direct" for count in data.cg_iterations.values.tolist()}
    curves = {name: error.sel(cg_iterations=count).values for count, name in names.items()}
    ends = _curves(right, data.implicit_steps.values, curves, logarithmic=True)
    style.plain(right, "x")
    right.yaxis.set_minor_locator(NullLocator())
    return ends


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
    'Smallest angle of one triangle [degree]'
    """
    data = _experiment(data, "slivers")
    perturbed = "perturbed_error" in data
    kinds = {"sliver": "sliver_angle", "perturbed": "perturbation"}
    size = (style.PAGE if perturbed else style.COLUMN, 2.4)
    with labels.arranged(ax, ncols=1 + perturbed, figsize=size, bottom=0.4) as (axes, ends):
        for panel, (kind, dimension) in zip(axes[0], kinds.items()):
            ends[panel] = _steps(panel, data, kind, dimension)
    return axes[0]


def _steps(panel, data, kind, dimension):
    """Draw largest stable steps of meshes of a kind: ends of the lines."""
    limits = data[f"{kind}_step_limit"]
    of_names = {name: limits.sel(definition=name) for name in labels_of(limits.notnull(), "definition")}
    curves = {name: (steps / steps.isel({dimension: 0})).values for name, steps in of_names.items()}
    panel.set(ylabel="Stable step over the whole mesh's", ylim=(0, 1.1))
    if kind == "sliver":
        panel.set(xscale="log", xlabel="Smallest angle of one triangle [degree]", title="A sliver")
    else:
        panel.set(xlabel="Move of inner particles over mesh size", title="Particles moved at random")
    ends = _curves(panel, data[dimension].values, curves)
    if not ends:
        labels.say(panel, "No definition has a largest step here.")
    elif kind == "sliver":
        panel.invert_xaxis()
        style.plain(panel, "x")
    return ends


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
    left = 0.15 + max(map(labels.width, names), default=0.3)
    style.arrange(figure, axes, left=left, right=0.08, bottom=0.68, top=0.25, down=0.28)
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
        figure.legend(handles=keys, loc="lower center", ncols=len(keys), borderaxespad=0.2, columnspacing=1.2)
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
    ["Buckling load over Euler's, less 1 [%]", 'Force [N]']
    """
    data = _experiment(data, "buckling")
    with labels.arranged(ax, ncols=2, figsize=(style.PAGE, 2.75), bottom=0.65) as (axes, ends):
        ends[axes[0, 1]] = _buckling(data, *axes[0])
    return axes[0]


def _buckling(data, left, right):
    """Draw buckling loads, and paths of arches: ends of the lines on the right."""
    names = labels_of(data["buckling_load"].notnull(), "definition")
    left.set(ylabel="Buckling load over Euler's, less 1 [%]", title="A column twenty times as long as high")
    right.set(xlabel="Deflection of the middle [mm]", ylabel="Force [N]",
              title="A shallow arch by arc length; wide: unstable")  # fmt: skip
    if not names:
        for panel in (left, right):
            labels.say(panel, "No definition has a buckling load.")
        return []
    places, shades = np.arange(len(names)), ("#0b3c5d", "#7fb8da", "#c8ddf0")
    wide = 0.8 / data.sizes["rows"]
    for number, rows in enumerate(data.rows.values):
        ratio = (data.buckling_load.sel(rows=rows) / data.euler_load).sel(definition=names)
        bars = left.bar(places - 0.4 + wide * (number + 0.5), 100 * (ratio - 1), 0.95 * wide, label=f"{rows} rows",
                        color=shades[number % 3], edgecolor="0.3", linewidth=0.4)  # fmt: skip
        for bar, message in zip(bars, data.buckling_message.sel(rows=rows, definition=names).values):
            bar.set_hatch("///" if message else "")
    left.axhspan(-2, 2, color="0.9", zorder=0)
    left.set_xticks(places, map(no_mathematics, names), rotation=20)
    left.legend()
    hatched = "; hatched: nothing bifurcates" if (data.buckling_message != "").any() else ""
    labels.note(left, f"grey: ±2 %{hatched}", 0.5)
    arches = {name: data.sel(definition=name) for name in names}
    known = {name: arch for name, arch in arches.items() if np.isfinite(arch.arch_load.values).any()}
    if not known:
        labels.say(right, "No definition was followed along an arch.")
        return []
    falling = data.arch_load.where(data.arch_negative_pivots > 0).values
    top = 2.2 * np.nanmax(falling) if np.isfinite(falling).any() else np.nanmax(data.arch_load.values)
    ends = []
    for number, (name, arch) in enumerate(known.items()):
        look = style.line(number) | {"marker": ""}
        deflection, load = 1e3 * arch.arch_deflection.values, arch.arch_load.values
        right.plot(deflection, load, **look, label=name)
        unstable = np.where(arch.arch_negative_pivots.values > 0, load, np.nan)
        right.plot(deflection, unstable, color=look["color"], linewidth=4, alpha=0.25)
        # A name stands where its line leaves the panel, or where it ends.
        within = np.flatnonzero(np.isfinite(load) & (load <= top))
        ends += [(deflection[within[-1]], load[within[-1]], name, look["color"])] if len(within) else []
    right.set(ylim=(0, top), xlim=(0, 1.08 * max(end[0] for end in ends)))
    return ends


PLOTS = {
    plot.__name__.removeprefix("plot_"): plot
    for plot in (
        plot_stability_limits, plot_stability_maps, plot_stability_energy, plot_stability_rest, plot_stability_meshes,
        plot_stability_strains, plot_stability_buckling,
    )
}  # fmt: skip
"""What plots each figure."""
