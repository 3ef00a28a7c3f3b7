"""What is fed: studies and mesh files, as bytes and by their structure."""

import io
import os
import random as generators
import shutil
import tempfile
from contextlib import redirect_stdout
from functools import cache, partial
from pathlib import Path

import meshio
import numpy as np
import yaml
from harness import Refused, Target, Wrong
from mutations import WORDS, spoil_bytes, spoil_counts, spoil_tree

import springtune as st
from springtune.mechanics.moduli import PatchTest
from springtune.mesh import MESH_TYPES, MeshError, corner_angles, read_beam_mesh, signed_areas, write_mesh
from springtune.mesh.formats import read_shape
from springtune.mesh.outlines import mesh_shape
from springtune.mesh.sheets import sheet_fault
from springtune.studies.config.kind import kinds
from springtune.studies.kinds import load_study
from springtune.studies.kinds.scenes.kind import summary

REPOSITORY = Path(__file__).parents[2]
STUDIES = [REPOSITORY / "config" / f"{name}.yaml" for name in ("quick", "paper", "block", "laying", "stability")]

BOX = 0.1, 0.02
"""Beam of the mesh files [m]."""

MADE = 2_000
"""Scenes up to which an accepted study is looked at further."""


# -- studies -----------------------------------------------------------------------------------------------------------


def _study(content, folder):
    path = folder / "study.yaml"
    path.write_bytes(content)
    table = folder / "paper_tables.csv"
    if not table.exists():
        shutil.copy(REPOSITORY / "config/paper_tables.csv", table)
    return path


@cache
def _texts():
    return [path.read_bytes() for path in STUDIES]


def study_bytes(random, folder):
    return _study(spoil_bytes(random, random.choice(_texts()), WORDS), folder)


@cache
def _trees():
    return [yaml.load(text, Loader=yaml.BaseLoader) for text in _texts()]


def study_trees(random, folder):
    if random.random() < 0.05:  # aliases of aliases
        levels = random.randrange(3, 30)
        lines = ["a0: &a0 [x, y]", *(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}, *a{n - 1}]" for n in range(1, levels))]
        return _study("\n".join(["title: aliases", *lines]).encode(), folder)
    tree = spoil_tree(random, random.choice(_trees()))
    try:
        return _study(yaml.dump(tree, allow_unicode=True, Dumper=yaml.CSafeDumper).encode(), folder)
    except RecursionError:  # deeper than can be written that way
        return _study(b"title: " + 400 * b"[" + 400 * b"]", folder)


def read_study(path):
    try:
        study = load_study(path)
    except st.StudyError as error:
        raise Refused(str(error)) from None
    if len(study.scenes) <= MADE:
        parts = [(kind, study.parts[kind.name]) for kind in kinds()]
        summary(study, [row for kind, part in parts if part for row in kind.summary(part)])
        for mesh in study.meshes:
            if len(mesh.name) > 200:
                raise Wrong(f"a mesh is called {mesh.name}, which no file can be")
    return "accepted"


# -- mesh files --------------------------------------------------------------------------------------------------------

FORMATS = {"vtu": "vtu", "msh": "gmsh", "inp": "abaqus", "vtk": "vtk", "off": "off", "su2": "su2", "xdmf": "xdmf"}
FORMATS |= {"ply": "ply", "mesh": "medit", "dat": "tecplot", "h5m": "h5m"}
"""Formats by ending."""

OLD = {"msh": "gmsh22", "vtk": "vtk42", "vtu": "vtu"}
"""Another version of some."""


@cache
def _mesh(name):
    return MESH_TYPES[name](*BOX, 5e-3)


def _write(path, points, cells, file_format):
    if file_format in ("off", "su2"):
        points = points if file_format == "off" else points[:, :2]
    options = {"binary": False} if file_format in ("vtu", "vtk", "vtk42", "gmsh", "gmsh22") and len(points) % 2 else {}
    meshio.Mesh(points, cells).write(path, file_format=file_format, **options)


def _flat(mesh):
    points = np.column_stack([mesh.points, np.zeros(len(mesh.points))])
    return points, [({3: "triangle", 4: "quad"}[count], corners) for count, corners in mesh.cells.items()]


@cache
def _files():
    """Contents of good files, with their endings."""
    found = []
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
        for ending, name in [*FORMATS.items(), *OLD.items()]:
            for kind in ("free", "braced") if ending not in ("off", "stl") else ("free",):
                path = Path(folder) / f"mesh.{ending}"
                _write(path, *_flat(_mesh(kind)), name)
                found.append((ending, path.read_bytes()))
    return found


NUMBERS = ("nan", "inf", "-1", "1e308", "1e999", "999999999999", "0", "4294967295", "-2147483648", "0.05", "<", "\n")


def mesh_bytes(random, folder):
    ending, content = random.choice(_files())
    path = folder / f"mesh.{ending}"
    spoil = spoil_counts if random.random() < 0.3 else partial(spoil_bytes, words=NUMBERS)
    path.write_bytes(spoil(random, content))
    return path


def mesh_structure(random, folder):
    """A mesh with a fault, or several, in a file of any format."""
    mesh = _mesh(random.choice(("free", "structured", "right", "braced")))
    points, cells = _flat(mesh)
    name, corners = cells[0]
    points, corners = points.copy(), corners.copy()
    further = []
    for _ in range(random.choice((0, 1, 1, 1, 2, 3))):
        cell, point = random.randrange(len(corners)), random.randrange(len(points))
        kind = random.randrange(18)
        if kind == 0:
            points[point, random.randrange(3)] = random.choice((np.nan, np.inf, -np.inf, 1e300, 1e-300))
        elif kind == 1:  # two points at one place, each with cells of its own
            points = np.vstack([points, points[point] + random.choice((0.0, 1e-12, 1e-8, 1e-5))])
            here = np.argwhere(corners == point)
            corners[tuple(here[random.randrange(len(here))])] = len(points) - 1 if len(here) else point
        elif kind == 2:  # a point that hangs on a side
            ends = corners[cell, :2]
            points = np.vstack([points, points[ends].mean(axis=0)])
            rest = corners[cell, 2:]
            if corners.shape[1] == 3:
                new = len(points) - 1
                corners = np.vstack([np.delete(corners, cell, 0), [[ends[0], new, rest[0]], [new, ends[1], rest[0]]]])
        elif kind == 3:
            corners[cell] = corners[cell][::-1]
        elif kind == 4:
            corners[cell, 0] = corners[cell, 1]
        elif kind == 5:  # flat
            points[corners[cell, 0]] = points[corners[cell, 1:3]].mean(axis=0)
        elif kind == 6:  # holes
            corners = np.delete(
                corners, random.sample(range(len(corners)), random.choice((1, 3, len(corners) // 2))), 0
            )
        elif kind == 7:
            corners = np.vstack([corners, corners[cell : cell + random.choice((1, 5))]])
        elif kind == 8:  # another part, beside or on top
            corners = np.vstack([corners, corners + len(points)])
            points = np.vstack([points, points + [random.choice((0.0, 0.05, 0.2)), 0.0, 0.0]])
        elif kind == 9:
            points[point, 2] = random.choice((1e-3, 1e-15, 1.0))
        elif kind == 10:
            points[:, 2] = random.choice((1.0, points[:, 0]) if random.random() < 0.5 else (5.0, -1.0))
        elif kind == 11:
            further.append((random.choice(("tetra", "line", "vertex", "triangle6", "quad8", "hexahedron")), None))
        elif kind == 12:  # unused points
            points = np.vstack([points, points[:3] + random.choice((0.0, 1.0, np.nan))])
        elif kind == 13:
            points *= random.choice((1e3, 1e-3, 1e200, 0.0, -1.0))
        elif kind == 14:
            points[point, :2] += [random.gauss(0, 3e-3), random.gauss(0, 3e-3)]
        elif kind == 15:
            corners[cell, 0] = random.choice((-1, len(points), 2**31 - 1, 0))
        elif kind == 16:
            points[:, :2] += [random.choice((0, 1e6, -3.0)), 0.0]
        elif kind == 17:
            corners[cell] = np.random.default_rng(random.randrange(2**32)).permutation(corners[cell])
    counts = {"tetra": 4, "line": 2, "vertex": 1, "triangle6": 6, "quad8": 8, "hexahedron": 8}
    blocks = [(name, corners)] + [(kind, np.arange(counts[kind])[None]) for kind, _ in further]
    ending, file_format = random.choice([*FORMATS.items(), *OLD.items()])
    path = folder / f"mesh.{ending}"
    path.unlink(missing_ok=True)
    try:
        with np.errstate(all="ignore"):
            _write(path, points, blocks, file_format)
    except Exception:  # not all formats have all of it
        _write(folder / "mesh.vtu", points, blocks, "vtu")
        path = folder / "mesh.vtu"
    return path


def read_mesh(path):
    """Read a mesh file; what is accepted fills the beam and has the modulus of its material."""
    try:
        mesh = read_beam_mesh(path, *BOX)
    except MeshError as error:
        raise Refused(str(error)) from None
    if abs(sum(signed_areas(mesh.points, one).sum() for one in mesh.cells.values()) / (BOX[0] * BOX[1]) - 1) > 1e-6:
        raise Wrong("is accepted and does not cover its beam")
    if set(mesh.cells) == {3}:
        # Delingette's network is linear triangles: an even strain is exact on any mesh, whatever its cells.
        smallest = min(corner_angles(mesh.points, corners).min() for corners in mesh.cells.values())
        if smallest > 1e-3:
            springs = st.DEFINITIONS["delingette"].springs(mesh, st.Material(1.0, 0.3), 1.0)
            modulus, ratio = PatchTest(mesh).axial(springs)
            if abs(modulus * springs.reference - 1) > 1e-6 or abs(ratio - 0.3) > 1e-6:
                raise Wrong(f"is accepted, and has E = {modulus * springs.reference} for 1 and nu = {ratio} for 0.3")
    return "accepted"


@cache
def _shape_files():
    """Contents of good files of a shape with groups, with their endings."""
    found = []
    hole = st.Hole.circle((0.05, 0.01), 0.004, part="core")
    shape = st.Shape.rectangle(*BOX, holes=[hole], points={"tip": (0.1, 0.013), "in": (0.02, 0.013)})
    grouped = mesh_shape(shape, 8e-3)
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
        for ending in ("vtu", "msh"):
            write_mesh(Path(folder) / f"shape.{ending}", grouped)
        content = meshio.read(Path(folder) / "shape.msh")
        content.write(Path(folder) / "text.msh", file_format="gmsh22", binary=False)
        points = {name: np.unique(edges) for name, edges in grouped.sides.items()}
        cells = {"core": [np.flatnonzero(grouped.parts["core"][3])]}
        blocks = [("triangle", grouped.mesh.triangles)]
        meshio.Mesh(grouped.mesh.points, blocks, point_sets=points, cell_sets=cells).write(Path(folder) / "shape.inp")
        for path in sorted(Path(folder).iterdir()):
            found.append((path.suffix, path.read_bytes()))
    return found


def shape_files(random, folder):
    if random.random() < 0.4:
        return mesh_structure(random, folder)
    ending, content = random.choice(_shape_files())
    path = folder / f"shape{ending}"
    words = (*NUMBERS, "core", "left", "lower", '""', "NSET", "part")
    path.write_bytes(spoil_bytes(random, content, words))
    return path


def read_shape_file(path):
    """Read a mesh file with groups; what is accepted is a sheet, whose groups are on its outline."""
    try:
        grouped = read_shape(path)
    except MeshError as error:
        raise Refused(str(error)) from None
    outline = {tuple(edge) for edge in grouped.mesh.edges[grouped.mesh.on_outline].tolist()}
    if sheet_fault(grouped.mesh):
        raise Wrong("is accepted and no sheet")
    for name, edges in grouped.sides.items():
        if not len(edges) or not {tuple(sorted(edge)) for edge in edges.tolist()} <= outline:
            raise Wrong(f"has a group {name!r} that is not on the outline")
    if any(why.count(";") < 1 for why in grouped.unusable.values()):
        raise Wrong(f"says no remedy: {grouped.unusable}")
    return "accepted"


TARGETS = (
    Target("studies as bytes", study_bytes, read_study, 30),
    Target("studies by structure", study_trees, read_study, 24),
    Target("mesh files as bytes", mesh_bytes, read_mesh, 16),
    Target("mesh files by structure", mesh_structure, read_mesh, 18),
    Target("files of shapes", shape_files, read_shape_file, 12),
)


def warm_up():
    """Import what workers need, before they are made: each would pay for it else."""
    with tempfile.TemporaryDirectory() as folder:
        random = generators.Random(0)
        for target in TARGETS:
            try:
                target.read(target.make(random, Path(folder)))
            except (Exception, SystemExit):
                continue
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
