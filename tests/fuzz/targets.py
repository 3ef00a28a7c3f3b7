"""What is fed: studies as bytes and by their structure, mesh files as bytes."""

import io
import shutil
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from functools import cache, partial
from pathlib import Path
from random import Random

import meshio
import numpy as np
import yaml
from mutations import WORDS, spoil_bytes, spoil_counts, spoil_tree

import springtune as st
from springtune.mechanics.moduli import PatchTest
from springtune.mesh import MESH_TYPES, MeshError, corner_angles, read_beam_mesh, signed_areas, write_mesh
from springtune.mesh.formats import read_shape
from springtune.mesh.outlines import mesh_shape
from springtune.mesh.sheets import sheet_fault
from springtune.studies.config.kind import kinds
from springtune.studies.kinds import load_study
from springtune.studies.kinds.bodies.kind import summary
from springtune.studies.kinds.bodies.plan import stem

CONFIG = Path(__file__).parents[2] / "config"
STUDIES = ("quick", "paper", "block", "laying", "stability")

BOX = 0.1, 0.02
"""Beam of the mesh files [m]."""

VERSIONS = [("vtu", "vtu"), ("msh", "gmsh"), ("msh", "gmsh22"), ("inp", "abaqus"), ("med", "med")]
"""Endings, and meshio's name of the format."""

NUMBERS = ("nan", "inf", "-1", "1e308", "1e999", "999999999999", "0", "4294967295", "-2147483648", "0.05", "<", "\n")


class Refused(Exception):
    """An input that is refused, with the message that its user reads."""


# -- studies -----------------------------------------------------------------------------------------------------------


def written(content, folder):
    """Path of a study, beside the table that it names."""
    shutil.copy(CONFIG / "paper_tables.csv", folder)
    path = folder / "study.yaml"
    path.write_bytes(content)
    return path


@cache
def studies():
    return [(CONFIG / f"{name}.yaml").read_bytes() for name in STUDIES]


def study_bytes(random, folder):
    return written(spoil_bytes(random, random.choice(studies()), WORDS), folder)


def study_trees(random, folder):
    if random.random() < 0.05:  # aliases of aliases
        lines = [f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}, *a{n - 1}]" for n in range(1, random.randrange(3, 30))]
        return written("\n".join(["title: aliases", "a0: &a0 [x, y]", *lines]).encode(), folder)
    tree = spoil_tree(random, yaml.load(random.choice(studies()), Loader=yaml.BaseLoader))
    try:
        return written(yaml.dump(tree, allow_unicode=True, Dumper=yaml.CSafeDumper).encode(), folder)
    except RecursionError:  # deeper than can be written that way
        return written(b"title: " + 400 * b"[" + 400 * b"]", folder)


def read_study(path):
    try:
        study = load_study(path)
    except st.StudyError as error:
        raise Refused(str(error)) from None
    if len(study.scenes) <= 2_000:
        parts = [(kind, study.parts[kind.name]) for kind in kinds()]
        summary(study, [row for kind, part in parts if part for row in kind.summary(part)])
        assert all(len(stem(mesh)) <= 200 for mesh in study.meshes), "a mesh is called as no file can be"


# -- mesh files --------------------------------------------------------------------------------------------------------


@cache
def mesh_of(name):
    mesh = MESH_TYPES[name](*BOX, 5e-3)
    [(count, corners)] = mesh.cells.items() if len(mesh.cells) == 1 else [next(iter(mesh.cells.items()))]
    return np.column_stack([mesh.points, np.zeros(len(mesh.points))]), {3: "triangle", 4: "quad"}[count], corners


def write(path, points, cells, file_format):
    text = file_format in ("vtu", "gmsh", "gmsh22") and len(points) % 2
    with redirect_stdout(io.StringIO()):
        meshio.Mesh(points, cells).write(path, file_format=file_format, **({"binary": False} if text else {}))


@cache
def mesh_files():
    """Endings and contents of good files."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for ending, file_format in VERSIONS:
            for name in ("free", "braced"):
                path = Path(folder) / f"mesh.{ending}"
                points, kind, corners = mesh_of(name)
                write(path, points, [(kind, corners)], file_format)
                found.append((ending, path.read_bytes()))
    return found


@cache
def shape_files():
    """Endings and contents of good files of a shape with groups."""
    hole = st.Hole.circle((0.05, 0.01), 0.004, part="core")
    shape = st.Shape.rectangle(*BOX, holes=[hole], points={"tip": (0.1, 0.013), "in": (0.02, 0.013)})
    grouped = mesh_shape(shape, 8e-3)
    with tempfile.TemporaryDirectory() as name, redirect_stdout(io.StringIO()):
        folder = Path(name)
        write_mesh(folder / "shape.vtu", grouped)
        points = {side: np.unique(edges) for side, edges in grouped.sides.items()}
        cells = {"core": [np.flatnonzero(grouped.parts["core"][3])]}
        blocks = [("triangle", grouped.mesh.triangles)]
        meshio.Mesh(grouped.mesh.points, blocks, point_sets=points, cell_sets=cells).write(folder / "shape.inp")
        return [(path.suffix[1:], path.read_bytes()) for path in sorted(folder.iterdir())]


def spoiled_file(files, words, random, folder):
    ending, content = random.choice(files())
    path = folder / f"mesh.{ending}"
    spoil = spoil_counts if random.random() < 0.3 else partial(spoil_bytes, words=words)
    path.write_bytes(spoil(random, content))
    return path


def read_mesh(path):
    """Read a mesh file; what is accepted fills the beam and has the modulus of its material."""
    try:
        mesh = read_beam_mesh(path, *BOX)
    except MeshError as error:
        raise Refused(str(error)) from None
    area = sum(signed_areas(mesh.points, one).sum() for one in mesh.cells.values())
    assert abs(area / (BOX[0] * BOX[1]) - 1) < 1e-6, "is accepted and does not cover its beam"
    # Delingette's network is linear triangles: an even strain is exact on any mesh, whatever its cells.
    if set(mesh.cells) == {3} and corner_angles(mesh.points, mesh.cells[3]).min() > 1e-3:
        springs = st.DEFINITIONS["delingette"].springs(mesh, st.Material(1.0, 0.3), 1.0)
        modulus, ratio = PatchTest(mesh).axial(springs)
        assert abs(modulus * springs.reference - 1) < 1e-6 and abs(ratio - 0.3) < 1e-6, (modulus, ratio)


def read_shape_file(path):
    """Read a mesh file with groups; what is accepted is a sheet, whose groups are on its outline."""
    try:
        grouped = read_shape(path)
    except MeshError as error:
        raise Refused(str(error)) from None
    outline = {tuple(edge) for edge in grouped.mesh.edges[grouped.mesh.on_outline].tolist()}
    assert not sheet_fault(grouped.mesh), "is accepted and no sheet"
    for name, edges in grouped.sides.items():
        assert len(edges) and {tuple(sorted(edge)) for edge in edges.tolist()} <= outline, name
    assert all(";" in why for why in grouped.unusable.values()), f"says no remedy: {grouped.unusable}"


TARGETS = {
    "studies as bytes": (study_bytes, read_study, 36),
    "studies by structure": (study_trees, read_study, 28),
    "mesh files as bytes": (partial(spoiled_file, mesh_files, NUMBERS), read_mesh, 20),
    "files of shapes": (partial(spoiled_file, shape_files, (*NUMBERS, "core", "NSET")), read_shape_file, 16),
}
"""How an input is made, how it is read, and how many of a hundred are of this kind."""


def load():
    """Import what processes need, before they are made: each would pay for it else."""
    with tempfile.TemporaryDirectory() as folder, redirect_stderr(io.StringIO()):
        for make, read, _ in TARGETS.values():
            try:
                read(make(Random(0), Path(folder)))
            except Exception:
                continue
