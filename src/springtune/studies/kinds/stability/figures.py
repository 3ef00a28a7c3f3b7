"""Figures and tables of the experiments on stability."""

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from springtune.safe_io import no_mathematics

from ...output import style
from ...output.dataset import STATUS, choose, group, labels_of, table_rows

BEHAVIOUR_COLOURS = {"stable": "#f4f4f4", "decaying": "#b5cfe3", "growing": "#d07a1f", "NaN": "#4a0d1a"}
"""Colours of the flags, from light to dark."""

STATUS_COLOURS = ("white", "#dce9f2", "#a9a9a9", "#4a0d1a", "#e0a458", "#5a5a5a")
"""Colours of the flags of a status."""

SCHEMES = {"central-difference-lagged": "Central, damping lags"}
STRAIN_LOADS = {"axial": "Force on the end", "follower-pressure": "Pressure that follows a long face"}
"""Titles of panels that differ from the label."""


def stability(tree):
    """Yield the figures of the experiments of a dataset."""
    done = group(tree, "stability").experiment.values
    for name, plot in {"maps": plot_stability_maps, "strains": plot_stability_strains}.items():
        if name in done:
            yield f"stability_{name}", plot, {}


def _experiment(data, name):
    """Return the group ``/stability``, or raise if it lacks an experiment."""
    data = group(data, "stability")
    choose(data.experiment != "", experiment=name)
    return data


def _swatches(colours):
    """Coloured boxes for a legend."""
    return [Patch(facecolor=colour, edgecolor="0.3", linewidth=0.4, label=text) for text, colour in colours.items()]


@style.styled
def plot_stability_maps(data, ax=None):
    """Behaviour of noise by time step and damping, one panel per integrator.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/stability``.
    ax : Figure or sequence of Axes, optional

    Returns
    -------
    ndarray of matplotlib.axes.Axes
        One per integrator.

    Raises
    ------
    ValueError
        If the dataset lacks the experiment, or ``ax`` has another number of Axes.

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
    steps = data.step_ratio.values

    def draw(panel, name):
        one = data.sel(integrator=name)
        colours = ListedColormap([*BEHAVIOUR_COLOURS.values()])
        places = data.map_damping_ratio, steps
        panel.pcolormesh(*places, one.behaviour, cmap=colours, vmin=-0.5, vmax=3.5, shading="nearest")
        for look in ({"color": "black"}, {"color": "white", "linewidth": 0.5}):
            panel.plot(places[0], one.step_ratio_predicted.where(one.step_ratio_predicted < 100), **look)
        panel.set(ylim=(steps.min(), steps.max()), xlabel="Damping ratio", ylabel="Step over 2/ωₘₐₓ")
        panel.grid(False)
        style.logarithmic(panel)
        return [], "" if np.isfinite(one.behaviour).any() else "nothing was run"

    shown = {SCHEMES.get(name, name.replace("-", " ").capitalize().replace("euler", "Euler")): name
             for name in data.integrator.values}  # fmt: skip
    note = "Damping ratio of the highest mode, mass-proportional damping; line: predicted limit"
    title, key = "Behaviour of noise by time step and damping", _swatches(BEHAVIOUR_COLOURS)
    return style.small_multiples(ax, shown, len(shown), 2.0, title, draw, sharey=True, note=note, key=key)


@style.styled
def plot_stability_strains(data, ax=None):
    """Status of equilibria at large strain, one panel per load and one row per definition.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/stability``.
    ax : Figure or sequence of Axes, optional

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_loads,)

    Raises
    ------
    ValueError
        If the dataset lacks the experiment, or ``ax`` has another number of Axes.

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
    names = labels_of(data.strain_load_share.notnull(), "definition")
    strains = [f"{100 * strain:g}".replace("-", "−") for strain in data.strain.values]

    def text(flag, pivots, share, message):
        """Text of a cell: negative pivots, reached load, flutter or an unstable path."""
        if pivots > 0 or share < 1:
            return f"{pivots:.0f}" if pivots > 0 else f"{100 * share:.0f} %"
        return ("f" if "flutters" in message else "path") if flag == 4 else ""

    def draw(panel, load):
        names_of = ("strain_status", "negative_pivots", "strain_load_share", "strain_message")
        here = data[[*names_of]].sel(strain_load=load, definition=names).transpose("definition", "strain")
        flags, *others = (here[name].values for name in names_of)
        panel.pcolormesh(flags, cmap=ListedColormap(STATUS_COLOURS), vmin=-0.5, vmax=5.5, edgecolor="white")
        for (i, j), flag in np.ndenumerate(flags):
            written, colour = text(flag, *(one[i, j] for one in others)), "white" if flag in (3, 5) else "black"
            panel.text(j + 0.5, i + 0.5, written, ha="center", va="center", fontsize=style.SMALL_TEXT, color=colour)
        panel.set_xticks(np.arange(len(strains)) + 0.5, strains)
        panel.set_yticks(np.arange(len(names)) + 0.5, map(no_mathematics, names))
        panel.set(xlabel="Strain of a linear sheet under the load [%]")
        panel.grid(False)
        return [], "" if names else "No definition was solved under this load."

    seen = np.unique(data.strain_status.sel(definition=names)).astype(int)
    key = _swatches({STATUS[flag].replace("_", " "): STATUS_COLOURS[flag] for flag in seen})
    note = "number: negative pivots; %: share of the load that is reached; f: flutter; path: unstable on the way"
    shown = {STRAIN_LOADS.get(load, load): load for load in data.strain_load.values}
    height = 0.6 + 0.19 * max(len(names), 2)
    return style.small_multiples(ax, shown, 1, height, "Equilibria at large strain", draw, note=note, key=key)


# -- tables ------------------------------------------------------------------------------------------------------------

STABILITY_TABLES = {
    "limits": (
        "Largest stable steps",
        ("definition", "integrator", "damper", "damping_ratio"),
        {"mesh_size_mm": ("mesh_size", 1e3), "predicted_ns": ("dt_limit_predicted", 1e9),
         "measured_ns": ("dt_limit_measured", 1e9), "bound_of_particles_ns": ("dt_particle_bound", 1e9)},
    ),
    "rest": (
        "Backward Euler to rest, by iterations of its linear solver (0: direct)",
        ("cg_iterations", "implicit_steps"),
        {"mesh_size_mm": ("mesh_size", 1e3), "error_percent": ("truncated_error", 100)},
    ),
    "slivers": (
        "A sliver in the mesh",
        ("definition", "sliver_angle"),
        {"step_ns": ("sliver_step_limit", 1e9), "error_percent": ("sliver_error", 100)},
    ),
    "strains": (
        "Large strains",
        ("definition", "strain_load", "strain", "strain_message"),
        {"load_share": ("strain_load_share", 1), "negative_pivots": ("negative_pivots", 1)},
    ),
    "perturbation": (
        "Particles moved at random",
        ("definition", "perturbation", "perturbed_message"),
        {"step_ns": ("perturbed_step_limit", 1e9), "error_percent": ("perturbed_error", 100)},
    ),
    "buckling": (
        "Buckling load of a slender column",
        ("definition", "rows", "buckling_message"),
        {"buckling_load_N": ("buckling_load", 1), "euler_load_N": ("euler_load", 1)},
    ),
}  # fmt: skip
"""Tables by experiment: title, labels and texts, and columns with the factor on a variable."""


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.bodies.tables.tables`."""
    data, found = tree["stability"].to_dataset(), []
    for name, (title, names, columns) in STABILITY_TABLES.items():
        if name in data.experiment.values:
            first = next(variable for variable, _ in columns.values() if variable not in data.coords)
            rows = table_rows(data, data[first].notnull(), names, columns)
            found.append({"stem": f"stability_{name}", "title": title, "rows": rows})
    return found
