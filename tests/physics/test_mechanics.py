"""The audit's mechanics against closed forms: what checks the library has to be right by itself."""

import math
from dataclasses import replace

import numpy as np
import pytest

import audit
import mechanics
from mechanics import LONG, Body, Part, spring_forces
from springtune.mesh import MESH_TYPES
from springtune.springs import DEFINITIONS

RNG = np.random.default_rng(5)


def triangles(count=7):
    """Random triangles at rest, not too flat, and moved."""
    rest = np.array([[0.0, 0.0], [1.0, 0.0], [0.4, 0.9]]) + 0.15 * RNG.standard_normal((count, 3, 2))
    return rest, rest + 0.1 * RNG.standard_normal((count, 3, 2))


def laws():
    rest, moved = triangles()
    area, angles = mechanics.area_of(rest), mechanics.angles_of(rest)[0]
    modulus, sides = RNG.uniform(0.5, 1.5, len(rest)), RNG.uniform(0.5, 1.5, (len(rest), 3))
    inverse = np.linalg.inv(np.stack([rest[:, 1] - rest[:, 0], rest[:, 2] - rest[:, 0]], axis=2))
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.1, 1.0], [0.0, 0.9]]) + 0.1 * RNG.standard_normal((7, 4, 2))
    return {
        "spring": (moved[:, :2], (modulus, np.ones(7))),
        "area": (moved, (modulus, area)),
        "area of quadrilaterals": (square, (modulus, np.ones(7))),
        "angle": (moved, (modulus, angles)),
        "squares": (moved, (sides, sides**2)),
        "element": (moved, (inverse, area, modulus, 0.7 * modulus)),
    }


@pytest.mark.parametrize("name", laws())
def test_forces_are_the_derivative_of_the_energy(name):
    x, parameters = laws()[name]
    law = name.split()[0]
    energy, forces = getattr(mechanics, f"{law}_energy"), getattr(mechanics, f"{law}_forces")
    expected = np.empty(x.shape)
    for corner in range(x.shape[1]):
        for axis in range(2):
            stepped = x.astype(complex)
            stepped[:, corner, axis] += 1e-40j
            expected[:, corner, axis] = energy(stepped, *parameters).imag / 1e-40
    # Two forms of one expression differ by rounding.
    assert forces(x, *parameters) == pytest.approx(expected, rel=1e-11, abs=1e-13)


def test_squared_lengths_with_coupling_are_linear_triangles():
    """Delingette 2008: his springs and couplings have the energy of the linear triangle, which is the audit's form."""
    rest, moved = triangles()
    young, nu = 1.3, 0.4
    first, second = young * nu / (1 - nu**2), young / (1 + nu)
    angles, a, b = mechanics.angles_of(rest)
    cotangent, area, squares = 1 / np.tan(angles), mechanics.area_of(rest), ((b - a) ** 2).sum(axis=2)
    k = (2 * (first + second) * cotangent**2 + second) / (16 * area[:, None])
    coupling = np.roll(cotangent, -1, axis=1) * np.roll(cotangent, -2, axis=1)
    coupling = (2 * (first + second) * coupling - second) / (16 * area[:, None])
    _, a, b = mechanics.angles_of(moved)
    q = ((b - a) ** 2).sum(axis=2) - squares
    expected = mechanics.squares_energy(moved, k, squares)
    expected += 0.5 * (coupling * np.roll(q, -1, axis=1) * np.roll(q, -2, axis=1)).sum(axis=1)
    inverse = np.linalg.inv(np.stack([rest[:, 1] - rest[:, 0], rest[:, 2] - rest[:, 0]], axis=2))
    moduli = np.full(len(rest), first), np.full(len(rest), second / 2)
    assert mechanics.element_energy(moved, inverse, area, *moduli) == pytest.approx(expected, rel=1e-10)


def toggle(rise=0.3):
    """Two springs between fixed ends carry a particle above the middle, which a force pushes down."""
    points = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, rise]])
    held = np.array([[True, True], [True, True], [False, False]])
    ends, pattern = np.array([[0, 2], [1, 2]]), np.array([[0.0, 0.0], [0.0, 0.0], [0.0, -1.0]])
    rest = np.sqrt(1 + LONG(rise) ** 2)
    return Body(points, held, pattern, [Part(ends, spring_forces, np.ones(2), np.full(2, rest))])


def test_toggle_snaps_at_its_limit_point():
    """Force 2 (L/l - 1) y at height y has its maximum at l^3 = L."""
    length = math.sqrt(1.09)
    lost = math.sqrt(length ** (2 / 3) - 1)
    most = 2 * (length / math.sqrt(1 + lost**2) - 1) * lost
    body = toggle()
    assert body.critical(1.5 * most) == pytest.approx(most, rel=1e-6)
    end, share, why = body.follow(0.9 * most)
    y = 0.3 + float(end[body.free.tolist().index(5)])
    assert (why, share) == ("", 1.0)
    assert 2 * (length / math.sqrt(1 + y**2) - 1) * y == pytest.approx(0.9 * most, rel=1e-12)
    assert body.follow(1.01 * most)[2]


def test_toggle_of_steep_springs_buckles_sideways_before_it_snaps():
    """Stiffness along x is 2 (1 - L y^2 / l^3) at height y: its root on the way down is where the force stands."""
    rise = 3.0
    length = math.sqrt(1 + rise**2)
    heights = np.linspace(0.5, rise, 2_000_001)
    across = 1 - length * heights**2 / (1 + heights**2) ** 1.5
    root = heights[np.flatnonzero(across[:-1] * across[1:] < 0)[-1]]
    expected = 2 * (length / math.sqrt(1 + root**2) - 1) * root
    assert toggle(rise).critical(1.5 * expected) == pytest.approx(expected, rel=1e-5)


def test_eigenvalue_next_to_a_loss_of_stability_has_its_sign():
    rise = 3.0
    body = toggle(rise)
    lost = body.critical(2.0)
    for distance in (1e-3, 1e-6, 1e-8):
        below, above = (body.newton(body.follow(0.99 * lost)[0], (1 + sign * distance) * lost) for sign in (-1.0, 1.0))
        assert body.lowest(below, (1 - distance) * lost)[0] > 0
        assert body.lowest(above, (1 + distance) * lost)[0] < 0


def test_pressed_column_flutters_at_becks_load():
    """Beck 1952: a follower on a cantilever merges its two lowest modes at 20.05 E I / L^2, 8.126 times Euler's load.

    Shear, the width of the column and its few cells leave some per cent on the ratio.
    """
    scene = audit.Scene(
        "braced", "area", "pressure", "nonlinear", "moderate", 0.005, 0.1, 0.0025, 1e-3, 1e6, 0.3, 1.0
    )  # fmt: skip
    mesh = MESH_TYPES["braced"](scene.length, scene.height, scene.size)
    springs = DEFINITIONS["area"].springs(mesh, scene.material, scene.thickness)
    masses = audit.masses_of(mesh)
    euler = audit.body_of(scene, mesh, springs).critical(1.6 * audit.column(scene))
    body = audit.body_of(replace(scene, load="follower-pressure"), mesh, springs)

    def lowest_two_apart(unknowns, force):
        return not set(audit.fluttering(body, unknowns, force, masses)) & {0, 1}

    assert body.critical(12 * euler, lowest_two_apart) / euler == pytest.approx(8.126, rel=0.02)
