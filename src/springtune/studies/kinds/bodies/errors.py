"""Figures of errors against mesh size and against swept parameters."""

import numpy as np

from springtune.problem.parameters import SWEPT

from ...config.kind import distinct
from ...output import labels, style
from ...output.drawing import BEYOND_SMALL_STRAIN, in_words
from ...output.selection import at, cells, choose, group, labelled_beam, labels_of, last_swept, sign_of_errors
from .beam_figures import USUAL_KINEMATICS, by_beam, figures_of, swept_words, title_labels
from .outputs import SCENE_LABELS, SWEPT_SHOWN
from .tables import like_with_like

MOST_DEFINITIONS_IN_PANEL = 6
"""Most definitions in one panel."""

# -- what both have ----------------------------------------------------------------------------------------------------


def title_of_errors(root, selection):
    """Title of a figure of errors."""
    finite = root.attrs.get("finite_strain") and selection["kinematics"] != "linear"
    return ", ".join(
        [*title_labels(selection, "mesh_type", "material", "load"), *(["against finite strain"] if finite else [])]
    )


def _line_styles(root):
    """Line style of each definition."""
    return {name: style.line(number) for number, name in enumerate(labels_of(root.status != 0, "definition"))}


def _panels_of(words, present):
    """Definitions of each panel by its title, at most `MOST_DEFINITIONS_IN_PANEL`."""
    asked = labels_of(present, "definition")
    parts = np.array_split(asked, -(-len(asked) // MOST_DEFINITIONS_IN_PANEL))
    several = len(parts) > 1
    return {f"{words}, {number} of {len(parts)}" if several else words: part.tolist()
            for number, part in enumerate(parts, start=1)}  # fmt: skip


def _draw_panels(ax, shown, draw, title, sign):
    """Draw a panel of deformation errors a title; `draw` gets a panel and its part, and returns notes."""

    def drawn(panel, part):
        panel.set_ylabel("Deformation error [%]")
        said = draw(panel, *part)
        return said, f"no errors: {'; '.join(said)}"

    return labels.small_multiples(ax, shown, 2 if len(shown) == 4 else 3, 2.1, title, drawn, sharey=True, said=sign)


def _draw_lines(panel, places, here, looks, listed, gaps):
    """Draw a line a definition, hollow where its error is doubtful; return notes.

    ``places`` has the x of each line. With ``gaps``, a line has gaps where no scene was requested.
    """
    said, doubts = [], set()
    for x, (name, look) in zip(places, looks.items()):
        cell = here.sel(definition=name)
        error, flags = 100 * cell.deformation_error.values, cell.status.values
        beyond = np.broadcast_to(cell.get("reference_applies", 1) == 0, error.shape)
        known, drawn = np.isfinite(error), (flags != 0) | gaps
        panel.plot(x[drawn], error[drawn], label=name, **look)
        doubtful, lost = known & ((flags > 1) | beyond), {}
        hollow = look | {"linestyle": "", "markerfacecolor": "white", "markersize": 4.5, "zorder": 4}
        panel.plot(x[doubtful], error[doubtful], **hollow)
        doubts |= {in_words(flag) for flag in flags[doubtful] if flag > 1}
        doubts |= {BEYOND_SMALL_STRAIN} if (known & beyond).any() else set()
        for place, flag in zip(np.flatnonzero(~known), flags[~known]):
            if flag:
                lost.setdefault("no reference" if flag == 1 else in_words(flag), []).append(place)
        said += [f"{name}, {listed(numbers)}: {reason}" for reason, numbers in lost.items()]
    panel.axhline(0, color="0.3", linewidth=0.7, zorder=1)
    return [f"hollow: {', '.join(sorted(doubts))}", *said] if doubts else said


# -- against mesh size -------------------------------------------------------------------------------------------------


def size(tree):
    """Stem, plotting function and selection of each figure of errors against mesh size."""
    yield from figures_of("size", plot_size, group(tree, "/").status, SCENE_LABELS)


@style.styled
def plot_size(data, ax=None, *, beam=None, mesh_type=None, material=None, load=None, kinematics="nonlinear"):
    """Deformation error against mesh size, a panel a beam, a line a definition.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its root.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as beams; by default a new figure.
    beam : str, optional
        One beam in place of all.
    mesh_type, material, load, kinematics : str, optional
        Labels of the scenes. One that is not given must leave no choice.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_beams,)
        One a beam.

    Raises
    ------
    ValueError
        If the selection leaves a choice, or nothing, or ``ax`` is not as many Axes as beams.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_size(tree, mesh_type="structured", material="steel", load="traction")
    >>> [panel.get_title(loc="left") for panel in axes]
    ['100x20 mm', '200x40 mm']
    >>> axes[0].get_xlabel(), axes[0].get_ylabel()
    ('Mesh size [mm]', 'Deformation error [%]')
    """
    root, beams, selection = by_beam(like_with_like(data), beam, mesh_type, material, load, kinematics)
    looks = _line_styles(root)
    values = last_swept(root.status != 0, "mesh_size")
    root = at(root, values)
    shown = {}
    for name in beams:
        here = root.sel(beam=name)
        words = [labelled_beam(root, name), *swept_words({one: value.sel(beam=name) for one, value in values.items()})]
        parts = _panels_of(", ".join(words), here.status != 0)
        shown |= {title: (here, {one: looks[one] for one in part}) for title, part in parts.items()}
    return _draw_panels(ax, shown, _draw_over_sizes, title_of_errors(root, selection), sign_of_errors(root))


def _draw_over_sizes(panel, here, looks):
    """Draw errors of a beam over mesh size; return notes."""
    here = here.isel(mesh_size=np.flatnonzero((here.status != 0).any("definition").values))
    sizes = 1e3 * here.mesh_size.values
    places = labels.sizes_axis(panel, sizes, len(looks))

    def listed(numbers):
        return f"{', '.join(f'{sizes[number]:g}' for number in numbers)} mm"

    said = _draw_lines(panel, places, here, looks, listed, True)
    if "paper_displacement" in here:
        printed = 100 * (here.paper_displacement.values / here.paper_reference_displacement.values - 1)
        if (here.force < 0).all():  # printed without sign
            printed = -printed
        panel.plot(places[0], printed, "x", color="0.35", markersize=4.5, label="as printed")
    return said


# -- against what is swept ---------------------------------------------------------------------------------------------

LOGARITHMIC_FROM_RATIO = 20.0
"""Ratio of the largest to the smallest value from which an axis is logarithmic."""


def sweep(tree):
    """Stem, plotting function and selection of each figure of a swept parameter."""
    present = group(tree, "/").status != 0
    names = [name for name in SWEPT if present.sizes.get(name, 1) > 1]
    for name in names:
        for stem, selection in distinct(f"sweep_{name}", SCENE_LABELS, cells(present, SCENE_LABELS)).items():
            here = present.sel(selection)
            counts = {one: _most_values(here.sel(kinematics=one), name) for one in labels_of(here, "kinematics")}
            chosen = max(counts, key=lambda one: (counts[one], one == USUAL_KINEMATICS))
            if counts[chosen] > 1:
                yield stem, plot_sweep, selection | {"parameter": name, "kinematics": chosen}


@style.styled
def plot_sweep(
    data,
    ax=None,
    *,
    parameter,
    beam=None,
    mesh_type=None,
    mesh_size=None,
    material=None,
    load=None,
    kinematics="nonlinear",
):
    """Deformation error against a parameter that the study sweeps, a panel a beam, a line a definition.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its root.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as beams; by default a new figure.
    parameter : str
        ``"force"``, ``"thickness"``, ``"young_modulus"``, ``"poisson_ratio"`` or ``"stiffness_scale"``. Of the others
        that are swept each beam shows values under which this one has most; of several the largest force, under it
        the largest thickness, and so on.
    beam : str, optional
        One beam in place of all.
    mesh_size : float, optional
        [m]; without, of each beam the one that has most values, the finest of several.
    mesh_type, material, load, kinematics : str, optional
        Labels of the scenes. One that is not given must leave no choice.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_panels,)
        One a beam, more where a beam has many definitions.

    Raises
    ------
    ValueError
        If the parameter is not swept, the selection leaves a choice, or nothing.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> st.plot_sweep(tree, parameter="force")
    Traceback (most recent call last):
    ValueError: parameter: 'force' is not swept; the study sweeps nothing
    """
    root = like_with_like(data)
    swept = [name for name in SWEPT if name in root.status.dims]
    if parameter not in swept:
        raise ValueError(f"parameter: {parameter!r} is not swept; the study sweeps {', '.join(swept) or 'nothing'}")
    whole = root
    needed = ("status", "deformation_error", "reference_applies", "beam_length", "beam_height")
    root = root[[name for name in needed if name in root]]
    root, beams, selection = by_beam(root, beam, mesh_type, material, load, kinematics)
    looks = _line_styles(root)
    several = [name for name in beams if _most_values((root.status != 0).sel(beam=[name]), parameter) > 1]
    shown = {}
    for name in several or beams:
        here = _errors_of_beam(root, name, parameter, mesh_size)
        parts = _panels_of(here.attrs["words"], here.status != 0)
        shown |= {title: (here, {one: looks[one] for one in part}) for title, part in parts.items()}

    def draw(panel, here, looks):
        return _draw_over_values(panel, here, looks, parameter)

    sign = sign_of_errors(whole.sel(load=selection["load"]))
    return _draw_panels(ax, shown, draw, title_of_errors(root, selection), sign)


def _most_values(present, parameter):
    """Largest number of values of a parameter on one beam."""
    return int(present.any([name for name in present.dims if name not in ("beam", parameter)]).sum(parameter).max())


def _errors_of_beam(root, name, parameter, mesh_size):
    """Errors of a beam over a parameter and definitions; the attribute `words` is the panel's title."""
    here = root.sel(beam=name)
    present = (here.status != 0).any("definition")
    if mesh_size is not None:
        choose(present, mesh_size=mesh_size)
    sizes = labels_of(present, "mesh_size")
    there = present.any([one for one in present.dims if one not in ("mesh_size", parameter)])
    counts = {size: int(there.sel(mesh_size=size).sum()) for size in sizes}
    if mesh_size is None and max(counts.values()) == 1 and len(sizes) > 1:
        # Each value has a mesh of its own: the finest where it has several.
        here = here.isel(mesh_size=there.argmax("mesh_size"))
        meshes = f"mesh {1e3 * min(sizes):g} to {1e3 * max(sizes):g}\u00a0mm"
    else:
        size = max(sizes, key=lambda one: (counts[one], -one)) if mesh_size is None else mesh_size
        here, meshes = here.sel(mesh_size=size), f"mesh {1e3 * size:g}\u00a0mm"
    values = last_swept(here.status != 0, parameter)
    words = ", ".join([labelled_beam(root, name), meshes, *swept_words(values)])
    return at(here, values).assign_attrs(words=words)


def _draw_over_values(panel, here, looks, parameter):
    """Draw errors over a parameter; return notes."""
    here, (words, _, unit) = here.transpose("definition", parameter, ...), SWEPT_SHOWN[parameter]
    x = unit * here[parameter].values

    def listed(numbers):
        values = x[numbers]
        several = f"{len(values)} from {min(values):.4g} to {max(values):.4g}"
        return several if len(values) > 1 else f"{values[0]:.4g}"

    panel.set_xlabel(words)
    asked = x[(here.status != 0).any("definition").values]
    if len(asked) > 1 and asked.min() > 0 and asked.max() / asked.min() > LOGARITHMIC_FROM_RATIO:
        panel.set_xscale("log")
    # What other beams or grids ask for makes no gaps.
    return _draw_lines(panel, [x] * len(looks), here, looks, listed, False)
