"""Meshes of shapes: made of outlines, read from files, and held against load cases."""

import math
from itertools import pairwise

import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import springtune as st
from springtune.mesh.cells import quality, signed_areas
from springtune.mesh.formats import read_shape, write_mesh
from springtune.mesh.free import mesh_shape
from springtune.mesh.sheets import outline_of, sheet_fault
from springtune.problem.boundary import check_case, free_motion

from tables import beside, cases, evaluated


def plate(**more):
    holes = [st.Hole.circle((0.05, 0.02), 0.008), st.Hole.circle((0.02, 0.02), 0.005, part="core")]
    points = {"inside": (0.07, 0.012), "tip": (0.1, 0.021), "corner": (0.0, 0.0)}
    return st.Shape.rectangle(0.1, 0.04, name="plate", **{"holes": holes, "points": points, **more})


SIDES = [((2, 0), None, "lower"), ((3.25, 0), (0, 0), "outer"), ((0, 2.75), None, "left"), ((0, 1), (0, 0), "inner")]
LE1 = st.Shape("le1", 0.1, [st.Segment(*side) for side in SIDES], points={"D": (2, 0)})


def polygon_area(corners):
    x, y = np.transpose(corners)
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def check_sides(shape, grouped):
    """Each outline edge is in one group, with the body on its left, and on its side."""
    outline, fault = outline_of(grouped.mesh)
    assert not fault and not sheet_fault(grouped.mesh)
    edges = np.concatenate(list(grouped.sides.values()))
    assert sorted(map(tuple, edges.tolist())) == sorted(map(tuple, outline.tolist()))
    extent = np.ptp(grouped.mesh.points, axis=0).max()
    for name, found in grouped.sides.items():
        sides = [side for one in shape.rounds for side in one.sides if side.group == name]
        for place in grouped.mesh.points[np.unique(found)]:
            assert min(side.nearest(tuple(place))[1] for side in sides) <= 1e-9 * extent
    for name, place in grouped.points.items():
        assert grouped.mesh.points[grouped.particle(name)] == pytest.approx(shape.points[name], abs=1e-9 * extent)
        assert tuple(place) == shape.points[name]


STARS = some.lists(some.floats(0.5, 1.0), min_size=3, max_size=9)


@pytest.mark.filterwarnings("ignore:.*its longer side is")
@settings(max_examples=12)
@given(STARS, some.floats(0.05, 0.2), some.floats(0.06, 0.5), some.floats(-3, 3))
def test_any_star_with_a_hole_is_filled(radii, hole, size, power):
    """Lengths from a micrometre to a kilometre."""
    scale = 10.0**power
    angles = [2 * math.pi * (i + 0.3) / len(radii) for i in range(len(radii))]
    corners = [(scale * r * math.cos(angle), scale * r * math.sin(angle)) for r, angle in zip(radii, angles)]
    sides = [st.Segment(corner, group=f"side{i}") for i, corner in enumerate(corners)]
    star = st.Shape("star", 1e-3, sides, [st.Hole.circle((0, 0), scale * hole)])
    grouped = mesh_shape(star, scale * size)
    check_sides(star, grouped)
    around = grouped.sides["hole"]
    assert len(around) >= 6
    following = dict(around.tolist())
    chain = [int(around[0, 0])]
    while len(chain) < len(around):
        chain.append(following[chain[-1]])
    area = polygon_area(corners) + polygon_area(grouped.mesh.points[chain])
    assert grouped.mesh.area == pytest.approx(area, rel=1e-9)
    lengths = [np.linalg.norm(np.diff(grouped.mesh.points[edges], axis=1), axis=2) for edges in grouped.sides.values()]
    assert max(one.max() for one in lengths) <= scale * size * (1 + 1e-9)


@pytest.mark.parametrize("shape", [plate(), LE1], ids=lambda shape: shape.name)
@pytest.mark.parametrize("share", [0.3, 0.05])
def test_shapes_have_their_groups_and_points(shape, share):
    (_, low), (_, high) = shape.extent
    grouped = mesh_shape(shape, share * (high - low))
    check_sides(shape, grouped)
    if shape.parts:
        cells = grouped.mesh.triangles[grouped.parts["core"][3]]
        centres = grouped.mesh.points[cells].mean(axis=1)
        assert (np.linalg.norm(centres - [0.02, 0.02], axis=1) < 0.005).all()
        edges = np.unique(np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
        # By Euler: one disc, whose rim is on the circle.
        assert len(np.unique(cells)) - len(edges) + len(cells) == 1
        assert grouped.mesh.area - signed_areas(grouped.mesh.points, cells).sum() > 0


def test_the_area_of_a_mesh_comes_to_that_of_the_shape_by_squares():
    disc = st.Shape("disc", 1e-3, st.Hole.circle((0, 0), 1).outline)
    errors = [1 - mesh_shape(disc, math.pi / 2 / n).mesh.area / disc.area for n in (4, 8, 16)]
    assert [math.log2(one / other) for one, other in pairwise(errors)] == pytest.approx([2, 2], abs=0.02)
    thirds = [st.Segment((math.cos(turn), math.sin(turn)), (0, 0), "rim") for turn in np.arange(3) * math.tau / 3]
    assert len(mesh_shape(st.Shape("disc", 1e-3, thirds), 1.7).sides["rim"]) == 6


def test_sides_are_divided_evenly():
    grouped = mesh_shape(LE1, 0.2)
    for name in ("lower", "left"):
        lengths = np.linalg.norm(np.diff(grouped.mesh.points[grouped.sides[name]], axis=1), axis=2)
        assert lengths.max() / lengths.min() == pytest.approx(1, rel=1e-9) and 0.15 < lengths.max() <= 0.2
    assert len(grouped.sides["left"]) == math.ceil(1.75 / 0.2)


def test_refinement_is_where_it_is_asked_for():
    coarse = mesh_shape(plate(), 5e-3)
    fine = mesh_shape(plate(), 5e-3, refined={"hole": 5e-4, "tip": 2e-4, "core": 1e-3})
    check_sides(plate(), fine)
    lengths = fine.mesh.edge_lengths
    middles = fine.mesh.points[fine.mesh.edges].mean(axis=1)
    at_hole = np.abs(np.linalg.norm(middles - [0.05, 0.02], axis=1) - 0.008) < 2e-4
    assert lengths[at_hole].max() < 7e-4
    assert lengths[np.linalg.norm(middles - [0.1, 0.021], axis=1) < 4e-4].max() < 6e-4
    assert lengths[np.linalg.norm(middles - [0.02, 0.02], axis=1) < 4e-3].max() < 2e-3
    assert lengths.max() > 4e-3 and len(fine.mesh.points) < 8 * len(coarse.mesh.points)
    assert quality(fine.mesh)["minimum_angle"] > 20


def test_a_thin_wall_does_not_close():
    """Chords of both arcs keep apart, whatever the size."""
    outer = st.Hole.circle((0, 0), 1.0, group="outer").outline
    for shift in (0.4, 0.499, 0.49999):
        ring = st.Shape("ring", 1e-3, outer, [st.Hole.circle((shift, 0), 0.5, group="inner")])
        grouped = mesh_shape(ring, 0.6)
        check_sides(ring, grouped)
        assert grouped.mesh.area == pytest.approx(ring.area, rel=0.08)


@pytest.mark.parametrize("distance", [1.5e-6, 2.5e-6, 1e-5])
def test_points_at_the_limit_are_particles_or_refused(distance):
    """What netgen takes for one point is not made one silently."""
    square = st.Shape.rectangle(1, 1, points={"a": (0.5, 0.5), "b": (0.5, 0.5 + distance), "c": (0.5, 1 - distance)})
    try:
        check_sides(square, mesh_shape(square, 0.3))
    except st.MeshError as error:
        assert distance < 1e-5 and "too near each other" in str(error)


def test_a_shape_far_from_the_origin_is_meshed_alike():
    far = st.Shape("far", 1e-3, [st.Segment((x, y), group="all") for x, y in UNIT + [1e4, -1e4]])
    assert mesh_shape(far, 0.1).mesh.area == pytest.approx(1, rel=1e-9)
    assert free_motion(UNIT + [1e6, -1e6], UNIT == 0) == ""


def same(grouped, other):
    """Whether two meshes have the same groups, by places."""

    def places(one):
        edges = {name: np.round(one.mesh.points[found], 12).reshape(-1, 4) for name, found in one.sides.items()}
        cells = {
            name: sum(float(signed_areas(one.mesh.points, one.mesh.cells[n])[mask].sum()) for n, mask in masks.items())
            for name, masks in one.parts.items()
        }
        sides = {name: sorted(map(tuple, found.tolist())) for name, found in edges.items()}
        points = {name: tuple(np.round(place, 12)) for name, place in one.points.items()}
        return sides, points, {name: round(area, 15) for name, area in cells.items()}

    return places(grouped) == places(other) and other.mesh.area == pytest.approx(grouped.mesh.area)


def squares():
    """A mesh of squares and triangles."""
    mesh = st.make_mesh(st.Beam(0.1, 0.04), "braced", 0.01)
    x, y = mesh.points[mesh.quads].mean(axis=1).T
    halved = mesh.quads[x > 0.07]
    mixed = st.Mesh(mesh.points, np.concatenate([halved[:, [0, 1, 2]], halved[:, [0, 2, 3]]]), mesh.quads[x < 0.07])
    parts = {n: mixed.points[corners].mean(axis=1)[:, 1] < 0.02 for n, corners in mixed.cells.items()}
    outline, _ = outline_of(mixed)
    left = outline[(mixed.points[outline, 0] == 0).all(axis=1)]
    return st.GroupedMesh(mixed, {"left": left}, {"between": np.array([0.033, 0.021])}, {"below": parts})


def by_meshio(grouped, **sets):
    mesh = grouped.mesh
    return meshio.Mesh(mesh.points, [("triangle", mesh.triangles)], **sets)


def write_vtu(path, grouped):
    """Arrays on points and cells, as users make them; no lines."""
    marks = {name: np.isin(np.arange(len(grouped.mesh.points)), edges) for name, edges in grouped.sides.items()}
    for name in grouped.points:
        marks[name] = np.arange(len(grouped.mesh.points)) == grouped.particle(name)
    parts = {name: [masks[3].astype(np.int32)] for name, masks in grouped.parts.items()}
    data = {name: mark.astype(np.uint8) for name, mark in marks.items()} | {"u": grouped.mesh.points}
    parts["density"] = [np.ones(len(grouped.mesh.triangles))]
    by_meshio(grouped, point_data=data, cell_data=parts).write(path)


def write_abaqus(path, grouped):
    sets = {name: np.unique(edges) for name, edges in grouped.sides.items()}
    sets |= {name: np.array([grouped.particle(name)]) for name in grouped.points}
    cells = {name: [np.flatnonzero(masks[3])] for name, masks in grouped.parts.items()}
    cells["Eall"] = [np.arange(len(grouped.mesh.triangles))]
    by_meshio(grouped, point_sets=sets, cell_sets=cells).write(path)


FILES = {"own.vtu": write_mesh, "marks.vtu": write_vtu, "sets.inp": write_abaqus}


@pytest.mark.usefixtures("mesh_library")
@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("shape", [plate(), LE1], ids=lambda shape: shape.name)
def test_groups_come_back_from_files(tmp_path, name, shape):
    grouped = mesh_shape(shape, 0.1 * shape.extent[1][1])
    FILES[name](tmp_path / name, grouped)
    found = read_shape(tmp_path / name)
    assert same(grouped, found) and not found.unusable


@pytest.mark.usefixtures("mesh_library")
def test_squares_and_points_between_particles_come_back(tmp_path):
    grouped = squares()
    write_mesh(tmp_path / "own.vtu", grouped)
    found = read_shape(tmp_path / "own.vtu")
    assert same(grouped, found) and found.particle("between") is None and len(found.particles("between")) == 0


@pytest.mark.usefixtures("mesh_library")
def test_numbers_of_parts_are_their_names(tmp_path):
    grouped = mesh_shape(plate(), 5e-3)
    part = {"part": [np.where(grouped.parts["core"][3], 7, 0)]}
    by_meshio(grouped, cell_data=part).write(tmp_path / "part.vtu")
    assert list(read_shape(tmp_path / "part.vtu").parts) == ["7"]


def lines(grouped, points=slice(0), **more):
    """A file's content with lines of its own, and points of the name of the first."""
    cells = [("triangle", grouped.mesh.triangles), *(("line", np.array(edges)) for edges in more.values())]
    counts = [len(found) for _, found in cells]
    data = {name: [np.full(n, i == own, np.int8) for i, n in enumerate(counts)] for own, name in enumerate(more, 1)}
    chosen = np.zeros(len(grouped.mesh.points), dtype=np.int8)
    chosen[points] = 1
    return meshio.Mesh(grouped.mesh.points, cells, {next(iter(more)): chosen} if chosen.any() else {}, data)


def inner_edges(grouped):
    return grouped.mesh.edges[~grouped.mesh.on_outline]


UNUSABLE = evaluated(beside(__file__)["UNUSABLE"], globals())


@pytest.mark.usefixtures("mesh_library")
@pytest.mark.parametrize("name", UNUSABLE)
def test_what_cannot_be_a_group_is_said_when_it_is_used(tmp_path, name):
    grouped = mesh_shape(plate(), 5e-3)
    make, says = UNUSABLE[name]
    path = tmp_path / ("file.inp" if "set" in name or "points" in name or "materials" in name else "file.vtu")
    make(grouped).write(path)
    found = read_shape(path)
    assert says in found.unusable["cut"]
    case = st.LoadCase("pull", [st.Support("cut", 0, 0)], gravity=(0, -9.81))
    with pytest.raises(
        ValueError, match=r"load 'pull', support: 'cut' .*; (take|mark|put|remove|rename|a cell)"
    ) as caught:
        check_case(found, case)
    assert says in str(caught.value)


@pytest.mark.usefixtures("mesh_library")
def test_names_that_cannot_be_used_are_told(tmp_path):
    grouped = mesh_shape(plate(), 5e-3)
    lines(grouped, **{"left side": grouped.sides["left"]}).write(tmp_path / "file.vtu")
    found = read_shape(tmp_path / "file.vtu")
    assert not found.sides and "cannot be a name; use letters" in found.unusable["left side"]


@pytest.mark.usefixtures("mesh_library")
@cases
def test_files_that_cannot_hold_a_group_are_not_written(tmp_path, monkeypatch, write, says):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(st.MeshError) as caught:
        write(mesh_shape(plate(), 5e-3))
    assert says in str(caught.value) and not [*tmp_path.iterdir()]


UNIT = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def two_squares(shift, joined=0):
    """Two squares of two triangles, some corners of the second being those of the first."""
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    points = np.concatenate([UNIT, UNIT + shift])
    numbers = np.arange(8)
    for i in range(4, 8):
        same = np.flatnonzero((points[:4] == points[i]).all(axis=1))
        if len(same) and joined:
            numbers[i] = same[0]
            joined -= 1
    cells = numbers[np.concatenate([halves, halves + 4])]
    used, cells = np.unique(cells, return_inverse=True)
    return st.Mesh(points[used], cells.reshape(-1, 3))


def hanging():
    """Squares, one triangle of which is split at the middle of its edge; its neighbour there is not."""
    mesh = st.MESH_TYPES["right"](4.0, 4.0, 1.0)
    a, b, new = *(int(np.flatnonzero((mesh.points == [x, 1.0]).all(axis=1))[0]) for x in (1.0, 2.0)), len(mesh.points)
    cell = np.flatnonzero(np.isin(mesh.triangles, (a, b)).sum(axis=1) == 2)[0]
    halves = [np.where(mesh.triangles[cell] == end, new, mesh.triangles[cell]) for end in (a, b)]
    return st.Mesh(np.vstack([mesh.points, [1.5, 1.0]]), np.vstack([np.delete(mesh.triangles, cell, axis=0), halves]))


FAULTS = evaluated(beside(__file__)["FAULTS"], globals())


@pytest.mark.parametrize("name", FAULTS)
def test_a_mesh_is_a_sheet_or_says_why_not(tmp_path, name):
    mesh, says = FAULTS[name]
    fault = sheet_fault(mesh)
    assert says in fault and bool(says) == bool(fault)
    write_mesh(tmp_path / "own.vtu", mesh)
    if says:
        with pytest.raises(st.MeshError, match=r"own\.vtu: ") as caught:
            read_shape(tmp_path / "own.vtu")
        assert says in str(caught.value)
    else:
        assert read_shape(tmp_path / "own.vtu").mesh.area == mesh.area


@settings(max_examples=40)
@given(some.integers(2, 12), some.integers(1, 8), some.data())
def test_a_sheet_without_any_of_its_cells_is_a_sheet_unless_cells_meet_in_a_point(cells, rows, data):
    """What is left has holes, or comes apart; all else that it may be is told."""
    mesh = st.make_mesh(st.Beam(0.01 * cells, 0.01 * rows), "right", 0.01)
    kept = np.array(data.draw(some.lists(some.booleans(), min_size=len(mesh.triangles), max_size=len(mesh.triangles))))
    if kept.any():
        used, triangles = np.unique(mesh.triangles[kept], return_inverse=True)
        left = st.Mesh(mesh.points[used], triangles.reshape(-1, 3))
        outline, _ = outline_of(left)
        pinched = (np.bincount(outline[:, 0]) > 1).any()
        assert ("point alone" in sheet_fault(left)) == pinched and (pinched or not sheet_fault(left))


def pull(*supports, at="right", **more):
    return st.LoadCase("pull", supports, [st.Traction(at, (1, 0))], **more)


def test_each_body_is_to_be_held():
    mesh = two_squares([3, 0])
    outline, _ = outline_of(mesh)
    ends = {"left": 0.0, "right": 4.0}
    sides = {name: outline[(mesh.points[outline, 0] == x).all(axis=1)] for name, x in ends.items()}
    grouped = st.GroupedMesh(mesh, sides)
    with pytest.raises(ValueError, match=r"one of the 2 bodies that are not joined, at \(3500, 500\) mm, free to move"):
        check_case(grouped, pull(st.Support("left", 0, 0)))
    check_case(grouped, pull(st.Support("left", 0, 0), st.Support("right", 0, 0)))
