"""Tables of beams and shapes: one row per network."""

import numpy as np
import pandas as pd
import xarray as xr

from springtune.problem.compare import sign_word
from springtune.problem.loads import LOADS
from springtune.problem.quantities import SWEPT
from springtune.problem.shapes import beam_label

from ...output.dataset import STATUS, against_own_laws, cells, group, in_own_plane, labels_of, records, table_rows
from ...output.present import MOST_ROWS, error_decimals, head
from ...output.text import decimals, number, range_text
from .outputs import BODY_NAMES, SCENE_AXES, SWEPT_SHOWN, TABLE_LABELS, shown_order, stem


def tables(tree):
    """Tables of the page: the paper's, those of references at finite strain and of pressed faces, and of shapes."""
    shapes = [_shape_table(tree)] if "shapes" in tree else []
    root = tree.to_dataset()
    if "status" not in root:  # a study without scenes
        return shapes
    own = own_references(tree)
    found = [_scene_table(own.sel(selection), selection) for selection in cells(own.status != 0, TABLE_LABELS)]
    found.sort(key=lambda table: (table["number"] is None, table["number"], table["stem"]))
    groups = {"finite_strain": _finite_strain_table, "block": _block_table}
    return found + [table(tree[name].to_dataset(), root) for name, table in groups.items() if name in tree] + shapes


def own_references(data):
    """Root with errors of nonlinear networks against references at finite strain, where there are any."""
    finite = data["finite_strain"].to_dataset() if "finite_strain" in getattr(data, "children", ()) else None
    return against_own_laws(group(data, "/"), finite)


def last_swept(present, along=""):
    """Last swept values of each beam, material and load, which figures without a sweep show."""
    names = [str(name) for name in present.dims if name in SWEPT and name != along]
    if not names:
        return {}
    kept = [name for name in ("beam", "material", "load") if name in present.dims]
    there = present.any([name for name in present.dims if name not in (*kept, *names, along)])
    if along in there.dims:
        counts = there.sum(along)
        together = int(counts.max()) == 1 and int((there.any(names).sum(along)).max()) > 1
        kept += [along] if together else []
        there = there if together else (counts > 0) & (counts == counts.max(names))
    # What is shown rather than others comes last.
    ranks = {name: [shown_order(name, value) for value in there[name].values.tolist()] for name in names}
    there = there.isel({name: np.argsort(rank, kind="stable")[::-1] for name, rank in ranks.items()})
    places, coordinates = there.transpose(*kept, *names).argmax(names), {name: there[name].values for name in kept}
    return {name: xr.DataArray(there[name].values[places[name]], coordinates, kept) for name in names}


def at(data, values):
    """Select one swept value for each beam, material and load."""
    chosen = {name: value for name, value in values.items() if name in data.dims}
    if not chosen:
        return data
    found = data.sel(chosen)
    for name in {*BODY_NAMES.values()} & {*found.variables}:  # of a body, and so the same under all loads if unswept
        body = name.partition("_")[0]
        found[name] = found[name].isel({one: -1 for one in found[name].dims if one != body}, drop=True)
    return found.reset_coords([name for name in chosen if name in found.coords])


def beam_title(data, name):
    """Beam name with its dimensions, see `springtune.problem.shapes.beam_label`."""
    if "beam_length" not in data:
        return str(name)
    found = data.sel(beam=name) if "beam" in data.beam_length.dims else data
    return beam_label(str(name), float(found.beam_length), float(found.beam_height))


# -- scenes ------------------------------------------------------------------------------------------------------------

NETWORK_COLUMNS = {
    "printed_stiffness_N_per_m": ("paper_stiffness", 1),
    "printed_reference_mm": ("paper_reference_displacement", 1e3),
    "printed_displacement_mm": ("paper_displacement", 1e3),
    "printed_error_percent": ("paper_deformation_error", 100),
    **{f"{name}_N_per_m": (name, 1) for name in ("stiffness", "stiffness_inside", "stiffness_outline")},
    "stiffness_alike": ("stiffness_alike", 1),
    "network_mm": ("displacement", 1e3),
    "reference_mm": ("reference_displacement", 1e3),
    "error_percent": ("deformation_error", 100),
    **{name: (name, 1) for name in ("reference_applies", "status", "message", "reference_message")},
    "remark": ("paper_remark", 1),
}
"""Columns of a network: variable and factor."""


def _swept_columns(dimensions):
    return {column: (name, unit) for name, (_, column, unit) in SWEPT_SHOWN.items() if name in dimensions}


def _scene_table(data, selection):
    numbers = np.unique(data.paper_table.values[np.isfinite(data.paper_table.values)])
    number = int(numbers[0]) if len(numbers) == 1 else None
    swept = [name for name in SWEPT if name in data.status.dims]
    sign = LOADS[selection["load"]].sign if "force" in swept else 1.0
    columns = {"mesh_size_mm": ("mesh_size", 1e3)} | _swept_columns(swept) | {"force_N": ("force", sign)}
    present = (data.status != 0).transpose("beam", "mesh_size", *swept, "kinematics", "definition")
    rows = table_rows(data, present, ("beam", "kinematics", "definition"), columns | NETWORK_COLUMNS)
    words = {-1: "unknown", 0: "no", 1: "yes"}
    for row in rows:
        row |= {"status": STATUS[row["status"]], "reference_applies": words[int(row["reference_applies"])]}
    title = f"{selection['load']}, {selection['mesh_type']} mesh, {selection['material']}"
    found = {"stem": stem(selection, number), "title": f"Table {number}: {title}" if number else title}
    shown = _page_cells(rows, labels_of(present, "definition"), _swept_columns(swept), "finite_strain" in data.attrs)
    return found | {"number": number, "rows": rows, "note": _stiffnesses(rows)} | shown


STATUS_MARKS = {"solved": "", "unstable": "u", "linear_only": "l"}  # marks of networks with a displacement, by status


def _page_cells(rows, definitions, swept, finite):
    """Cells of the page, a line for each mesh, load and kinematics, two columns per definition, the best first."""
    data = pd.DataFrame(rows)
    length = decimals(data[["network_mm", "reference_mm"]].to_numpy().ravel())
    percent, printed = error_decimals(data["error_percent"]), data["printed_displacement_mm"].notna().any()
    alike = data.groupby(["beam", "kinematics", "reference_message"])[[*swept]].nunique().to_dict("index")
    lines, marks, remarks = {}, set(), {}
    for row in rows[:MOST_ROWS]:
        beam, size, status = row["beam"], f"{row['mesh_size_mm']:g}", row["status"]
        force = f"{row['force_N']:g}".replace("-", "−")
        line = {("", "Beam"): beam, ("", "Mesh [mm]"): size, ("", "Force [N]"): force}
        line |= {("", head(name)): f"{row[name]:.6g}" for name in swept if name != "force_N"}
        line = lines.setdefault((*line.values(), row["kinematics"]), line)
        if printed:
            remark = "*" if row["remark"] else ""
            names = {"FEM [mm]": ("reference_mm", 3, ""), "network [mm]": ("displacement_mm", 2, "")}
            for name, (column, places, mark) in (names | {"error [%]": ("error_percent", 2, remark)}).items():
                line["Paper, as printed", name] = number(row[f"printed_{column}"], places) + mark
        own = "f" if finite and row["kinematics"] != "linear" else ""
        own += "" if row["reference_applies"] == "yes" else "r"
        line["", "Reference [mm]"] = number(row["reference_mm"], length) + own
        line["", "Kinematics"] = row["kinematics"]
        answered = status in STATUS_MARKS and np.isfinite(row["network_mm"])  # beyond a limit point there is none
        text = number(row["network_mm"], length) + STATUS_MARKS[status] if answered else status.replace("_", " ")
        line[row["definition"], "[mm]"] = text
        line[row["definition"], "error [%]"] = number(row["error_percent"], percent, sign=True) if answered else ""
        marks |= {*own, *(STATUS_MARKS[status] if answered else ""), *("*" if row["remark"] else "")}
        reasons = {f"* {beam}, {size} mm": row["remark"], text: "" if answered else row["message"]}
        label, why = (beam, row["kinematics"]), row["reference_message"]
        place = [f"{head(name)} {row[name]:.6g}" for name in swept if alike[*label, why][name] == 1]
        reasons[f"r {', '.join([*label, *place])}"] = why if "r" in own else ""
        remarks |= {f"{what}: {why}": None for what, why in reasons.items() if why}
    medians = data["error_percent"].abs().groupby(data["definition"]).median()
    best = sorted(definitions, key=lambda name: (np.isnan(medians[name]), medians[name]))
    columns = [(name, unit) for name in best for unit in ("[mm]", "error [%]")]
    shown = pd.DataFrame(list(lines.values()))
    marks |= {"e"} if shown.isna().to_numpy().any() else set()
    shown = shown[[*(column for column in shown.columns if column not in columns), *columns]].fillna("")
    shown.columns = pd.MultiIndex.from_tuples(shown.columns)
    return {"shown": shown, "marks": marks, "remarks": list(remarks)}


def _stiffnesses(rows):
    """Text with the stiffness to type: of uniform definitions one, of others those inside and on the outline."""
    parts = []
    for name, own in pd.DataFrame(rows).groupby("definition", sort=False):
        words = {"stiffness_inside_N_per_m": " inside", "stiffness_outline_N_per_m": " on the outline"}
        words = {"stiffness_N_per_m": ""} if own["stiffness_N_per_m"].notna().any() else words
        alike = own[own["stiffness_alike"] != 0]
        found = {word: alike[column].dropna() for column, word in words.items() if alike[column].notna().any()}
        texts = [f"{range_text(values)} N/m{word}" for word, values in found.items()]
        parts += [f"{name}: k = {', '.join(texts)}"] if texts else []
        parts += [f"{name}: each spring its own k"] if (own["stiffness_alike"] == 0).any() else []
    return "; ".join(parts)


# -- further tables ----------------------------------------------------------------------------------------------------


def _rows(data, present, order, network, reference, error):
    """Rows of networks beside references, from present cells."""
    columns = _swept_columns(present.dims) | {"mesh_size_mm": ("mesh_size", 1e3), "network_mm": (network, 1e3)}
    columns |= {"reference_mm": (reference, 1e3), "error_percent": (error, 100)}
    names = ("beam", "material", "load", "mesh_type", "definition", "kinematics", "reference")
    return table_rows(data, present.transpose(*order, ...), names, columns)


def _finite_strain_table(finite, root):
    """Networks of nonlinear kinematics against references at finite strain."""
    finite = in_own_plane(finite).assign(displacement=root.displacement)
    order = ("material", "load", "beam", "mesh_type", "mesh_size", "definition", "reference", "kinematics")
    present = finite.deformation_error.notnull() & (finite.kinematics != "linear")
    rows = _rows(finite, present, order, "displacement", "reference_displacement", "deformation_error")
    note = (
        "Networks of nonlinear kinematics against finite elements of rubber: neo-Hookean, or of the law fitted to a "
        "uniaxial test. At finite strain an error includes the difference of the two material laws. Networks are in "
        "the plane of their material: an error against the other plane includes that difference, too."
    )
    lacking = [text for text in np.unique(finite.reference_message.values.astype(str)) if text]
    note += "".join(f" No reference: {text}." for text in lacking)
    return {"stem": "finite_strain", "title": "Against references at finite strain", "note": note, "rows": rows}


def _block_table(block, root):
    """Middle of the pressed face: linear networks against small strain, others against finite strain if known."""
    block = in_own_plane(block)
    order = ("material", "load", "mesh_type", "mesh_size", "definition", "kinematics", "beam")
    present = block.face_error.notnull()
    if block.sizes["reference"] > 1:
        present &= (block.kinematics == "linear") == (block.reference == block.reference[0])
    rows = _rows(block, present, order, "face_displacement", "reference_face_displacement", "face_error")
    note = (
        "Displacement of the middle of the pressed face along the load. Networks of nonlinear kinematics are compared "
        "with references at finite strain where the study has them, linear ones with small strain."
    )
    return {"stem": "block", "title": "The pressed face", "note": note, "rows": rows}


SHAPE_COLUMNS = ("shape", "load", "quantity", "definition", "kinematics", "material", "mesh_type")
"""First columns of the table of shapes."""

SHAPE_ERRORS = ("error", "expected_error", "reference_error_estimate")

FITTING_UNITS = {"m": {"mm": 1e-3, "um": 1e-6}, "Pa": {"MPa": 1e6, "kPa": 1e3}, "m2": {"mm2": 1e-6}, "J": {"mJ": 1e-3}}
"""Units of quantities for readers, the largest first."""


def _in_fitting_unit(row):
    """Row of a quantity in the largest unit in which its reference, or itself, is above a tenth; the error's sign."""
    row["sign"] = sign_word(row["error_percent"], row["reference"], row.pop("kind"))
    size = next((abs(row[name]) for name in ("reference", "expected", "value") if abs(row[name]) > 0), 1.0)
    units = FITTING_UNITS.get(row["units"], {row["units"]: 1.0})
    unit = next((name for name, factor in units.items() if size >= 0.1 * factor), [*units][-1])
    length = 1e3 * row.pop("edge_length")
    row["mesh_size_mm"] = row["mesh_size_mm"] or length  # 0 of a mesh file
    scaled = {name: row[name] / units[unit] for name in ("value", "reference", "expected")}
    return row | scaled | {"units": unit, "status": STATUS[row["status"]]}


def _shape_table(tree):
    data = tree["shapes"].to_dataset()
    present = ((data.status != 0) & (data.quantity_kind != "")).transpose(*SCENE_AXES, "quantity")
    columns = {"mesh_size_mm": ("mesh_size", 1e3), "particles": ("particles", 1), "value": ("value", 1)}
    columns |= {"reference": ("reference_value", 1), "expected": ("expected_value", 1), "units": ("quantity_units", 1)}
    columns |= {f"{name}_percent": (name, 100) for name in SHAPE_ERRORS}
    columns |= {"sign": ("quantity_kind", 1), "kind": ("quantity_kind", 1)}
    columns |= {name: (name, 1) for name in ("edge_length", "status", "message")}
    rows = [_in_fitting_unit(row) for row in table_rows(data, present, SHAPE_COLUMNS, columns)]
    cited = (one for one in records(data, present, ["source"]) if one["source"])
    sources = dict.fromkeys(f"{one['shape']}, {one['quantity']}: {one['source']}" for one in cited)
    strained = tree.attrs.get("plane_strain")
    note = (
        "Quantities of interest of the networks; the reference is small-strain plane stress "
        f"{f'(plane strain of {strained}) ' if strained else ''}by converged finite elements on the same shape, and "
        "errors are signed: (network − reference) / |reference|, and the same against published values."
    )
    note += f" Sources: {'; '.join(sources)}." if sources else ""
    return {"stem": "shapes", "title": "Shapes", "note": note, "rows": rows}
