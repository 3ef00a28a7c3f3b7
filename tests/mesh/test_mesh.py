"""Meshes: geometry that holds for any size, quality figures, and files."""

import resource

import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy.spatial import Delaunay

import springtune as st
from springtune.mesh.cells import quality, signed_areas
from springtune.mesh.formats import read_beam_mesh, read_mesh, write_mesh
from springtune.mesh.free import free
from springtune.mesh.rows import braced, isosceles, lattice, structured
from springtune.safe_io import virtual_memory
from springtune.studies.kinds.bodies.mesh import make

from tables import cases

boxes = {"length": some.floats(0.02, 0.3), "height": some.floats(0.01, 0.05), "size": some.floats(2e-3, 9e-3)}


@pytest.mark.parametrize("mesh_type", st.MESH_TYPES)
@settings(max_examples=8)
@given(**boxes)
def test_any_box_is_covered_once(mesh_type, length, height, size):
    mesh = st.MESH_TYPES[mesh_type](length, height, size)
    for corners in mesh.cells.values():
        assert (signed_areas(mesh.points, corners) > 0).all()
    assert mesh.area == pytest.approx(length * height, rel=1e-9)
    assert not mesh.inverted(mesh.points)
    # Euler's formula of a disc, diagonals left out, and each edge at one or two cells.
    sides = len(mesh.edges) - 2 * len(mesh.quads)
    assert len(mesh.points) - sides + len(mesh.triangles) + len(mesh.quads) == 1
    assert set(np.unique(mesh.cells_per_edge)) <= {1, 2}
    outline = sum(mesh.edge_lengths[mesh.on_outline])
    assert outline == pytest.approx(2 * (length + height), rel=1e-9)
    for axis, end in ((0, length), (1, height)):
        for value in (0.0, end):
            assert len(mesh.outline_edges(axis, value)) >= 1


@pytest.mark.parametrize("mesh_type", ["structured", "right", "free"])
def test_counts_are_the_same_in_every_unit(mesh_type):
    """Two cells and a half are a half in every unit: rounding took two or three."""
    kind, counts = st.MESH_TYPES[mesh_type], set()
    for unit in np.random.default_rng(1).uniform(1e-3, 1e3, 20):
        box = (7.5 * 0.1 * unit, 0.5 * unit, 0.3 * unit)
        counts.add(len(kind(*box).points))
    assert len(counts) == 1


def test_rows_are_equilateral_where_they_fit():
    height = 4 * np.sqrt(3) / 2 * 5e-3
    mesh = structured(0.05, height, 5e-3)
    corners = mesh.points[mesh.triangles]
    whole = np.isclose(signed_areas(mesh.points, mesh.triangles), np.sqrt(3) / 4 * 25e-6)
    sides = np.linalg.norm(corners[whole] - np.roll(corners[whole], 1, axis=1), axis=2)
    # 4 rows of 10 triangles on one base and 9 on the other; the two halves at each row's ends are cut.
    assert whole.sum() == 4 * (10 + 9)
    assert np.allclose(sides, 5e-3, rtol=1e-9)


def test_lattice_is_equilateral_throughout():
    mesh = lattice(7, 5, 2.0)
    assert np.allclose(mesh.edge_lengths, 2.0, rtol=1e-9)
    assert quality(mesh) == pytest.approx({"minimum_angle": 60.0, "edge_length_spread": 0.0}, abs=1e-7)


@pytest.mark.parametrize("size", [5e-3, 2e-3])
def test_free_has_the_imposed_size_on_its_outline_and_is_delaunay(size):
    mesh = free(0.1, 0.02, size)
    outline = mesh.edge_lengths[mesh.cells_per_edge == 1]
    assert np.allclose(outline, size, rtol=1e-9)
    other = Delaunay(mesh.points).simplices
    ours, theirs = ({tuple(sorted(corners)) for corners in triangles.tolist()} for triangles in (mesh.triangles, other))
    assert ours == theirs
    assert quality(mesh)["minimum_angle"] > 30


def test_quality_of_a_right_isosceles_triangle():
    mesh = st.Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([[0, 1, 2]]))
    lengths = np.array([1.0, 1.0, np.sqrt(2)])
    expected = {"minimum_angle": 45.0, "edge_length_spread": lengths.std() / lengths.mean()}
    assert quality(mesh) == pytest.approx(expected)


@pytest.mark.usefixtures("mesh_library")
@pytest.mark.parametrize("mesh_type", st.MESH_TYPES)
@pytest.mark.parametrize("box", [(0.2, 0.04, 5e-3), (0.1, 0.005, 5e-3), (0.005, 0.1, 5e-3), (1.0, 1e-3, 1e-3)])
def test_file_keeps_every_digit(tmp_path, mesh_type, box):
    mesh = st.MESH_TYPES[mesh_type](*box)
    write_mesh(tmp_path / "mesh.vtu", mesh)
    assert len(read_beam_mesh(tmp_path / "mesh.vtu", *box[:2]).edges) == len(mesh.edges)
    again = read_mesh(tmp_path / "mesh.vtu")
    assert (again.points == mesh.points).all()
    assert (again.triangles == mesh.triangles).all() and (again.quads == mesh.quads).all()
    kinds = {"braced": ["quad"]}.get(mesh_type, ["triangle"])
    assert [block.type for block in meshio.read(tmp_path / "mesh.vtu").cells] == kinds
    assert [path.name for path in tmp_path.iterdir()] == ["mesh.vtu"]


SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
HALVES = [("triangle", np.array([[0, 1, 2], [0, 2, 3]]))]


@pytest.mark.usefixtures("mesh_library")
@cases
def test_files_that_are_no_plane_mesh_are_refused(tmp_path, points, cells, message):
    path = tmp_path / "mesh.vtu"
    meshio.Mesh(points, cells).write(path)
    with pytest.raises(st.MeshError, match=f"mesh.vtu: .*{message}"):
        read_mesh(path)


@pytest.mark.usefixtures("mesh_library")
def test_unreadable_file_is_refused(tmp_path):
    for name, content in (("mesh.txt", "nothing"), ("mesh.vtu", "nothing"), ("mesh.msh", "$MeshFormat")):
        (tmp_path / name).write_text(content)
        with pytest.raises(st.MeshError, match=f"{name}: (cannot be read|unknown format).*(convert|write) it"):
            read_mesh(tmp_path / name)


FORMATS = {"vtu": "vtu", "med": "med", "gmsh22": "msh", "abaqus": "inp"}
"""Ending of formats that hold lines, triangles and quadrilaterals."""


@pytest.mark.usefixtures("mesh_library")
@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("mesh_type", ["free", "braced"])
def test_a_beam_may_come_from_any_format(tmp_path, name, mesh_type):
    mesh = st.MESH_TYPES[mesh_type](0.1, 0.02, 5e-3)
    # Elsewhere, in mm, with a particle of no cell and with lines on the outline; the first cell clockwise.
    points = np.column_stack([1e3 * mesh.points + [7.0, -3.0], np.zeros(len(mesh.points))])
    points = np.vstack([points, [[50.0, 10.0, 0.0]]])
    kind, cells = ("quad", mesh.quads.copy()) if len(mesh.quads) else ("triangle", mesh.triangles.copy())
    cells[0] = cells[0][::-1]
    path = tmp_path / f"beam.{FORMATS[name]}"
    meshio.Mesh(points, [("line", mesh.outline_edges(1, 0.0)), (kind, cells)]).write(path, file_format=name)
    found = read_beam_mesh(path, 0.1, 0.02, unit=1e-3)
    # Formats in text keep some twelve digits.
    assert np.allclose(found.points, mesh.points, rtol=0, atol=1e-9 * 0.1)
    assert len(found.edges) == len(mesh.edges)
    assert (signed_areas(found.points, next(iter(found.cells.values()))) > 0).all()
    for axis, end in ((0, 0.1), (1, 0.02)):
        for value in (0.0, end):
            assert len(found.outline_edges(axis, value)) == len(mesh.outline_edges(axis, value))


def test_a_mesh_that_does_not_fill_its_beam_is_refused(tmp_path):
    mesh = st.MESH_TYPES["free"](0.1, 0.02, 5e-3)
    path = tmp_path / "beam.vtu"
    write_mesh(path, mesh)
    with pytest.raises(st.MeshError, match="extends over 100 x 20 mm, its beam over 200 x 40 mm; correct the unit"):
        read_beam_mesh(path, 0.2, 0.04)


def save(path, points, cells):
    """Write cells, a dict of corner indices by number of corners."""
    blocks = [({3: "triangle", 4: "quad"}[count], corners) for count, corners in cells.items()]
    meshio.Mesh(np.column_stack([points, np.zeros(len(points))]), blocks).write(path, file_format="vtu")
    return path


def refuse(path, points, cells, said, length=0.1, height=0.02):
    """Assert that a file is no mesh of a beam, and what is said of it."""
    with pytest.raises(st.MeshError, match=said):
        read_beam_mesh(save(path, points, cells), length, height)


def part(mesh, chosen, joint, gap=0.0):
    """Points and cells of a mesh with points of a joint doubled, the cells of `chosen` on the new ones.

    Parameters
    ----------
    mesh : Mesh
    chosen : callable
        Whether cells with their middles at points, shape (n, 2), are on the far side of the joint.
    joint : callable
        Whether points of the joint are doubled, from their indices.
    gap : float
        How far the new ones are off along x [m].
    """
    far = {count: chosen(mesh.points[corners].mean(axis=1)) for count, corners in mesh.cells.items()}
    sides = [np.unique(np.concatenate([corners[far[count] == side].ravel() for count, corners in mesh.cells.items()]))
             for side in (False, True)]  # fmt: skip
    shared = np.intersect1d(*sides)
    shared = shared[joint(shared)]
    number = np.arange(len(mesh.points))
    number[shared] = len(mesh.points) + np.arange(len(shared))
    cells = {count: np.where(far[count][:, None], number[corners], corners) for count, corners in mesh.cells.items()}
    return np.vstack([mesh.points, mesh.points[shared] + [gap, 0.0]]), cells, shared


class TestSlits:
    """Meshes whose cells cover the box once, by their areas, but are not joined throughout."""

    MESH = st.MESH_TYPES["right"](0.1, 0.02, 5e-3)

    def test_a_file_that_changes_during_a_run_is_not_read(self, tmp_path):
        """Its mesh would be stored under the key of what it held before."""
        path = save(tmp_path / "own.vtu", self.MESH.points, {3: self.MESH.triangles})
        with pytest.raises(SystemExit, match="was changed while the study ran; call the same command again"):
            make({"length": 0.1, "height": 0.02, "file": str(path), "unit": 1.0, "content": "that of before"})

    def test_a_file_that_claims_more_than_any_memory_is_damaged(self, tmp_path, monkeypatch):
        path = save(tmp_path / "own.vtu", self.MESH.points, {3: self.MESH.triangles})
        monkeypatch.setattr(meshio, "read", lambda path: np.empty(10**15))
        before = resource.getrlimit(resource.RLIMIT_AS)
        # Of a limit that somebody else has set, and that is tighter than that of reading a file.
        resource.setrlimit(resource.RLIMIT_AS, (virtual_memory() + 10**8, before[1]))
        try:
            with pytest.raises(st.MeshError, match="is damaged"):
                read_beam_mesh(path, 0.1, 0.02)
        finally:
            resource.setrlimit(resource.RLIMIT_AS, before)

    def test_cells_that_touch_in_a_point(self, tmp_path):
        """A hole of two cells that meet the rest's outline in points."""
        mesh = self.MESH
        away = np.isin(mesh.triangles, np.flatnonzero((mesh.points == [0.05, 0.01]).all(axis=1))).any(axis=1)
        order = np.argsort(mesh.points[mesh.triangles[away]].mean(axis=1).sum(axis=1))
        opposite = np.flatnonzero(away)[order[[0, -1]]]
        said = r"cover 98.75 % of the box .* cells hang together in a point alone, at \(50, 10\) mm; join them"
        refuse(tmp_path / "holes.vtu", mesh.points, {3: np.delete(mesh.triangles, opposite, axis=0)}, said)

    def test_sheets_on_top_of_each_other(self, tmp_path):
        mesh, other = self.MESH, st.MESH_TYPES["alternating"](0.1, 0.02, 5e-3)
        apart, points = np.vstack([mesh.triangles, other.triangles + len(mesh.points)]), [mesh.points, other.points]
        said = "cover 200 % of the box or overlap: two points at .*, do not join their cells"
        refuse(tmp_path / "two.vtu", np.vstack(points), {3: apart}, said)
        said = "cover 200 % .* edges with two cells on the same side: .*; remove one"
        refuse(tmp_path / "one.vtu", mesh.points, {3: np.vstack([mesh.triangles, other.triangles])}, said)

    def test_triangles_beside_quadrilaterals_and_slivers_are_legal(self, tmp_path):
        mesh = st.MESH_TYPES["braced"](0.1, 0.02, 5e-3)
        half = mesh.points[mesh.quads].mean(axis=1)[:, 0] < 0.05
        triangles = np.vstack([mesh.quads[half][:, [0, 1, 2]], mesh.quads[half][:, [0, 2, 3]]])
        points = mesh.points.copy()
        # Two lines of points close together: triangles 1e-4 as high as long.
        points[points[:, 0] == 0.02, 0] = 0.015 + 1e-4 * 5e-3
        found = read_beam_mesh(save(tmp_path / "both.vtu", points, {3: triangles, 4: mesh.quads[~half]}), 0.1, 0.02)
        assert (len(found.triangles), len(found.quads)) == (80, 40)

    @settings(max_examples=25)
    @given(
        mesh_type=some.sampled_from(sorted(st.MESH_TYPES)),
        angle=some.floats(0, np.pi),
        seed=some.integers(0, 2**32 - 1),
        gap=some.sampled_from([0.0, 1e-12, 1e-9]),
        **boxes,
    )
    def test_any_slit_is_refused(self, tmp_path_factory, mesh_type, angle, seed, gap, length, height, size):
        """A line through the box, random points of the joint along it doubled: refused; the mesh itself is not."""
        mesh, path = st.MESH_TYPES[mesh_type](length, height, size), tmp_path_factory.mktemp("any") / "mesh.vtu"
        found = read_beam_mesh(save(path, mesh.points, mesh.cells), length, height)
        assert len(found.edges) == len(mesh.edges)
        random = np.random.default_rng(seed)
        normal = np.array([np.cos(angle), np.sin(angle)])
        level = (random.choice(mesh.points) * [0.98, 0.98] + 0.01 * np.array([length, height])) @ normal
        share = random.random()
        points, cells, shared = part(
            mesh, lambda at: at @ normal > level, lambda at: random.random(len(at)) < share, gap
        )
        if len(shared):
            said = r"two points at .* do not join their cells .*; merge duplicate points"
            refuse(path, points, cells, said, length, height)
        else:
            read_beam_mesh(save(path, points, cells), length, height)

    @settings(max_examples=20)
    @given(
        mesh_type=some.sampled_from(sorted(set(st.MESH_TYPES) - {"braced"})), seed=some.integers(0, 2**32 - 1), **boxes
    )
    def test_any_hanging_point_is_refused(self, tmp_path_factory, mesh_type, seed, length, height, size):
        """A point on an edge inside that splits one of its two triangles."""
        mesh, random = st.MESH_TYPES[mesh_type](length, height, size), np.random.default_rng(seed)
        inner = np.flatnonzero(mesh.cells_per_edge == 2)
        if not len(inner):
            return
        a, b = mesh.edges[random.choice(inner)]
        cell = np.flatnonzero(np.isin(mesh.triangles, (a, b)).sum(axis=1) == 2)[random.integers(2)]
        corners = mesh.triangles[cell]
        new, share = len(mesh.points), random.uniform(0.2, 0.8)
        points = np.vstack([mesh.points, (1 - share) * mesh.points[a] + share * mesh.points[b]])
        halves = [np.where(corners == end, new, corners) for end in (a, b)]
        path = tmp_path_factory.mktemp("hanging") / "mesh.vtu"
        cells = np.vstack([np.delete(mesh.triangles, cell, axis=0), halves])
        refuse(path, points, {3: cells}, "hangs on the edge from .* split the cell of that edge there", length, height)


@cases
def test_points_that_are_nowhere_are_refused(tmp_path, point, corner, message):
    points, triangles = SQUARE.copy(), HALVES[0][1].copy()
    points[1], triangles[0, 1] = point, corner
    meshio.Mesh(points, [("triangle", triangles)]).write(tmp_path / "mesh.vtu")
    with pytest.raises(st.MeshError, match=message):
        read_beam_mesh(tmp_path / "mesh.vtu", 1.0, 1.0)


@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_isosceles_rows_have_the_shape_for_their_poisson_ratio(nu):
    mesh = isosceles(0.2, 0.04, 2e-3, nu)
    x, y = np.abs(mesh.points[mesh.edges[:, 1]] - mesh.points[mesh.edges[:, 0]]).T
    slanted = (x > 1e-9) & (y > 1e-9)
    # Rows and cells are whole numbers: 22 and 28 rows, 100 cells.
    assert (x[slanted] / y[slanted]) ** 2 == pytest.approx(nu, rel=0.02)


def test_quads_turn_inside_out_corner_by_corner():
    mesh = braced(0.01, 0.01, 0.01)
    assert not mesh.inverted(mesh.points)
    pushed = mesh.points.copy()
    pushed[mesh.quads[0, 0]] = [0.008, 0.008]  # past the diagonal: the area stays positive
    assert signed_areas(pushed, mesh.quads)[0] > 0
    assert mesh.inverted(pushed)
