"""Files that appear whole or not at all; and input that is refused, and what it said or did before it was.

Found by the targets of tests/fuzz, or by people.
"""

import os
import platform
import re
import shutil
import struct
import subprocess
import sys
import time
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
import yaml
from click.testing import CliRunner

import springtune as st
from springtune.cli import main
from springtune.mesh.formats import read_beam_mesh, read_shape, write_mesh
from springtune.mesh.rows import braced, lattice, right
from springtune.safe_io import ABANDONED_SECONDS, remove_unfinished, replacing, write_text
from springtune.studies.output.browse import page
from springtune.studies.output.dataset import write

from synthetic import dataset
from tables import STUDIES, beside, cases, evaluated

BEAM, STEEL = st.Beam("100 mm", "20 mm"), st.Material("210 GPa", 0.3)

SMALL = "\n" + STUDIES["bad_input_small"]  # of a file, lines are told from 2 on


def sizes(count):
    return "[" + ", ".join(f"{1 + number / 1e4:.4f} mm" for number in range(count)) + "]"


STUDIES = {
    "a long list": (SMALL.replace("5 mm", sizes(10_001)), "mesh_size: 10001 values; give at most 10000, or split"),
    "a large file": (SMALL + "#" * 500_000, "larger than 0.5 MB"),
    "aliases of aliases": (
        "a0: &a0 [x, y]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}, *a{n - 1}]\n" for n in range(1, 30)),
        "study.yaml:1: more than 100000 values, aliases (*name) as what they stand for; give",
    ),
}


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_beyond_limits_is_refused_before_it_is_expanded(tmp_path, name):
    text, says = STUDIES[name]
    path = tmp_path / "study.yaml"
    path.write_text(text)
    with pytest.raises(st.StudyError) as caught:
        st.load_study(path)
    assert says in str(caught.value) and len(str(caught.value)) < 2000


@pytest.mark.parametrize("fault", ["No such file", "Is a directory"])
def test_a_mesh_file_that_cannot_be_meant_is_an_error_of_the_study(tmp_path, fault):
    file = tmp_path / "own.vtu"
    if fault == "Is a directory":
        file.mkdir()
    text = SMALL.replace("mesh_type: structured", "mesh_type: own")
    (tmp_path / "study.yaml").write_text(text + "mesh_files: {own: [{file: own.vtu, beam: a, mesh_size: 5 mm}]}\n")
    with pytest.raises(st.StudyError, match=rf"mesh_files\.own\[0\]\.file: .*own\.vtu': {fault}.*; give"):
        st.load_study(tmp_path / "study.yaml")


POINTS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def of_cells(mesh, kept, corners=3):
    """A mesh of some cells of another one."""
    used, cells = np.unique(kept, return_inverse=True)
    cells = cells.reshape(-1, corners)
    return st.Mesh(mesh.points[used], *([cells] if corners == 3 else [mesh.triangles, cells]))


def plate(hole, mesh_type="structured"):
    """A plate without the cells in its middle, or without a corner."""
    whole = st.MESH_TYPES[mesh_type](0.1, 0.04, 2.5e-3)
    middles = whole.points[whole.triangles].mean(axis=1)
    keep = (np.abs(middles - ([0.05, 0.02] if hole else [0.1, 0.04])) > 0.01).any(axis=1)
    return of_cells(whole, whole.triangles[keep])


@pytest.mark.parametrize("hole", [True, False])
@pytest.mark.parametrize("definition", ["patch", "patch-area"])
def test_a_patch_test_takes_no_rim_for_an_end(hole, definition):
    """It took the rim of a hole for ends, and gave 468e6 N/m for 182e6. The rows are all but equilateral."""
    found = st.DEFINITIONS[definition].springs(plate(hole), STEEL, 1e-3)
    plain = st.DEFINITIONS["area" if "area" in definition else "lattice"].springs(plate(hole), STEEL, 1e-3)
    assert found.reference == pytest.approx(plain.reference, rel=0.02)
    assert st.moduli(plate(hole), STEEL, definition).young_modulus_error == pytest.approx(0, abs=1e-9)


def test_parts_and_slanted_sides_have_the_moduli_of_linear_triangles():
    whole = right(0.1, 0.02, 5e-3)
    cells = np.vstack([whole.triangles, whole.triangles + len(whole.points)])
    twice = st.Mesh(np.vstack([whole.points, whole.points + [0.2, 0]]), cells)
    trapezoid = st.Mesh(whole.points * (1 + whole.points[:, 1:] * [5, 0]), whole.triangles)
    turned = st.Mesh(whole.points @ [[0.8, 0.6], [-0.6, 0.8]], whole.triangles)
    for mesh in (twice, trapezoid, turned, plate(True, "right")):
        found = st.moduli(mesh, STEEL, "delingette")
        measured = found.young_modulus_error, found.poisson_ratio, found.shear_modulus_error
        assert measured == pytest.approx((0, 0.3, 0), abs=1e-9)


def test_springs_with_a_lateral_stress_are_tested_on_strips_alone():
    """Their stress pulls on the two long faces."""
    squares = braced(0.1, 0.04, 5e-3)
    notched = of_cells(squares, squares.quads[1:], 4)
    with pytest.raises(st.MeshError, match="lateral stress: its ends do not run .*; give a full rectangle"):
        st.moduli(notched, STEEL, "baudet-corrected")


def test_a_strip_with_staggered_ends_has_one():
    """Linear triangles are exact under an even strain, and so is the modulus on any strip."""
    skewed = right(0.1, 0.02, 5e-3)
    skewed = st.Mesh(skewed.points + 0.3 * skewed.points[:, 1:] * [1, 0], skewed.triangles)
    for mesh in (lattice(12, 8, 1e-3), lattice(12, 7, 1e-3), skewed):
        assert abs(st.moduli(mesh, STEEL, "delingette").young_modulus_error) < 1e-9


@pytest.mark.parametrize("call", [st.predict, lambda *scene: st.Scene(*scene, "traction", "1 kN")])
def test_a_scene_and_a_prediction_are_of_a_beam_that_is_filled(call):
    with pytest.raises(ValueError, match="mesh: does not fill its beam: its cells cover 90 %"):
        call(st.Beam("100 mm", "40 mm"), plate(True), STEEL)


MESH = st.make_mesh(BEAM, "structured", "5 mm")


def test_an_instability_of_the_patch_test_is_a_failed_scene():
    result = st.Scene(BEAM, MESH, st.Material("210 GPa", -0.5), "traction", "1 kN", definition="patch-area").solve()
    assert result.status is st.Status.FAILED and "unstable at rest" in result.message


def test_a_definition_and_a_mesh_type_that_return_something_else_are_refused():
    st.definition("nothing")(lambda mesh, material, thickness: None)
    st.mesh_type("nothing")(lambda length, height, size: None)
    try:
        with pytest.raises(st.DefinitionError, match=r"returns NoneType; return springtune\.Springs"):
            st.DEFINITIONS["nothing"].springs(MESH, STEEL, 1e-3)
        with pytest.raises(st.MeshError, match=r"mesh type 'nothing' returns NoneType; return springtune\.Mesh"):
            st.make_mesh(BEAM, "nothing", "5 mm")
    finally:
        st.DEFINITIONS.discard("nothing")
        st.MESH_TYPES.discard("nothing")


class TestFiles:
    def test_many_points_at_one_place_are_found_at_once(self, tmp_path):
        """Pairs of them all would be billions."""
        whole = right(0.1, 0.02, 1e-3)
        corners = whole.triangles.ravel()
        points = np.column_stack([whole.points[corners], np.zeros(len(corners))])
        meshio.Mesh(points, [("triangle", np.arange(len(corners)).reshape(-1, 3))]).write(tmp_path / "own.vtu")
        with pytest.raises(st.MeshError, match="two points at .* do not join their cells .*; merge duplicate points"):
            read_beam_mesh(tmp_path / "own.vtu", 0.1, 0.02)


PLATE = right(0.1, 0.02, 0.01)


def stated(blocks, count):
    """Counts at the head of a section of Gmsh's format 4.1: blocks, nodes or elements, the smallest and the last."""
    return struct.pack("<4Q", blocks, count, 1, count)


STATED = 4_000_000_000

COUNTS = evaluated(beside(__file__)["COUNTS"], globals())


def plate_file(folder, name, ending, options):
    """A good file of `PLATE`, in a format of meshio."""
    path = folder / f"plate.{ending}"
    points = np.column_stack([PLATE.points, np.zeros(len(PLATE.points))])
    mesh = meshio.Mesh(points, [("triangle", PLATE.triangles)])
    mesh.write(path, file_format=name.partition(",")[0], **options)
    return path


class TestCounts:
    """Files of some kilobytes that state billions of points or cells: what they took, or why they were refused."""

    @pytest.mark.usefixtures("mesh_library")
    @pytest.mark.parametrize("name", COUNTS)
    def test_a_stated_count_is_no_reason_to_take_memory(self, tmp_path, name):
        ending, options, sound, other = COUNTS[name]
        path = plate_file(tmp_path, name, ending, options)
        assert len(read_shape(path).mesh.points) == len(PLATE.points)
        sound = sound % len(PLATE.points) if b"%" in sound else sound
        content = path.read_bytes()
        assert sound in content
        path.write_bytes(content.replace(sound, other, 1))
        for read in (read_shape, lambda path: read_beam_mesh(path, 0.1, 0.02)):
            says = r"plate\.\w+: .*is damaged[^\n]*; write it again(, in text, or as .vtu)?$"
            with pytest.raises(st.MeshError, match=says):
                read(path)


class TestOfOtherKinds:
    """Pipes, devices and folders in the place of files: what opened a pipe without a writer never came to an end."""

    @pytest.fixture(params=["a pipe", "/dev/zero", "a folder"])
    def odd(self, request, tmp_path):
        path = tmp_path / "odd.csv"
        if request.param == "a pipe":
            os.mkfifo(path)
        elif request.param == "a folder":
            path.mkdir()
        else:
            path.symlink_to(request.param)
        return path

    @cases
    def test_a_file_that_a_study_names(self, tmp_path, odd, old, new, more):
        assert old in SMALL
        (tmp_path / "study.yaml").write_text(SMALL.replace(old, new) + more)
        says = "odd.csv'.*(a pipe or a device, not a file|Is a directory|not a file); "
        with pytest.raises(st.StudyError, match=says):
            st.load_study(tmp_path / "study.yaml")

    @cases
    def test_what_a_command_is_given(self, tmp_path, odd, command, monkeypatch):
        monkeypatch.chdir(tmp_path)
        name, *options = command
        told = CliRunner().invoke(main, [name, odd.name, *options])
        assert told.exit_code and isinstance(told.exception, SystemExit), told.output
        assert ("index.html" if name == "browse" else "odd.csv") in told.output

    def test_a_mesh(self, odd):
        with pytest.raises(st.MeshError, match="odd.csv: there is no such file; give"):
            read_beam_mesh(odd, 0.1, 0.02)


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A dataset of two groups."""
    path = tmp_path_factory.mktemp("sound") / "dataset.nc"
    groups = {node.path: node.to_dataset(inherit=False) for node in dataset("fields", "moduli").subtree}
    write(path, groups, {"springtune_version": "1", "study": "x"})
    return path


class TestDatasets:
    @pytest.fixture
    def path(self, sound, tmp_path):
        return shutil.copy(sound, tmp_path / "dataset.nc")

    @pytest.mark.parametrize(
        "name", ["../x", "/etc/x", "a\nb", "a/b", "", "..", "one + ../x", "x" * 61, "{x}", b"\xff", [7, 8], ["a", "b"]]
    )
    def test_a_study_whose_name_is_no_name_is_refused(self, path, name):
        with h5py.File(path, "r+") as file:
            file.attrs["study"] = name
        with pytest.raises(ValueError, match="dataset.nc: attribute 'study' is .*use letters, digits"):
            st.open(path)

    def links(self, name, path):
        """Change a dataset so that data of another file are in it."""
        with h5py.File(path, "r+") as file:
            shape, attributes = file["deformation_error"].shape, dict(file["deformation_error"].attrs)
            del file["deformation_error"]
            if name == "an external link":
                file["deformation_error"] = h5py.ExternalLink(path.with_name("other.nc"), "/deformation_error")
            elif name == "stored outside of the file":
                external = [("/etc/passwd", 0, h5py.h5f.UNLIMITED)]
                file.create_dataset("deformation_error", shape, "u1", external=external)
            else:
                layout = h5py.VirtualLayout(shape, "f8")
                layout[:] = h5py.VirtualSource(path.with_name("other.nc"), "deformation_error", shape)
                file.create_virtual_dataset("deformation_error", layout)
            if name != "an external link":
                for key in ("DIMENSION_LIST", "units", "_Netcdf4Dimid", "_Netcdf4Coordinates"):
                    if key in attributes:
                        file["deformation_error"].attrs[key] = attributes[key]

    @pytest.mark.parametrize("name", ["an external link", "stored outside of the file", "a virtual dataset"])
    def test_data_of_other_files_are_refused_wherever_a_dataset_is_opened(self, path, name, monkeypatch):
        from springtune.studies.paper import PaperError
        from springtune.studies.paper.numbers import read as for_paper

        monkeypatch.chdir(path.parent)
        shutil.copy(path, path.with_name("other.nc"))
        self.links(name, path)
        says = rf"dataset.nc: 'deformation_error' is {name}[^;]*; links and other files are not followed"
        for call in (st.open, page):
            with pytest.raises(ValueError, match=says):
                call(path)
        with pytest.raises(PaperError, match=says):
            for_paper([path])
        commands = ["info", "diff . other.nc", "diff other.nc .", "export --to x.csv"]
        for command in commands:
            first, *rest = command.split()
            told = CliRunner().invoke(main, [first, *([] if "other.nc" in rest else ["dataset.nc"]), *rest])
            assert told.exit_code and re.search(says, told.output), f"{command}: {told.output}"
        assert not path.with_name("x.csv").exists()

    def test_a_mesh_file_is_refused_likewise(self, tmp_path):
        mesh = plate_file(tmp_path, "med", "med", {})
        with h5py.File(mesh, "r+") as file:
            names: list[str] = []
            file.visit(lambda one: names.append(one) if one.endswith("/COO") else None)
            [name] = names
            shape = file[name].shape
            del file[name]
            file.create_dataset(name, shape, "f8", external=[("/etc/passwd", 0, h5py.h5f.UNLIMITED)])
        with pytest.raises(st.MeshError, match=f"'{name}' is stored outside of the file, in '/etc/passwd'"):
            read_beam_mesh(mesh, 0.1, 0.02)
        with h5py.File(mesh, "r+") as file:
            file["elsewhere"] = h5py.SoftLink("/ENS_MAA")
            del file[name]
        with pytest.raises(st.MeshError, match="'elsewhere' is a soft link; links and other files are not followed"):
            read_beam_mesh(mesh, 0.1, 0.02)

    ODD = yaml.safe_load(Path(__file__).with_name("odd_datasets.yaml").read_text())

    @pytest.mark.parametrize(("spoil", "says"), ODD)
    def test_what_a_dataset_cannot_hold_is_refused_in_one_line(self, path, spoil, says):
        with h5py.File(path, "r+") as file:
            exec(spoil, {"file": file, "h5py": h5py, "np": np})
        told = CliRunner().invoke(main, ["info", str(path)])
        assert told.exit_code == 1 and isinstance(told.exception, SystemExit), told.output
        assert len(told.output.splitlines()) == 1 and str(path) in told.output and says in told.output


def test_two_processes_never_write_one_file(tmp_path):
    with replacing(tmp_path / "note.txt") as unfinished:
        assert unfinished.name == f"note.txt.{os.getpid()}@{platform.node().replace('.', '-')}.unfinished"
        unfinished.write_text("whole")
    assert [path.name for path in tmp_path.iterdir()] == ["note.txt"]


def test_an_error_leaves_what_was_there(tmp_path):
    write_text(tmp_path / "note.txt", "of before")
    with pytest.raises(ZeroDivisionError), replacing(tmp_path / "note.txt", synced=True) as unfinished:
        unfinished.write_text("half of")
        _ = 1 / 0
    assert [path.read_text() for path in tmp_path.iterdir()] == ["of before"]


def test_an_unfinished_mesh_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "replace", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_mesh(tmp_path / "mesh.vtu", st.MESH_TYPES["right"](0.05, 0.02, 1e-2))
    assert not list(tmp_path.iterdir())


def test_what_the_dead_left_is_swept_and_what_the_living_write_stays(tmp_path):
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as living:
        kept = tmp_path / "deep" / f"a.h5.{living.pid}.unfinished"
        write_text(kept, "half of")
        for name in ("deep/a.h5.99999999.unfinished", "b.unfinished", "c.x.unfinished", f"d.{10**30}.unfinished"):
            write_text(tmp_path / name, "half of")
        write_text(tmp_path / "deep/unfinished.txt", "whole")
        remove_unfinished(tmp_path, below=False)
        assert [path.name for path in tmp_path.iterdir()] == ["deep"] and len(list((tmp_path / "deep").iterdir())) == 3
        remove_unfinished(tmp_path)
        assert {path.name for path in (tmp_path / "deep").iterdir()} == {kept.name, "unfinished.txt"}
        living.communicate(b"\n")
    remove_unfinished(tmp_path)
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["unfinished.txt"]


def test_what_another_machine_writes_stays_for_an_hour(tmp_path):
    """Its processes are not to be seen, and one of this machine may have the same number."""
    (tmp_path / f"a.h5.{os.getpid()}@elsewhere.unfinished").write_text("half of")
    (tmp_path / "b.h5.99999999@else-where.unfinished").write_text("half of")
    remove_unfinished(tmp_path)
    assert len(list(tmp_path.iterdir())) == 2
    for path in tmp_path.iterdir():
        os.utime(path, (time.time() - ABANDONED_SECONDS - 1,) * 2)
    remove_unfinished(tmp_path)
    assert not list(tmp_path.iterdir())


def test_the_dead_that_nobody_waits_for_write_nothing(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    os.waitid(os.P_PID, dead.pid, os.WEXITED | os.WNOWAIT)
    write_text(tmp_path / f"note.txt.{dead.pid}.unfinished", "half of")
    remove_unfinished(tmp_path)
    assert not list(tmp_path.iterdir())
    dead.wait()
