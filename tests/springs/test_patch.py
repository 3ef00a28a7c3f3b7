"""Definitions that are scaled by a patch test: Young's modulus is exact on any mesh."""

import pytest

from patches import errors, patch


@pytest.mark.parametrize("mesh_type", ["structured", "free", "right", "alternating", "braced", "isosceles-0.5"])
@pytest.mark.parametrize("name", ["patch", "patch-area"])
def test_patch_makes_young_modulus_exact_on_any_mesh(name, mesh_type):
    assert errors(name, patch(mesh_type), 0.45)[0] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("name", ["uniform", "lattice", "van-gelder", "element-fit", "delingette-tensile", "patch"])
def test_mesh_fixes_poisson_ratio_of_rows(name):
    """Only the row springs carry a load along the rows: nu = (a / 2h)^2."""
    assert errors(name, patch("isosceles-0.5"), 0.2)[1] == pytest.approx(0.5, rel=1e-9)
    assert errors(name, patch("right"), 0.2)[1] == pytest.approx(0.0, abs=1e-9)
