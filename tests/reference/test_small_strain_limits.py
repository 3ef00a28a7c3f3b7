"""How far the small-strain reference applies: the elastica, and rotations and strains of its field."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import springtune as st
from springtune.problem.loads import BENDING
from springtune.reference.answers import (
    beyond_linear,
    elastica,
    most_rotation_and_strain,
    rotation_and_strain,
    rotation_effect,
)
from springtune.reference.small_strain import solve_small_strain

STEEL = st.Material(210e9, 0.3, name="steel")


def bent(load, slenderness=20.0, nu=0.3):
    """Reference of a cantilever and its force, which is the load times E I / L^2."""
    beam = st.Beam(slenderness * 0.01, 0.01, 1e-3, "b")
    material = st.Material(1e9, nu, name="any")
    force = load * material.young_modulus * beam.thickness * beam.height**3 / 12 / beam.length**2
    return solve_small_strain(beam, material, force, kind=BENDING)


@pytest.mark.parametrize("load", [1e-5, 0.1, 0.5, 1.0, 2.0, 10.0])
def test_elastica_is_the_solution_of_its_equation(load):
    s, turn = np.linspace(0, 1, 201), min(load, 2.8)
    found = solve_bvp(
        lambda _, turn: np.stack([turn[1], -load * np.cos(turn[0]), np.sin(turn[0])]),
        lambda start, end: np.array([start[0], end[1], start[2]]),
        s, np.stack([turn * (s - s**2 / 2), turn * (1 - s), turn * s**2 / 3]), tol=1e-9, max_nodes=50_000,
    )  # fmt: skip
    assert found.success
    assert elastica(load) == pytest.approx(found.y[2, -1], rel=1e-7)


def test_effect_of_rotation_begins_with_its_square():
    assert rotation_effect(0.0) == 0.0
    assert rotation_effect(0.01) == pytest.approx(-16 / 35 * 1e-4, rel=1e-3)
    turns = np.linspace(0.001, 3, 100)
    effects = np.array([rotation_effect(turn) for turn in turns])
    assert (np.diff(effects) < 0).all() and (effects > -16 / 35 * turns**2 - 1e-9).all()


def test_rotation_and_strain_do_not_depend_on_the_unit_of_areas():
    """Of 20 cells of one size 19 are the share; rounding of their sum took the 20th now and then."""
    gradients = np.arange(20.0)[:, None, None] * np.array([[1e-3, 0], [0, 0]])
    for area in np.random.default_rng(1).uniform(1e-6, 1e3, 100):
        assert most_rotation_and_strain(gradients, np.full(20, area))[1] == pytest.approx(18e-3, rel=1e-9)


def test_rotation_and_strain_of_even_fields():
    x, y = np.linspace(0, 2, 9) ** 2, np.linspace(-1, 1, 6)
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=2)
    turned = points @ np.array([[0.0, 0.3], [-0.3, 0.0]])
    assert rotation_and_strain(x, y, turned) == pytest.approx((0.3, 0.0), abs=1e-9)
    stretched = points @ np.diag([0.02, -0.01])
    assert rotation_and_strain(x, y, stretched) == pytest.approx((0.0, 0.02), rel=1e-9, abs=1e-9)
    sheared = points @ np.array([[0.0, 0.0], [0.04, 0.0]])
    assert rotation_and_strain(x, y, sheared) == pytest.approx((0.02, 0.02), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("load", [0.1, 1.0])
def test_rotation_of_a_cantilever_is_that_of_its_end(load):
    found = bent(load)
    # The end turns by load / 2; 95 % of the length by at most .9975 of that; shear and clamp, some 1 / slenderness^2.
    assert found.rotation == pytest.approx(load / 2, rel=5e-3)
    assert found.scaled(-0.5).rotation == pytest.approx(found.rotation / 2)


@pytest.mark.parametrize(("load", "applies"), [(0.25, True), (0.35, False), (1.0, False), (2.0, False)])
def test_a_bent_beam_is_beyond_the_linear_reference_from_one_percent_on(load, applies):
    found = bent(load)
    text = beyond_linear(found.rotation, found.strain)
    assert (text == "") == applies == (abs(3 * elastica(load) / load - 1) <= 0.01)
    if load == 1.0:
        assert "turns by 0.5 rad" in text and "9.4 %" in text  # 9.5 at the very end


def test_the_paper_s_traction_applies():
    found = solve_small_strain(st.Beam(0.2, 0.04, 1e-3, "200x40"), STEEL, 400e3)
    assert found.strain == pytest.approx(400e3 / (210e9 * 40e-6), rel=0.05)  # 4.8 %
    assert found.rotation < 0.02
    assert beyond_linear(found.rotation, found.strain) == ""
    assert "strain is 19 %" in beyond_linear(4 * found.rotation, 4 * found.strain)
