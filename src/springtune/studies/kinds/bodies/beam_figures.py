"""Figures of beams: sensitivity curves, deformed networks, errors, the pressed block."""

from functools import partial

import numpy as np
import xarray as xr
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from springtune.problem.loads import LOADS
from springtune.problem.quantities import SWEPT, with_unit
from springtune.springs.lattice import COEFFICIENT

from ...output import style
from ...output.answers import plane_vectors, status_words
from ...output.dataset import SHOWN_PREFIX, cells, choose, group, in_own_plane, labels_of, own_laws, sign_of_errors
from .outputs import SCENE_LABELS, SENSITIVITY_LABELS, SWEPT_SHOWN, distinct_cells
from .shape_figures import draw_network, extent, magnification
from .tables import at, beam_title, last_swept, own_references

# -- sensitivity curves ------------------------------------------------------------------------------------------------

LARGEST_ERROR_SHOWN = 60.0  # largest error shown [%]


def sensitivity(tree):
    """Stem, plotting function and selection of each figure of sensitivity curves."""
    present = group(tree, "sensitivity").status != 0
    for stem, selection in selections("sensitivity", present, SENSITIVITY_LABELS):
        yield stem, plot_sensitivity, selection | {"kinematics": usual_kinematics(present.sel(selection))}


def selections(name, present, labels=SCENE_LABELS):
    """Stem and labels of each figure with cells."""
    return distinct_cells(name, labels, cells(present, labels)).items()


USUAL_KINEMATICS = "nonlinear"
"""Kinematics of figures; a study without them shows its first kinematics, which the title names."""


def usual_kinematics(present):
    """Return the usual kinematics if cells have them, else their first ones."""
    there = labels_of(present, "kinematics")
    return USUAL_KINEMATICS if USUAL_KINEMATICS in there else there[0]


@style.styled
def plot_sensitivity(data, ax=None, *, beam=None, mesh_type=None, material=None, load=None, kinematics="nonlinear"):
    """Deformation error against uniform stiffness, one line per mesh size, as in figures 7 and 8 of the paper.

    Marks show where each curve is lowest and where the stiffness of its lattice predicts that. Unstable equilibria are
    thin.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/sensitivity`` (then without force, reference and what the paper prints).
    ax : Axes or Figure, optional
    beam, mesh_type, material, load, kinematics : str, optional

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        If the dataset has no curves, or the selection leaves a choice, or nothing.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_sensitivity(tree, beam="200x40", mesh_type="structured", material="steel", load="traction")
    >>> axes.get_title(loc="left").splitlines()[0]
    '200x40 mm, structured, steel, traction'
    >>> axes.get_ylabel()
    '|Deformation error| [%]'
    """
    curves = group(data, "sensitivity")
    asked = curves.status != 0
    selection = choose(asked, beam=beam, mesh_type=mesh_type, material=material, load=load, kinematics=kinematics)
    curves, root = curves.sel(selection), group(data, "/")
    values = last_swept(curves.status != 0)
    curves, root = at(curves, values), at(root.sel(selection), values) if "reference_displacement" in root else None
    # The force has a place of its own.
    words = swept_words({name: value for name, value in values.items() if name != "force" or root is None})
    _, ((panel,),) = style.panels(ax, figsize=(style.COLUMN_WIDTH, 2.6))
    unit, written = style.power_of_ten(np.nanmax(curves.stiffness.values, initial=0.0))
    known, seen = curves.stiffness.values[np.isfinite(curves.stiffness.values)] / unit, set()
    for number, size in enumerate(labels_of(curves.status != 0, "mesh_size")):
        seen |= draw_curve(panel, curves.sel(mesh_size=size), unit, f"{1e3 * size:g} mm", style.line(number), known)
    if root is not None and int(root.get("reference_applies", 1)) == 0:
        seen.add("beyond")
    errors = 100 * abs(curves.deformation_error)
    highest, large = float(errors.max()), errors.min("stiffness_ratio").max() >= 0.8 * LARGEST_ERROR_SHOWN
    top = 1.1 * highest if large else min(LARGEST_ERROR_SHOWN, 1.1 * highest)
    panel.set(xlabel=f"Uniform spring stiffness [{written}N/m]", ylabel="|Deformation error| [%]")
    panel.set(xlim=(known.min(), known.max()) if len(known) else (0, 1))
    panel.set(ylim=(0, top if highest > 0 else LARGEST_ERROR_SHOWN))
    panel.set(title=_sensitivity_title(panel, root, selection, words))
    printed = root.paper_stiffness.values if root is not None and "paper_stiffness" in root else np.array(np.nan)
    for value in np.unique(printed[np.isfinite(printed)]) / unit:
        if panel.get_xlim()[0] < value < panel.get_xlim()[1]:
            mark_stiffness(panel, value, f"the paper's {value:g}")
    key = [Line2D([], [], color="0.3", label=text, **look) for name, (text, look) in LEGEND.items() if name in seen]
    style.add_legend(panel, why=_reason_without_curve(curves), key=key)
    return panel


def mark_stiffness(panel, value, name, dash=2):
    """Draw a dashed line at a stiffness."""
    panel.axvline(value, color="0.35", linewidth=0.7, linestyle=(0, (dash, dash)), zorder=1, label=name)


def draw_curve(panel, curve, unit, name, look, known):
    """Draw one curve; return the keys of `LEGEND` that it needs."""
    marker, colour, seen = look["marker"], look["color"], set()
    line = {"color": colour, "linestyle": look["linestyle"]}
    stiffness, error = curve.stiffness.values, 100 * np.abs(curve.deformation_error.values)
    best, predicted, flags = float(curve.best_stiffness), float(curve.predicted_stiffness), curve.status.values
    if np.isfinite(best):
        # The curve's lowest point lies between two of its stiffnesses.
        place = np.searchsorted(stiffness, best)
        flags = np.insert(flags, place, 1)
        stiffness, error = np.insert(stiffness, place, best), np.insert(error, place, 0.0)
        panel.plot(best / unit, 0, marker=marker, markersize=4.5, color=colour, clip_on=False, zorder=4)
        seen.add("minimum")
    # Beyond the axes a mark would stand over the words at their ends.
    if np.isfinite(predicted) and known.size and known.min() <= predicted / unit <= known.max():
        panel.plot(predicted / unit, 0, marker="|", markersize=11, markeredgewidth=1.2, color=colour, clip_on=False)
        seen.add("predicted")
    unstable = np.where(flags == 4, error, np.nan)
    panel.plot(stiffness / unit, np.where(flags == 4, np.nan, error), label=name, **line)
    if np.isfinite(unstable).any():
        seen.add("unstable")
        panel.plot(stiffness / unit, unstable, color=colour, linewidth=0.5)
    return seen | {status_words(flag) for flag in flags[np.isnan(error)] if flag > 1 and np.isfinite(error).any()}


LEGEND = {
    "minimum": ("minimum", {"marker": "o", "markersize": 4.5, "linestyle": ""}),
    "predicted": ("predicted", {"marker": "|", "markersize": 9, "markeredgewidth": 1.2, "linestyle": ""}),
    "unstable": ("thin: unstable", {"linewidth": 0.5}),
    "not converged": ("gap: not converged", {"linestyle": ""}),
    "failed": ("gap: failed", {"linestyle": ""}),
    "beyond": (style.BEYOND_SMALL_STRAIN, {"linestyle": ""}),
}
"""Entries in the legend of a sensitivity figure, each shown where it occurs."""


def _sensitivity_title(panel, root, selection, swept):
    shown = dict(selection)
    if root is not None and "beam" in shown:
        shown["beam"] = beam_title(root, shown["beam"])
    words = [*title_labels(shown, "beam", "mesh_type", "material", "load"), *swept]
    first = style.wrap_to_panel(panel, [", ".join(words)], 8)
    if root is None:
        return first
    force, reference = float(root.force), float(root.reference_displacement)
    text = f"reference {1e3 * reference:.4g} mm" if np.isfinite(reference) else "no reference"
    return f"{first}\n{with_unit('force', force) if np.isfinite(force) else 'no force'}, {text}".replace("-", "−")


def _reason_without_curve(curves):
    if 1 in curves.status.values:
        return "solved, but without a reference there is no error"
    messages = [text for text in np.unique(curves.message.values.astype(str)) if text] if "message" in curves else []
    return "; ".join([f"no stiffness has an error: {status_words(curves.status.values)}", *messages[:1]])


def swept_words(values):
    """Values of swept parameters for a title."""
    ends = {name: [*dict.fromkeys((float(value.min()), float(value.max())))] for name, value in values.items()}
    shown = {name: own for name, own in ends.items() if (name, own) != ("stiffness_scale", [1.0])}
    return [" to ".join(with_unit(name, end) for end in own) for name, own in shown.items()]


def _beam_title(root, name, values):
    """Title of a beam with its swept values."""
    own = {one: value.sel(beam=name) for one, value in values.items()}
    return ", ".join([beam_title(root, name), *swept_words(own)])


def title_labels(selection, *names):
    """Labels of a selection for a title."""
    found = [str(selection[name]) for name in names if name in selection]
    return found + [str(name) for name in [selection.get("kinematics", USUAL_KINEMATICS)] if name != USUAL_KINEMATICS]


def by_beam(root, beam, mesh_type, material, load, kinematics):
    """Data, beams and selection of a figure with one panel per beam; without kinematics `in_usual_kinematics`."""
    if beam is not None:
        choose(root.status != 0, beam=beam)
        root = root.sel(beam=[beam])
    chosen = {"mesh_type": mesh_type, "material": material, "load": load}
    if kinematics is None:
        selection = choose((root.status != 0).any("kinematics"), **chosen)
        root, selection["kinematics"] = in_usual_kinematics(root.sel(selection))
    else:
        selection = choose(root.status != 0, **chosen, kinematics=kinematics)
        root = root.sel(selection)
    return root, labels_of(root.status != 0, "beam"), selection


def in_usual_kinematics(root):
    """Return cells with each definition in its usual kinematics, and the kinematics of the figure; others are named."""
    present = root.status != 0
    whole, names = usual_kinematics(present), labels_of(present, "definition")
    own = [usual_kinematics(present.sel(definition=name)) for name in names]
    labels = [name if kinematics == whole else f"{name}, {kinematics}" for name, kinematics in zip(names, own)]
    root = root.sel(definition=xr.Variable("definition", names), kinematics=xr.Variable("definition", own))
    return root.drop_vars("kinematics").assign_coords(definition=labels), whole


# -- deformed networks -------------------------------------------------------------------------------------------------

SHOWN_FIRST = ("patch", "delingette", "lattice", "calibrated", "paper")
"""Definitions whose deformed network is preferred."""


def deformed(tree):
    """Stem, plotting function and selection of each figure of deformed networks."""
    status = group(tree, "/").status.sel(definition=group(tree, "fields").definition.values)
    for stem, selection in selections("deformed", status != 0):
        here = status.sel(selection)
        solved = here.isin((1, 2, 4))
        present = solved if solved.any() else here != 0
        names = labels_of(present, "definition")
        definition = next((name for name in SHOWN_FIRST if name in names), names[0])
        kinematics = usual_kinematics(present.sel(definition=definition))
        yield stem, plot_deformed, selection | {"definition": definition, "kinematics": kinematics}


@style.styled
def plot_deformed(
    data, ax=None, *, beam=None, mesh_type=None, material=None, load=None, definition=None, kinematics="nonlinear"
):
    """Deformed network over the deformed reference, one panel per beam, displacements magnified.

    Parameters
    ----------
    data : xarray.DataTree
        A study's dataset with the group ``/fields``.
    ax : Figure or sequence of Axes, optional
    beam : str, optional
        One beam in place of all.
    mesh_type, material, load, definition, kinematics : str, optional

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_beams,)

    Raises
    ------
    ValueError
        If the dataset has no fields, the selection leaves a choice, or nothing, or ``ax`` is not as many Axes as beams.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_deformed(tree, mesh_type="structured", material="steel", load="traction", definition="paper")
    >>> axes[0].figure.get_suptitle()
    'structured, steel, traction'
    """
    fields, root = group(data, "fields", needs_tree=True), group(data, "/")
    kept = fields.definition.values.tolist()
    definition = choose((root.status != 0).sel(definition=kept), definition=definition)["definition"]
    cut, beams, selection = by_beam(root, beam, mesh_type, material, load, kinematics)
    fields = fields.sel(selection | {"definition": definition}).drop_vars([*SWEPT], errors="ignore")
    names = [name for name in SWEPT if f"{SHOWN_PREFIX}{name}" in fields]
    # Nothing is kept of what has no value: any will do.
    values = {name: fields[f"{SHOWN_PREFIX}{name}"].fillna(root[name].values[0]) for name in names}
    cut = at(cut.sel(definition=definition), values)
    shown = {_beam_title(root, name, values): (fields.sel(beam=name), cut.sel(beam=name)) for name in beams}
    extents = [extent(plane_vectors(part, "outline_{}"), (5.0, 1.0)) for part, _ in shown.values()]
    height = max(float(np.clip((style.PAGE_WIDTH - 0.5) * high / wide, 0.45, 2.4)) for wide, high in extents)
    note = f"lines: network ({definition}); grey: reference; dashed: at rest"
    title = ", ".join(title_labels(selection, "mesh_type", "material", "load"))
    return style.small_multiples(ax, shown, 1, 0.75 + height, title, _draw_deformed, note=note)


def _draw_deformed(panel, part):
    """Draw the network of a beam; return notes."""
    fields, root = part
    # Of the meshes that this beam has, the one that this load is asked for on.
    variables = fields.displacement_x, fields.x.where(root.status != 0), fields.x
    places = (np.flatnonzero(known.notnull().any("particle").values) for known in variables)
    here = fields.isel(mesh_size=next(filter(len, places), [0])[-1])
    scale, flag = magnification(here), int(root.status.sel(mesh_size=here.mesh_size.values))
    draw_network(panel, here, scale)
    text = f"{panel.get_title('left')}, mesh {1e3 * float(here.mesh_size):g} mm, displaced ×\u00a0{scale:g}"
    panel.set_title(style.wrap_to_panel(panel, [text], 8))
    beyond = [f"reference {style.BEYOND_SMALL_STRAIN}"] if int(root.get("reference_applies", 1)) == 0 else []
    notes = beyond if here.reference_displacement_x.notnull().any() else ["no reference"]
    if not here.displacement_x.notnull().any():
        notes.append(f"no network: {status_words(flag) or 'not requested'}" if flag != 1 else "no network stored")
    elif flag not in (0, 1):
        notes.append(status_words(flag))
    return notes, ""


# -- errors ------------------------------------------------------------------------------------------------------------

MOST_DEFINITIONS_IN_PANEL = 6  # most definitions in one panel


def _draw_panels(ax, root, selection, beams, draw):
    """Draw deformation errors of beams by their titles; `draw` gets a panel, errors and line styles; returns notes."""
    shown, names = {}, labels_of(root.status != 0, "definition")
    looks = {name: style.line(number) for number, name in enumerate(names)}
    for words, here in beams.items():
        asked = labels_of(here.status != 0, "definition")
        parts = np.array_split(asked, -(-len(asked) // MOST_DEFINITIONS_IN_PANEL))
        for number, part in enumerate(parts, 1):
            title = f"{words}, {number} of {len(parts)}" if len(parts) > 1 else words
            shown[title] = here, {name: looks[name] for name in part.tolist()}
    title = title_labels(selection, "mesh_type", "material", "load")
    if "finite_strain" in root.attrs and selection["kinematics"] != "linear":
        mixed = any(str(name).endswith(", linear") for name in root.definition.values)
        title.append("against finite strain" + " (linear: small strain)" * mixed)

    def drawn(panel, part):
        panel.set_ylabel("Deformation error [%]")
        notes = draw(panel, *part)
        return notes, f"no errors: {'; '.join(notes)}"

    columns, note = 2 if len(shown) == 4 else 3, sign_of_errors(root)
    return style.small_multiples(ax, shown, columns, 2.1, ", ".join(title), drawn, sharey=True, note=note)


def _draw_lines(panel, places, here, looks, listed, gaps):
    """Draw one line per definition over ``places``, hollow where its error is doubtful; return notes."""
    notes, doubts = [], set()
    for x, (name, look) in zip(places, looks.items()):
        cell = here.sel(definition=name)
        error, flags = 100 * cell.deformation_error.values, cell.status.values
        beyond = np.broadcast_to(cell.get("reference_applies", 1) == 0, error.shape)
        known, drawn = np.isfinite(error), (flags != 0) | gaps
        panel.plot(x[drawn], error[drawn], label=name, **look)
        doubtful, lost = known & ((flags > 1) | beyond), {}
        hollow = look | {"linestyle": "", "markerfacecolor": "white", "markersize": 4.5, "zorder": 4}
        panel.plot(x[doubtful], error[doubtful], **hollow)
        doubts |= {status_words(flag) for flag in flags[doubtful] if flag > 1}
        doubts |= {style.BEYOND_SMALL_STRAIN} if (known & beyond).any() else set()
        for place, flag in zip(np.flatnonzero(~known), flags[~known]):
            if flag:
                lost.setdefault("no reference" if flag == 1 else status_words(flag), []).append(place)
        notes += [f"{name}, {listed(numbers)}: {reason}" for reason, numbers in lost.items()]
    panel.axhline(0, color="0.3", linewidth=0.7, zorder=1)
    return [f"hollow: {', '.join(sorted(doubts))}", *notes] if doubts else notes


# -- against mesh size -------------------------------------------------------------------------------------------------


def size(tree):
    """Stem, plotting function and selection of each figure of errors against mesh size."""
    for stem, selection in selections("size", group(tree, "/").status != 0):
        yield stem, plot_size, selection


@style.styled
def plot_size(data, ax=None, *, beam=None, mesh_type=None, material=None, load=None, kinematics=None):
    """Deformation error against mesh size, one panel per beam, one line per definition.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its root.
    ax : Figure or sequence of Axes, optional
    beam : str, optional
        One beam in place of all.
    mesh_type, material, load : str, optional
    kinematics : str, optional
        By default nonlinear; definitions that have none are shown in linear kinematics, and named so.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_beams,)

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
    root, beams, selection = by_beam(own_references(data), beam, mesh_type, material, load, kinematics)
    values = last_swept(root.status != 0, "mesh_size")
    root = at(root, values)
    shown = {_beam_title(root, name, values): root.sel(beam=name) for name in beams}
    return _draw_panels(ax, root, selection, shown, _draw_over_sizes)


def _sizes_axis(panel, sizes, count):
    """Set up an axis of mesh sizes [mm]; return the x of each line: points of a single size stand side by side."""
    if len(sizes) == 1:
        panel.set(xlabel=f"One mesh size, {sizes[0]:g} mm", xlim=(-0.6, count - 0.4), xticks=[])
        return [np.array([float(number)]) for number in range(count)]
    panel.set(xscale="log", xlabel="Mesh size [mm]")
    panel.set_xticks(sizes, [f"{size:g}" for size in sizes])
    panel.xaxis.set_minor_locator(NullLocator())
    panel.set_xlim(sizes.min() / 1.2, sizes.max() * 1.2)
    return [sizes] * count


def _draw_over_sizes(panel, here, looks):
    """Draw errors of a beam over mesh size; return notes."""
    here = here.isel(mesh_size=np.flatnonzero((here.status != 0).any("definition").values))
    sizes = 1e3 * here.mesh_size.values
    places = _sizes_axis(panel, sizes, len(looks))

    def listed(numbers):
        return f"{', '.join(f'{sizes[number]:g}' for number in numbers)} mm"

    note = _draw_lines(panel, places, here, looks, listed, True)
    if "paper_displacement" in here:
        printed = 100 * (here.paper_displacement.values / here.paper_reference_displacement.values - 1)
        if (here.force < 0).all():  # printed without sign
            printed = -printed
        panel.plot(places[0], printed, "x", color="0.35", markersize=4.5, label="as printed")
    return note


# -- against what is swept ---------------------------------------------------------------------------------------------

LOGARITHMIC_FROM_RATIO = 20.0  # ratio of the largest to the smallest value from which an axis is logarithmic


def sweep(tree):
    """Stem, plotting function and selection of each figure of a swept parameter."""
    present = group(tree, "/").status != 0
    for name in (name for name in SWEPT if present.sizes.get(name, 1) > 1):
        for stem, selection in selections(f"sweep_{name}", present):
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
    """Deformation error against a swept parameter, one panel per beam, one line per definition.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its root.
    ax : Figure or sequence of Axes, optional
    parameter : str
        ``"force"``, ``"thickness"``, ``"young_modulus"``, ``"poisson_ratio"`` or ``"stiffness_scale"``. Of others
        that are swept each beam shows values under which this one has most, else the largest.
    beam : str, optional
        One beam in place of all.
    mesh_size : float, optional
        [m]; without, of each beam the one that has most values, the finest of several.
    mesh_type, material, load, kinematics : str, optional

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
    root = own_references(data)
    swept = [name for name in SWEPT if name in root.status.dims]
    if parameter not in swept:
        raise ValueError(f"parameter: {parameter!r} is not swept; the study sweeps {', '.join(swept) or 'nothing'}")
    needed = "status", "deformation_error", "reference_applies", "reference_displacement", "beam_length", "beam_height"
    root = root[[name for name in needed if name in root]]
    root, beams, selection = by_beam(root, beam, mesh_type, material, load, kinematics)
    several = [name for name in beams if _most_values((root.status != 0).sel(beam=[name]), parameter) > 1]
    shown = dict(_errors_of_beam(root, name, parameter, mesh_size) for name in several or beams)
    return _draw_panels(ax, root, selection, shown, partial(_draw_over_values, parameter=parameter))


def _most_values(present, parameter):
    """Return the largest number of values that a parameter takes on one beam."""
    return int(present.any([name for name in present.dims if name not in ("beam", parameter)]).sum(parameter).max())


def _errors_of_beam(root, name, parameter, mesh_size):
    """Title of a beam, and its errors over a parameter and definitions."""
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
    words = ", ".join([beam_title(root, name), meshes, *swept_words(values)])
    return words, at(here, values)


def _draw_over_values(panel, here, looks, parameter):
    """Draw errors over a parameter; return notes."""
    here, (words, _, unit) = here.transpose("definition", parameter, ...), SWEPT_SHOWN[parameter]
    x = unit * here[parameter].values

    def listed(numbers):
        count, low, high = len(numbers), min(x[numbers]), max(x[numbers])
        return f"{count} from {low:.4g} to {high:.4g}" if count > 1 else f"{low:.4g}"

    panel.set_xlabel(words)
    asked = x[(here.status != 0).any("definition").values]
    if len(asked) > 1 and asked.min() > 0 and asked.max() / asked.min() > LOGARITHMIC_FROM_RATIO:
        panel.set_xscale("log")
    # What other beams or grids ask for makes no gaps.
    return _draw_lines(panel, [x] * len(looks), here, looks, listed, False)


# -- the pressed block -------------------------------------------------------------------------------------------------

ENERGY_DEFINITIONS = ("area", "delingette")
"""Definitions whose largest error over all loads is a line in the block's figure."""

FACES_SHOWN_FIRST = ("neo-hooke", "uniform", "paper", "lattice", "patch", "area", "delingette")
"""Definitions whose pressed faces are drawn first."""

MOST_FACES = 5  # networks in the panel of the pressed face


def _pressing_load(names):
    """Load of the block's figure: pressure, else the first one on a face."""
    pressed = [name for name in names if name in LOADS and LOADS[name].kind.pressed]
    return "pressure" if "pressure" in pressed or not pressed else pressed[0]


def block(tree):
    """Stem, plotting function and selection of the block's figure: last material and beam, finest structured mesh."""
    present = group(tree, "/").status != 0
    load, selection = _pressing_load(labels_of(present, "load")), {}
    types = sorted(present.mesh_type.values, key=lambda name: name != "structured")
    present = present.sel(load=[load], mesh_type=types)
    for name, place in (("mesh_type", 0), ("material", -1), ("beam", -1), ("mesh_size", 0)):
        selection[name] = labels_of(present, name)[place]
        present = present.sel({name: [selection[name]]})
    yield "block", plot_block, selection


@style.styled
def plot_block(data, ax=None, *, beam=None, mesh_type=None, mesh_size=None, material=None):
    """A pressed block: error of one stiffness for three loads, and the shape of the pressed face.

    Parameters
    ----------
    data : xarray.DataTree
        A study's dataset with the group ``/block``; the first panel needs ``/sensitivity``, too.
    ax : Figure or sequence of two Axes, optional
    beam, mesh_type, material : str, optional
    mesh_size : float, optional
        Likewise [m].

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (2,)

    Raises
    ------
    ValueError
        If the dataset has no block, the selection leaves a choice, or nothing, or ``ax`` is not two Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_block(tree, beam="200x40", mesh_type="structured", mesh_size=1e-3, material="rubber")
    >>> [panel.get_title(loc="left") for panel in axes]
    ['One stiffness for all loads? (small strain)', 'The pressed face (finite strain)']
    >>> axes[0].figure.get_suptitle()
    '200x40 mm, structured 1 mm, rubber'
    """
    faces, root = group(data, "block", needs_tree=True), group(data, "/")
    asked = root.status != 0
    load = _pressing_load(labels_of(asked, "load"))
    chosen = choose(asked.sel(load=[load]), beam=beam, mesh_type=mesh_type, mesh_size=mesh_size, material=material)
    figure, axes = style.panels(ax, ncols=2, figsize=(style.PAGE_WIDTH, 3.0))
    size = 1e3 * chosen["mesh_size"]
    here = root.sel(chosen)
    values = last_swept(here.status != 0)
    words = [beam_title(root, chosen["beam"]), f"{chosen['mesh_type']} {size:g} mm", chosen["material"]]
    words += swept_words({name: value.sel(load=load) for name, value in values.items()})
    style.add_title(figure, ", ".join(words))
    (left, right), here, faces = axes[0], at(here, values), at(faces.sel(chosen), values)
    curves = at(group(data, "sensitivity").sel(chosen), values) if "sensitivity" in data.children else None
    style.add_legend(left, *_draw_errors_over_stiffness(left, curves, here))
    style.add_legend(right, *_draw_pressed_face(right, faces, here, load))
    return axes[0]


def _draw_errors_over_stiffness(panel, curves, root):
    """Draw errors in linear kinematics; return notes, and the reason if there is no curve."""
    panel.set(xlabel="Uniform stiffness [N/m]", ylabel="|Deformation error| [%]")
    panel.set_title("One stiffness for all loads? (small strain)")
    if curves is None or "linear" not in curves.kinematics.values:
        return [], "The study has no sensitivity curves in linear kinematics of this mesh and material."
    curves = curves.sel(kinematics="linear")
    asked = labels_of(curves.status != 0, "load")
    loads = [load for load in asked if curves.deformation_error.sel(load=load).notnull().any()]
    notes = [f"{load}: no error" for load in asked if load not in loads]
    if not loads:
        return [], "No uniform stiffness has an error: " + ("; ".join(notes) or "the study has no curves") + "."
    known = curves.stiffness.values[np.isfinite(curves.stiffness.values)]
    for number, load in enumerate(loads):
        draw_curve(panel, curves.sel(load=load), 1.0, load, style.line(number), known)
    middle = COEFFICIENT * np.nanmax((curves.stiffness / curves.stiffness_ratio).values)
    low, high = max(0.7 * middle, known.min()), min(1.5 * middle, known.max())
    within = (curves.stiffness >= low) & (curves.stiffness <= high)
    highest = 100 * float(abs(curves.deformation_error).where(within).max())
    networks = root.sel(kinematics="linear", load=asked)
    energies = [name for name in labels_of(networks.status != 0, "definition") if name in ENERGY_DEFINITIONS]
    for number, name in enumerate(energies):
        errors = 100 * np.abs(networks.deformation_error.sel(definition=name).values)
        if np.isfinite(errors).all():
            worst, look = errors.max(), style.line(len(loads) + number) | {"marker": ""}
            panel.plot([low, high], [worst, worst], label=f"{name}, worst: {worst:.2g} %", **look)
        else:
            notes.append(f"{name}: not solved for all loads")
    panel.set(xlim=(low, high), ylim=(0, min(40.0, 1.05 * highest)))
    stated = networks.stiffness.sel(definition=networks.definition == "paper").values
    for value in np.unique(stated[np.isfinite(stated)]):
        mark_stiffness(panel, value, f"as stated: {value:.4g}")
    if str(root.mesh_type.values) == "structured" and np.isfinite(middle):
        # Held sideways, a sheet's modulus is E / (1 - nu^2), and that of a network, whose nu is 1/3, 9/8 E.
        ratio = float(root.material_poisson_ratio)
        ratio = ratio / (1 - ratio) if str(root.get("material_plane", "")) == "strain" else ratio
        held = middle / (1 - ratio**2) / (9 / 8)
        mark_stiffness(panel, middle, f"by closed form: {middle:.4g}", 1)
        if low < held < high and abs(held / middle - 1) > 0.02:
            mark_stiffness(panel, held, f"the same, sides held: {held:.4g}", 3)
    return notes, ""


def _draw_pressed_face(panel, block, root, load):
    """Draw the pressed face over the reference of its kinematics; return notes, and the reason if nothing is drawn."""
    x, pressed, notes = block.face_position.values, block.sel(load=load), []
    panel.set(xlabel="Place on the loaded face over its length", ylabel="Displacement along the load [mm]")
    solved = pressed.face_profile.notnull().any("face_position")
    laws, own = own_laws(pressed), in_own_plane(pressed).reference_face_profile
    law = next(iter([law for law in laws if own.sel(reference=law).notnull().any()] or laws[::-1]), None)
    references, nonlinear = pressed.reference_face_profile, solved.sel(kinematics=solved.kinematics != "linear")
    finite = bool(law and references.sel(reference=law).notnull().any() and nonlinear.any())
    panel.set_title(f"The pressed face ({'finite' if finite else 'small'} strain)")
    kind = law if finite else str(block.reference.values[0])
    profiles = {f"reference, {kind.replace('-', ' ')}": references.sel(reference=kind)}
    asked = labels_of(root.status.sel(load=[load]) != 0, "definition")
    for definition in sorted(asked, key=lambda name: (name not in FACES_SHOWN_FIRST, asked.index(name))):
        usual = [one for one in (("nonlinear",) if finite else ("linear", "nonlinear")) if one in solved.kinematics]
        drawn = [one for one in usual if solved.sel(definition=definition, kinematics=one)]
        if drawn and len(profiles) <= MOST_FACES:
            own = pressed.face_profile.sel(definition=definition, kinematics=drawn[0])
            profiles[f"{definition}, {drawn[0]}"] = own
        else:
            flags = root.status.sel(load=load, definition=definition, kinematics=usual).values
            notes.append(f"{definition}: {'in the dataset' if drawn else status_words(flags) or 'not requested'}")
    looks = [{"color": "0.72", "linewidth": 3}, *(style.line(number) | {"marker": ""} for number in range(MOST_FACES))]
    for (name, profile), look in zip(profiles.items(), looks):
        panel.plot(x, -1e3 * profile.values, label=name, **look)
    if not finite and any(name.endswith("nonlinear") for name in profiles):
        notes.append("the reference is of small strain, not all networks are: add further_references")
    panel.margins(x=0.02, y=0.08)
    return notes, "No network is solved and there is no reference: " + "; ".join(notes or ["nothing was requested"])
