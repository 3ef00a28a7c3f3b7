"""Definitions compared: moduli, errors over mesh sizes and by load, and which definition to use."""

import numpy as np
import xarray as xr

from springtune.safe_io.escapes import no_mathematics

from ...output import labels, style, tables
from ...output.dataset import most_requested
from ...output.drawing import BEYOND_SMALL_STRAIN, NO_RESULT, NOT_ASKED, error_text, heat_map
from ...output.selection import choose, group, in_plane_ratio, labelled_beam, labels_of, sign_of_errors, unswept
from ...output.tables import numbers
from ...output.text import cell_number, markdown_section, markdown_table
from .outputs import figures

FLOOR = 1e-5
"""Smallest error drawn on a logarithmic axis [1]; smaller ones are rounding and the reference's own error."""

MOST_NAMED = 6
"""Most named lines in a panel of errors against mesh size; the others are grey."""

BASELINE = "uniform"
"""The definition that is named beside the best ones."""


def definitions(tree):
    """Figures that compare definitions: moduli, errors against mesh size by load, and heat maps by mesh type."""
    root = unswept(group(tree, "/"))
    asked = root.status != 0
    for stem, selection in figures(labels_of(asked, "load"), labels_of(asked, "mesh_type")).items():
        if "load" in selection:
            yield stem, plot_definitions_size, _main(root, ("beam", "kinematics", "material"), selection)
        elif "mesh_type" in selection:
            yield stem, plot_definitions_loads, _main(root, ("beam", "kinematics"), selection)
        else:
            yield stem, plot_moduli, {}


def _main(root, names, selection):
    """A selection, and of further dimensions the labels with most of its scenes."""
    chosen, root = dict(selection), root[["status"]].sel({name: [label] for name, label in selection.items()})
    for name in names:
        chosen[name] = most_requested(root, name)
        root = root.sel({name: [chosen[name]]})
    return chosen


def _by_mesh_type(ax, present, title, draw):
    """A panel a mesh type; `draw` returns notes, and what to say without lines."""
    names = {name: name for name in labels_of(present, "mesh_type")}
    return labels.small_multiples(ax, names, 2, 1.95, title, draw)


def _statuses(flags):
    """Count the cells of each status, in words."""
    found = labels.statuses(flags).items()
    return ", ".join(f"{name} ({count})" for name, count in found) or "none was asked for"


@style.styled
def plot_moduli(data, ax=None):
    """Effective Poisson's ratio against the one asked for, a panel a mesh type, each on its finest patch.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/moduli``.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as mesh types; by default a new figure.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_mesh_types,)
        One a mesh type.

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
    ('asked for', 'effective')
    """
    moduli = group(data, "moduli")
    title = "Effective Poisson's ratio against the one asked for; grey: as asked"
    return _by_mesh_type(ax, moduli.status != 0, title, lambda panel, name: _moduli(panel, moduli.sel(mesh_type=name)))


def _moduli(panel, here):
    """Draw the moduli of one mesh type, see `_by_mesh_type`."""
    panel.set(xlabel="asked for", ylabel="effective")
    curves, lacking, wanted = {}, [], here.poisson_ratio.values
    for definition in here.definition.values:
        one = here.sel(definition=definition)
        sizes = np.flatnonzero((one.status == 1).any("poisson_ratio").values)
        if len(sizes):
            curves[str(definition)] = one.effective_poisson_ratio.values[sizes[0]]
        elif (one.status != 0).any():
            lacking.append(str(definition))
    low, high = wanted.min(), max(wanted.max(), wanted.min() + 1e-3)
    panel.plot([low, high], [low, high], color="0.8", linewidth=3.5, zorder=0)
    panel.set_xlim(low - 0.02, high + 0.02)
    values = np.concatenate([[low, high], *curves.values()])
    bottom, top = np.clip([np.nanmin(values) - 0.03, np.nanmax(values) + 0.03], -0.45, 0.75)
    panel.set_ylim(min(bottom, low - 0.03), max(top, high + 0.03))
    for number, names in enumerate(labels.alike(curves, 0.012)):
        panel.plot(wanted, curves[names[0]], label=", ".join(names), **style.line(number))
    said = [f"no moduli: {', '.join(lacking)}"] if lacking else []
    return said, f"No definition has moduli here: {_statuses(here.status.values)}."


@style.styled
def plot_definitions_size(data, ax=None, *, beam=None, material=None, load=None, kinematics=None):
    """Field error against mesh size with fitted rates, a panel a mesh type, a line a definition.

    Definitions that look like one line share it. Only the best and `uniform` have names; the others are grey.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its root.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as mesh types; by default a new figure.
    beam, material, load, kinematics : str, optional
        Labels of the scenes. One that is not given must leave no choice.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_mesh_types,)
        One a mesh type.

    Raises
    ------
    ValueError
        If the selection leaves a choice, or nothing, or ``ax`` is not as many Axes as mesh types.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_definitions_size(tree, beam="200x40", material="steel", load="traction", kinematics="linear")
    >>> [panel.get_title(loc="left") for panel in axes]
    ['structured', 'free']
    >>> axes[0].figure.get_suptitle()
    '200x40 mm, steel, traction: error of the displacement field in L2, fitted rate in brackets'
    """
    root = unswept(group(data, "/"))
    chosen = choose(root.status != 0, beam=beam, material=material, load=load, kinematics=kinematics)
    root = root.sel(chosen)
    title = f"{labelled_beam(root, chosen['beam'])}, {chosen['material']}, {chosen['load']}"
    rates = ", fitted rate in brackets" if len(labels_of(root.status != 0, "mesh_size")) > 1 else ""
    title = f"{title}: error of the displacement field in L2{rates}"
    values = root.field_error.values
    values = 100 * np.maximum(values[np.isfinite(values)], FLOOR)
    limits = (0.7 * values.min(), 1.4 * values.max()) if len(values) else None

    def draw(panel, name):
        drawn = _field_errors(panel, root.field_error.sel(mesh_type=name), root.status.sel(mesh_type=name))
        panel.set(ylabel="Error [%]", ylim=limits)
        style.plain(panel, "y")
        return drawn

    return _by_mesh_type(ax, root.status != 0, title, draw)


def _field_errors(panel, error, status):
    """Draw the errors of one mesh type, see `_by_mesh_type`: the best definitions and the baseline have names."""
    asked = labels_of(status != 0, "mesh_size")
    error = error.sel(mesh_size=asked)
    every, flags = (one.transpose("definition", ...).values for one in (error, status.sel(mesh_size=asked)))
    sizes, names = 1e3 * error.mesh_size.values, error.definition.values
    known = np.isfinite(every)
    curves = {str(name): 100 * np.maximum(row, FLOOR) for name, row, there in zip(names, every, known) if there.any()}
    panel.set(yscale="log")
    places = dict(zip(curves, labels.sizes_axis(panel, sizes, len(curves))))
    if not curves:
        return [], f"No definition has a field error here: {_statuses(flags)}."
    together = labels.alike({name: np.log(values) for name, values in curves.items()}, 0.01)
    together.sort(key=lambda one: np.nanmean(np.log(curves[one[0]])))
    base, named = next((one for one in together if BASELINE in one), None), together[:MOST_NAMED]
    if base is not None and base not in named:
        named[-1] = base
    others = [name for one in together if one not in named for name in one]
    for name in others:
        panel.plot(places[name], curves[name], color="0.75", linewidth=0.6, marker=".", markersize=2, zorder=1)
    order = names.tolist()
    for one in named:
        values, look = curves[one[0]], style.line(order.index(one[0]))
        there = np.flatnonzero(np.isfinite(values))
        label = ", ".join(one)
        if len(there) > 1:
            rate = np.polyfit(np.log(sizes[there]), np.log(values[there]), 1)[0]
            label += f" ({rate:.1f})".replace("-0.0", "0.0").replace("-", "−")
        panel.plot(places[one[0]], values, label=label, **look)
    lacking = [str(name) for name, there, flag in zip(names, known, flags) if not there.any() and (flag > 0).any()]
    said = {"grey": others, "no error": lacking}
    return [f"{what}: {', '.join(own)}" for what, own in said.items() if own], ""


@style.styled
def plot_definitions_loads(data, ax=None, *, beam=None, mesh_type=None, materials=None, kinematics=None):
    """Heat map of the deformation error, definition by load, each on its finest mesh, a panel a material.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its root.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as materials; by default a new figure.
    beam, mesh_type, kinematics : str, optional
        Labels of the scenes. One that is not given must leave no choice.
    materials : sequence of str, optional
        By default three of those with most scenes, from the lowest to the highest Poisson's ratio.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_materials,)
        One a material.

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
    root = unswept(group(data, "/"))
    chosen = choose(root.status != 0, beam=beam, mesh_type=mesh_type, kinematics=kinematics)
    root = root.sel(chosen)
    solved = root.status == 1
    materials = _spread(root, solved) if materials is None else materials
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
        texts = np.where(asked, NO_RESULT, NOT_ASKED).astype(object)
        for row, column in np.argwhere(np.isfinite(error)):
            texts[row, column] = error_text(error[row, column]) + "*" * bool(doubted[column])
        heat_map(panel, error, texts)
        panel.set_xticks(range(len(loads)), map(no_mathematics, loads))
        panel.xaxis.set_tick_params(rotation=90, labelsize=style.SMALL)
        panel.set_yticks(range(len(names)), map(no_mathematics, names))
        return [], ""

    shown = {}
    for material in materials:
        ratio = f"ν = {float(root.material_poisson_ratio.sel(material=material)):g}"
        shown[ratio if material == ratio.replace("ν = ", "nu-") else f"{material}, {ratio}"] = material
    flags = root.status.sel(material=materials).values
    said = [sign_of_errors(root), f"{NO_RESULT}: no result" * bool((flags > 1).any())]
    said += [f"{NOT_ASKED}: not asked for" * bool((flags == 0).any())]
    said += [f"*: {BEYOND_SMALL_STRAIN}" * bool(beyond.sel(material=materials).any())]
    title = (
        f"{labelled_beam(root, chosen['beam'])}, {chosen['mesh_type']}: deformation error [%] on the finest mesh solved"
    )
    said, height = "; ".join(filter(None, said)), 1.2 + 0.165 * len(names)
    return labels.small_multiples(ax, shown, len(shown), height, title, draw, sharey=True, said=said)


def _spread(root, solved):
    """The first, middle and last material by Poisson's ratio, of those with most loads."""
    counts = solved.any("mesh_size").sum(["definition", "load"]).values
    full = np.flatnonzero(counts > 0.5 * counts.max() if counts.any() else counts == 0)
    order = full[np.argsort(root.material_poisson_ratio.values[full], kind="stable")]
    return root.material.values[[*dict.fromkeys((order[0], order[len(order) // 3], order[-1]))]].tolist()


# -- tables ------------------------------------------------------------------------------------------------------------


TABLE_MESH_TYPES = ("structured", "free", "braced", "alternating", "right")
TABLE_LOADS = ("traction", "bending", "shear")


ADVICE = (
    # what one has, what to use, on which mesh type
    ("Triangles, and the simulator can couple the sides of a triangle", "delingette", "free"),
    ("Triangles, springs and an energy of their area", "patch-area", "free"),
    ("the same, without a patch test", "area", "free"),
    ("Triangles, springs alone, each fitted", "patch-fit", "free"),
    ("Triangles, springs alone, scaled", "patch", "free"),
    ("Rows of near-equilateral triangles, springs alone, no patch test", "van-gelder", "structured"),
    ("Squares with both diagonals and an energy of their area", "area", "braced"),
    ("Squares with both diagonals, springs alone", "lattice", "braced"),
    ("One stiffness for all springs, whatever it costs", "uniform", "structured"),
)


COARSENESS = (0.05, 0.1, np.inf)
"""Largest mesh sizes over the height of the beam [1] of each line of the advice."""


def decision(tree: xr.DataTree) -> str:
    """Markdown: what to use, what each definition attains on each mesh type, and over the paper's cells."""
    root, moduli = unswept(tree.to_dataset()), tree["moduli"].to_dataset()
    beam = most_requested(root, "beam")
    materials = _materials(root, beam)
    root = root.sel(kinematics=most_requested(root, "kinematics"))
    shown = root.sel(material=list(materials.values()), load=[one for one in TABLE_LOADS if one in root["load"].values])
    shown = shown.assign_coords(material=list(materials)).transpose("load", "material", ...)
    parts = _advice(shown)
    for mesh_type in TABLE_MESH_TYPES:
        if mesh_type in root.mesh_type.values and mesh_type in moduli.mesh_type.values:
            parts += _attained(shown.sel(beam=beam, mesh_type=mesh_type), moduli.sel(mesh_type=mesh_type), moduli.attrs)
    strained = ", ".join(root.material.values[root.material_plane == "strain"]) if "material_plane" in root else ""
    plane = [f"Of materials in plane strain, E and ν are E / (1 − ν²) and ν / (1 − ν): {strained}.", ""]
    return "\n".join(parts + _paper_cells(root) + (plane if strained else []) + _beyond(root))


def _materials(root, beam):
    """Materials by Poisson's ratio: nearest to 0.3, and the largest one, of those with most scenes."""
    requested = (root.status.sel(beam=beam) != 0).any(["mesh_type", "mesh_size", "definition", "kinematics"])
    counts, ratios = requested.sum("load").values, in_plane_ratio(root).values
    found = np.flatnonzero(counts == counts.max())
    chosen = {found[np.argmin(np.abs(ratios[found] - 0.3))], found[np.argmax(ratios[found])]}
    return {float(ratios[i]): str(root.material.values[i]) for i in sorted(chosen, key=lambda i: ratios[i])}


def _advice(root):
    """What to use, with the range of its errors over all beams and mesh sizes, by mesh size over height."""
    place = ["definition", "mesh_type", "beam", "mesh_size"]
    cells = root[["deformation_error", "status"]].assign(ratio=root.mesh_size / root.beam_height)
    cells = cells.to_dataframe(["load", "material", *place]).reset_index()
    cells = cells[cells.groupby(place).status.transform("max") > 0]
    cells["size"] = np.digitize(cells.ratio, np.multiply(COARSENESS, 1 + 1e-9), right=True)
    rows, seen = [], {}
    for situation, name, mesh_type in ADVICE:
        for number, part in cells[(cells.definition == name) & (cells.mesh_type == mesh_type)].groupby("size"):
            meshes = list(part.groupby(["beam", "mesh_size"], sort=False).groups)
            seen.setdefault(number, {}).update(dict.fromkeys(meshes))
            columns = {f"{load}, ν = {nu:g}": one for (load, nu), one in part.groupby(["load", "material"], sort=False)}
            size = f"to {min(COARSENESS[number], part.ratio.max()):.3g}"
            row = {"what you have": situation, "usual choice": f"`{name}`", "mesh type": mesh_type, "a/H": size}
            rows.append(row | {"meshes": str(len(meshes))} | {head: _range(one) for head, one in columns.items()})
            situation = ""
    if not rows:
        return []
    meshes = (", ".join(f"{beam} at {1e3 * size:g} mm" for beam, size in seen[one]) for one in sorted(seen))
    said = "Each line is the range over the meshes of its a/H, from the finest to the coarsest"
    lines = markdown_table(list(rows[0]), [list(row.values()) for row in rows], 4)
    return [*markdown_section("In short"), *lines, "", f"{said}: {'; '.join(meshes)}.", ""]


def _range(cells):
    """Lowest to highest error of the requested cells, and the number without an error."""
    there = cells.deformation_error[cells.status == 1]
    ends = dict.fromkeys(_signed(value) for value in (there.min(), there.max()) if len(there))
    text = " to ".join(ends).replace(" % to", " to")
    missing, requested = int((cells.status > 1).sum()), int((cells.status != 0).sum())
    notes = [f"{missing} not solved"] if missing else []
    notes += [f"{requested} of {len(cells)}"] if 0 < requested < len(cells) else []
    return f"{text} ({', '.join(notes)})".strip() if notes else text


def _beyond(root):
    """Scenes of these tables whose reference does not apply; empty without any."""
    if "reference_applies" not in root:
        return []
    place = ("material", "load")
    beyond = (root.reference_applies == 0) & (root.status == 1)
    beyond = beyond.any([name for name in beyond.dims if name not in place]).transpose(*place)
    if not beyond.any():
        return []
    named = "; ".join(f"{root.material.values[i]}, {root['load'].values[j]}" for i, j in np.argwhere(beyond.values))
    return [f"Beyond small strain, where errors hold more than the network's own: {named}.", ""]


def _attained(scenes, moduli, box):
    """Moduli and deformation errors on the finest mesh size that has both, for the beam with most scenes."""
    names = [name for name in scenes.definition.values if name in moduli.definition.values]
    ratios = [ratio for ratio in scenes.material.values if ratio in moduli.poisson_ratio.values]
    scenes, moduli = scenes.sel(definition=names), moduli.sel(definition=names, poisson_ratio=ratios)
    both = (moduli.status == 1).any("poisson_ratio") & (scenes.status == 1).any(["material", "load"])
    sizes = both.mesh_size.where(both).min("mesh_size").dropna("definition").reset_coords(drop=True)
    if not sizes.size:
        return []
    fine, sizes = min(scenes.mesh_size.values), {"definition": sizes.definition, "mesh_size": sizes}
    patch, scenes, sizes = moduli.sel(sizes), scenes.sel(sizes), sizes["mesh_size"].to_series()
    seconds = scenes.definition_seconds.max(["load", "material"])
    columns = {
        "E at {:g}": _errors(patch.young_modulus_error),
        "ν at {:g}": numbers(patch.effective_poisson_ratio, ".3f"),
        "{}, {:g}": _errors(scenes.deformation_error),
        "cost": numbers(seconds, ".0f", 1e3, " ms").where(~(seconds < 5e-4), "< 1 ms"),
    }
    marks = {name: "" if size == fine else f" ({1e3 * size:g} mm)" for name, size in sizes.items()}
    heads = {"definition": ("definition", lambda name: f"`{name}`{marks[name]}")}
    height, extent = float(scenes.beam_height), [box[f"patch_{side}"] for side in ("length", "height")]
    same = np.allclose(extent, [float(scenes.beam_length), height], atol=0)
    text = " x ".join(f"{1e3 * side:g}" for side in extent) + " mm"
    of = f"beam of {text}" if same else f"beam {scenes.beam.item()}; moduli are of the meshes of a {text} sheet"
    note = f"All at {1e3 * fine:g} mm (a/H = {fine / height:.3g}), but where a row says otherwise; {of}."
    table = tables.markdown(["definition"], columns, heads)
    return [*markdown_section(f"Mesh type `{scenes.mesh_type.item()}`", note), *table, ""]


def _paper_cells(root):
    """Median and largest error over beams, mesh sizes and the paper's three loads and materials."""
    pairs = (("steel", "traction"), ("steel", "compression"), ("rubber", "traction"))
    known = {*root.material.values, *root["load"].values}
    if not {name for pair in pairs for name in pair} <= known:
        return []
    pull, push, rubber = (abs(root.deformation_error.sel(material=one, load=load, drop=True)) for one, load in pairs)
    columns, others = {}, [one for one in rubber.dims if one not in ("definition", "mesh_type")]
    for name, errors in {"steel": xr.concat([pull, push], "beam"), "rubber": rubber}.items():
        for head, found in {"median": errors.median(others), "largest": errors.max(others)}.items():
            columns[f"{name}, {head}"] = numbers(found.where(rubber.notnull().any(others)), ".2f", 100, " %")
    return [*markdown_section("The paper's cells"), *tables.markdown(["definition", "mesh_type"], columns), ""]


def _signed(value):
    text = cell_number(value, "+.1f", 100, " %")
    return "0.0 %" if text[1:] == "0.0 %" else text


def _errors(array):
    return xr.apply_ufunc(_signed, array, vectorize=True, output_dtypes=[object])
