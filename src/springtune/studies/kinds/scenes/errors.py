"""Figures of errors: against mesh size, and against a parameter that a study gives several values."""

import numpy as np

from springtune.problem.parameters import SWEPT

from ...config.kind import distinct
from ...output import labels, style
from ...output.drawing import BEYOND_SMALL_STRAIN, fitted, in_words
from ...output.selection import at, cells, group, labelled_beam, labels_of, last_swept, of_own_law, sign_of_errors
from .figures import USUAL, by_beam, each, named, swept_words
from .outputs import SCENE_LABELS, SWEPT_SHOWN

MOST_LINES = 6
"""Definitions in one panel; more of them take further rows of panels."""

# -- what both have ----------------------------------------------------------------------------------------------------


def like_with_like(data):
    """Root of a dataset; errors of nonlinear networks are against finite strain where that is known.

    `beyond` says where small strain does not apply, so that an error is not the network's alone.
    """
    root = group(data, "/")
    root = root.assign(beyond=root.reference_applies == 0 if "reference_applies" in root else root.status < 0)
    finite = data["finite_strain"].to_dataset() if "finite_strain" in getattr(data, "children", ()) else None
    finite = None if finite is None else of_own_law(finite)
    if finite is None:
        return root
    errors, linear = finite.deformation_error, root.kinematics == "linear"
    errors = root.deformation_error.where(linear, errors).transpose(*root.deformation_error.dims)
    return root.assign(deformation_error=errors, beyond=root.beyond & linear).assign_attrs(finite_strain=True)


def compared(root, selection):
    """Title of a figure of errors."""
    finite = root.attrs.get("finite_strain") and selection["kinematics"] != "linear"
    return ", ".join(
        [*named(selection, "mesh_type", "material", "load"), *(["against finite strain"] if finite else [])]
    )


def _looks(root):
    """Line style of each definition."""
    return {name: style.line(number) for number, name in enumerate(labels_of(root.status != 0, "definition"))}


def _parts(present):
    """Definitions of a beam, split into parts of at most `MOST_LINES`."""
    asked = labels_of(present, "definition")
    return [part.tolist() for part in np.array_split(asked, -(-len(asked) // MOST_LINES))]


def _multiples(ax, shown, draw, title, swept, sign):
    """Small multiples of deformation errors, shape (n_panels,): ``draw`` returns a title, ends of lines and a note.

    The first note also has the meaning of a ``sign``.
    """
    columns = min(3, len(shown)) if len(shown) != 4 else 2
    figure, axes, flat, height = style.multiples(ax, len(shown), columns, 2.1, sharey=True)
    place = {"left": 0.55, "right": 0.06, "top": 0.48, "bottom": 0.4, "across": 0.12, "down": 0.7, "title": title}
    style.arrange(figure, axes, **place)
    drawn = {}
    for panel, one in zip(flat, shown):
        words, ends, said = draw(panel, one)
        said = fitted(panel, [*([sign] if sign and ends and not drawn else []), *said])
        drawn[panel] = ends, said, "" if ends else "no errors: " + said.replace("\n", "; ")
        panel.set_title(fitted(panel, [words], 8))
    over = labels.TITLE_LINE * (max(labels.lines_of(panel.get_title("left")) for panel in flat) - 1) if swept else 0.0
    for panel in axes[:, 0]:
        panel.set_ylabel("Deformation error [%]")
    place |= {"top": 0.48 + over, "down": 0.7 + over, "across": 0.06}
    labels.finish(figure, axes, place, drawn, height + len(axes) * over if ax is None else 0.0)
    return flat


def _lines(panel, places, here, looks, listed, gaps):
    """Draw a line a definition, hollow where its error is in doubt: ends of lines, and what a note says.

    ``places`` are those along x of each. ``gaps`` says whether cells that were not asked for leave any.
    """
    ends, said, doubts = [], [], set()
    for x, (name, look) in zip(places, looks.items()):
        cell = here.sel(definition=name)
        error, flags = 100 * cell.deformation_error.values, cell.status.values
        beyond = np.broadcast_to(cell.beyond.values, error.shape)
        known, drawn = np.isfinite(error), (flags != 0) | gaps
        ends += labels.line(panel, x[drawn], error[drawn], look, name)
        doubtful, lost = known & ((flags > 1) | beyond), {}
        if doubtful.any():
            panel.plot(x[doubtful], error[doubtful], linestyle="", marker=look["marker"], color=look["color"],
                       markerfacecolor="white", markersize=4.5, zorder=4)  # fmt: skip
        doubts |= {in_words(flag) for flag in flags[doubtful] if flag > 1}
        doubts |= {BEYOND_SMALL_STRAIN} if (known & beyond).any() else set()
        for place, flag in zip(np.flatnonzero(~known), flags[~known]):
            if flag:
                lost.setdefault("no reference" if flag == 1 else in_words(flag), []).append(place)
        said += [f"{name}, {listed(numbers)}: {reason}" for reason, numbers in lost.items()]
    return ends, [f"hollow: {', '.join(sorted(doubts))}", *said] if doubts else said


# -- against mesh size -------------------------------------------------------------------------------------------------


def size(tree):
    """Figures of errors against mesh size: one for each mesh type, material and load."""
    yield from each("size", plot_size, group(tree, "/").status, SCENE_LABELS)


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
    looks = _looks(root)
    values = last_swept(root.status != 0, "mesh_size")
    root = at(root, values)
    parts = {name: _parts(root.status.sel(beam=name) != 0) for name in beams}
    shown = [(name, number) for name in beams for number in range(len(parts[name]))]

    def draw(panel, one):
        name, number = one
        chosen = {definition: looks[definition] for definition in parts[name][number]}
        drawn = _over_sizes(panel, root.sel(beam=name), chosen, one == shown[0])
        part = f", {number + 1} of {len(parts[name])}" if len(parts[name]) > 1 else ""
        here = {parameter: value.sel(beam=name) for parameter, value in values.items()}
        return ", ".join([labelled_beam(root, name) + part, *swept_words(here)]), *drawn

    return _multiples(ax, shown, draw, compared(root, selection), bool(values), sign_of_errors(root))


def _over_sizes(panel, here, looks, first):
    """Draw errors of a beam over mesh size: as `_lines`."""
    here = here.isel(mesh_size=np.flatnonzero((here.status != 0).any("definition").values))
    sizes = 1e3 * here.mesh_size.values
    places = labels.sizes_axis(panel, sizes, len(looks))

    def listed(numbers):
        return f"{', '.join(f'{sizes[number]:g}' for number in numbers)} mm"

    ends, said = _lines(panel, places, here, looks, listed, True)
    if "paper_displacement" in here:
        printed = 100 * (here.paper_displacement.values / here.paper_reference_displacement.values - 1)
        if (here.force < 0).all():  # printed without sign
            printed = -printed
        if np.isfinite(printed).any():
            panel.plot(places[0], printed, "x", color="0.35", markersize=4.5, label="as printed")
            said = ["×: as the paper prints", *said] if first else said
    if ends:
        panel.hlines(0, *panel.get_xlim(), color="0.3", linewidth=0.7, zorder=1)  # not below names
    return ends, said


# -- against what is swept ---------------------------------------------------------------------------------------------

WIDE = 20.0
"""Largest value over the smallest from which on an axis is logarithmic."""


def sweep(tree):
    """Figures of sweeps: one for each parameter that is swept, mesh type, material and load."""
    present = group(tree, "/").status != 0
    names = [name for name in SWEPT if present.sizes.get(name, 1) > 1]
    for name in names:
        for stem, selection in distinct(f"sweep_{name}", SCENE_LABELS, cells(present, SCENE_LABELS)).items():
            here = present.sel(selection)
            counts = {one: _most(here.sel(kinematics=one), name) for one in labels_of(here, "kinematics")}
            chosen = max(counts, key=lambda one: (counts[one], one == USUAL))
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
    root = root[["status", "deformation_error", "beyond", "beam_length", "beam_height"]]
    root, beams, selection = by_beam(root, beam, mesh_type, material, load, kinematics)
    looks = _looks(root)
    several = [name for name in beams if _most((root.status != 0).sel(beam=[name]), parameter) > 1]
    shown = [_of_beam(root, name, parameter, mesh_size) for name in several or beams]
    shown = [(one, part) for one in shown for part in _parts(one.status != 0)]

    def draw(panel, one):
        here, definitions = one
        return here.attrs["words"], *_over_values(panel, here, {name: looks[name] for name in definitions}, parameter)

    sign = sign_of_errors(whole.sel(load=selection["load"]))
    return _multiples(ax, shown, draw, compared(root, selection), True, sign)


def _most(present, parameter):
    """Largest number of values of a parameter that a beam has."""
    return int(present.any([name for name in present.dims if name not in ("beam", parameter)]).sum(parameter).max())


def _of_beam(root, name, parameter, mesh_size):
    """Errors of a beam over a parameter and definitions; the attribute `words` is the panel's title."""
    here = root.sel(beam=name)
    present = here.status != 0
    sizes = labels_of(present, "mesh_size")
    if mesh_size is not None and mesh_size not in sizes:
        listed = ", ".join(map(str, sizes))
        raise ValueError(f"mesh_size: nothing of beam {name!r} has {mesh_size!r} m; it has {listed}")
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
    words = [labelled_beam(root, name), meshes]
    words += swept_words(values)
    return at(here, values).assign_attrs(words=", ".join(words))


def _over_values(panel, here, looks, parameter):
    """Draw errors over a parameter: as `_lines`."""
    here, (words, _, unit) = here.transpose("definition", parameter, ...), SWEPT_SHOWN[parameter]
    x = unit * here[parameter].values

    def listed(numbers):
        values = x[numbers]
        several = f"{len(values)} from {min(values):.4g} to {max(values):.4g}"
        return several if len(values) > 1 else f"{values[0]:.4g}"

    # What other beams or grids ask for makes no gaps.
    ends, said = _lines(panel, [x] * len(looks), here, looks, listed, False)
    panel.set_xlabel(words)
    asked = x[(here.status != 0).any("definition").values]
    if len(asked) > 1 and asked.min() > 0 and asked.max() / asked.min() > WIDE:
        panel.set_xscale("log")
    if ends:
        panel.axhline(0, color="0.3", linewidth=0.7, zorder=1)
    return ends, said
