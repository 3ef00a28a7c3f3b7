"""Which definition to use: what each attains on each mesh type, every number from the dataset."""

import numpy as np
import xarray as xr

from ...output import tables
from ...output.dataset import most_requested
from ...output.selection import in_plane_ratio, unswept
from ...output.tables import numbers
from ...output.text import cell_number, markdown_section, markdown_table

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
    meshes = "; ".join(", ".join(f"{beam} at {1e3 * size:g} mm" for beam, size in seen[one]) for one in sorted(seen))
    said = "Each line is the range over all meshes of the study up to its a/H and beyond that of the line before"
    lines = markdown_table(list(rows[0]), [list(row.values()) for row in rows], 4)
    return [*markdown_section("In short"), *lines, "", f"{said}: {meshes}.", ""]


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
