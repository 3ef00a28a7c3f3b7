"""Tables of scenes: a row a beam and mesh size, a column a definition."""

import numpy as np
import pandas as pd
import xarray as xr

from springtune.problem.loads import LOADS
from springtune.problem.parameters import SWEPT

from ...output.dataset import STATUS
from ...output.page import MOST_ROWS, error_decimals, head
from ...output.selection import cells, labels_of, listed, of_own_law, own_laws, records
from ...output.text import decimals, number
from .outputs import SCENE_AXES, SWEPT_SHOWN, TABLE, stem

ROW = ("beam", "mesh_size")


def tables(tree):
    """Tables of the page: the paper's, those of references at finite strain and of pressed faces, and of shapes."""
    shapes = [_shapes(tree)] if "shapes" in tree else []
    root = tree.to_dataset()
    if "status" not in root:  # a study without scenes
        return shapes
    finite = _finite(tree)
    found = [_table(root.sel(selection), selection, finite) for selection in cells(root.status != 0, TABLE)]
    found.sort(key=lambda table: (table["number"] is None, table["number"], table["stem"]))
    groups = {"finite_strain": _finite_strain, "block": _block}
    return found + [table(tree[name].to_dataset(), root) for name, table in groups.items() if name in tree] + shapes


def _finite(tree):
    """References at finite strain and the errors against them; None without any."""
    found = tree["finite_strain"].to_dataset() if "finite_strain" in tree else None
    found = None if found is None else of_own_law(found)
    if found is None:
        return None
    names = ("reference_displacement", "deformation_error", "reference_message")
    return found[list(names)].rename({name: f"finite_{name}" for name in names})


OF_ROW = ("paper_stiffness", "paper_reference_displacement", "paper_displacement", "paper_deformation_error",
          "paper_remark", "reference_displacement", "reference_message", "reference_applies",
          "finite_reference_displacement", "finite_reference_message")  # fmt: skip
OF_NETWORK = ("status", "message", "stiffness", "displacement", "deformation_error", "finite_deformation_error")
"""Variables of a scene, and those of a network."""


def _table(data, selection, finite=None):
    numbers = np.unique(data.paper_table.values[np.isfinite(data.paper_table.values)])
    number = int(numbers[0]) if len(numbers) == 1 else None
    swept = [name for name in SWEPT if name in data.status.dims]
    data = data if finite is None else data.merge(finite.sel(selection), join="exact", compat="override")
    place = (*ROW, *swept)
    asked = (data.status != 0).transpose(*place, "kinematics", "definition")
    scenes = asked.any(["kinematics", "definition"]).expand_dims(kinematics=data.kinematics, axis=len(place))
    force = () if "force" in swept else ("force",)
    rows = {}
    for one in records(data, scenes, [name for name in (*OF_ROW, *force) if name in data]):
        row = rows.setdefault(tuple(one[name] for name in place), _row(one, swept, LOADS[selection["load"]].sign))
        applies, kinematics = one["reference_applies"] == 1, one["kinematics"]
        if finite is not None and kinematics != "linear":
            row[f"reference_{kinematics}_mm"] = 1e3 * one["finite_reference_displacement"]
            applies = np.isfinite(one["finite_reference_displacement"])
            if np.isfinite(row["reference_mm"]):  # else it says why there is none
                row["reference_message"] = str(one["finite_reference_message"])
        row[f"reference_applies_{kinematics}"] = "yes" if applies else "no"
    for one in records(data, asked, [name for name in OF_NETWORK if name in data]):
        name = f"{one['definition']}_{one['kinematics']}"
        against_finite = finite is not None and one["kinematics"] != "linear"
        error = one["finite_deformation_error" if against_finite else "deformation_error"]
        rows[tuple(one[name] for name in place)] |= {
            f"{name}_stiffness_N_per_m": one["stiffness"],
            f"{name}_mm": 1e3 * one["displacement"],
            f"{name}_error_percent": 100 * error,
            f"{name}_status": STATUS[int(one["status"])],
            f"{name}_message": str(one["message"]),
        }
    definitions, kinematics = labels_of(asked, "definition"), labels_of(asked, "kinematics")
    title = f"{selection['load']}, {selection['mesh_type']} mesh, {selection['material']}"
    found = {"stem": stem(selection, number), "title": f"Table {number}: {title}" if number else title}
    columns = [SWEPT_SHOWN[name][1] for name in swept if name != "force"]
    listed = list(rows.values())
    return found | {"number": number, "rows": listed} | _shown(listed, definitions, kinematics, columns)


def _row(one, swept, sign):
    """Columns of a scene."""
    return {
        "beam": one["beam"],
        "mesh_size_mm": 1e3 * one["mesh_size"],
        "force_N": (sign if "force" in swept else 1.0) * one["force"],
        **{column: unit * one[name] for column, (name, unit) in _swept(swept).items() if name != "force"},
        "printed_stiffness_N_per_m": one["paper_stiffness"],
        "printed_reference_mm": 1e3 * one["paper_reference_displacement"],
        "printed_displacement_mm": 1e3 * one["paper_displacement"],
        "printed_error_percent": 100 * one["paper_deformation_error"],
        "reference_mm": 1e3 * one["reference_displacement"],
        "reference_message": str(one["reference_message"]),
        "remark": str(one["paper_remark"]),
    }


# -- on the page -------------------------------------------------------------------------------------------------------

ANSWERED = {"solved": "", "unstable": "u", "linear_only": "l"}
"""Marks of networks with a displacement, by status."""


def _shown(rows, definitions, kinematics, swept):
    """Cells of the page: a line for each row and kinematics, two columns a definition; marks in use, and remarks."""
    data = pd.DataFrame(rows)
    length = decimals(data.filter(regex="^(?!printed|mesh_size).*_mm$").to_numpy().ravel())
    percent = error_decimals(data.filter(regex="^(?!printed).*_error_percent$").to_numpy().ravel())
    printed = data["printed_displacement_mm"].notna().any()
    lines, marks, remarks = [], set(), {}
    for row in rows[:MOST_ROWS]:
        first = {"Beam": row["beam"], "Mesh [mm]": f"{row['mesh_size_mm']:g}", "Force [N]": f"{row['force_N']:g}"}
        first |= {head(name): f"{row[name]:.6g}" for name in swept}
        first = {("", name): text.replace("-", "−") if name == "Force [N]" else text for name, text in first.items()}
        if printed:
            remark = "*" if row["remark"] else ""
            names = {"FEM [mm]": ("reference_mm", 3, ""), "network [mm]": ("displacement_mm", 2, "")}
            for name, (column, places, mark) in (names | {"error [%]": ("error_percent", 2, remark)}).items():
                first["Paper, as printed", name] = number(row[f"printed_{column}"], places) + mark
        if row["remark"]:
            remarks[f"* {row['beam']}, {row['mesh_size_mm']:g} mm: {row['remark']}"] = None
        for one in kinematics:
            if not any(f"{definition}_{one}_status" in row for definition in definitions):
                continue
            own = f"reference_{one}_mm" in row
            objected = row[f"reference_applies_{one}"] == "no"
            mark = "f" * own + "r" * objected
            marks |= {*mark}
            if objected:
                remarks[f"r {row['beam']}, {one}: {row['reference_message']}"] = None
            reference = number(row[f"reference_{one}_mm" if own else "reference_mm"], length)
            line = first | {("", "Reference [mm]"): reference + mark, ("", "Kinematics"): one}
            for definition in definitions:
                name = f"{definition}_{one}"
                status, displacement = row.get(f"{name}_status", "not_asked"), row.get(f"{name}_mm", np.nan)
                if status in ANSWERED and np.isfinite(displacement):  # beyond a limit point there is none
                    marks |= {*ANSWERED[status]}
                    texts = number(displacement, length), number(row[f"{name}_error_percent"], percent, sign=True)
                    line |= {(definition, "[mm]"): texts[0] + ANSWERED[status], (definition, "error [%]"): texts[1]}
                else:
                    words, message = status.replace("_", " "), row.get(f"{name}_message", "")
                    line |= {(definition, "[mm]"): words, (definition, "error [%]"): ""}
                    remarks |= {f"{words}: {message}": None} if message else {}
            lines.append(line)
    marks |= {"*"} if data["remark"].any() else set()
    note = "; ".join(_stiffnesses(data, definitions, kinematics))
    shown = pd.DataFrame(lines)
    shown.columns = pd.MultiIndex.from_tuples(shown.columns)
    return {"shown": shown, "marks": marks, "remarks": list(remarks), "note": note}


def _stiffnesses(data, definitions, kinematics):
    """Uniform stiffnesses of a table's networks."""
    for definition in definitions:
        texts = {}
        for name in kinematics:
            known = data.get(f"{definition}_{name}_stiffness_N_per_m", pd.Series(dtype=float)).dropna()
            if len(known):
                texts[name] = " to ".join(dict.fromkeys(f"{value:.4g}" for value in (known.min(), known.max())))
        if len(set(texts.values())) == 1:
            yield f"{definition}: k = {next(iter(texts.values()))} N/m"
        else:
            yield from (f"{definition}, {name}: k = {text} N/m" for name, text in texts.items())


# -- further tables ----------------------------------------------------------------------------------------------------


def _rows(data, present, names, network, reference, error):
    """Rows of networks beside references, from present cells."""
    columns = _swept(present.dims) | {"mesh_size_mm": ("mesh_size", 1e3), "network_mm": (network, 1e3)}
    columns |= {"reference_mm": (reference, 1e3), "error_percent": (error, 100)}
    return listed(data, present, [*names, "reference"], columns)


def _swept(dimensions):
    """Swept parameters and their units, by column."""
    return {column: (name, unit) for name, (_, column, unit) in SWEPT_SHOWN.items() if name in dimensions}


def _finite_strain(finite, root):
    """Networks of nonlinear kinematics against references at finite strain."""
    nonlinear = {"kinematics": np.flatnonzero(finite.kinematics.values != "linear")}
    finite = finite.isel(nonlinear).assign(displacement=root.displacement.isel(nonlinear))
    names = ("material", "load", "beam", "mesh_type", "definition")
    order = ("material", "load", "beam", "mesh_type", "mesh_size", "definition", "reference", "kinematics")
    present = finite.deformation_error.notnull().transpose(*order, ...)
    rows = _rows(finite, present, names, "displacement", "reference_displacement", "deformation_error")
    note = (
        "Networks of nonlinear kinematics against finite elements of rubber: neo-Hookean ones, or of the law that is "
        "fitted to a uniaxial test. At finite strain an error holds the difference of two material laws, where "
        "there are two; where a slender beam turns and hardly stretches, it does not. Networks are in the "
        "plane of their material, plane stress by default: an error against the other one holds that difference, too."
    )
    lacking = [text for text in np.unique(finite.reference_message.values.astype(str)) if text]
    note += "".join(f" No reference: {text}." for text in lacking)
    return {"stem": "finite_strain", "title": "Against references at finite strain", "note": note, "rows": rows}


def _block(block, root):
    """Middle of the pressed face, every definition, mesh, material and kinematics, beside its own law."""
    kinds, block = own_laws(block)
    known, references = block.reference.values.tolist(), block.reference_face_displacement
    laws = [known.index(kind) for kind in kinds] or [0]
    chosen = xr.full_like(references.isel(reference=0, drop=True), laws[-1], int)
    for law in reversed(laws):
        chosen = chosen.where(references.isel(reference=law, drop=True).isnull(), law)
    chosen = xr.where(block.kinematics == "linear", 0, chosen)
    values = ("face_displacement", "reference_face_displacement", "face_error")
    block = block[[*values]].isel(reference=chosen)
    names = ("beam", "material", "load", "mesh_type", "definition", "kinematics")
    order = ("material", "load", "mesh_type", "mesh_size", "definition", "kinematics", "beam")
    rows = _rows(block, block.face_displacement.notnull().transpose(*order, ...), names, *values)
    note = (
        "Displacement of the middle of the pressed face along the load. Networks of nonlinear kinematics are compared "
        "with the reference at finite strain in their material's plane where the study has it, linear ones with that "
        "of small strain; all pairs are in the dataset."
    )
    return {"stem": "block", "title": "The pressed face", "note": note, "rows": rows}


SHAPE_COLUMNS = ("shape", "load", "quantity", "definition", "kinematics", "material", "mesh_type")
"""First columns: what a value is of."""

SHAPE_ERRORS = ("error", "expected_error", "reference_error_estimate")


def _shapes(tree):
    """Table of the quantities of shapes."""
    data = tree["shapes"].to_dataset()
    present = (data.status != 0).transpose(*SCENE_AXES) & (data.quantity_kind != "")
    present = present.transpose(*SCENE_AXES, "quantity")
    columns = {"mesh_size_mm": ("mesh_size", 1e3), "particles": ("particles", 1), "value": ("value", 1)}
    columns |= {"reference": ("reference_value", 1), "expected": ("expected_value", 1), "units": ("quantity_units", 1)}
    columns |= {f"{name}_percent": (name, 100) for name in SHAPE_ERRORS}
    columns |= {name: (name, 1) for name in ("status", "message")}
    rows = [row | {"status": STATUS[row["status"]]} for row in listed(data, present, SHAPE_COLUMNS, columns)]
    cited = (one for one in records(data, present, ["source"]) if one["source"])
    sources = dict.fromkeys(f"{one['shape']}, {one['quantity']}: {one['source']}" for one in cited)
    strained = tree.attrs.get("plane_strain")
    note = (
        "Quantities of interest of the networks, in SI units; the reference is small-strain plane stress "
        f"{f'(plane strain of {strained}) ' if strained else ''}by converged finite elements on the same shape, and "
        "errors are signed: (network − reference) / |reference|, and the same against the expected values that others "
        "give."
    )
    told = "; ".join(sources)
    return {"stem": "shapes", "title": "Shapes", "note": f"{note} Sources: {told}." if told else note, "rows": rows}
