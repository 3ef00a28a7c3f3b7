"""Tables that compare definitions: all scenes, all moduli, and which definition to use."""

from pathlib import Path

import numpy as np
import xarray as xr

from springtune.safe_io.atomic import write_text

from ...output.dataset import STATUS, most_requested
from ...output.selection import in_plane_ratio, records, unswept
from ...output.text import cell_number, csv_text, markdown_section, markdown_table
from ..scenes.variables import SCENE
from .outputs import TABLES

SCENE_VALUES = ("deformation_error", "field_error", "definition_seconds", "definition_evaluations", "spring_ratio")
MODULI_VALUES = ("young_modulus_error", "effective_poisson_ratio", "shear_modulus_error", "spring_ratio")


def write(tree, folder):
    """Write two CSV files and a page in Markdown."""
    root, moduli = tree.to_dataset(), tree["moduli"].to_dataset()
    scene = (*SCENE, *(str(name) for name in root.status.dims if name not in SCENE))  # what is swept, too
    texts = (_csv(root, scene, SCENE_VALUES), _csv(moduli, moduli.status.dims, MODULI_VALUES), decision(tree))
    for name, text in zip(TABLES, texts):
        write_text(Path(folder) / name, text)
    return list(TABLES)


def _csv(data, dimensions, values):
    """One row for each cell that was asked for."""
    present = (data.status != 0).transpose(*dimensions)
    rows = records(data, present, ("status", *values, "message"))
    for row in rows:
        row["status"] = STATUS[row["status"]]
        row |= {name: "" if np.isnan(row[name]) else f"{row[name]:.6g}" for name in values}
    return csv_text(rows)


# -- which definition to use -------------------------------------------------------------------------------------------

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


def _advice(root, materials):
    """What to use, with the range of its errors over all beams and mesh sizes, by mesh size over height."""
    loads = [load for load in TABLE_LOADS if load in root["load"].values]
    ratios = root.mesh_size.values / root.beam_height.values[:, None]
    heads = [f"{load}, ν = {nu:g}" for load in loads for nu in materials]
    rows, seen = [], np.zeros((len(COARSENESS), *ratios.shape), dtype=bool)
    for situation, name, mesh_type in ADVICE:
        if name not in root.definition.values or mesh_type not in root.mesh_type.values:
            continue
        cells = root[["deformation_error", "status"]].sel(
            definition=name, mesh_type=mesh_type, load=loads, material=list(materials.values())
        )
        cells = cells.transpose("load", "material", "beam", "mesh_size")
        errors, flags = (cells[part].values.reshape(-1, *ratios.shape) for part in ("deformation_error", "status"))
        low = 0.0
        for number, high in enumerate(COARSENESS):
            within = (ratios > low * (1 + 1e-9)) & (ratios <= high * (1 + 1e-9)) & (flags != 0).any(axis=0)
            low = high
            if within.any():
                seen[number] |= within
                texts = [_range(error[within], flag[within]) for error, flag in zip(errors, flags)]
                size = f"to {min(high, ratios[within].max()):.3g}"
                rows.append([situation, f"`{name}`", mesh_type, size, str(within.sum()), *texts])
                situation = ""
    if not rows:
        return []
    heads = ["what you have", "usual choice", "mesh type", "a/H", "meshes", *heads]
    lines = markdown_table(heads, rows, 4)
    meshes = "; ".join(
        ", ".join(f"{root.beam.values[i]} at {1e3 * root.mesh_size.values[j]:g} mm" for i, j in np.argwhere(group))
        for group in seen if group.any()
    )  # fmt: skip
    said = "Each line is the range over all meshes of the study up to its a/H and beyond that of the line before"
    return [*markdown_section("In short"), *lines, "", f"{said}: {meshes}.", ""]


def _range(errors, flags):
    """Lowest to highest error of the requested cells, and the number without an error."""
    there = errors[flags == 1]
    ends = list(dict.fromkeys(_signed(value) for value in (there.min(), there.max()))) if len(there) else []
    text = " to ".join([*(end.removesuffix(" %") for end in ends[:-1]), *ends[-1:]])
    missing, requested = int((flags > 1).sum()), int((flags != 0).sum())
    notes = [f"{missing} not solved"] if missing else []
    notes += [f"{requested} of {len(flags)}"] if 0 < requested < len(flags) else []
    return f"{text} ({', '.join(notes)})".strip() if notes else text


def decision(tree: xr.DataTree) -> str:
    """Markdown: what to use, what each definition attains on each mesh type, and over the paper's cells."""
    root, moduli = unswept(tree.to_dataset()), tree["moduli"].to_dataset()
    beam = most_requested(root, "beam")
    materials = _materials(root, beam)
    root = root.sel(kinematics=most_requested(root, "kinematics"))
    parts = _advice(root, materials)
    for mesh_type in TABLE_MESH_TYPES:
        if mesh_type in root.mesh_type.values and mesh_type in moduli.mesh_type.values:
            parts += _attained(root, moduli, mesh_type, beam, materials)
    return "\n".join(parts + _paper_cells(root) + _beyond(root))


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


def _materials(root, beam):
    """Materials by Poisson's ratio: nearest to 0.3, and the largest one, of those with most scenes."""
    requested = (root.status.sel(beam=beam) != 0).any(["mesh_type", "mesh_size", "definition", "kinematics"])
    counts, ratios = requested.sum("load").values, in_plane_ratio(root).values
    found = np.flatnonzero(counts == counts.max())
    chosen = {found[np.argmin(np.abs(ratios[found] - 0.3))], found[np.argmax(ratios[found])]}
    return {float(ratios[i]): str(root.material.values[i]) for i in sorted(chosen, key=lambda i: ratios[i])}


def _attained(root, moduli, mesh_type, beam, materials):
    """Moduli and deformation errors on the finest mesh size that has both, for the beam with most scenes."""
    loads = [load for load in TABLE_LOADS if load in root["load"].values]
    fine, height = min(root.mesh_size.values), float(root.beam_height.sel(beam=beam))
    here, moduli_here = root.sel(mesh_type=mesh_type, beam=beam), moduli.sel(mesh_type=mesh_type)
    ratios = [ratio for ratio in materials if ratio in moduli.poisson_ratio.values]
    heads = [f"E at {nu:g}" for nu in ratios] + [f"ν at {nu:g}" for nu in ratios]
    heads += [f"{load}, {nu:g}" for load in loads for nu in materials]
    rows = []
    for name in (name for name in root.definition.values if name in moduli.definition.values):
        patch, scenes = moduli_here.sel(definition=name), here.sel(definition=name)
        both = (patch.status == 1).any("poisson_ratio") & (scenes.status == 1).any(["material", "load"])
        if not both.any():
            continue
        size = float(both.mesh_size[both.values].min())
        patch, scene = patch.sel(mesh_size=size), scenes.sel(mesh_size=size)
        errors = scene.deformation_error.sel(load=loads, material=list(materials.values()))
        cells = [_signed(patch.young_modulus_error.sel(poisson_ratio=nu)) for nu in ratios]
        cells += [cell_number(patch.effective_poisson_ratio.sel(poisson_ratio=nu), ".3f") for nu in ratios]
        cells += [_signed(error) for error in errors.transpose("load", "material").values.flat]
        seconds = float(scene.definition_seconds.max())
        cells.append(f"{1e3 * seconds:.0f} ms" if seconds >= 5e-4 else "< 1 ms")
        mark = "" if size == fine else f" ({1e3 * size:g} mm)"
        rows.append([f"`{name}`{mark}", *cells])
    if not rows:
        return []
    sides = [moduli.attrs[f"patch_{part}"] for part in ("length", "height")]
    same = np.allclose(sides, [float(root[f"beam_{part}"].sel(beam=beam)) for part in ("length", "height")], atol=0)
    extent = " x ".join(f"{1e3 * side:g}" for side in sides) + " mm"
    of = f"beam of {extent}" if same else f"beam {beam}; moduli are of the meshes of a {extent} sheet"
    note = f"All at {1e3 * fine:g} mm (a/H = {fine / height:.3g}), but where a row says otherwise; {of}."
    table = markdown_table(["definition", *heads, "cost"], rows)
    return [*markdown_section(f"Mesh type `{mesh_type}`", note), *table, ""]


def _paper_cells(root):
    """Median and largest error over beams, mesh sizes and the paper's three loads and materials."""
    pairs = (("steel", "traction"), ("steel", "compression"), ("rubber", "traction"))
    known = {*root.material.values, *root["load"].values}
    if not {name for pair in pairs for name in pair} <= known:
        return []
    errors = [root.deformation_error.sel(material=material, load=load) for material, load in pairs]
    rows, heads = [], ["definition", "mesh type", "steel, median", "largest", "rubber, median", "largest"]
    for name in root.definition.values:
        for mesh_type in root.mesh_type.values:
            found = [error.sel(definition=name, mesh_type=mesh_type).values.ravel() for error in errors]
            if np.isfinite(found[2]).any():
                texts = []
                for values in (np.concatenate(found[:2]), found[2]):
                    values = 100 * np.abs(values[np.isfinite(values)])
                    texts += [f"{np.median(values):.2f} %", f"{values.max():.2f} %"]
                rows.append([f"`{name}`", mesh_type, *texts])
    return [*markdown_section("The paper's cells"), *markdown_table(heads, rows, 2), ""]


def _signed(value):
    return "0.0 %" if abs(100 * float(value)) < 0.05 else cell_number(value, "+.1f", 100, " %")
