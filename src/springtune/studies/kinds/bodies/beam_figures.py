"""Figures of scenes: sensitivity curves, deformed networks, the pressed block."""

import numpy as np
from matplotlib.lines import Line2D

from springtune.problem.loads import LOADS
from springtune.problem.parameters import with_unit
from springtune.springs.lattice import COEFFICIENT

from ...config.kind import distinct
from ...output import labels, style
from ...output.drawing import BEYOND_SMALL_STRAIN, draw_network, extent, in_words, magnification, plane
from ...output.selection import (
    at,
    cells,
    choose,
    group,
    labelled_beam,
    labels_of,
    last_swept,
    own_law,
    shown_swept,
)
from .outputs import SCENE_LABELS, SENSITIVITY_LABELS

# -- sensitivity curves ------------------------------------------------------------------------------------------------

LARGEST_ERROR_SHOWN = 60.0
"""Largest error shown [%]."""


def sensitivity(tree):
    """Stem, plotting function and selection of each figure of sensitivity curves."""
    yield from figures_of("sensitivity", plot_sensitivity, group(tree, "sensitivity").status, SENSITIVITY_LABELS)


USUAL_KINEMATICS = "nonlinear"
"""Kinematics of figures; a study without them shows its first kinematics, which the title names."""


def figures_of(name, plot, status, names):
    """Stem, plotting function and selection of each figure with cells, in the usual or else the first kinematics."""
    for stem, selection in distinct(name, names, cells(status != 0, names)).items():
        there = labels_of((status != 0).sel(selection), "kinematics")
        yield stem, plot, selection | {"kinematics": USUAL_KINEMATICS if USUAL_KINEMATICS in there else there[0]}


@style.styled
def plot_sensitivity(data, ax=None, *, beam=None, mesh_type=None, material=None, load=None, kinematics="nonlinear"):
    """Deformation error against uniform stiffness, a line a mesh size, as in figures 7 and 8 of the paper.

    Marks show where each curve is lowest and where the stiffness of its lattice predicts that. Unstable equilibria are
    thin.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/sensitivity`` (then without force, reference and what the paper prints).
    ax : Axes or Figure, optional
        Where to plot; by default a new figure.
    beam, mesh_type, material, load, kinematics : str, optional
        Labels of the curves. One that is not given must leave no choice.

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
    selection = choose(
        curves.status != 0, beam=beam, mesh_type=mesh_type, material=material, load=load, kinematics=kinematics
    )
    curves, root = curves.sel(selection), group(data, "/")
    values = last_swept(curves.status != 0)
    curves, root = at(curves, values), at(root.sel(selection), values) if "reference_displacement" in root else None
    # The force has a place of its own.
    words = swept_words({name: value for name, value in values.items() if name != "force" or root is None})
    _, ((panel,),) = style.panels(ax, figsize=(style.COLUMN, 2.6))
    unit, written = labels.power_of_ten(np.nanmax(curves.stiffness.values, initial=0.0))
    known, seen = curves.stiffness.values[np.isfinite(curves.stiffness.values)] / unit, set()
    for number, size in enumerate(labels_of(curves.status != 0, "mesh_size")):
        curve = curves.sel(mesh_size=size)
        seen |= draw_curve(panel, curve, unit, f"{1e3 * size:g} mm", style.line(number), known)
    if root is not None and int(root.get("reference_applies", 1)) == 0:
        seen.add("beyond")
    errors = 100 * abs(curves.deformation_error)
    highest, top = float(errors.max()), LARGEST_ERROR_SHOWN
    if errors.min("stiffness_ratio").max() >= 0.8 * LARGEST_ERROR_SHOWN:
        top = 1.1 * highest
    panel.set(xlabel=f"Uniform spring stiffness [{written}N/m]", ylabel="|Deformation error| [%]")
    panel.set_ylim(0, min(top, 1.1 * highest) if highest > 0 else LARGEST_ERROR_SHOWN)
    panel.set_xlim(*((known.min(), known.max()) if len(known) else (0, 1)))
    panel.set_title(_sensitivity_title(panel, root, selection, words))
    printed = root.paper_stiffness.values if root is not None and "paper_stiffness" in root else np.array(np.nan)
    for value in np.unique(printed[np.isfinite(printed)]) / unit:
        if panel.get_xlim()[0] < value < panel.get_xlim()[1]:
            mark_stiffness(panel, value, f"the paper's {value:g}")
    key = [Line2D([], [], color="0.3", label=text, **look) for name, (text, look) in LEGEND.items() if name in seen]
    labels.finish(panel, why=_reason_without_curve(curves), key=key)
    return panel


def mark_stiffness(panel, value, name):
    """Draw a dashed line at a stiffness."""
    panel.axvline(value, color="0.35", linewidth=0.7, linestyle=(0, (2, 2)), zorder=1, label=name)


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
    return seen | {in_words(flag) for flag in flags[np.isnan(error)] if flag > 1 and np.isfinite(error).any()}


LEGEND = {
    "minimum": ("minimum", {"marker": "o", "markersize": 4.5, "linestyle": ""}),
    "predicted": ("predicted", {"marker": "|", "markersize": 9, "markeredgewidth": 1.2, "linestyle": ""}),
    "unstable": ("thin: unstable", {"linewidth": 0.5}),
    "not converged": ("gap: not converged", {"linestyle": ""}),
    "failed": ("gap: failed", {"linestyle": ""}),
    "beyond": (BEYOND_SMALL_STRAIN, {"linestyle": ""}),
}
"""Entries in the legend of a sensitivity figure, each shown where it occurs."""


def _sensitivity_title(panel, root, selection, swept):
    shown = dict(selection)
    if root is not None and "beam" in shown:
        shown["beam"] = labelled_beam(root, shown["beam"])
    words = [*title_labels(shown, "beam", "mesh_type", "material", "load"), *swept]
    first = labels.fitted(panel, [", ".join(words)], 8)
    if root is None:
        return first
    force, reference = float(root.force), float(root.reference_displacement)
    text = f"reference {1e3 * reference:.4g} mm" if np.isfinite(reference) else "no reference"
    return f"{first}\n{with_unit('force', force) if np.isfinite(force) else 'no force'}, {text}".replace("-", "−")


def _reason_without_curve(curves):
    """Reason why no curve of a figure has an error."""
    if 1 in curves.status.values:
        return "solved, but without a reference there is no error"
    messages = [text for text in np.unique(curves.message.values.astype(str)) if text] if "message" in curves else []
    return "; ".join([f"no stiffness has an error: {in_words(curves.status.values)}", *messages[:1]])


def swept_words(values):
    """Values of swept parameters for a title."""
    found = []
    for name, value in values.items():
        ends = list(dict.fromkeys((float(value.min()), float(value.max()))))
        if (name, ends) != ("stiffness_scale", [1.0]):
            found.append(" to ".join(with_unit(name, end) for end in ends))
    return found


def title_labels(selection, *names):
    """Labels of a selection for a title."""
    found = [str(selection[name]) for name in names if name in selection]
    return found + [str(name) for name in [selection.get("kinematics", USUAL_KINEMATICS)] if name != USUAL_KINEMATICS]


def by_beam(root, beam, mesh_type, material, load, kinematics):
    """Data, beams and selection of a figure with one panel a beam."""
    if beam is not None:
        choose(root.status != 0, beam=beam)
        root = root.sel(beam=[beam])
    present = root.status != 0
    selection = choose(present, mesh_type=mesh_type, material=material, load=load, kinematics=kinematics)
    return root.sel(selection), labels_of(present.sel(selection), "beam"), selection


# -- deformed networks -------------------------------------------------------------------------------------------------

SHOWN_FIRST = ("lattice", "calibrated", "paper")
"""Definitions whose deformed network is preferred."""


def deformed(tree):
    """Stem, plotting function and selection of each figure of deformed networks."""
    status = group(tree, "/").status
    status = status.sel(definition=group(tree, "fields").definition.values)
    for stem, plot, selection in figures_of("deformed", plot_deformed, status, SCENE_LABELS):
        here = status.sel(selection)
        names = labels_of(here.isin((1, 2, 4)), "definition") or labels_of(here != 0, "definition")
        yield stem, plot, selection | {"definition": next((name for name in SHOWN_FIRST if name in names), names[0])}


@style.styled
def plot_deformed(
    data, ax=None, *, beam=None, mesh_type=None, material=None, load=None, definition=None, kinematics="nonlinear"
):
    """Deformed network over the deformed reference, a panel a beam, displacements magnified.

    Parameters
    ----------
    data : xarray.DataTree
        A study's dataset with the group ``/fields``.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as beams; by default a new figure.
    beam : str, optional
        One beam in place of all.
    mesh_type, material, load, definition, kinematics : str, optional
        Labels of the scenes. One that is not given must leave no choice.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_beams,)
        One a beam.

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
    fields, root = group(data, "fields", alone=False), group(data, "/")
    kept = fields.definition.values.tolist()
    definition = choose((root.status != 0).sel(definition=kept), definition=definition)["definition"]
    cut, beams, selection = by_beam(root, beam, mesh_type, material, load, kinematics)
    fields = fields.sel({"definition": definition, "mesh_type": selection["mesh_type"]})
    if "kinematics" in fields.dims:
        fields = fields.sel(kinematics=selection["kinematics"])
    cut = cut.sel(definition=definition)
    values = shown_swept(fields, root)
    chosen = {one: selection[one] for one in ("material", "load")}
    values = {name: value.sel(chosen) for name, value in values.items()}
    cut = at(cut, values)
    shown = {}
    for name in beams:
        words = [labelled_beam(root, name), *swept_words({one: value.sel(beam=name) for one, value in values.items()})]
        shown[", ".join(words)] = fields.sel(beam=name).sel(chosen), cut.sel(beam=name)
    extents = [extent(plane(part, "outline_{}"), (5.0, 1.0)) for part, _ in shown.values()]
    height = max(float(np.clip((style.PAGE - 0.5) * high / wide, 0.45, 2.4)) for wide, high in extents)
    said = f"lines: network ({definition}); grey: reference; dashed: at rest"
    title = ", ".join(title_labels(selection, "mesh_type", "material", "load"))
    return labels.small_multiples(ax, shown, 1, 0.75 + height, title, _draw_deformed, said=said)


def _draw_deformed(panel, part):
    """Draw the network of a beam; return notes."""
    fields, root = part
    # Of the meshes that this beam has, the one that this load is asked for on.
    for known in (fields.displacement_x, fields.x.where(root.status != 0), fields.x):
        places = np.flatnonzero(known.notnull().any("particle").values)
        if len(places):
            break
    here = fields.isel(mesh_size=places[-1] if len(places) else 0)
    scale, flag = magnification(here), int(root.status.sel(mesh_size=here.mesh_size.values))
    draw_network(panel, here, scale)
    text = f"{panel.get_title('left')}, mesh {1e3 * float(here.mesh_size):g} mm, displaced ×\u00a0{scale:g}"
    panel.set_title(labels.fitted(panel, [text], 8))
    panel.set(aspect="equal", adjustable="datalim", xlabel="x [mm]", ylabel="y [mm]")
    panel.grid(False)
    beyond = [f"reference {BEYOND_SMALL_STRAIN}"] if int(root.get("reference_applies", 1)) == 0 else []
    notes = beyond if here.reference_displacement_x.notnull().any() else ["no reference"]
    if not here.displacement_x.notnull().any():
        notes.append(f"no network: {in_words(flag) or 'not asked for'}" if flag != 1 else "no network stored")
    elif flag not in (0, 1):
        notes.append(in_words(flag))
    return notes, ""


# -- the pressed block -------------------------------------------------------------------------------------------------

ENERGY_DEFINITIONS = ("area", "delingette")
"""Definitions whose largest error over all loads is a line in the block's figure."""

FACES_SHOWN_FIRST = ("neo-hooke", "uniform", "paper", "lattice", "patch", "area", "delingette")
"""Definitions whose pressed faces are drawn first."""

MOST_FACES = 5
"""Networks in the panel of the pressed face."""


def _pressing_load(names):
    """Load of the block's figure: pressure, else the first one on a face."""
    pressed = [name for name in names if name in LOADS and LOADS[name].kind.pressed]
    return "pressure" if "pressure" in pressed or not pressed else pressed[0]


def block(tree):
    """Stem, plotting function and selection of the block's figure: last material and beam, finest structured mesh."""
    present = group(tree, "/").status != 0
    present = present.sel(load=[_pressing_load(labels_of(present, "load"))])
    types = labels_of(present, "mesh_type")
    selection = {"mesh_type": "structured" if "structured" in types else types[0]}
    present = present.sel(mesh_type=[selection["mesh_type"]])
    for name, place in (("material", -1), ("beam", -1), ("mesh_size", 0)):
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
        Where to plot; by default a new figure.
    beam, mesh_type, material : str, optional
        Labels of the scene. One that is not given must leave no choice.
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
    faces, root = group(data, "block", alone=False), group(data, "/")
    asked = root.status != 0
    load = _pressing_load(labels_of(asked, "load"))
    chosen = choose(asked.sel(load=[load]), beam=beam, mesh_type=mesh_type, mesh_size=mesh_size, material=material)
    figure, axes = style.panels(ax, ncols=2, figsize=(style.PAGE, 3.0))
    size = 1e3 * chosen["mesh_size"]
    here = root.sel(chosen)
    values = last_swept(here.status != 0)
    words = [labelled_beam(root, chosen["beam"]), f"{chosen['mesh_type']} {size:g} mm", chosen["material"]]
    words += swept_words({name: value.sel(load=load) for name, value in values.items()})
    labels.entitle(figure, ", ".join(words))
    left, right = axes[0]
    curves = group(data, "sensitivity").sel(chosen) if "sensitivity" in data.children else None
    here, faces = at(here, values), at(faces.sel(chosen), values)
    curves = None if curves is None else at(curves, values)
    labels.finish(left, *_draw_errors_over_stiffness(left, curves, here))
    labels.finish(right, *_draw_pressed_face(right, faces, here, load))
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
    said = [f"{load}: no error" for load in asked if load not in loads]
    if not loads:
        return [], "No uniform stiffness has an error: " + ("; ".join(said) or "the study has no curves") + "."
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
            said.append(f"{name}: not solved for all loads")
    panel.set(xlim=(low, high), ylim=(0, min(40.0, 1.05 * highest)))
    stated = networks.stiffness.sel(definition=networks.definition == "paper").values
    for value in np.unique(stated[np.isfinite(stated)]):
        mark_stiffness(panel, value, f"as stated: {value:.4g}")
    return said, ""


def _draw_pressed_face(panel, block, root, load):
    """Draw the pressed face over the reference of its kinematics; return notes, and the reason if nothing is drawn."""
    x, pressed, said = block.face_position.values, block.sel(load=load), []
    panel.set(xlabel="Place on the loaded face over its length", ylabel="Displacement along the load [mm]")
    solved = pressed.face_profile.notnull().any("face_position")
    law = own_law(pressed, "reference_face_profile")
    finite = bool(law) and bool(
        pressed.reference_face_profile.sel(reference=law).notnull().any()
        and solved.sel(kinematics=solved.kinematics != "linear").any()
    )
    panel.set_title(f"The pressed face ({'finite' if finite else 'small'} strain)")
    kind = law if finite else str(block.reference.values[0])
    profiles = {f"reference, {kind.replace('-', ' ')}": pressed.reference_face_profile.sel(reference=kind)}
    asked = labels_of(root.status.sel(load=[load]) != 0, "definition")
    for definition in sorted(asked, key=lambda name: (name not in FACES_SHOWN_FIRST, asked.index(name))):
        usual = [one for one in (("nonlinear",) if finite else ("linear", "nonlinear")) if one in solved.kinematics]
        drawn = [one for one in usual if solved.sel(definition=definition, kinematics=one)]
        if drawn and len(profiles) <= MOST_FACES:
            profile = pressed.face_profile.sel(definition=definition, kinematics=drawn[0])
            profiles[f"{definition}, {drawn[0]}"] = profile
        else:
            flags = root.status.sel(load=load, definition=definition, kinematics=usual).values
            said.append(f"{definition}: {'in the dataset' if drawn else in_words(flags) or 'not asked for'}")
    looks = [{"color": "0.72", "linewidth": 3}, *(style.line(number) | {"marker": ""} for number in range(MOST_FACES))]
    for (name, profile), look in zip(profiles.items(), looks):
        panel.plot(x, -1e3 * profile.values, label=name, **look)
    if not finite and any(name.endswith("nonlinear") for name in profiles):
        said.append("the reference is of small strain, not all networks are: add further_references")
    panel.margins(x=0.02, y=0.08)
    return said, "No network is solved and there is no reference: " + "; ".join(said or ["nothing was asked for"])
