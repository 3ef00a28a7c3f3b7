"""The examples: each runs, and finds a number that is known from elsewhere."""

import math
import runpy
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"

STEEL, RUBBER = 210e9, 1e6
"""Young's moduli [Pa]."""

KNOWN = {
    # example: (number, relative tolerance), with where either is from
    # Table 1 of the paper; its finite elements are 0.11 % below converged ones, `patch` is within 0.2 % of those.
    "one_scene": (9.49e-3, 3e-3),
    # Closed form, outline included, at a/H = 1/6. Seven rows on 30 mm are 1 % lower than equilateral ones.
    "sensitivity_curve": (math.sqrt(3) / 2 * STEEL * 1e-3 / (1 + math.sqrt(3) / 2 * 5 / 30), 1e-2),
    # A bar without lateral strain is in uniform strain, which linear triangles hold: the patch test.
    "own_mesh_file": (1.0, 1e-9),
    # Closed form: a network of E t = 2 k / sqrt(3), and its two faces; ten rows. Their zigzag ends count as a/L = 1 %,
    # in the next number, too.
    "own_definition": (2 / math.sqrt(3) * (1 + 1 / 10) - 1, 2e-2),
    # Cauchy's relation.
    "poisson_ratio": (1 / 3, 1e-2),
    # The same.
    "orthotropic_springs": (1.0, 1e-9),
    # Closed form: equally stretched, the rows of all three directions carry, of which half is along each axis.
    "rubber_tests": (1.5, 1e-9),
    # Euler; shear takes off 0.1 % (Engesser), 18 rows of linear triangles, too stiff in bending, add 0.6 %.
    "buckling": (1.0, 1e-2),
    # sqrt(E/rho) / (4 L); the clamped end, which cannot shrink sideways, adds 0.1 %.
    "dynamics": (math.sqrt(STEEL / 7850) / 0.4, 2e-3),
    # Bernoulli's beam; shear takes off 0.3 %, 12 rows of linear triangles, too stiff in bending, add 0.6 %.
    "let_go": (1.8751**2 / (2 * math.pi * 0.1**2) * math.sqrt(STEEL / 7850 / 12) * 5e-3, 1e-2),
    # Section 4.1 of the paper, printed to three digits.
    "pressed_block": (3.14e-3, 2e-3),
    # Closed form of the equilateral lattice.
    "predict": (math.sqrt(3) / 2 * STEEL * 1e-3, 1e-9),
    # Closed form: uniform strain, which linear triangles hold.
    "laminate": (1.0, 1e-9),
    # Closed form of uniaxial tension of a neo-Hooke sheet: the force is that of twice its length.
    "stretched_rubber": (2.0, 1e-8),
    # Lame; linear triangles of a twentieth of the ring's wall.
    "shape_from_file": (1.0, 5e-3),
    # Howland, hole a fifth of the width, by Peterson's polynomial; recovered from triangles of .4 mm at the rim.
    "plate": ((3 - 3.14 * 0.2 + 3.667 * 0.2**2 - 1.527 * 0.2**3) / (1 - 0.2), 1.5e-2),
}

ON_A_DATASET = {"read_dataset"}
"""Run by tests/workflow/test_quick.py, which has one."""


def test_every_example_has_a_known_number():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(KNOWN) | ON_A_DATASET


@pytest.mark.parametrize("name", KNOWN)
def test_example(name, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    number, tolerance = KNOWN[name]
    found = runpy.run_path(str(EXAMPLES / f"{name}.py"))["main"]()
    assert found == pytest.approx(number, rel=tolerance)
    assert 1 <= len(capsys.readouterr().out.splitlines())
    assert not list(tmp_path.iterdir()), "leaves files behind"
