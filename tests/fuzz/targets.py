"""What is fed: studies, mesh files, datasets, nets and archives, as bytes and by their structure; texts and paths."""

import hashlib
import io
import json
import os
import random as generators
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
import zipfile
from contextlib import redirect_stdout
from functools import cache, partial
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import h5py
import jinja2
import meshio
import numpy as np
import yaml
from docutils import nodes
from docutils.core import publish_doctree
from harness import Refused, Target, Wrong
from markdown_it import MarkdownIt
from matplotlib.figure import Figure
from mutations import WORDS, spoil_bytes, spoil_counts, spoil_tree
from snakemake.utils import format as rendered
from springtune.studies.archive.contents import METADATA, SUMS

import springtune as st
from springtune.cli.diff import comparison_text
from springtune.cli.results import verified
from springtune.handover.formats import ENDINGS
from springtune.mechanics.moduli import PatchTest
from springtune.mesh import MESH_TYPES, MeshError, corner_angles, read_beam_mesh, signed_areas, write_mesh
from springtune.mesh.formats import read_shape
from springtune.mesh.outlines import mesh_shape
from springtune.mesh.sheets import sheet_fault
from springtune.safe_io.escapes import UNSEEN, markdown, no_mathematics, rst
from springtune.studies.archive import reproduction
from springtune.studies.config.kind import kinds
from springtune.studies.kinds import load_study
from springtune.studies.kinds.scenes.kind import summary
from springtune.studies.output import reading
from springtune.studies.output.browse.page import page
from springtune.studies.output.comparison import compare
from springtune.studies.output.dataset import write
from springtune.studies.output.export import export
from springtune.studies.output.page import html as tables_page
from springtune.studies.output.page import shown as shown_table
from springtune.studies.output.style import png_and_pdf, styled
from springtune.studies.output.summing_up import info_text
from springtune.studies.runs import rerun, workload
from springtune.studies.runs.plan import plan

import synthetic

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


# -- datasets ----------------------------------------------------------------------------------------------------------


@cache
def _dataset():
    """Content of a small dataset with every group."""
    tree = synthetic.dataset()
    groups = {node.path: node.to_dataset(inherit=False) for node in tree.subtree}
    attributes = {"title": "Fuzz", "study": "fuzz", "springtune_version": "1", "software": "{}", "config": "title: x"}
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / "dataset.nc", groups, attributes)
        return (Path(folder) / "dataset.nc").read_bytes()


def dataset_bytes(random, folder):
    path = folder / "dataset.nc"
    content = _dataset()
    if random.random() < 0.5:  # where HDF5 keeps its structure, not its numbers
        head = random.choice((512, 4096, 20_000))
        content = spoil_bytes(random, content[:head]) + content[head:]
    else:
        content = spoil_bytes(random, content)
    path.write_bytes(content)
    return path, random.randrange(5)


def dataset_structure(random, folder):
    """A dataset of which groups, variables or attributes are missing, or are of another size or type."""
    path = folder / "dataset.nc"
    path.write_bytes(_dataset())
    with h5py.File(path, "r+") as file:
        names = []
        file.visit(names.append)
        for _ in range(random.choice((1, 1, 2, 4))):
            name = random.choice(names)
            if name not in file:
                continue
            kind = random.randrange(11)
            try:
                one = file[name]  # a link to another file leads nowhere
                if kind == 0:
                    del file[name]
                elif kind == 1 and one.attrs:
                    del one.attrs[random.choice(list(one.attrs))]
                elif kind == 2 and one.attrs:
                    one.attrs[random.choice(list(one.attrs))] = random.choice((1.5, "x", np.arange(3), b"\xff", ""))
                elif kind == 3 and file.attrs:
                    key = random.choice(list(file.attrs))
                    file.attrs[key] = random.choice((7, "{", "x" * 100_000, np.zeros(2)))
                elif kind in (4, 5) and isinstance(one, h5py.Dataset):
                    values = random.choice(
                        (np.zeros(()), np.zeros(3), np.zeros((2, 2)), np.array(["a", "b"], dtype="S1"))
                    )
                    del file[name]
                    file[name] = values
                elif kind == 6:
                    file.move(name, f"{name}_other")
                elif kind == 7:  # data of other files
                    del file[name]
                    file[name] = h5py.ExternalLink("/etc/passwd", name)
                elif kind in (8, 9, 10) and isinstance(one, h5py.Dataset):
                    shape = one.shape
                    del file[name]
                    if kind == 8:
                        file.create_dataset(name, shape, "u1", external=[("/etc/passwd", 0, h5py.h5f.UNLIMITED)])
                    elif kind == 9:
                        layout = h5py.VirtualLayout(shape, "f8")
                        layout[...] = h5py.VirtualSource("other.nc", name, shape)
                        file.create_virtual_dataset(name, layout)
                    else:  # a chunk is read as one
                        long = {"maxshape": (None,), "chunks": (random.choice((10**6, 10**8, 5 * 10**8)),)}
                        file.create_dataset(name, (3,), "f8", compression="gzip", **long)[:] = 1.0
            except (OSError, KeyError, ValueError, RuntimeError, TypeError):
                continue
    return path, random.randrange(5)


def read_dataset(made):
    """Open a dataset and say what it holds, export it, make its page, or say what changed from the sound one."""
    path, how = made
    try:
        reading.check_opens(path)
        if how == 0:
            page(path)
            return "accepted"
        with reading.open(path) as tree, reading.guarded(path):
            if how == 1:
                info_text(tree, path)
            elif how == 2:
                target = path.with_name("out.csv")
                export(tree, target, "/", [], {}, force=True)
            elif how == 3:
                sound = path.with_name("sound.nc")
                sound.write_bytes(_dataset())
                with reading.open(sound) as other:
                    comparison_text(compare(other, tree, most=5), (sound, path), ("before", "after"))
            else:
                st.field(tree, beam="200x40", mesh_type="free", mesh_size=5e-3)
    except (OSError, ValueError) as error:
        raise Refused(str(error)) from None
    return "accepted"


# -- nets --------------------------------------------------------------------------------------------------------------


@cache
def _nets():
    """Contents of the files of a small net, by their names: one or, of tables, several.

    Not of HDF5, whose own library never comes to an end on some damaged files; no command reads nets.
    """
    scene = st.Scene(st.Beam(*BOX), _mesh("free"), st.Material(210e9, 0.3), "traction", 1.0, definition="delingette")
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for ending in (ending for ending in ENDINGS if ending != ".h5"):
            written = scene.springs.write(Path(folder) / f"net{ending}", errors=False)
            found.append({path.name: path.read_bytes() for path in written})
    return found


def net_bytes(random, folder):
    files = random.choice(_nets())
    spoiled = random.choice(list(files))
    for name, content in files.items():
        (folder / name).write_bytes(spoil_bytes(random, content, NUMBERS) if name == spoiled else content)
    return folder / next(iter(files))


def read_net(path):
    """Read a net; what is accepted is whole, and is written and read again as it is."""
    try:
        net = st.SpringNet.read(path)
    except ValueError as error:
        raise Refused(str(error)) from None
    net.write(path.with_name("again.json"))
    if (st.SpringNet.read(path.with_name("again.json")).stiffness != net.stiffness).any():
        raise Wrong("is accepted, and another one when it was written again")
    return "accepted"


# -- archives ----------------------------------------------------------------------------------------------------------


@cache
def _archived():
    """Files of a small archive, and its metadata as a tree."""
    snakefile, config, dataset = "code/Snakefile", "code/config/one.yaml", "results/one/dataset.nc"
    files = {snakefile: b"rule all:\n", config: b"title: One\n", dataset: bytes(range(256)) * 40}
    files["code/plate mesh.vtu"] = b"<VTKFile>" * 500
    described = [
        {"@id": name.replace(" ", "%20"), "@type": "File", "sha256": hashlib.sha256(content).hexdigest()}
        for name, content in files.items()
    ]
    described[0] |= {"input": {"@id": "#study"}, "output": {"@id": "#dataset"}}
    described += [
        {"@id": "./", "name": "One", "version": "0.1.0", "conformsTo": [{"@id": reproduction.MADE_BY}]},
        {"@id": "#study", "workExample": {"@id": config}},
        {"@id": "#dataset", "workExample": {"@id": dataset}},
        {"@id": "#machine-cores", "@type": "PropertyValue", "name": "cores", "value": "2"},
        {"@id": "#collect-s", "@type": "PropertyValue", "name": "wall time", "value": "0.25"},
    ]
    return files, {"@context": "https://w3id.org/ro/crate/1.1/context", "@graph": described}


def _sums(files):
    return "".join(f"{hashlib.sha256(content).hexdigest()}  {name}\n" for name, content in files.items()).encode()


def _zipped(files):
    """Bytes of a zip file of members: names or their ZipInfo, and contents."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of names that are there twice
        for name, content in files:
            archive.writestr(name, content)
    return target.getvalue()


@cache
def _archive():
    files, tree = _archived()
    files = files | {METADATA: json.dumps(tree).encode()}
    return _zipped([*files.items(), (SUMS, _sums(files))])


def archive_bytes(random, folder):
    path, content = folder / "one.zip", _archive()
    # Where the lists of contents are, or anywhere.
    start = content.index(b"PK\1\2") if random.random() < 0.5 else 0
    path.write_bytes(content[:start] + spoil_bytes(random, content[start:], (METADATA, SUMS, "../", "PK\1\2")))
    return path, False


NAMES = (*"/etc/passwd ../x code/../../x code//x ./x code/Snakefile/x \\x ü".split(), "", "x" * 60_000, "a\nb")
"""Names that no archive has."""


def archive_structure(random, folder):
    """An archive of which metadata, checksums or members are others; its other checksums are right."""
    path, (files, tree) = folder / "one.zip", _archived()
    text = json.dumps(spoil_tree(random, tree) if random.random() < 0.6 else tree).encode()
    kind = random.randrange(8)
    if kind == 0:
        text = random.choice((b"[", b'{"a":')) * random.choice((900, 30_000, 300_000))
    elif kind == 1:
        text = random.choice((b"\0", b" ", b"[[],[]," * 20)).ljust(100, b" ") * random.choice((10, 1000, 200_000))
    elif kind == 2:
        text = text.replace(b'"', random.choice((b"'", b'\\"', b'"\\ud800')), random.randrange(1, 9))
    files = files | {METADATA: text}
    sums = _sums(files)
    if kind == 3:
        sums = random.choice((b"\n", b" ", b"\xff", sums[:70])) * random.choice((1, 300, 20_000, 300_000))
    members = [*files.items(), (SUMS, sums)]
    if kind in (4, 5):
        info = zipfile.ZipInfo(random.choice((*NAMES, *files)))
        info.external_attr = random.choice((0, 0o120777, 0o020666, 0o040755)) << 16
        info.compress_type = random.choice((zipfile.ZIP_STORED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA))
        members.insert(random.randrange(len(members) + 1), (info, bytes(random.choice((0, 10, 3_000_000)))))
    elif kind == 6:
        members += [(f"{number}/", b"") for number in range(random.choice((10, 3000)))]
    elif kind == 7:
        del members[random.randrange(len(members))]
    path.write_bytes(_zipped(members))
    return path, True


def read_archive(made):
    """Check an archive as `springtune verify` does; without a fault it holds what was packed."""
    path, rewritten = made
    try:
        whole = verified(path, again=False, fresh=False)
    except ValueError as error:
        if "\n" in str(error):
            raise Wrong(f"is refused in several lines: {str(error)[:300]!r}") from None
        raise Refused(str(error)) from None
    if whole and not rewritten:
        with zipfile.ZipFile(path) as archive, zipfile.ZipFile(io.BytesIO(_archive())) as sound:
            if any(archive.read(name) != sound.read(name) for name in sound.namelist()):
                raise Wrong("is accepted, and holds what was not packed")
    return "accepted" if whole else "faulty"


# -- texts -------------------------------------------------------------------------------------------------------------

PIECES = (
    *("`click <javascript:alert(1)>`__", "<script>alert(1)</script>", "$x_{", "$", ".. raw:: html", "*", "**", "|b|"),
    *("Statistics_", "a__", "http://x.org", "x@y.org", "[1]_", "`a`", "::", "\\", "\\\\", '#panic("x")', "{{ 7*7 }}"),
    *("{%", "%}", "<!--", "&lt;", "'", '"', "- ", "1. ", "+ ", "===", "```", "~~", "[a](b)", "![a](b)", ">>> ", ":f: "),
    *(
        "\n",
        "\r",
        "\0",
        "\x1b[2K",
        "\t",
        "\x85",
        "\u2028",
        "\u202e",
        "\ud800",
        "é",
        "中",
        "\u00a0",
        " ",
        "  ",
        "x",
        "0",
    ),
)
"""Parts of texts that mean something to a terminal, or in RST, HTML, Markdown, Jinja, Typst or a formula."""

FEW_TAGS = {"meta", "style", "html", "head", "body", "title", "h1", "h2", "p", "div", "table", "thead", "tbody", "tr",
            "th", "td", "a"}  # fmt: skip
"""Tags of the page of tables."""


def texts(random, folder):
    """A study with a hostile title, source and name of a grid, and the text of all of them."""
    text = "".join(random.choice(PIECES[: random.choice((44, len(PIECES)))]) for _ in range(random.randrange(1, 9)))
    path = folder / "study.yaml"
    # As JSON, which has escapes for all of it, and is YAML.
    beam = {"beam": "b", "mesh_type": "structured", "mesh_size": "5 mm", "material": "m", "load": "traction"}
    study = {
        "title": text,
        "beams": {"b": {"length": "20 mm", "height": "10 mm"}},
        "materials": {"m": {"young_modulus": "1 MPa", "poisson_ratio": 0.3}},
        "grids": {text: beam | {"force": "1 N", "definition": "lattice", "sensitivity": False}},
    }
    path.write_text(json.dumps(study))
    return path, text


def read_texts(made):
    """Read a study, and look at what becomes of its title in a report, a table, a figure and a readme."""
    path, text = made
    try:
        title = load_study(path).title
    except st.StudyError as error:
        message = str(error)
        if not re.match(r"\S+/study.yaml:1: (title|grids)\b.*;", message) or UNSEEN.search(message.replace("\n", "")):
            raise Wrong(f"is refused without line, key or remedy, or in other characters: {message!r}") from None
        raise Refused(message) from None
    if title != text or UNSEEN.search(title):
        raise Wrong(f"is accepted as {title!r}")
    said = " ".join(title.split())
    caption = jinja2.Template((REPOSITORY / "workflow/report/study.rst").read_text())
    links = "\n\n.. _Statistics: x\n.. _Workflow: x\n"
    config = {"title": rst(title), "results": "results/study"}
    document = publish_doctree(
        caption.render(snakemake={"config": config}) + links, settings_overrides={"report_level": 5}
    )
    odd = [
        type(node).__name__
        for node in document.findall()
        if isinstance(node, nodes.raw | nodes.system_message | nodes.problematic)
    ]
    named = [node.astext() for node in document.findall(nodes.reference)]
    if odd or named != ["Statistics", "Workflow"] or " ".join(document[0].astext().split()) != said:
        raise Wrong(f"is {odd}, links {named} and {document[0].astext()!r} in a report")
    table = {"stem": "x", "title": title, "note": title, "rows": [{"scene": title}]}
    tags = Tags(tables_page([], [shown_table(table)], [], {"title": title}))
    if tags.found - FEW_TAGS or " ".join("".join(tags.texts).split()).count(said) < 4:
        raise Wrong(f"is {tags.found - FEW_TAGS} and {tags.texts} on a page")
    heading = MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"]).parse(f"# {markdown(title)}")
    inline = heading[1].children or []
    if {one.type for one in inline} - {"text", "text_special"} or "".join(
        one.content for one in inline
    ).split() != said.split():
        raise Wrong(f"is {[one.type for one in inline]} in a readme")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of characters that the font has not
        png_and_pdf(_titled(title).figure)
    return "accepted"


class Tags(HTMLParser):
    """Tags and texts of a page."""

    def __init__(self, content):
        super().__init__()
        self.found, self.texts = set(), []
        self.feed(content)

    def handle_starttag(self, tag, attributes):
        self.found.add(tag)

    def handle_data(self, data):
        self.texts.append(data)


@styled
def _titled(text):
    panel = Figure(figsize=(2, 1)).subplots()
    panel.set_title(text)
    panel.set_yticks([0], [no_mathematics(text)])
    return panel


# -- paths -------------------------------------------------------------------------------------------------------------

PARTS = (
    *"abz09._- ~!@#$%^&*()+=[]{}|;:'\",<>?\\`\t\n\r\x1b\x7füßЖ中\u202e\u2028\U0001f600\udcff",
    "$(touch PWNED)", "`touch PWNED`", "; touch PWNED;", "& touch PWNED &", "| touch PWNED", "> PWNED ",
    "\ntouch PWNED\n", "{input}", "{params.config}", "{{}}", "${HOME}", "$'x'", "''", "'\\''", "--", "%s", "%j", "..",
    "\\n",
)  # fmt: skip
"""What names are put together from; a surrogate stands for a byte that is not UTF-8."""

STUDY = b"""
title: A path
beams: {small: {length: 50 mm, height: 20 mm}}
materials: {steel: {young_modulus: 210 GPa, poisson_ratio: 0.3}}
grids:
  one: {beam: small, mesh_type: structured, mesh_size: 10 mm, material: steel, load: traction, force: 20 kN,
        definition: lattice}
"""


@cache
def _shell_blocks():
    """Commands of all rules, as Snakemake puts them together; that of a job on another machine is one of these."""
    texts = [path.read_text() for path in sorted((REPOSITORY / "workflow/rules").glob("*.smk"))]
    blocks = re.findall(r"shell:\n((?:\s+\".*\"\n)+)", "".join(texts))
    found = ["".join(re.findall(r'"(.*)"', block)) for block in blocks]
    return [one for one in found if one != "{params.command}"]


def _name(random):
    name = "".join(random.choice(PARTS) for _ in range(random.choice((1, 2, 3, 8))))
    return f"{name}_" if name in (".", "..") else name


def paths(random, folder):
    stem = _name(random) if random.random() < 0.2 else random.choice(("mine", "-mine", "a.b"))
    path = folder / _name(random) / f"{stem}.yaml"
    path.parent.mkdir()
    path.write_bytes(STUDY)
    return path


def plan_paths(path):
    """Plan a study in a folder of some name; each command of a rule gives its program what the rule has."""
    os.chdir(path.parent)
    try:
        study = load_study(path.name)
    except st.StudyError as error:
        raise Refused(str(error)) from None
    here = Path.cwd()
    why = workload.refusal(Path(path.name), here, here, Path(sys.executable), on_cluster=False)
    if why:
        raise Refused(why)
    jobs = rerun.jobs(study, plan(study, Path("results") / study.name, 2))
    # A function stands for Python; it says what it is called with.
    script, expected = [r"""python() { printf '%s\0' "$@"; }"""], {}
    for number, block in enumerate(_shell_blocks()):
        log = f"{number}{here.name}.log"
        known = {
            "log": log,
            "params.config": str(path),
            "params.source": str(here),
            "params.digest": jobs["collect"].digest,
        }
        values = {name: known.get(name, [here.name, str(here)]) for name in re.findall(r"\{([a-z.]+)", block)}
        whole = {name: value for name, value in values.items() if "." not in name}
        for name in values.keys() - whole.keys():
            holder, _, part = name.partition(".")
            vars(whole.setdefault(holder, SimpleNamespace()))[part] = values[name]
        script.append(rendered(block, **whole) + ("" if "log" in values else " > " + rendered("{log:q}", log=log)))
        words = block.partition(" > ")[0].split()[1:]
        given = [values.get(word.strip("{}").removesuffix(":q"), word) for word in words]
        expected[log] = [word for one in given for word in ([one] if isinstance(one, str) else one)]
    subprocess.run(["sh", "-c", "\n".join(script)], check=True)
    found = {one.name: one.read_bytes().decode().split("\0")[:-1] for one in here.iterdir() if one.name != path.name}
    if found != expected:
        raise Wrong(f"commands with {str(path)!r} do not have it as it is")
    return "accepted"


TARGETS = (
    Target("studies as bytes", study_bytes, read_study, 25),
    Target("studies by structure", study_trees, read_study, 15),
    Target("mesh files as bytes", mesh_bytes, read_mesh, 13),
    Target("mesh files by structure", mesh_structure, read_mesh, 13),
    Target("files of shapes", shape_files, read_shape_file, 8),
    Target("datasets as bytes", dataset_bytes, read_dataset, 7),
    Target("datasets by structure", dataset_structure, read_dataset, 4),
    Target("nets as bytes", net_bytes, read_net, 4),
    Target("archives as bytes", archive_bytes, read_archive, 1),
    Target("archives by structure", archive_structure, read_archive, 2),
    Target("texts", texts, read_texts, 4),
    Target("paths", paths, plan_paths, 4),
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
