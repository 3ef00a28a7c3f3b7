"""Shapes, loads and materials in tasks: plain dicts without labels."""

import warnings
from dataclasses import asdict, replace
from math import isfinite
from typing import Any

from pydantic import TypeAdapter

from springtune.mesh.formats import read_shape
from springtune.mesh.sheets import GroupedMesh
from springtune.problem.materials import AnyMaterial, material_of
from springtune.problem.shapes import AssumptionWarning, LoadCase, Quantity, Shape

from .stored import check_unchanged

SHAPE_NAME, LOAD_NAME = "shape", "load"  # names of a shape and of its load in tasks


def quantity_key(quantity: Quantity) -> str:
    """Key of a quantity that does not depend on its name, as ``displacement y end``."""
    return " ".join(filter(None, (quantity.kind, quantity.component, quantity.of)))


def geometry(shape: Shape) -> dict[str, Any]:
    """Sides, holes and points of a shape, on which meshes depend."""
    return {
        "outline": [asdict(side) for side in shape.outline],
        "holes": [asdict(hole) for hole in shape.holes],
        "points": {name: list(point) for name, point in shape.points.items()},
    }


def load(case: LoadCase) -> dict[str, Any]:
    """Values of a load case, without its name and the names of its quantities."""
    quantities = sorted({quantity_key(one): one for one in case.quantities}.items())
    plain = (replace(one, name=f"q{number}", expected=None, source="") for number, (_, one) in enumerate(quantities))
    return asdict(replace(case, name=LOAD_NAME, quantities=tuple(plain)))


_SHAPE_READER = TypeAdapter(Shape)  # inverse of `asdict` for shapes


def shape_of(described: dict[str, Any], thickness: float = 1.0, case: dict[str, Any] | None = None) -> Shape:
    """Shape from its `geometry` and thickness [m]."""
    own = {name: described[name] for name in ("outline", "holes", "points")}
    own |= {"name": SHAPE_NAME, "thickness": thickness, "file": described.get("file", "")}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AssumptionWarning)  # whoever read the study said it
        return _SHAPE_READER.validate_python(own | {"loads": {LOAD_NAME: case} if case else {}})


def make_shape(source: dict[str, Any]) -> GroupedMesh:
    """Mesh of a shape with its groups, generated or read from its ``file``."""
    from springtune.mesh.free import mesh_shape  # here: most callers mesh nothing

    if "file" in source:
        check_unchanged(source)
        return read_shape(source["file"], source["unit"])
    return mesh_shape(shape_of(source), source["mesh_size"], source["refined"])


def values_by_key(values: dict[str, float], case: LoadCase) -> dict[str, float]:
    """Finite values of quantities by their `quantity_key`."""
    found = {quantity_key(one): float(values[one.name]) for one in case.quantities if one.name in values}
    return {key: value for key, value in found.items() if isfinite(value)}


def with_names(message: str, shape: Shape, case: LoadCase) -> str:
    """Message of a task with the names that the study gives."""
    names = {f"shape '{SHAPE_NAME}'": f"shape '{shape.name}'", f"load '{LOAD_NAME}'": f"load '{case.name}'"}
    order = sorted({quantity_key(one) for one in case.quantities})
    names |= {f"'q{order.index(quantity_key(one))}'": f"'{one.name}'" for one in case.quantities}
    for plain, name in names.items():
        message = message.replace(plain, name)
    return message


def materials_of(described: dict[str, dict[str, Any]]) -> dict[str, AnyMaterial]:
    """Materials by part, the inverse of `springtune.studies.runs.keys.material_key`."""
    return {part: material_of(one) for part, one in described.items()}
