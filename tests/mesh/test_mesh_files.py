"""Mesh files that say one body in many ways: each moves as the clean one does, or is refused by its true reason."""

import re
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
import yaml

import springtune as st
from springtune.mesh.formats import read_shape, write_mesh

# Two rows of four cells of 15 x 10 mm, the upper ones halved; the left half is hard.
POINTS = np.array([[15.0 * i, 10.0 * j] for j in range(3) for i in range(5)])
QUADS = np.array([[1, 2, 7, 6], [2, 3, 8, 7], [3, 4, 9, 8], [4, 5, 10, 9]])
TRIANGLES = np.array([half for a, b, c, d in QUADS + 5 for half in ([a, b, c], [a, c, d])])
RIGHT, LEFT = np.array([[5, 10], [10, 15]]), np.array([[11, 6], [6, 1]])
HARD = {4: np.array([1, 1, 0, 0], bool), 3: np.repeat(np.array([1, 1, 0, 0], bool), 2)}
SOFT = {count: ~mask for count, mask in HARD.items()}
CLEAN = st.GroupedMesh(
    st.Mesh(1e-3 * POINTS, TRIANGLES - 1, QUADS - 1),
    {"left": LEFT - 1, "right": RIGHT - 1},
    parts={"hard": HARD, "soft": SOFT},
)
STEEL, POLYMER = st.Material("210 GPa", 0.3, name="steel"), st.Material("3 GPa", 0.35, name="polymer")


def moves(grouped, names=("left", "right", "hard", "soft")):
    """Displacements of the right side that is pulled up and away, the left one fixed."""
    left, right, hard, soft = names
    found = [st.Quantity(axis, "displacement", right, axis) for axis in "xy"]
    load = st.LoadCase("pull", [st.Support(left, 0, 0)], [st.Traction(right, ("1 kN", "300 N"))], quantities=found)
    shape = st.Shape("own", 1e-3, file="own.msh", loads={"pull": load})
    materials = {name: {hard: STEEL, soft: POLYMER}[name] for name in grouped.parts}
    if len(materials) == 1:  # the other part is the main one
        materials[""] = POLYMER if hard in materials else STEEL
    return st.Scene(shape, grouped, materials, "pull", definition="uniform", kinematics="linear").solve().values


EXPECTED = moves(CLEAN)


def rows(table, first=1):
    return "".join(
        f"{', '.join(map(str, [number, *row]))}\n" for number, row in enumerate(np.asarray(table).tolist(), first)
    )


NODES, CPS4, CPS3 = rows(POINTS), rows(QUADS), rows(TRIANGLES, 5)
MESH = f"*NODE\n{NODES}*ELEMENT, TYPE=CPS4\n{CPS4}*ELEMENT, TYPE=CPS3\n{CPS3}"
ROWS = yaml.load(Path(__file__).with_name("mesh_files.yaml").read_text(), yaml.CSafeLoader)
SIDES, PARTS = ROWS["sides"], ROWS["parts"]
SETS = SIDES + PARTS
INP = f"*HEADING\nplate\n{MESH}{SETS}"


def blocks(hard="", soft=""):
    """Elements in four blocks."""
    lines = [one.splitlines(keepends=True) for one in (CPS4, CPS3)]
    parts = [("CPS4", hard, lines[0][:2]), ("CPS4", soft, lines[0][2:])]
    parts += [("CPS3", soft, lines[1][4:]), ("CPS3", hard, lines[1][:4])]
    return "".join(f"*ELEMENT, TYPE={kind}{name}\n{''.join(found)}" for kind, name, found in parts)


# What mesh_files.yaml puts into texts, and begins with.
BLOCKED, NAMED = INP.replace(MESH, f"*NODE\n{NODES}{blocks()}"), blocks(hard=", ELSET=hard", soft=",elset=soft")
SURFACES = blocks(hard=", ELSET=Surface1", soft=", ELSET=Surface2")
REST = "".join(line for line in NODES.splitlines(keepends=True) if not re.match(r"(1|6|11),", line))
HEAD = INP.partition("*ELSET")[0]
FLAT = "is not supported; write one flat model: in Abaqus/CAE, Model > Edit Attributes"
NOT_READ = "is not supported; mesh the part in the program and write all nodes and elements"
OTHER_FILES = "parts of it are in other files, whose changes would not be seen"
LINEAR = "write linear triangles and quadrilaterals only"
MSH = "write 4.1 or 2.2: Mesh.MshFileVersion = 4.1"
MSH41, MSH22 = ROWS["texts"].values()


def filled(text):
    """A text in which {NAME} is a text of this module."""
    return re.sub(r"\{([A-Z_]+)\}", lambda found: globals()[found[1]], text)


def changed(name, *changes):
    """A text of this module with some texts in place of others; END is the end of it."""
    text = globals()[name] if name else ""
    for old, new in changes:
        assert old == "END" or filled(old) in text, old
        text = text + filled(new) if old == "END" else text.replace(filled(old), filled(new))
    return text


ABAQUS = {name: changed(*row) for name, row in ROWS["abaqus"].items()}
ABAQUS["lower case, with comments, blanks, CR and a mark at the beginning"] = "\ufeff" + (MESH + SETS).lower().replace(
    "\n", "\r\n** a, 1\r\n\r\n  "
)


NUMBERED = ("102", "101", "201", "202")

GMSH = {name: changed(*row) for name, row in ROWS["gmsh"].items()}


def write_clean(path):
    write_mesh(path, replace(CLEAN, mesh=st.Mesh(POINTS, TRIANGLES - 1, QUADS - 1)))


def write_newer(path):
    """VTU of version 2, as ParaView writes it, with copies of no cell."""
    mesh = meshio.read(write_clean(path) or path)
    mesh.cell_data["vtkGhostType"] = [np.zeros(len(block.data), np.uint8) for block in mesh.cells]
    mesh.write(path)
    path.write_text(re.sub('version="[0-9.]+"', 'version="2.3"', path.read_text()))


def write_med(path):
    """Families of cells with one group, with two and with none."""
    cells = [("line", np.concatenate([RIGHT, LEFT]) - 1), ("quad", QUADS - 1), ("triangle", TRIANGLES - 1)]
    tags = [np.array([-1, -1, -2, -2]), np.where(HARD[4], -3, -4), np.where(HARD[3], -3, -4)]
    mesh = meshio.Mesh(POINTS, cells, cell_data={"cell_tags": tags})
    mesh.cell_tags = {-1: ["right", "ends"], -2: ["left", "ends"], -3: ["hard", "all"], -4: ["all"]}
    mesh.write(path)


def write_refs(path, key):
    """Numbers of groups as other formats have them."""
    cells = [("line", np.concatenate([RIGHT, LEFT]) - 1), ("quad", QUADS - 1), ("triangle", TRIANGLES - 1)]
    tags = [np.array([101, 101, 102, 102]), np.where(HARD[4], 201, 202), np.where(HARD[3], 201, 202)]
    meshio.Mesh(np.column_stack([POINTS, 0 * POINTS[:, 0]]), cells, cell_data={key: tags}).write(path)


WRITTEN = {
    "marks.vtu": write_clean,
    "version.vtu": write_newer,
    "plate.med": write_med,
    "numbers.mesh": lambda path: write_refs(path, "medit:ref"),
    "numbers.avs": lambda path: write_refs(path, "avsucd:material"),
}

TEXTS = {
    **{f"inp: {name}": ("plate.inp", text) for name, text in ABAQUS.items()},
    **{f"msh: {name}": ("plate.msh", text) for name, text in GMSH.items()},
}


@pytest.mark.usefixtures("mesh_library")
@pytest.mark.parametrize("name", [*TEXTS, *WRITTEN])
def test_one_body_in_many_files(tmp_path, name):
    file, text = TEXTS.get(name, (name, ""))
    if text:
        (tmp_path / file).write_bytes(text.encode())
    else:
        WRITTEN[name](tmp_path / file)
    found = read_shape(tmp_path / file, 1e-3)
    names = NUMBERED if NUMBERED[0] in found.sides else ("left", "right", "hard", "soft")
    assert found.mesh.area == pytest.approx(CLEAN.mesh.area, rel=1e-9)
    assert moves(found, names) == pytest.approx(EXPECTED, rel=1e-9)


def test_sets_that_are_left_out_have_a_reason(tmp_path):
    text = (
        ABAQUS["entities of Gmsh"] + "*SURFACE, NAME=Right\n4, S2\n*SURFACE, NAME=top\n5, S2\n*NSET, NSET=far\n4, 99\n"
    )
    (tmp_path / "a.inp").write_text(text)
    assert read_shape(tmp_path / "a.inp", 1e-3).unusable == {
        "top": "is a `*SURFACE`, which is not read; give a set of its points",
        "far": "has what is not in the file; remove this",
        "Surface1": "is no part, as others have a `*SOLID SECTION` or an `*ELSET`; use these",
        "Surface2": "is no part, as others have a `*SOLID SECTION` or an `*ELSET`; use these",
    }


def one_of_several(path):
    ghosts = [np.array([0, 0, 0, 1], np.uint8)]
    meshio.Mesh(POINTS, [("quad", QUADS - 1)], cell_data={"vtkGhostType": ghosts}).write(path)


def replaced(write, old, new):
    """A writer of a file with something else in it."""

    def written(path):
        write(path)
        path.write_bytes(path.read_bytes().replace(old, new))

    return written


REFUSED = {file: (changed(*row), filled(says)) for file, *row, says in ROWS["refused"]} | {
    "pieces.vtu": (replaced(write_clean, b"<Piece ", b"<Piece /><Piece "), "has 2 pieces, and one is read; join them"),
    "lz4.vtu": (replaced(write_clean, b"ZLib", b"LZ4"), "is compressed by LZ4, which is not read; write it with ZLib"),
    "ghosts.vtu": (one_of_several, OTHER_FILES),
    "parallel.vtu": (replaced(write_clean, b'"Unstr', b'"PUnstr'), OTHER_FILES),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_read_is_refused_by_its_reason(tmp_path, name, capfd):
    content, says = REFUSED[name]
    if callable(content):
        content(tmp_path / name)
    else:
        (tmp_path / name).write_text(content)
    with pytest.raises(st.MeshError, match=says) as caught:
        read_shape(tmp_path / name, 1e-3)
    assert not re.search(r"\(np\.|Error\)|\('", str(caught.value)) and not capfd.readouterr().out
