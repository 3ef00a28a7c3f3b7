"""Figures and table that compare definitions: moduli, and errors by load."""

import numpy as np
import pandas as pd

from ...output import style
from ...output.answers import count_statuses
from ...output.dataset import choose, group, labels_of, sign_of_errors
from ..bodies.tables import at, beam_title, last_swept


def definitions(tree):
    """Yield the figures of moduli, and of errors by mesh type for the beam and kinematics with most scenes."""
    yield "definitions_moduli", plot_moduli, {}
    root = _unswept(group(tree, "/"))
    for mesh_type in labels_of(root.status != 0, "mesh_type"):
        selection, own = {"mesh_type": mesh_type}, root[["status"]].sel(mesh_type=[mesh_type])
        for name in ("beam", "kinematics"):
            selection[name] = _most_requested(own, name)
            own = own.sel({name: [selection[name]]})
        yield f"definitions_loads_{mesh_type}", plot_definitions_loads, selection


def _most_requested(root, dimension):
    """Label of a dimension with the most requested scenes."""
    counts = (root.status != 0).sum([name for name in root.status.dims if name != dimension])
    return str(counts[dimension].values[counts.values.argmax()])


def _unswept(root):
    """Root at the last swept values of each beam, material and load."""
    return at(root, last_swept(root.status != 0))


@style.styled
def plot_moduli(data, ax=None):
    """Effective over requested Poisson's ratio, one panel per mesh type, on its finest patch.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/moduli``.
    ax : Figure or sequence of Axes, optional

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_mesh_types,)

    Raises
    ------
    ValueError
        If the dataset has no moduli, or ``ax`` is not as many Axes as mesh types.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_moduli(tree)
    >>> [panel.get_title(loc="left") for panel in axes]
    ['structured', 'free']
    >>> axes[0].get_xlabel(), axes[0].get_ylabel()
    ('requested', 'effective')
    """
    moduli = group(data, "moduli")
    title = "Effective over requested Poisson's ratio; grey: equal"
    shown = {name: moduli.sel(mesh_type=name) for name in labels_of(moduli.status != 0, "mesh_type")}
    return style.small_multiples(ax, shown, 2, 1.95, title, _moduli)


def _group_equal_curves(curves, within):
    """Groups of curves that look like one line, in order."""
    groups = {}
    for name, values in curves.items():
        alike = (one for one in groups if np.allclose(values, curves[one], rtol=0, atol=within, equal_nan=True))
        groups.setdefault(next(alike, name), []).append(name)
    return list(groups.values())


def _moduli(panel, here):
    """Draw the moduli of one mesh type; return notes, and a message if there are none."""
    panel.set(xlabel="requested", ylabel="effective")
    curves, lacking, requested = {}, [], here.poisson_ratio.values
    for definition in here.definition.values:
        one = here.sel(definition=definition)
        sizes = np.flatnonzero((one.status == 1).any("poisson_ratio").values)
        if len(sizes):
            curves[str(definition)] = one.effective_poisson_ratio.values[sizes[0]]
        elif (one.status != 0).any():
            lacking.append(str(definition))
    low, high = requested.min(), max(requested.max(), requested.min() + 1e-3)
    panel.plot([low, high], [low, high], color="0.8", linewidth=3.5, zorder=0)
    panel.set_xlim(low - 0.02, high + 0.02)
    values = np.concatenate([[low, high], *curves.values()])
    bottom, top = np.clip([np.nanmin(values) - 0.03, np.nanmax(values) + 0.03], -0.45, 0.75)
    panel.set_ylim(min(bottom, low - 0.03), max(top, high + 0.03))
    for number, names in enumerate(_group_equal_curves(curves, 0.012)):
        panel.plot(requested, curves[names[0]], label=", ".join(names), **style.line(number))
    notes = [f"no moduli: {', '.join(lacking)}"] if lacking else []
    counts = ", ".join(f"{name} ({count})" for name, count in count_statuses(here.status.values).items())
    return notes, f"No definition has moduli here: {counts or 'none was requested'}."


@style.styled
def plot_definitions_loads(data, ax=None, *, beam=None, mesh_type=None, materials=None, kinematics=None):
    """Heat map of the deformation error by definition and load on the finest mesh, one panel per material.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its root.
    ax : Figure or sequence of Axes, optional
    beam, mesh_type, kinematics : str, optional
    materials : sequence of str, optional
        By default three of those with most scenes, from the lowest to the highest Poisson's ratio.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_materials,)

    Raises
    ------
    ValueError
        If the selection leaves a choice, or nothing, or ``ax`` is not as many Axes as materials.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_definitions_loads(tree, beam="200x40", mesh_type="free", kinematics="linear")
    >>> [panel.get_title(loc="left").partition(", ν = ")[0] for panel in axes]
    ['steel', 'rubber']
    >>> [tick.get_text() for tick in axes[0].get_xticklabels()]
    ['traction', 'compression', 'pressure']
    """
    root = _unswept(group(data, "/"))
    chosen = choose(root.status != 0, beam=beam, mesh_type=mesh_type, kinematics=kinematics)
    root = root.sel(chosen)
    solved = root.status == 1
    materials = _default_materials(root, solved) if materials is None else materials
    for material in materials:
        choose(root.status != 0, material=material)
    if solved.any():
        root = root.sel(definition=labels_of(solved, "definition"))
    root = root.sel(load=labels_of(root.status != 0, "load"))
    names, loads = root.definition.values.tolist(), root["load"].values.tolist()
    place = ("mesh_size", "definition", "load")
    beyond = root.reference_applies == 0 if "reference_applies" in root else root.status < 0

    def draw(panel, material):
        cells, error = root.sel(material=material), np.full((len(names), len(loads)), np.nan)
        doubted = beyond.sel(material=material).any([name for name in beyond.dims if name not in ("material", "load")])
        for values in 100 * cells.deformation_error.transpose(*place).values[::-1]:  # the finest solved mesh stays
            error = np.where(np.isfinite(values), values, error)
        asked = (cells.status != 0).any("mesh_size").transpose(*place[1:]).values
        style.heat_map(panel, pd.DataFrame(error, names, loads), asked, doubted.values, "+")
        return [], ""

    shown = {}
    for material in materials:
        ratio = f"ν = {float(root.material_poisson_ratio.sel(material=material)):g}"
        shown[ratio if material == ratio.replace("ν = ", "nu-") else f"{material}, {ratio}"] = material
    flags = root.status.sel(material=materials).values
    note = [sign_of_errors(root), f"{style.NO_RESULT}: no result" * bool((flags > 1).any())]
    note += [f"{style.NOT_REQUESTED}: not requested" * bool((flags == 0).any())]
    note += [f"*: {style.BEYOND_SMALL_STRAIN}" * bool(beyond.sel(material=materials).any())]
    title = f"{beam_title(root, chosen['beam'])}, {chosen['mesh_type']}"
    title += ": deformation error [%] on the finest mesh solved"
    note, height = "; ".join(filter(None, note)), 1.2 + 0.165 * len(names)
    return style.small_multiples(ax, shown, len(shown), height, title, draw, sharey=True, note=note)


def _default_materials(root, solved):
    """First, middle and last material by Poisson's ratio, among those with most loads."""
    counts = solved.any("mesh_size").sum(["definition", "load"]).values
    full = np.flatnonzero(counts > 0.5 * counts.max() if counts.any() else counts == 0)
    order = full[np.argsort(root.material_poisson_ratio.values[full], kind="stable")]
    return root.material.values[[*dict.fromkeys((order[0], order[len(order) // 3], order[-1]))]].tolist()


# -- tables ------------------------------------------------------------------------------------------------------------

MESH_SIZES_OVER_HEIGHT = {0.05: "up to 0.05", 0.1: "0.05 to 0.1", float("inf"): "above 0.1"}
"""Largest mesh sizes over the height of the beam [1] of fine, middle and coarse meshes, and their texts."""

TABLE_NOTE = (
    "Lowest and highest deformation error over beams and mesh sizes. Beyond small strain a reference does not apply, "
    "and the error is not the network's alone."
)


def tables(tree):
    """Make the table of error ranges by definition, mesh type, material, load and mesh size."""
    if "deformation_error" not in tree:
        return []
    root = _unswept(tree.to_dataset())
    root = root.sel(kinematics=_most_requested(root, "kinematics"))
    place = ["definition", "mesh_type", "material", "load"]
    cells = root[["deformation_error", "status", "reference_applies"]].assign(ratio=root.mesh_size / root.beam_height)
    frame = cells.to_dataframe([*place, "beam", "mesh_size"]).reset_index()
    frame = frame[frame.status != 0]
    ends = [0.0, *(end * (1 + 1e-9) for end in MESH_SIZES_OVER_HEIGHT)]
    frame["mesh_size_over_height"] = pd.cut(frame.ratio, ends, labels=[*MESH_SIZES_OVER_HEIGHT.values()]).astype(str)
    frame["solved"] = frame.status == 1
    frame["beyond"] = frame.solved & (frame.reference_applies == 0)
    frame["error"] = 100 * frame.deformation_error.where(frame.solved)
    ranges = frame.groupby([*place, "mesh_size_over_height"], sort=False).agg(
        scenes=("solved", "size"),
        solved=("solved", "sum"),
        beyond_small_strain=("beyond", "sum"),
        lowest_error_percent=("error", "min"),
        highest_error_percent=("error", "max"),
    )
    rows = ranges.reset_index().to_dict("records")
    return [{"stem": "definitions", "title": "Definitions compared", "note": TABLE_NOTE, "rows": rows}]
