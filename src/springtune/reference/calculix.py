"""CalculiX (`ccx`) as a second opinion and as an approach of the benchmark: input, run and answer."""

import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ..problem.materials import Material


def quadratic_mesh(length: float, height: float, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points [m] and serendipity quadrilaterals (n_elements, 8): corners, then the middles of their sides."""
    columns, rows = max(1, round(length / size)), max(1, round(height / size))
    # Nodes on a grid of half the element size; the middles of elements stay without one.
    count = 2 * rows + 1
    i, j = (index.ravel() for index in np.meshgrid(np.arange(2 * columns + 1), np.arange(count), indexing="ij"))
    used = (i % 2 == 0) | (j % 2 == 0)
    number = np.cumsum(used) - 1
    points = np.stack([i * length / (2 * columns), j * height / (2 * rows)], axis=1)[used]
    first = (2 * np.arange(columns)[:, None] * count + 2 * np.arange(rows)).ravel()
    steps = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    return points, np.stack([number[first + di * count + dj] for di, dj in steps], axis=1)


def side_weights(points: np.ndarray, normal: int, value: float) -> np.ndarray:
    """Return each node's share, sum 1, of an even load on the side ``points[:, normal] == value`` [m] of a mesh."""
    along, tolerance = 1 - normal, 1e-9 * np.ptp(points[:, normal])
    side = np.flatnonzero(np.abs(points[:, normal] - value) <= tolerance)
    side = side[np.argsort(points[side, along])]
    weights, lengths = np.zeros(len(points)), np.diff(points[side, along])
    whole = lengths[::2] + lengths[1::2]
    for place, share in ((slice(0, -1, 2), 1 / 6), (slice(1, None, 2), 4 / 6), (slice(2, None, 2), 1 / 6)):
        weights[side[place]] += share * whole
    return weights / weights.sum()


def solve(
    points: np.ndarray,
    elements: np.ndarray,
    kind: str,
    material: Material,
    thickness: float,
    load: np.ndarray,
    held: np.ndarray,
    finite: bool = False,
) -> np.ndarray:
    """Return displacements [m] at small strain, or neo-Hookean ones at finite strain, of 3- or 8-noded elements."""

    def lines(rows: Iterable[Iterable[object]]) -> str:
        return "\n".join(", ".join(map(str, row)) for row in rows)

    forces = [(n + 1, axis + 1, repr(float(load[n, axis]))) for n, axis in np.argwhere(load != 0)]
    modulus, nu = material.young_modulus, material.poisson_ratio
    if material.plane == "strain":
        kind = kind.replace("CPS", "CPE")
    law = f"*ELASTIC\n{modulus!r}, {nu!r}"
    if finite:  # half the shear modulus, and 2 over the bulk modulus, in the 20 columns that a number may have
        law = f"*HYPERELASTIC, NEO HOOKE\n{modulus / (4 * (1 + nu)):.12e}, {6 * (1 - 2 * nu) / modulus:.12e}"
    increments = "0.1, 1.\n" if finite else ""
    clamps = [(n + 1, axis + 1, axis + 1) for n, axis in np.argwhere(held)]
    deck = f"""*NODE, NSET=ALL
{lines((n + 1, repr(float(x)), repr(float(y)), 0.0) for n, (x, y) in enumerate(points))}
*ELEMENT, TYPE={kind}, ELSET=SHEET
{lines((e + 1, *(nodes + 1).tolist()) for e, nodes in enumerate(elements))}
*MATERIAL, NAME=M
{law}
*SOLID SECTION, ELSET=SHEET, MATERIAL=M
{thickness!r}
*BOUNDARY
{lines(clamps)}
*STEP{", NLGEOM, INC=1000" if finite else ""}
*STATIC
{increments}*CLOAD
{lines(forces)}
*NODE PRINT, NSET=ALL
U
*END STEP
"""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "job.inp").write_text(deck)
        done = subprocess.run([PROGRAM, "job"], cwd=folder, capture_output=True, text=True)
        answer = Path(folder, "job.dat")
        if done.returncode or not answer.exists():
            raise RuntimeError(f"{PROGRAM} failed: {(done.stdout + done.stderr).strip()[-200:]}")
        found = re.findall(r"^\s+(\d+)\s+(\S+)\s+(\S+)\s+\S+\s*$", answer.read_text(), re.MULTILINE)
    displacements = np.zeros(points.shape)
    for number, x, y in found:
        displacements[int(number) - 1] = float(x), float(y)
    return displacements


PROGRAM = "ccx"


def program() -> str:
    """Return which CalculiX is installed, for plans: another one, or none, gives other results."""
    found = shutil.which(PROGRAM)
    if found is None:
        return ""
    state = Path(found).resolve().stat()
    return f"{state.st_size} {state.st_mtime_ns}"
