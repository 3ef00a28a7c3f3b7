"""Check that a mesh is one of its shape."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..mesh.groups import GroupedMesh, part_names
from ..mesh.segments import in_words
from ..mesh.sides import OutlineSide
from ..problem.materials import AnyMaterial
from ..problem.shapes import Shape

MOST_DISTANCE_FROM_SIDE = 1e-5
"""Largest distance of a particle from its side of a shape, over its extent: text formats have few digits."""

LEAST_COVERED = 0.9
"""Least length of a group's edges over the length of its sides: six chords are 5 % shorter than a circle."""


def check_meshed(shape: Shape, grouped: GroupedMesh, materials: Mapping[str, AnyMaterial]) -> None:
    """Refuse a mesh of another shape, or with other groups: the reference is on the outline."""
    if not shape.outline:
        return
    what, remedy = f"shape {shape.name!r}", "mesh it with springtune.mesh_shape"
    mesh, (low, high) = grouped.mesh, shape.extent
    small = MOST_DISTANCE_FROM_SIDE * max(high[0] - low[0], high[1] - low[1])

    def filled(part: str | None) -> object:
        """Material of a part, or the name of a part that the mesh lacks; None for nothing."""
        return None if part is None else materials.get(part, part)

    sides = [side for one in shape.rounds if filled(one.inner) != filled(one.outer) for side in one.sides]
    particles = np.unique(mesh.edges[mesh.on_outline | _between(grouped, materials)])
    near = np.array([_distances(side, mesh.points[particles]) for side in sides]) <= small
    if not near.any(axis=0).all():
        first = in_words(mesh.points[particles[np.argmin(near.any(axis=0))]])
        raise ValueError(f"mesh: its outline has a particle at {first}, on no side of {what}; {remedy}")
    if near.sum(axis=1).min() < 2:
        side = sides[int(np.argmin(near.sum(axis=1)))]
        ends = f"from {in_words(side.start)} to {in_words(side.end)}"
        raise ValueError(f"mesh: has no edge on the side of {what} {ends}; {remedy}")
    for name in shape.groups:
        own: Sequence[OutlineSide] = [side for side in sides if side.group == name]
        if name not in grouped.sides or not own:
            continue
        ends = mesh.points[grouped.sides[name]]
        away = np.min([_distances(side, ends.reshape(-1, 2)) for side in own], axis=0)
        share = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() / sum(side.length for side in own)
        if away.max(initial=0.0) > small or not LEAST_COVERED <= share <= 1 + MOST_DISTANCE_FROM_SIDE:
            raise ValueError(f"mesh: its group {name!r} is not the sides {name!r} of {what}; {remedy}")
    for name, point in shape.points.items():
        if name in grouped.points and np.linalg.norm(np.subtract(grouped.points[name], point)) > small:
            there = in_words(grouped.points[name])
            raise ValueError(f"mesh: its point {name!r} is at {there}, that of {what} at {in_words(point)}; {remedy}")


def _between(grouped: GroupedMesh, materials: Mapping[str, AnyMaterial]) -> np.ndarray:
    """Whether edges have cells of two materials, shape (n_edges,)."""
    mesh, several = grouped.mesh, list(dict.fromkeys(materials.values()))
    if len(several) < 2:
        return np.zeros(len(mesh.edges), dtype=bool)
    least, most = np.full(len(mesh.edges), len(several)), np.full(len(mesh.edges), -1)
    numbers = {name: several.index(one) for name, one in materials.items()}
    for count, names in part_names(grouped).items():
        edges = mesh.cell_edges[count]
        of_cells = np.array([numbers[name] for name in names])[:, None]
        np.minimum.at(least, edges, np.broadcast_to(of_cells, edges.shape))
        np.maximum.at(most, edges, np.broadcast_to(of_cells, edges.shape))
    return least < most


def _distances(side: OutlineSide, points: np.ndarray) -> np.ndarray:
    """Distances of points from a side [m], shape (n,); on an ellipse only for points close to it."""
    if side.arc is None or side.centre is None:
        start, along = np.array(side.start), np.subtract(side.end, side.start)
        shares = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
        nearest = start + shares[:, None] * along
    else:
        axes, (begin, turn) = np.array(side.arc[:2]), side.arc[2:]
        x, y = ((points - side.centre) / axes).T
        # From the middle of the arc, so that no turn is cut.
        from_middle = np.mod(np.arctan2(y, x) - begin - 0.5 * turn + np.pi, 2 * np.pi) - np.pi
        angles = begin + 0.5 * turn + np.clip(from_middle, -0.5 * abs(turn), 0.5 * abs(turn))
        nearest = np.array(side.centre) + axes * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.asarray(np.linalg.norm(points - nearest, axis=1))
