"""Figures of shapes: errors of quantities over particles and seconds, and deformed networks."""

import math

import numpy as np
import pandas as pd
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap

from ...output import style
from ...output.answers import plane_vectors, status_words
from ...output.dataset import STATUS, cells, choose, group, labels_of
from .outputs import ERRORS_STEM, shape_figures

NETWORKS_IN_ROW = 3  # most networks side by side

MOST_NETWORKS = 6  # most networks without a choice of definitions

SHOWN_FIRST = ("lattice", "energy-fit", "patch", "patch-fit", "area", "delingette")  # definitions that are preferred

REFERENCE_COLUMN = "reference to expected"  # column of the errors of references

FORCE_COLOURS = LinearSegmentedColormap.from_list("forces", ["#0a4f9e", "#6fa0cf", "#c4c4c4", "#dd8466", "#a50f15"])
"""Colours of spring forces: from compression to tension, the middle dark enough for thin lines."""


def shapes(tree):
    """Stem, plotting function and selection of each figure of shapes."""
    data = group(tree, "shapes")
    for stem, selection in shape_figures(cells(data.status != 0, ("shape", "load"))).items():
        of_case = plot_shape_errors if stem.startswith(ERRORS_STEM) else plot_shape
        yield stem, of_case if selection else plot_shapes, selection


# -- errors ------------------------------------------------------------------------------------------------------------


@style.styled
def plot_shape_errors(data, ax=None, *, shape=None, load=None, material=None, kinematics=None):
    """Error of each quantity of a shape over particles and over seconds, one line per definition.

    Errors are against the reference, or else the expected value. Hollow markers: unstable, or beyond the reference.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/shapes``.
    ax : Figure or sequence of Axes, optional
    shape, load, material, kinematics : str, optional
        Labels of the scenes; of materials and kinematics the first ones without. Others that are not given must leave
        no choice.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_quantities, 2)

    Raises
    ------
    ValueError
        If the dataset has no shapes, the selection leaves a choice, or nothing, or ``ax`` is not as many Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_shape_errors(tree, shape="cook")
    >>> axes[0, 0].get_title(loc="left"), axes[0, 1].get_xlabel()
    ('tip: displacement y, tip', 'Seconds, springs and solve')
    """
    cut, selection = _select_case(data, shape, load, material, kinematics)
    names, definitions = _quantities(cut), labels_of(cut.status != 0, "definition")
    rows = max(1, len(names))
    tall = max(2.25, 0.72 + 0.16 * len(definitions))  # a line of names for each
    title = ", ".join([selection["shape"], selection["load"], selection["material"], selection["kinematics"]])
    points = {name: {one: _points_of_line(cut, name, one) for one in definitions} for name in names}
    if not all(line[3].all() for lines in points.values() for line in lines.values()):
        title += "; hollow: unstable, or beyond the linear reference"
    figure, axes = style.panels(ax, rows, 2, figsize=(style.PAGE_WIDTH, 0.35 + tall * rows))
    style.add_title(figure, title)
    for panels, name in zip(axes, names):
        _draw_errors(panels, cut, name, points[name])
    for panel in axes.flat if not names else ():
        style.write_reason(panel, "No quantity was requested.")
    return axes


def _select_case(data, shape, load, material, kinematics):
    """Cells of a shape, load, material and kinematics, and their labels."""
    data = group(data, "shapes")
    present = data.status != 0
    chosen = choose(present, shape=shape, load=load)
    here = present.sel(chosen)
    for name, label in (("material", material), ("kinematics", kinematics)):
        chosen[name] = label or labels_of(here, name)[0]
    chosen = choose(present, **chosen)
    return data.sel(chosen).load(), chosen


def _quantities(cut):
    return [name for name in cut.quantity.values.tolist() if str(cut.quantity_kind.sel(quantity=name).item())]


def described(cut, name):
    """Description of a quantity."""
    one = cut.sel(quantity=name)
    kind, component, of = (str(one[f"quantity_{part}"].item()) for part in ("kind", "component", "of"))
    return {"area": "growth of the area", "energy": "strain energy"}.get(kind, f"{kind} {component}, {of}")


def _points_of_line(cut, name, definition):
    """Points of a line by particles: particles, seconds, sizes of errors [%], and whether each counts."""
    against = _error_variable(cut, name)
    read = cut[["particles", "solve_seconds", "definition_seconds", "status", against]]
    line = read.sel(definition=definition, quantity=name).stack(mesh=("mesh_type", "mesh_size"))
    seconds = line.solve_seconds.values + np.nan_to_num(line.definition_seconds.values)
    counted = (line.status.values == STATUS.index("solved")) & (int(cut.reference_applies.item()) != 0)
    found = [line.particles.values, seconds, 100 * np.abs(line[against].values), counted]
    order, there = np.argsort(found[0], kind="stable"), np.isfinite(found[0] * found[2]) & (found[2] > 0)
    return [values[order[there[order]]] for values in found]


def _error_variable(cut, name):
    """Variable with the errors of a quantity: against the reference if there is one."""
    return "error" if np.isfinite(float(cut.reference_value.sel(quantity=name))) else "expected_error"


def _draw_errors(panels, cut, name, points):
    """Draw the lines of a quantity over particles and over seconds."""
    one = cut.sel(quantity=name)
    estimate, difference = (100 * abs(float(one[f"reference_{name}"])) for name in ("error_estimate", "expected_error"))
    for number, (definition, (*places, errors, counted)) in enumerate(points.items()):
        look = style.line(number)
        for panel, along in zip(panels, places):
            panel.plot(along, errors, label=definition, **look)
            panel.plot(along[~counted], errors[~counted], **look | {"linestyle": "", "markerfacecolor": "white"})
    there = any(len(errors) for _, _, errors, _ in points.values())
    against = "Error" if _error_variable(cut, name) == "error" else "Difference to expected"
    for panel, words in zip(panels, ("Particles", "Seconds, springs and solve")):
        panel.set(xlabel=words, ylabel=f"|{against}| [%]")
        if not there:
            style.write_reason(panel, _reason_without_error(cut))
            continue
        panel.set(xscale="log", yscale="log")
        low = panel.get_ylim()[0]
        if estimate > low:
            panel.axhspan(low, estimate, color="0.92", zorder=0)
            panel.set_ylim(low, None)
        style.logarithmic(panel)
    panels[1].set_ylabel("")
    style.add_legend(panels[1])
    panels[0].set_title(f"{name}: {described(cut, name)}")
    facts = [f"{difference:.2g} % from expected"] if difference > 0 else []
    facts += [f"known to {estimate:.1g} %"] if estimate > 0 else []
    panels[1].set_title(f"reference: {', '.join(facts)}" if facts else "over seconds", fontsize=style.SMALL_TEXT)


def _reason_without_error(cut):
    states = status_words(cut.status.values) or "not requested"
    message = next((text for text in cut.message.values.ravel().tolist() if text), "")
    return f"No error: {states}. {message[:160] or 'There is neither a reference nor an expected value.'}"


# -- all quantities ----------------------------------------------------------------------------------------------------


@style.styled
def plot_shapes(data, ax=None, *, material=None, kinematics=None):
    """Size of the error of each quantity of all shapes on their finest mesh, by quantity and definition.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/shapes``.
    ax : Axes or Figure, optional
    material, kinematics : str, optional
        Labels of the scenes; of each shape and load the first ones without.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        If the dataset has no shapes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_shapes(tree)
    >>> axes.get_title(loc="left")
    '|Error| on the finest mesh [%]'
    """
    whole = group(data, "shapes")
    rows = _errors_by_quantity(whole, material, kinematics)
    known = {name for row in rows.values() for name in row}
    names = [name for name in (*whole.definition.values.tolist(), REFERENCE_COLUMN) if name in known]
    errors = pd.DataFrame([*rows.values()], [*rows], names)
    asked = np.array([[name in row for name in names] for row in rows.values()])
    _, ((panel,),) = style.panels(ax, figsize=(style.PAGE_WIDTH, 1.4 + 0.17 * max(len(rows), 3)))
    panel.set_title("|Error| on the finest mesh [%]")
    if not np.isfinite(errors.values).any():
        style.write_reason(panel, "No quantity has an error: see status and message.")
        return panel
    texts = style.heat_map(panel, errors, asked)
    meanings = {style.NO_RESULT: "no result that counts", style.NOT_REQUESTED: "not requested"}
    panel.set_xlabel("; ".join(f"{mark}: {word}" for mark, word in meanings.items() if (texts == mark).any()))
    return panel


def _errors_by_quantity(whole, material, kinematics):
    """Errors on the finest mesh by quantity [%]: of definitions, NaN without a result, and of the reference."""
    found, asked = {}, whole.status != 0
    for place in cells(asked, ("shape", "load")):
        try:
            cut, _ = _select_case(whole, *place.values(), material, kinematics)
        except ValueError:  # not of this material or kinematics
            continue
        several = len(labels_of(asked.sel(shape=place["shape"]), "load")) > 1
        where = " ".join(place.values()) if several else place["shape"]
        finest = np.nanmax(cut.particles.values, initial=0.0)
        for name in _quantities(cut):
            row = found[f"{where}: {name}"] = {}
            for definition in labels_of(cut.status != 0, "definition"):
                particles, _, sizes, counted = _points_of_line(cut, name, definition)
                row[definition] = sizes[-1] if len(sizes) and counted[-1] and particles[-1] == finest else np.nan
            reference = 100 * abs(float(cut.reference_expected_error.sel(quantity=name)))
            row |= {REFERENCE_COLUMN: reference} if reference > 0 else {}
    return found


# -- networks ----------------------------------------------------------------------------------------------------------


def extent(places, nothing):
    """Width and height of the box around points (n, 2), NaN left out; `nothing` if the box has no area."""
    known = places[np.isfinite(places).all(axis=1)]
    wide, high = np.ptp(known, axis=0) if len(known) else (0.0, 0.0)
    return (float(wide), float(high)) if min(wide, high) > 0 else nothing


def magnification(fields):
    """Factor on displacements, 1, 2 or 5 times a power of ten, so that the largest is about a fifteenth of the body."""
    places = np.concatenate([plane_vectors(fields, "{}"), plane_vectors(fields, "outline_{}")])
    names = ("reference_displacement", "displacement")
    sizes = (np.hypot(fields[f"{name}_x"].values, fields[f"{name}_y"].values) for name in names)
    largest = next(filter(None, (np.max(size, where=np.isfinite(size), initial=0.0) for size in sizes)), 0.0)
    factor = 0.07 * max(extent(places, (0.0, 0.0))) / largest if largest else 0.0
    if not factor or 0.4 < factor < 2:
        return 1.0
    steps = np.array([1, 2, 5]) * 10.0 ** math.floor(math.log10(factor))
    return float(steps[steps <= factor * (1 + 1e-9)][-1])


NETWORK_LINE_WIDTH = 0.35  # width of the lines of springs that have one colour [pt]


def draw_network(panel, fields, scale, most=0.0, cmap=None):
    """Draw a deformed network, coloured up to `most` [N], over the outline of its reference and the one at rest."""
    panel.set(aspect="equal", adjustable="datalim", xlabel="x [mm]", ylabel="y [mm]")
    panel.grid(False)
    outline, there = plane_vectors(fields, "outline_{}"), plane_vectors(fields, "reference_displacement_{}")
    rounds = fields.outline_round.values if "outline_round" in fields else np.where(np.isfinite(outline[:, 0]), 0, -1)
    for number in range(int(rounds.max(initial=-1)) + 1):
        places = np.flatnonzero(rounds == number)
        closed = np.append(places, places[:1])
        panel.plot(*1e3 * (outline + scale * there)[closed].T, color="0.7", linewidth=2.0, zorder=1)
        panel.plot(*1e3 * outline[closed].T, color="0.5", linewidth=0.6, linestyle=(0, (3, 3)), zorder=1)
    moved = 1e3 * (plane_vectors(fields, "{}") + scale * plane_vectors(fields, "displacement_{}"))
    if not np.isfinite(moved).any():
        return None
    nodes = fields.spring_nodes.transpose("spring", "spring_end").fillna(-1).values.astype(int)
    kept = (nodes >= 0).all(axis=1)
    springs = moved[nodes[kept]]
    # One line with gaps a colour: thousands of lines take ten times as long.
    gaps = np.pad(springs, ((0, 0), (0, 1), (0, 0)), constant_values=np.nan)
    if not most:
        panel.plot(*gaps.reshape(-1, 2).T, color="#0b3c5d", linewidth=NETWORK_LINE_WIDTH)
        return None
    width = float(np.clip(18 / np.sqrt(len(springs)), 0.25, 0.9))
    levels = np.clip(np.floor((fields.spring_force.values[kept] / most + 1) * cmap.N / 2), 0, cmap.N - 1)
    shown = np.unique(levels)
    coloured = [gaps[levels == level].reshape(-1, 2) for level in shown]
    middle = most * ((2 * shown + 1) / cmap.N - 1)
    lines = LineCollection(coloured, array=middle, cmap=cmap, clim=(-most, most), linewidths=width, zorder=2)
    panel.add_collection(lines, autolim=False)
    panel.update_datalim(springs.reshape(-1, 2))
    panel.autoscale()
    return lines


@style.styled
def plot_shape(data, ax=None, *, shape=None, load=None, definition=None):
    """Deformed networks of a shape, springs coloured by their force, over the outline of the reference: one a panel.

    Displacements are magnified. Springs whose law is part of an energy are coloured by what they carry alone.

    Parameters
    ----------
    data : xarray.DataTree
        A study's dataset with the group ``/shape_fields``.
    ax : Figure or sequence of Axes, optional
    shape, load : str, optional
    definition : str or list of str, optional
        Definitions in the place of a few, of which those that have an answer come first.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_definitions,)

    Raises
    ------
    ValueError
        If the dataset has no networks of shapes, the selection leaves a choice, or nothing, or ``ax`` does not fit.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_shape(tree, shape="cook", definition="area")
    >>> axes[0].get_title(loc="left")
    'area'
    """
    fields, scenes = group(data, "shape_fields", needs_tree=True), group(data, "shapes")
    names = list(zip(fields.shape_name.values.tolist(), fields.load_name.values.tolist()))
    here = [i for i, one in enumerate(names) if shape in (None, one[0]) and load in (None, one[1])]
    if len(here) != 1:
        what = "choose one shape and load" if here else "no network to draw has this shape and load; choose"
        raise ValueError(f"{what}: {'; '.join(map(', '.join, names))}")
    case = fields.isel(case=here[0])
    about = {name: str(case[f"{name}_name"].item()) for name in ("shape", "load", "material", "kinematics")}
    mesh = {"mesh_type": str(case.mesh_type_name.item()), "mesh_size": float(case.case_mesh_size)}
    cut = scenes.sel(about | mesh)
    asked = labels_of(cut.status != 0, "definition")
    drawn = [definition] if isinstance(definition, str) else definition or _choose_definitions(cut, asked)
    for name in drawn:
        choose(cut.status != 0, definition=name)
    places = np.concatenate([plane_vectors(case, "{}"), plane_vectors(case, "outline_{}")])
    width, height = extent(places, (1.0, 1.0))
    columns = min(NETWORKS_IN_ROW, len(drawn))
    wide = (style.COLUMN_WIDTH if columns == 1 else style.PAGE_WIDTH) / columns - 0.5
    tall = float(np.clip(wide * height / width, 0.8, 3.2)) + 0.8
    networks = case.reindex(definition=drawn)
    scale, forces = magnification(networks), np.abs(networks.spring_force.values)
    # Of 3 % of the springs the force is beyond the ends of the colour scale.
    most = float(np.nanquantile(forces, 0.97)) if np.nanmax(forces, initial=0.0) > 0 else 1.0
    size = "mesh of the file" if not mesh["mesh_size"] else f"mesh {1e3 * mesh['mesh_size']:g} mm"
    facts = [*about.values(), f"{size}, {float(cut.particles):.0f} particles", f"displaced × {scale:g}"]
    lost = [name for name in asked if STATUS[int(cut.status.sel(definition=name))] != "solved" and name not in drawn]
    facts += [f"not solved: {', '.join(lost)}"] if lost and definition is None else []
    there = np.isfinite(case.reference_displacement_x.values).any()
    below = "grey: outline of the reference, displaced; dashed: at rest" if there else "no reference"
    shown = {name: (networks.sel(definition=name), cut.sel(definition=name)) for name in drawn}

    def draw(panel, part):
        """Draw one network; return notes."""
        one, state = part
        lines = draw_network(panel, one, scale, most, FORCE_COLOURS)
        notes = ["forces in an energy"] if lines is not None and not one.spring_force.fillna(0).any() else []
        if STATUS[int(state.status)] != "solved":
            message = f": {state.message.item()[:120]}" if lines is None else ""
            notes.append(status_words(int(state.status)) + message)
        return notes, ""

    flat = style.small_multiples(ax, shown, NETWORKS_IN_ROW, tall, ", ".join(facts), draw, note=below)
    lines = [one for panel in flat for one in panel.collections]
    if lines and flat[0].figure.get_layout_engine():
        bar = flat[0].figure.colorbar(lines[0], ax=flat.tolist(), location="bottom", extend="both", aspect=50,
                                      fraction=0.06, label="Spring force [N], tension positive")  # fmt: skip
        bar.formatter.set_powerlimits((-2, 4))  # long numbers would run into each other
        bar.outline.set_linewidth(0.5)
    return flat


def _choose_definitions(cut, asked):
    """Definitions to draw: solved ones first, then `SHOWN_FIRST`, then the rest."""
    solved = {name: int(cut.status.sel(definition=name)) == STATUS.index("solved") for name in asked}
    order = sorted(asked, key=lambda name: (not solved[name], name not in SHOWN_FIRST))
    return [name for name in asked if name in order[:MOST_NETWORKS]]
