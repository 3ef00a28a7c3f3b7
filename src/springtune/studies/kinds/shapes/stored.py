"""Stored meshes of shapes with their groups: arrays of numbers, and the names that they go by."""

from pathlib import Path
from typing import Any

import numpy as np

from springtune.mesh import Mesh
from springtune.mesh.groups import GroupedMesh

from ...runs import store

CORNERS = {3: "triangles", 4: "quads"}

NO_LIMITS = "none"
"""Limits that no task went beyond."""


def packed(grouped: GroupedMesh) -> dict[str, Any]:
    """A mesh and its groups as they are stored."""
    mesh = grouped.mesh
    found: dict[str, Any] = {"points": mesh.points, "triangles": mesh.triangles, "quads": mesh.quads}
    found |= {"side_names": list(grouped.sides), "part_names": list(grouped.parts), "unusable": dict(grouped.unusable)}
    found |= {f"side_{number}": np.asarray(edges) for number, edges in enumerate(grouped.sides.values())}
    found["named_points"] = {name: [float(x) for x in point] for name, point in grouped.points.items()}
    for number, cells in enumerate(grouped.parts.values()):
        found |= {f"part_{number}_{count}": np.asarray(inside) for count, inside in cells.items()}
    return found


def read(folder: str | Path, name: str, key: str) -> GroupedMesh | str:
    """A stored mesh, or why there is none."""
    path = Path(folder) / f"{name}.h5"
    known = store.read(path, [key])[key]
    if known["message"]:
        return str(known["message"])
    sides, parts = known["side_names"], known["part_names"]
    names = ["points", "triangles", "quads", *(f"side_{number}" for number in range(len(sides)))]
    names += [f"part_{number}_{count}" for number in range(len(parts)) for count in CORNERS]
    found = store.read(path, [key], names)[key]
    return GroupedMesh(
        Mesh(found["points"], found["triangles"], found["quads"]),
        {label: found[f"side_{number}"] for number, label in enumerate(sides)},
        {label: np.array(point) for label, point in known["named_points"].items()},
        {
            label: {count: found[f"part_{number}_{count}"] for count in CORNERS if f"part_{number}_{count}" in found}
            for number, label in enumerate(parts)
        },
        known["unusable"],
    )


def is_limited(folder: str | Path, name: str, key: str) -> bool:
    """Whether a mesh went beyond its limits, so that others may make it."""
    return key not in store.stored(Path(folder) / f"{name}.h5", NO_LIMITS)
