"""Springs that are searched for: gradients of the misfit, and what a search reaches."""

import numpy as np
import pytest

import springtune as st
from springtune.mechanics.moduli import PatchTest
from springtune.springs.identification import Misfit, patch_cases
from springtune.springs.searched import adjoint


def test_gradient_of_the_misfit_is_exact():
    mesh = st.MESH_TYPES["free"](0.03, 0.01, 2.5e-3)
    material = st.Material(5.0, 0.45, name="any")
    misfit = Misfit(mesh, material, 2.0, patch_cases(mesh, material, 2.0))
    generator = np.random.default_rng(1)
    here, direction = 0.3 * generator.standard_normal((2, len(mesh.edges)))
    _, slope = misfit.evaluate(here)
    difference = (misfit(here + 1e-5 * direction) - misfit(here - 1e-5 * direction)) / 2e-5
    assert difference == pytest.approx(slope @ direction, rel=1e-7)


def test_a_network_that_does_not_move_misses_half_of_each_case():
    """J = 1/2 sum |u - u*|^2 / |u*|^2 at u = 0, which springs 1e12 times as stiff as asked come near to."""
    mesh, material = st.MESH_TYPES["free"](0.03, 0.01, 2.5e-3), st.Material(5.0, 0.45, name="any")
    misfit = Misfit(mesh, material, 2.0, patch_cases(mesh, material, 2.0))
    assert misfit(np.full(len(mesh.edges), np.log(1e12))) == pytest.approx(3 / 2, rel=1e-9)
    assert misfit.evaluations == 1


@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_adjoint_reaches_poisson_ratios_that_springs_cannot(nu):
    mesh, material = st.MESH_TYPES["free"](0.04, 0.0133, 2.5e-3), st.Material(1.0, nu, name="unit")
    springs = adjoint(mesh, material, 1.0)
    young, ratio = PatchTest(mesh).axial(springs)
    assert young * springs.reference == pytest.approx(1, abs=0.03)
    # 150 particles: with 373 of them .307 and .484 have been reached.
    assert ratio == pytest.approx(nu, abs=0.04)
    assert springs.spring_ratio <= 100.0 * 2  # bounds of ten each way, about outline springs of half weight
    assert 10 < springs.evaluations <= 450


@pytest.mark.parametrize("name", ["annealed", "evolved"])
def test_searches_are_repeatable_and_better_than_their_start(name):
    mesh, material = st.MESH_TYPES["free"](0.03, 0.01, 5e-3), st.Material(1.0, 0.45, name="unit")
    cases = patch_cases(mesh, material, 1.0)
    first, second = (st.DEFINITIONS[name].function(mesh, material, 1.0, cases, 200) for _ in "ab")
    assert (first.relative == second.relative).all()
    assert first.evaluations <= 200
    misfit = Misfit(mesh, material, 1.0, cases)
    assert misfit(np.log(first.relative / misfit.start)) < misfit(np.zeros(len(mesh.edges)))


def test_rounding_does_not_choose_the_corner_that_is_held():
    """A regular polygon has two lowest corners of equal x + y; coordinates differ by rounding among processors."""
    angles, noise = np.arange(12) * np.pi / 6, np.random.default_rng(1)
    points = np.vstack([np.zeros(2), np.column_stack([np.cos(angles), np.sin(angles)])])
    triangles = np.array([[0, i + 1, (i + 1) % 12 + 1] for i in range(12)])
    held = {
        patch_cases(
            st.Mesh(points * (1 + noise.uniform(-1e-15, 1e-15, points.shape)), triangles),
            st.Material(1.0, 0.3, name="unit"),
            1.0,
        )[0].held.tobytes()
        for _ in range(20)
    }
    assert len(held) == 1
