"""Refinements: the group ``/refinement``, and tables of its values and of where errors are zero or the tolerance."""

from itertools import product
from pathlib import Path

import numpy as np

from springtune.safe_io.atomic import write_text

from ...output.dataset import STATUS, Filler, Group
from ...output.selection import records
from ...output.text import csv_text
from ...runs import store
from .batches import crossings, refine, value_key
from .kind import file_key
from .outputs import REFINEMENT_TABLES, SPACINGS, VARIED

OF_ONE, OF_EACH = ("refinement",), ("refinement", "definition")
VALUE, CROSSING = (*OF_EACH, "point"), (*OF_EACH, "crossing")

COORDINATES = (*(f"refined_{name}" for name in VARIED), "batch", "parameter")
"""Auxiliary coordinates."""


def _of_parameter(name):
    """Variables of what is varied."""
    known = VARIED[name]
    return {
        f"refined_{name}": (VALUE, known.unit, f"{known.meaning}, where it is varied", np.nan),
        f"crossing_{name}": (CROSSING, known.unit, f"{known.meaning} at which the error is crossed", np.nan),
        f"crossing_{name}_width": (CROSSING, known.unit, "distance of the values that enclose it", np.nan),
    }


OF_PARAMETERS = {variable: row for name in VARIED for variable, row in _of_parameter(name).items()}

REFINEMENT = Group(
    "/refinement",
    {
        "parameter": (OF_ONE, "1", "what is varied", ""),
        "scene": (OF_ONE, "1", "the scene of which it is varied: beam, mesh, material, load and kinematics", ""),
        "spacing": (OF_ONE, "1", "whether values or their logarithms are evenly spaced", ""),
        "tolerance": (OF_ONE, "1", "size of the error that matters", np.nan),
        "value_count": (OF_EACH, "1", "number of values", 0),
        "halved": (OF_EACH, "1", "batches after the first one", 0),
        **{name: row for name, row in OF_PARAMETERS.items() if row[0] == VALUE},
        "batch": (VALUE, "1", "batch that the value came in, from 0; -1 where there is no value", -1),
        "displacement": (VALUE, "m", "displacement of the network", np.nan),
        "reference_displacement": (VALUE, "m", "displacement of the reference", np.nan),
        "reference_error_estimate": (VALUE, "1", "bound on the relative error of the reference", np.nan),
        "reference_applies": (VALUE, "1", "whether small strain applies; -1 where there is no reference", -1),
        "deformation_error": (VALUE, "1", "(network - reference) / |reference|", np.nan),
        "particles": (VALUE, "1", "number of particles", 0),
        "status": (VALUE, "1", "what became of the scene", 0),
        "message": (VALUE, "1", "why the scene is not solved, or its reference does not apply", ""),
        "crossing_level": (CROSSING, "1", "error that is crossed: zero, or the tolerance", np.nan),
        **{name: row for name, row in OF_PARAMETERS.items() if row[0] == CROSSING},
        "crossing_change": (CROSSING, "1", "change of the error between the enclosing values", np.nan),
    },
    dimensions={
        "refinement": "refinement, by name",
        "point": "number of a value, in the order of their addition",
        "crossing": "number of a crossing, ascending",
    },
)
"""The group with all parameters; a study has the variables of those that it varies."""

VALUE_NUMBERS = ("displacement", "reference_displacement", "reference_error_estimate", "deformation_error", "particles")
"""Numbers of a value's result that the dataset and the table have."""


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    part = study.parts["refinement"]
    found = [_read(one, folder / "refinement") for one in part]
    lengths = {
        "point": max(len(places) for places, *_ in found),
        "crossing": max(1, *(len(where) for *_, where in found)),
    }
    axes = study.axes | {name: tuple(range(length)) for name, length in lengths.items()}
    own = {variable for one in part for variable in _of_parameter(one.parameter)}
    data = Filler(REFINEMENT.empty(axes, REFINEMENT.variables.keys() - OF_PARAMETERS.keys() | own))
    for one, values in zip(part, found):
        _put(one, *values, data)
    return {REFINEMENT.name: data.data.set_coords([name for name in COORDINATES if name in data.data])}


def _read(one, folder):
    """Places, batches and results of a refinement's values, and its crossings: the loop again, on what is stored."""
    file, results = file_key(one), []

    def errors(values):
        keys = [value_key(file, value) for value in values]
        known = store.read(folder / f"{file}.h5", keys)
        results.extend(known[key] for key in keys)
        return [known[key].get("deformation_error", np.nan) for key in keys]

    places, batches, found = refine(one.rule, errors)
    return places, batches, results, crossings(one.rule, places, found)


def _scene(one):
    """What a refinement does not vary, in words."""
    said = {"mesh_size": f"{one.mesh_type} mesh", "force": one.load}
    for name, given in (("mesh_size", one.mesh_size), ("force", abs(one.force))):
        if name != one.parameter:
            unit, size = VARIED[name].scale(given)
            said[name] += f" {given / size:.6g} {unit}"
    return ", ".join((one.beam.name, said["mesh_size"], one.material.name, said["force"], one.kinematics))


def _put(one, places, batches, results, where, data):
    labels = {"refinement": one.name, "definition": one.definition}
    about = {"parameter": one.parameter, "tolerance": one.rule.tolerance, "spacing": SPACINGS[one.rule.logarithmic]}
    data.put(about | {"scene": _scene(one)}, refinement=one.name)
    data.put({"value_count": len(places), "halved": max(batches)}, **labels)
    for point, (place, batch, result) in enumerate(zip(places, batches, results)):
        values = {f"refined_{one.parameter}": one.rule.value(place), "batch": batch}
        known = ("status", "message", "reference_applies", *VALUE_NUMBERS)
        data.put(values | {name: result[name] for name in known if name in result}, point=point, **labels)
    for number, crossing in enumerate(where):
        values = {"crossing_level": crossing.level, "crossing_change": crossing.change}
        values |= {f"crossing_{one.parameter}": crossing.value, f"crossing_{one.parameter}_width": crossing.width}
        data.put(values, crossing=number, **labels)


CROSSING_COLUMNS = ("refinement", "definition", "parameter", "unit", "error", "value", "width", "change")


def write(tree, folder):
    """Write two CSV files: a row a value, and a row a crossing."""
    data, values, found = tree["refinement"].to_dataset(), [], []
    for name, definition in product(data.refinement.values.tolist(), data.definition.values.tolist()):
        cell = data.sel(refinement=name, definition=definition)
        parameter = str(cell.parameter.item())
        labels = {"refinement": name, "definition": definition, "parameter": parameter, "unit": VARIED[parameter].unit}
        refined, of = cell[f"refined_{parameter}"], f"crossing_{parameter}"
        cell = cell.isel(point=np.argsort(refined.values, kind="stable")[: int(cell.value_count)])  # NaN comes last
        numbers = (refined.name, "batch", *VALUE_NUMBERS)
        for one in records(cell, cell.point.notnull(), (*numbers, "status", "message")):
            row = {"value": one[refined.name]} | {key: one[key] for key in numbers[1:]}
            values.append(labels | row | {"status": STATUS[int(one["status"])], "message": one["message"]})
        columns = {"error": "crossing_level", "value": of, "width": f"{of}_width", "change": "crossing_change"}
        for one in records(cell, cell.crossing_level.notnull(), columns.values()):
            found.append(labels | {column: one[variable] for column, variable in columns.items()})
    # A file without rows has its columns.
    for name, rows in zip(REFINEMENT_TABLES, (values, found or [dict.fromkeys(CROSSING_COLUMNS, "")])):
        write_text(Path(folder) / name, csv_text(rows))
    return list(REFINEMENT_TABLES)
