"""Tables of scenes: a row a beam and mesh size, a column a definition."""

import numpy as np
import xarray as xr

from springtune.problem.loads import LOADS
from springtune.problem.parameters import SWEPT

from ...output.dataset import STATUS
from ...output.selection import OWN_LAWS, of_own_law, records
from .outputs import SWEPT_SHOWN, TABLE, stem

ROW = ("beam", "mesh_size")


def tables(tree):
    """Tables of the page: the paper's, and those of references at finite strain and of pressed faces."""
    root = tree.to_dataset()
    if "status" not in root:  # a study without scenes
        return []
    finite = _finite(tree)
    found = [_table(root.sel(selection), selection, finite) for selection in _selections(root)]
    found.sort(key=lambda table: (table["number"] is None, table["number"], table["stem"]))
    groups = {"finite_strain": _finite_strain, "block": _block}
    return found + [table(tree[name].to_dataset(), root) for name, table in groups.items() if name in tree]


OF_ROWS = (
    *("status", "message", "stiffness", "displacement", "deformation_error", "force"),
    *("reference_displacement", "reference_message", "reference_applies"),
    *("finite_reference_displacement", "finite_deformation_error", "finite_reference_message"),
    *(
        "paper_stiffness",
        "paper_reference_displacement",
        "paper_displacement",
        "paper_deformation_error",
        "paper_remark",
    ),
)
"""Variables that the rows are made of."""


def _read(array):
    """Read an array; texts one beam at a time, since netCDF takes ten times their room."""
    if array.dtype != object or "beam" not in array.dims:
        return array.variable
    each = [array.variable.isel(beam=[number]).values for number in range(array.sizes["beam"])]
    return array.variable.copy(data=np.concatenate(each, axis=array.dims.index("beam")))


def _selections(root):
    requested = (root.status != 0).any([dimension for dimension in root.status.dims if dimension not in TABLE])
    requested = requested.stack(cell=TABLE)
    return [dict(zip(TABLE, map(str, cell))) for cell in requested.cell.values[requested.values]]


def _finite(tree):
    """References at finite strain and the errors against them; None without any."""
    found = tree["finite_strain"].to_dataset() if "finite_strain" in tree else None
    found = None if found is None else of_own_law(found)
    if found is None:
        return None
    names = ("reference_displacement", "deformation_error", "reference_message")
    return found[list(names)].rename({name: f"finite_{name}" for name in names})


def _table(cells, selection, finite=None):
    numbers = np.unique(cells.paper_table.values[np.isfinite(cells.paper_table.values)])
    number = int(numbers[0]) if len(numbers) == 1 else None
    # Plain arrays: selecting each cell of a dataset takes a thousand times as long.
    swept = [name for name in SWEPT if name in cells.status.dims]
    cells = cells if finite is None else cells.merge(finite.sel(selection), join="exact", compat="override")
    order = (*ROW, *swept, "kinematics", "definition")
    shown = (cells[name] for name in OF_ROWS if name in cells)
    arrays = {array.name: _read(array).transpose(..., *(one for one in order if one in array.dims)) for array in shown}
    values = {name: (array.dims, array.values) for name, array in arrays.items()}
    labels = {name: cells[name].values.tolist() for name in order}
    requested = values["status"][1] != 0
    places = np.argwhere(requested.any(axis=(-2, -1)))
    rows = [
        _row(values, labels, dict(zip(order, place)), swept, LOADS[selection["load"]].sign) for place in places.tolist()
    ]
    present = requested.any(axis=tuple(range(requested.ndim - 1)))
    definitions = [name for name, there in zip(labels["definition"], present) if there]
    found = {"number": number, "stem": stem(selection, number), "rows": rows, "definitions": definitions}
    return found | {"swept": [SWEPT_SHOWN[name][1] for name in swept if name != "force"], **selection}


def _row(values, labels, place, swept, sign):
    def value(name, **further):
        dimensions, array = values[name]
        return array[tuple((place | further)[dimension] for dimension in dimensions)]

    row = {
        "beam": labels["beam"][place["beam"]],
        "mesh_size_mm": 1e3 * labels["mesh_size"][place["mesh_size"]],
        "force_N": sign * labels["force"][place["force"]] if "force" in swept else float(value("force")),
    }
    row |= _swept({name: labels[name][place[name]] for name in swept if name != "force"})
    row |= {
        "printed_stiffness_N_per_m": float(value("paper_stiffness")),
        "printed_reference_mm": 1e3 * float(value("paper_reference_displacement")),
        "printed_displacement_mm": 1e3 * float(value("paper_displacement")),
        "printed_error_percent": 100 * float(value("paper_deformation_error")),
        "reference_mm": 1e3 * float(value("reference_displacement")),
        "reference_message": str(value("reference_message")),
    }
    against = {}  # finite strain, by kinematics
    for k, kinematics in enumerate(labels["kinematics"]):
        row[f"reference_applies_{kinematics}"] = "yes" if value("reference_applies", kinematics=k) == 1 else "no"
        if kinematics != "linear" and "finite_reference_displacement" in values:
            reference = 1e3 * float(value("finite_reference_displacement"))
            against[kinematics] = row[f"reference_{kinematics}_mm"] = reference
            row[f"reference_applies_{kinematics}"] = "yes" if np.isfinite(reference) else "no"
            if np.isfinite(row["reference_mm"]):  # else it says why there is none
                row["reference_message"] = str(value("finite_reference_message"))
        for d, definition in enumerate(labels["definition"]):
            one = {"kinematics": k, "definition": d}
            status = STATUS[int(value("status", **one))]
            if status == "not_requested":
                continue
            name = f"{definition}_{kinematics}"
            row[f"{name}_stiffness_N_per_m"] = float(value("stiffness", **one))
            row[f"{name}_mm"] = 1e3 * float(value("displacement", **one))
            error = "finite_deformation_error" if kinematics in against else "deformation_error"
            row[f"{name}_error_percent"] = 100 * float(value(error, **one))
            row[f"{name}_status"] = status
            row[f"{name}_message"] = str(value("message", **one))
    row["remark"] = str(value("paper_remark"))
    return row


def _swept(labels):
    """Columns of swept parameters from the labels of a cell."""
    return {column: unit * labels[name] for name, (_, column, unit) in SWEPT_SHOWN.items() if name in labels}


def _rows(data, present, names, network, reference, error):
    """Rows of networks beside references, from present cells."""
    for one in records(data, present, dict.fromkeys((*names, network, reference, error))):
        row = {name: one[name] for name in names} | _swept(one)
        row |= {"mesh_size_mm": 1e3 * one["mesh_size"], "network_mm": 1e3 * one[network]}
        yield row | {"reference_mm": 1e3 * one[reference], "error_percent": 100 * one[error]}


def _finite_strain(finite, root):
    """Networks of nonlinear kinematics against references at finite strain."""
    nonlinear = {"kinematics": np.flatnonzero(finite.kinematics.values != "linear")}
    finite = finite.isel(nonlinear).assign(displacement=root.displacement.isel(nonlinear))
    names = ("material", "load", "beam", "mesh_type", "definition", "reference")
    order = ("material", "load", "beam", "mesh_type", "mesh_size", "definition", "reference", "kinematics")
    present = finite.deformation_error.notnull().transpose(*order, ...)
    rows = list(_rows(finite, present, names, "displacement", "reference_displacement", "deformation_error"))
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
    known, references = block.reference.values.tolist(), block.reference_face_displacement
    laws = [known.index(kind) for kind in OWN_LAWS if kind in known] or [0]
    chosen = xr.full_like(references.isel(reference=0, drop=True), laws[-1], int)
    for law in reversed(laws):
        chosen = chosen.where(references.isel(reference=law, drop=True).isnull(), law)
    chosen = xr.where(block.kinematics == "linear", 0, chosen)
    values = ("face_displacement", "reference_face_displacement", "face_error")
    block = block[[*values]].isel(reference=chosen)
    names = ("beam", "material", "load", "mesh_type", "definition", "kinematics", "reference")
    order = ("material", "load", "mesh_type", "mesh_size", "definition", "kinematics", "beam")
    rows = list(_rows(block, block.face_displacement.notnull().transpose(*order, ...), names, *values))
    note = (
        "Displacement of the middle of the pressed face along the load. Networks of nonlinear kinematics are compared "
        "with the reference at finite strain in plane stress where the study has it, linear ones with that of small "
        "strain; all pairs are in the dataset."
    )
    return {"stem": "block", "title": "The pressed face", "note": note, "rows": rows}
