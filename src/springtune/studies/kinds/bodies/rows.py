"""Rows that the groups of beams and of shapes share: messages of scenes, meshes, networks and outlines."""

import numpy as np

from springtune.problem.status import Status

from ...output.dataset import NO_NODE


def with_objection(result, message, why):
    """Message of a scene; of a solved one with the objection to its reference."""
    return "; ".join(filter(None, (message, why if result["status"] in (Status.SOLVED, Status.UNSTABLE) else "")))


def fields_of_rows(group, axes, rows):
    """Group of whole fields; its dimensions are as long as the longest arrays."""

    def longest(name, axis=0, least=1):
        return tuple(range(max((row[name].shape[axis] for row in rows if name in row), default=least) or 1))

    axes = axes | {"particle": longest("x"), "spring": longest("spring_nodes"), "spring_end": (0, 1)}
    axes |= {"cell": longest("cell_nodes"), "cell_corner": longest("cell_nodes", 1, least=3)}
    found = group.of_rows(axes | {"outline_point": longest("outline_x")}, rows)
    return found.assign_attrs(Conventions="CF-1.11 UGRID-1.0")


def mesh_row(mesh):
    """Values of a mesh at rest; a cell with fewer corners than another one has no node at the last."""
    cells = np.full((sum(map(len, mesh.cells.values())), max(mesh.cells)), NO_NODE)
    start = 0
    for count, corners in mesh.cells.items():
        cells[start : start + len(corners), :count] = corners
        start += len(corners)
    return {"x": mesh.points[:, 0], "y": mesh.points[:, 1], "spring_nodes": mesh.edges, "cell_nodes": cells}


def displaced(arrays):
    """Values of a network from its stored arrays."""
    x, y = arrays["displacements"].T
    return {"displacement_x": x, "displacement_y": y, "spring_force": arrays["spring_forces"]}


def outline_row(points, moved):
    """Values of the outline of a reference at rest, and its displacements."""
    values = {"outline_x": points[:, 0], "outline_y": points[:, 1]}
    return values | {"reference_displacement_x": moved[:, 0], "reference_displacement_y": moved[:, 1]}
