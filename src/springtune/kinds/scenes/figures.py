"""Figures of scenes: sensitivity curves, errors against mesh size, deformed networks, the pressed block."""

import math

import numpy as np

from ...output import style
from ...output.selection import cells, choose, group, labels_of
from ..base import distinct
from .outputs import SCENE_LABELS, SENSITIVITY_LABELS

# -- sensitivity curves ------------------------------------------------------------------------------------------------

MOST_SHOWN = 60.0
"""Largest error shown [%]."""


def sensitivity(tree):
    """Figures of sensitivity curves: one for each beam, mesh type, material and load.

    Parameters
    ----------
    tree : xarray.DataTree

    Yields
    ------
    tuple
        Stem, function that plots, and selection.
    """
    status = group(tree, "sensitivity").status.sel(kinematics="nonlinear")
    for stem, selection in distinct("sensitivity", SENSITIVITY_LABELS, cells(status != 0, SENSITIVITY_LABELS)).items():
        yield stem, plot_sensitivity, selection


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
    curves = curves.sel(selection)
    root = group(data, "/")
    return _sensitivity(curves, root.sel(selection) if "reference_displacement" in root else None, selection, ax)


def _sensitivity(curves, root, selection, ax):
    lowest, highest = np.nanmin(curves.stiffness.values), np.nanmax(curves.stiffness.values)
    unit = 1e6 if highest >= 1e6 else 1.0
    figure, ((axes,),) = style.panels(ax, figsize=(5.6, 3.5))
    style.arrange(figure, left=0.56, right=0.14, bottom=0.4725, top=0.525)
    unstable_shown = False
    for number, size in enumerate(curves.mesh_size.values):
        curve = curves.isel(mesh_size=number)
        if not (curve.status.values != 0).any():
            continue
        look = style.line(number)
        marker = look.pop("marker")
        stiffness, error = curve.stiffness.values, 100 * np.abs(curve.deformation_error.values)
        best, predicted = float(curve.best_stiffness), float(curve.predicted_stiffness)
        stable = curve.status.values == 1
        if np.isfinite(best):
            # The curve's lowest point lies between two of its stiffnesses.
            place = np.searchsorted(stiffness, best)
            stable = np.insert(stable, place, True)
            stiffness, error = np.insert(stiffness, place, best), np.insert(error, place, 0.0)
        stiffness = stiffness / unit
        axes.plot(stiffness, np.where(stable, error, np.nan), label=f"{1e3 * size:g} mm", **look)
        if not stable.all():
            unstable_shown = True
            axes.plot(stiffness, np.where(stable, np.nan, error), color=look["color"], linewidth=0.7)
        axes.plot(best / unit, 0, marker=marker, color=look["color"], clip_on=False, zorder=4)
        axes.plot(
            predicted / unit, 0, marker="|", markersize=13, markeredgewidth=1.6, color=look["color"], clip_on=False
        )
    title = ", ".join(_named(selection, "beam", "mesh_type", "material", "load"))
    if root is not None:
        for value in np.unique(root.paper_stiffness.values[np.isfinite(root.paper_stiffness.values)]):
            axes.axvline(value / unit, color="0.45", linewidth=0.8, linestyle=(0, (2, 2)), zorder=1)
            place = {"xy": (value / unit, 0.985), "xycoords": ("data", "axes fraction")}
            axes.annotate(
                "paper", **place, xytext=(2, 0), textcoords="offset points", va="top", color="0.35", fontsize=7.5
            )
        title += f"\n{_force(float(root.force))}, reference {1e3 * float(root.reference_displacement):.4g} mm"
    axes.plot([], [], marker="o", color="0.3", linestyle="", label="minimum")
    axes.plot([], [], marker="|", markersize=10, markeredgewidth=1.6, color="0.3", linestyle="", label="predicted")
    if unstable_shown:
        axes.plot([], [], color="0.3", linewidth=0.7, label="buckled: equilibrium unstable")
    axes.set(xlim=(lowest / unit, highest / unit), ylim=(0, MOST_SHOWN), ylabel="|Deformation error| [%]")
    axes.set_xlabel(f"Uniform spring stiffness [{'' if unit == 1 else '10⁶ '}N/m]")
    axes.legend(loc="upper center", bbox_to_anchor=(0.62, 1.0), ncols=2)
    axes.set_title(title)
    return axes


def _force(newtons):
    return f"{newtons / 1e3:g} kN" if abs(newtons) >= 1e3 else f"{newtons:g} N"


def _named(selection, *names):
    """Labels of a selection for a title."""
    for name in names:
        if name in selection:
            yield f"{selection[name]} mm" if name == "beam" else selection[name]


# -- errors against mesh size ------------------------------------------------------------------------------------------


def size(tree):
    """Figures of errors against mesh size: one for each mesh type, material and load; see `sensitivity`."""
    status = group(tree, "/").status.sel(kinematics="nonlinear")
    for stem, selection in distinct("size", SCENE_LABELS, cells(status != 0, SCENE_LABELS)).items():
        yield stem, plot_size, selection


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
    root = group(data, "/")
    root, beams, selection = _by_beam(root, beam, mesh_type, material, load, kinematics)
    figure, axes = style.panels(ax, ncols=len(beams), sharey=True, figsize=(1.2 + 2.2 * len(beams), 3.2))
    axes = axes[0]
    for panel, name in zip(axes, beams):
        here = root.sel(beam=name)
        sizes = 1e3 * here.mesh_size.values
        for number, definition in enumerate(here.definition.values):
            error = 100 * here.deformation_error.sel(definition=definition).values
            if np.isfinite(error).any():
                panel.plot(sizes, error, label=definition, **style.line(number))
        printed = 100 * (here.paper_displacement.values / here.paper_reference_displacement.values - 1)
        if here.force < 0:  # printed without sign
            printed = -printed
        if np.isfinite(printed).any():
            panel.plot(sizes, printed, "x", color="0.45", markersize=6, label="as printed")
        panel.axhline(0, color="0.3", linewidth=0.8)
        panel.set_xscale("log")
        panel.set_xticks(sizes, [f"{size:g}" for size in sizes])
        panel.minorticks_off()
        panel.set_xlim(sizes.min() / 1.2, sizes.max() * 1.2)
        panel.set(title=f"{name} mm", xlabel="Mesh size [mm]")
    axes[0].set_ylabel("Deformation error [%]")
    if figure is None:
        axes[0].legend()
        return axes
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=len(labels))
    title = ", ".join(_named(selection, "mesh_type", "material", "load"))
    style.arrange(figure, left=0.62, right=0.1, bottom=0.78, top=0.55, wspace=0.1, title=title)
    return axes


def _by_beam(root, beam, mesh_type, material, load, kinematics):
    """Data of a figure with a panel a beam, the beams, and the selection."""
    if beam is not None:
        choose(root.status != 0, beam=beam)
        root = root.sel(beam=[beam])
    present = root.status != 0
    selection = choose(present, mesh_type=mesh_type, material=material, load=load, kinematics=kinematics)
    return root.sel(selection), labels_of(present.sel(selection), "beam"), selection


# -- deformed networks -------------------------------------------------------------------------------------------------

DEFINITION = ("lattice", "calibrated", "paper")
"""Whose network is shown: the first of these that the study has, else its first."""


def deformed(tree):
    """Figures of deformed networks: one for each mesh type, material and load; see `sensitivity`."""
    status = group(tree, "/").status.sel(kinematics="nonlinear")
    names = group(tree, "fields").definition.values.tolist()
    definition = next((name for name in DEFINITION if name in names), names[0])
    for stem, selection in distinct("deformed", SCENE_LABELS, cells(status != 0, SCENE_LABELS)).items():
        yield stem, plot_deformed, selection | {"definition": definition}


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
    'structured, steel, traction: network (paper) over reference (grey)'
    """
    fields, root = group(data, "fields", alone=False), group(data, "/")
    kept = fields.definition.values.tolist()
    definition = choose((root.status != 0).sel(definition=kept), definition=definition)["definition"]
    _, beams, selection = _by_beam(root, beam, mesh_type, material, load, kinematics)
    fields = fields.sel({"definition": definition, "mesh_type": selection["mesh_type"]})
    if "kinematics" in fields.dims:
        fields = fields.sel(kinematics=selection["kinematics"])
    figure, axes = style.panels(ax, nrows=len(beams), figsize=(6.0, 0.5 + 1.6 * len(beams)))
    axes = axes[:, 0]
    for panel, name in zip(axes, beams):
        _deformed(panel, fields.sel(beam=name), selection, name)
    labels = ", ".join(_named(selection, "mesh_type", "material", "load"))
    title = f"{labels}: network ({definition}) over reference (grey)"
    style.arrange(figure, left=0.51, right=0.06, bottom=0.42, top=0.55, hspace=0.75, title=title)
    return axes


def _deformed(panel, fields, selection, beam):
    known = np.isfinite(fields.x.values).any(axis=fields.x.dims.index("particle"))
    fields = fields.isel(mesh_size=np.flatnonzero(known)[-1] if known.any() else 0)
    load = {"material": selection["material"], "load": selection["load"]}
    rest = 1e3 * np.stack([fields.x.values, fields.y.values], axis=1)
    moved = 1e3 * np.stack([fields.displacement_x.sel(load).values, fields.displacement_y.sel(load).values], axis=1)
    outline = 1e3 * np.stack([fields.outline_x.values, fields.outline_y.values], axis=1)
    there = 1e3 * np.stack(
        [fields.reference_displacement_x.sel(load).values, fields.reference_displacement_y.sel(load).values], axis=1
    )
    kept = np.isfinite(outline[:, 0])
    outline, there = outline[kept], there[kept]
    largest = np.abs(there).max()
    scale = _round(0.06 * np.ptp(outline[:, 0]) / largest) if largest > 0 else 1
    panel.fill(*(outline + scale * there).T, facecolor="0.82", edgecolor="0.45", linewidth=1.0)
    panel.plot(*np.vstack([outline, outline[:1]]).T, color="0.6", linewidth=0.6, linestyle=(0, (3, 3)))
    known = np.isfinite(fields.spring_first.values)
    ends = np.stack([fields.spring_first.values[known], fields.spring_second.values[known]], axis=1).astype(int)
    if np.isfinite(moved).any():
        # One line with gaps: thousands of lines take ten times as long.
        springs = np.full((len(ends), 3, 2), np.nan)
        springs[:, :2] = (rest + scale * moved)[ends]
        panel.plot(*springs.reshape(-1, 2).T, color="#14213d", linewidth=0.5)
    else:
        panel.text(0.5, 0.5, "not solved", transform=panel.transAxes, ha="center", va="center")
    panel.set(aspect="equal", adjustable="datalim", xlabel="x [mm]", ylabel="y [mm]")
    panel.set_title(f"{beam} mm, mesh {1e3 * float(fields.mesh_size):g} mm, displacements x {scale:g}")
    panel.grid(False)


def _round(value):
    """Nearest of 1, 2, 5 times a power of ten below."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(step for step in (1, 2, 5) if step * power <= value * (1 + 1e-9)) * power


# -- the pressed block -------------------------------------------------------------------------------------------------

BLOCK_LOADS = ("traction", "compression", "pressure")
ENERGIES = ("area", "delingette")
POISSON_LAW = (4 / 3) / (9 / 8)
"""Constrained modulus of a block held sideways at nu = 1/2 over that of a network, nu = 1/3 [1]."""


def block(tree):
    """The figure of a pressed block: its last material, its last beam and its finest structured mesh.

    See `sensitivity`.
    """
    present = (group(tree, "/").status != 0).sel(load=["pressure"], mesh_type=["structured"])
    selection = {"mesh_type": "structured"}
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
    ['One stiffness for three loads? (small strain)', 'The pressed face']
    >>> axes[0].figure.get_suptitle()
    '200x40 mm, structured 1 mm, rubber'
    """
    faces, root = group(data, "block", alone=False), group(data, "/")
    pressed = (root.status != 0).sel(load=["pressure"])
    chosen = choose(pressed, beam=beam, mesh_type=mesh_type, mesh_size=mesh_size, material=material)
    figure, ((left, right),) = style.panels(ax, ncols=2, figsize=(8.4, 4.2))
    if "sensitivity" in data.children:
        _stiffness(left, group(data, "sensitivity").sel(chosen), root.sel(chosen))
    _profile(right, faces.sel(chosen), root.sel(chosen))
    size = 1e3 * chosen["mesh_size"]
    title = f"{chosen['beam']} mm, {chosen['mesh_type']} {size:g} mm, {chosen['material']}"
    style.arrange(figure, left=0.588, right=0.084, bottom=1.134, top=0.588, wspace=0.2, title=title)
    return np.array([left, right])


def _stiffness(panel, curves, root):
    """Linear kinematics: the reference's own, so that only the law of stiffness is seen."""
    curves = curves.sel(kinematics="linear")
    membrane = float(root.material_young_modulus) * 1e-3
    for number, load in enumerate(BLOCK_LOADS):
        if load in curves["load"]:
            curve = curves.sel(load=load)
            # A linear network's displacement goes as 1/k.
            stiffness = np.linspace(float(curve.stiffness.min()), float(curve.stiffness.max()), 600)
            softness = curve.displacement.values[0] * curve.stiffness.values[0]
            error = 100 * np.abs(softness / stiffness / float(root.reference_displacement.sel(load=load)) - 1)
            look = style.line(number) | {"marker": ""}
            panel.plot(stiffness, error, label=load, **look)
    stated = float(root.paper_stiffness.max()) if np.isfinite(root.paper_stiffness).any() else np.nan
    predicted = np.sqrt(3) / 2 * membrane
    printed = root.stiffness.sel(definition="paper").values if "paper" in root.definition.values else np.array([np.nan])
    known = printed[np.isfinite(printed)]
    stated = known[0] if len(known) else stated
    marks = {f"{stated:.0f}: the paper's, from traction": stated, f"{predicted:.0f}: √3/2 E t": predicted}
    marks[f"{predicted * POISSON_LAW:.0f}: fits the block by a wrong ν"] = predicted * POISSON_LAW
    for text, value in marks.items():
        if np.isfinite(value):
            panel.axvline(value, color="0.5", linewidth=0.8, linestyle=(0, (2, 2)), zorder=1)
            panel.annotate(
                text, (value, 0.97), xycoords=("data", "axes fraction"), xytext=(2, 0), textcoords="offset points",
                rotation=90, va="top", fontsize=6.2, color="0.3",
            )  # fmt: skip
    for number, definition in enumerate(name for name in ENERGIES if name in root.definition.values):
        errors = 100 * np.abs(
            root.deformation_error.sel(definition=definition, kinematics="linear", load=list(BLOCK_LOADS))
        )
        look = style.line(3 + number) | {"marker": ""}
        worst = float(errors.max())
        panel.axhline(worst, label=f"{definition}, worst of the three ({worst:.2f} %)", **look)
    panel.set(ylim=(0, 40), xlabel="Uniform stiffness [N/m]", ylabel="|Deformation error| [%]")
    panel.set_xlim(0.7 * predicted, 1.5 * predicted)
    panel.set_title("One stiffness for three loads? (small strain)")
    panel.legend(loc="upper center", fontsize=6.4, bbox_to_anchor=(0.5, -0.17), ncols=2)


def _profile(panel, block, root):
    """The pressed face: networks with their full length law over references."""
    x = block.face_position.values
    pressed = block.sel(load="pressure")
    for number, kind in enumerate(block.reference.values):
        profile = -1e3 * pressed.reference_face_profile.sel(reference=kind).values
        if np.isfinite(profile).any():
            shade = ("0.55", "0.3", "0.75")[number % 3]
            panel.plot(x, profile, color=shade, linewidth=3.2, alpha=0.6, label=f"reference, {kind.replace('-', ' ')}")
    for number, definition in enumerate(block.definition.values):
        linear = definition in ENERGIES
        profile = pressed.face_profile.sel(definition=definition, kinematics="linear" if linear else "nonlinear")
        if np.isfinite(profile.values).any():
            look = style.line(number) | {"marker": ""}
            panel.plot(x, -1e3 * profile.values, label=f"{definition}, {'linear' if linear else 'nonlinear'}", **look)
    panel.set(xlabel="Place on the loaded face over its length", ylabel="Displacement along the load [mm]")
    panel.set_title("The pressed face")
    panel.set_ylim(2.0, None)
    panel.legend(loc="upper center", fontsize=6.4, bbox_to_anchor=(0.5, -0.17), ncols=2)
