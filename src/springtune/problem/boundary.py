"""Supports, forces and measured quantities of load cases on a mesh, and their checks; arrays are (n_points, 2)."""

from collections.abc import Mapping

import numpy as np

from ..mesh.cells import Mesh, no_cells, signed_areas
from ..mesh.sheets import GroupedMesh, connected, part_names, parts_of, side_fault
from ..mesh.sides import in_words
from .loads import MIDDLE, LoadKind
from .shapes import LoadCase, Quantity, check_names

POINT_TOLERANCE = 1e-9  # distance from a particle below which a point is that particle, over the extent of the mesh [1]

OUTSIDE_TOLERANCE = 0.25  # how far outside the nearest cell a point may lie, over its size [1], as next to an arc

CELL_TOLERANCE = 1e-6
"""How far outside a cell a point counts as in it, over the cell's size [1]: coordinates are rounded."""

MOST_NEWTON_STEPS = 50  # Newton steps that look for a point in a quadrilateral


def box(mesh: Mesh, kind: LoadKind) -> GroupedMesh:
    """Mesh of a box at the origin with the groups of a kind of load: sides, and the middle of a pressed one."""
    size = mesh.points.max(axis=0)
    sides = dict.fromkeys([kind.loaded, *(side for side, _ in kind.held)])
    middle = 0.5 * (mesh.points.min(axis=0) + size)
    middle[kind.normal] = kind.loaded.place(*size)
    edges = {side.name: mesh.outline_edges(side.axis, side.place(*size)) for side in sides}
    return GroupedMesh(mesh, edges, {MIDDLE: middle} if kind.pressed else {})


def held_directions(mesh: Mesh, kind: LoadKind) -> np.ndarray:
    """Return the directions that a kind of load holds, see `springtune.problem.loads`."""
    return support_directions(box(mesh, kind), kind.case)[0]


def weights(mesh: Mesh, kind: LoadKind) -> np.ndarray:
    """Return each particle's weight in an even load over the loaded side: sum 1 along the force, zero across."""
    return even_weights(box(mesh, kind), kind.loaded.name, kind.axis)


def measured_weights(mesh: Mesh, kind: LoadKind) -> np.ndarray:
    """Return the weights of a load's displacement, sum 1: the loaded side's mean, or under pressure its middle."""
    return displacement_weights(box(mesh, kind), kind.case.quantities[0])


def support_directions(grouped: GroupedMesh, case: LoadCase) -> tuple[np.ndarray, np.ndarray]:
    """Return the directions that a load case holds and their prescribed displacements [m], zero elsewhere."""
    points = grouped.mesh.points
    held, given = np.zeros(points.shape, dtype=bool), np.zeros(points.shape)
    for support in case.supports:
        particles = grouped.particles(support.group)
        for axis, value in enumerate((support.x, support.y)):
            if value is None:
                continue
            differ = held[particles, axis] & (given[particles, axis] != value)
            if differ.any():
                particle = particles[np.argmax(differ)]
                others = [one.group for one in case.supports if particle in grouped.particles(one.group)]
                both, there = f"{others[0]!r} and {support.group!r}", f"the particle at {in_words(points[particle])}"
                why = f"move {there} by different amounts along {'xy'[axis]}; make them agree there"
                raise ValueError(f"load {case.name!r}: supports on {both} {why}")
            held[particles, axis] = True
            given[particles, axis] = value
    return held, given


def even_weights(grouped: GroupedMesh, group: str, axis: int) -> np.ndarray:
    """Return the weights of an even distribution over a group, by length; sum 1 along `axis`, zero across."""
    field = np.zeros(grouped.mesh.points.shape)
    field[:, axis] = _lengths(grouped, group)
    return field / field.sum()


def forces(
    grouped: GroupedMesh,
    case: LoadCase,
    thickness: float,
    densities: Mapping[str, float | None],
    followers: bool = True,
) -> np.ndarray:
    """Return the forces of a load case on the particles at rest [N]; densities [kg/m3] by part are for gravity."""
    field = np.zeros(grouped.mesh.points.shape)
    for traction in case.tractions:
        for axis, force in enumerate(traction.force):
            if force:
                field += force * even_weights(grouped, traction.group, axis)
    for pressure in case.pressures:
        if followers or not pressure.follower:
            edges = grouped.sides[pressure.group]
            apart = grouped.mesh.points[edges[:, 1]] - grouped.mesh.points[edges[:, 0]]
            half = 0.5 * pressure.pressure * thickness * np.stack([-apart[:, 1], apart[:, 0]], axis=1)
            np.add.at(field, edges, half[:, None, :])
    if any(case.gravity):
        field += particle_masses(grouped, thickness, densities)[:, None] * case.gravity
    return field


def follower_edges(grouped: GroupedMesh, case: LoadCase, thickness: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges (n, 2) with follower pressure, the body to the left, and it (n,) times the thickness [N/m]."""
    found = [(grouped.sides[one.group], one.pressure * thickness) for one in case.pressures if one.follower]
    edges, pressures = zip((no_cells(2), 0.0), *found)
    return np.concatenate(edges), np.repeat(pressures, [*map(len, edges)])


def particle_masses(grouped: GroupedMesh, thickness: float, densities: Mapping[str, float | None]) -> np.ndarray:
    """Return lumped masses [kg] (n_points,) from densities [kg/m3] by part, the main one at ``""``."""
    known: dict[str, float] = {}
    for name in parts_of(grouped):
        if (density := densities.get(name)) is None:
            body = f"part {name!r}" if name else "the body"
            raise ValueError(f"density: the material of {body} has none; give one such as '7850 kg/m^3'")
        known[name] = density
    if len({*known.values()}) == 1:
        return known.popitem()[1] * thickness * grouped.mesh.particle_areas
    points, labels = grouped.mesh.points, part_names(grouped)
    masses = np.zeros(len(points))
    for count, corners in grouped.mesh.cells.items():
        of_cells = np.array([known[name] for name in labels[count]])
        np.add.at(masses, corners, (of_cells * thickness * signed_areas(points, corners) / count)[:, None])
    return masses


def displacement_weights(grouped: GroupedMesh, quantity: Quantity) -> np.ndarray:
    """Return the weights, sum 1, of a displacement quantity: the mean of sides, or a point's."""
    axis = "xy".index(quantity.component)
    if quantity.of in grouped.sides:
        return even_weights(grouped, quantity.of, axis)
    count, cell, shares = cell_at(grouped, quantity.of)
    field = np.zeros(grouped.mesh.points.shape)
    field[grouped.mesh.cells[count][cell], axis] = shares
    return field


def reaction_weights(grouped: GroupedMesh, case: LoadCase, quantity: Quantity) -> np.ndarray:
    """Return the weights of support forces that make a reaction; groups share a particle's force by their lengths."""
    axis = "xy".index(quantity.component)
    holding = [one for one in case.supports if (one.x, one.y)[axis] is not None]
    shares = {group: _lengths(grouped, group) for group in dict.fromkeys(one.group for one in holding)}
    by_sides = sum((share for group, share in shares.items() if group in grouped.sides), np.zeros(1))
    for group, share in shares.items():
        if group not in grouped.sides:
            share[np.broadcast_to(by_sides > 0, share.shape)] = 0.0
    total, field = sum(shares.values()), np.zeros(grouped.mesh.points.shape)
    own = shares[quantity.of]
    np.divide(own, total, out=field[:, axis], where=own > 0)
    return field


def _lengths(grouped: GroupedMesh, group: str) -> np.ndarray:
    """Length of a group at each particle [m], half of each edge's; 1 of a point."""
    field = np.zeros(len(grouped.mesh.points))
    if group not in grouped.sides:
        field[grouped.particles(group)] = 1.0
        return field
    edges = grouped.sides[group]
    apart = grouped.mesh.points[edges[:, 1]] - grouped.mesh.points[edges[:, 0]]
    np.add.at(field, edges, 0.5 * np.sqrt(apart[:, 0] ** 2 + apart[:, 1] ** 2)[:, None])
    return field


def cell_at(grouped: GroupedMesh, name: str) -> tuple[int, int, np.ndarray]:
    """Return the cell of a named point, or the nearest one, and its corners' interpolation weights, sum 1."""
    mesh, point = grouped.mesh, np.asarray(grouped.points[name], dtype=float)
    slack, best, found = POINT_TOLERANCE * np.ptp(mesh.points, axis=0).max(), -OUTSIDE_TOLERANCE, None
    for count, corners in mesh.cells.items():
        here = mesh.points[corners] - point
        # What has it is among the cells whose boxes are near.
        low, high = here.min(axis=1), here.max(axis=1)
        room = OUTSIDE_TOLERANCE * (high - low).max(axis=1, keepdims=True) + slack
        for cell in np.flatnonzero(((low <= room) & (high >= -room)).all(axis=1)):
            shares = _corner_weights(here[cell])
            if shares is not None and shares.min() > best:
                best, found = float(shares.min()), (count, int(cell), shares)
    if found is None:
        raise ValueError(f"point: {name!r} at {in_words(point)} is outside of the mesh; move it, or correct its unit")
    shares = np.where(np.abs(found[2]) <= POINT_TOLERANCE, 0.0, found[2])
    return found[0], found[1], shares / shares.sum()


def _corner_weights(corners: np.ndarray) -> np.ndarray | None:
    """Weights of the corners of a cell, relative to a point, that interpolate there; None where they are not found."""
    if len(corners) == 3:
        after, before = corners[[1, 2, 0]], corners[[2, 0, 1]]
        opposite = after[:, 0] * before[:, 1] - after[:, 1] * before[:, 0]
        return opposite / opposite.sum()
    place = np.full(2, 0.5)
    for _ in range(MOST_NEWTON_STEPS):
        (a, b), (c, d) = 1 - place, place
        shares = np.array([a * b, c * b, c * d, a * d])
        slopes = np.array([[-b, b, d, -d], [-a, -c, c, a]]) @ corners
        try:
            step = np.linalg.solve(slopes.T, -shares @ corners)
        except np.linalg.LinAlgError:
            return None
        if not np.abs(step).max() >= 1e-15:
            break
        place = place + step
    return shares if np.isfinite(shares).all() else None


def check_case(grouped: GroupedMesh, case: LoadCase) -> None:
    """Refuse a load case whose groups a mesh lacks, or that leaves cells free to move."""
    check_names(case, grouped.sides, grouped.points, grouped.unusable)
    where = f"load {case.name!r}"
    pressed = {one.group for one in case.pressures}
    held_and_pulled = [("support", one.group) for one in case.supports]
    held_and_pulled += [("traction", one.group) for one in case.tractions]
    for name in dict.fromkeys([*pressed, *(name for _, name in held_and_pulled), *(one.of for one in case.quantities)]):
        if name in grouped.sides and (fault := side_fault(grouped, name, name in pressed)):
            raise ValueError(f"{where}: {name!r} {fault}")
    for what, name in held_and_pulled:
        if name in grouped.points and grouped.particle(name) is None:
            raise ValueError(f"{where}, {what}: point {name!r} is no particle of the mesh; move it to one")
    for quantity in case.quantities:
        if quantity.of in grouped.points and not _in_body(grouped, quantity.of):
            raise ValueError(f"{where}, quantity {quantity.name!r}: point {quantity.of!r} is not in the body; move it")
    check_held(grouped.mesh.points, grouped.mesh.edges, support_directions(grouped, case)[0], where)


def _in_body(grouped: GroupedMesh, name: str) -> bool:
    """Whether a named point is in a cell, or within rounding of one."""
    try:
        return bool(cell_at(grouped, name)[2].min() > -CELL_TOLERANCE)
    except ValueError:
        return False


def check_held(points: np.ndarray, edges: np.ndarray, held: np.ndarray, where: str) -> None:
    """Refuse supports that leave a connected body free to move, unless all its points are held."""
    components = connected(edges, len(points))
    count = components.max() + 1
    for number in range(count):
        own, fixed = points[components == number], held[components == number]
        if not fixed.all() and (free := free_motion(own, fixed)):
            one = f"one of the {count} bodies that are not joined, at {in_words(own)},"
            raise ValueError(f"{where}: its supports leave {one if count > 1 else 'the body'} free to {free}; hold it")


def free_motion(points: np.ndarray, held: np.ndarray) -> str:
    """Return a rigid motion that supports leave free, in words, or an empty string; all arrays are (n_points, 2).

    >>> free_motion(np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[True, True], [False, False]]))
    'turn about (0, 0) mm'
    """
    middle, size = points.mean(axis=0), np.ptp(points, axis=0).max() or 1.0
    x, y = ((points - middle) / size).T
    one, none = np.ones_like(x), np.zeros_like(x)
    rows = np.array([[one, none], [none, one], [-y, x]]).T[held]  # of each held direction by a unit of each motion
    sizes, motions = np.linalg.eigh(rows.T @ rows)
    free = (sizes <= 1e-12 * max(sizes[-1], 1.0)).sum()
    if free != 1:
        return "move and turn" if free else ""
    u, v, turn = motions[:, 0]
    if abs(turn) > 1e-6:
        about = middle + np.array([-v, u]) / turn * size
        return f"turn about {in_words(np.where(np.abs(about) > 1e-9 * size, about, 0.0))}"
    return "move along " + ("x" if abs(v) < 1e-6 else "y" if abs(u) < 1e-6 else f"({u:.3g}, {v:.3g})")
