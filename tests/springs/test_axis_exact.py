"""Springs that are exact along the axis of a beam, and the meshes that they are for."""

import numpy as np
import pytest

import springtune as st
from springtune.mesh import lattice, signed_areas

from patches import errors, patch


@pytest.mark.parametrize(
    ("mesh_type", "nu"),
    [
        *(("braced", nu) for nu in (0.2, 0.3, 1 / 3, 0.45, 0.49, 0.5)),
        *(("isosceles-0.3", 0.3), ("isosceles-0.5", 0.5), ("structured", 1 / 3)),
    ],
)
def test_axis_exact_on_squares_and_on_rows_made_for_it(mesh_type, nu):
    young, ratio, shear = errors("axis-exact", patch(mesh_type), nu)
    assert (young, ratio, 1 + shear) == pytest.approx((0, nu, 2 * nu / (1 - nu)), abs=1e-9)


def test_ends_of_rows_carry_what_a_strip_of_their_area_does():
    """Half triangles at the ends of rows: each gives its edge across its area over the square of it."""
    mesh = st.MESH_TYPES["isosceles-0.3"](0.03, 0.01, 2e-3)
    relative = st.DEFINITIONS["axis-exact"].springs(mesh, st.Material(1.0, 0.3, name="unit"), 1.0).relative
    across = np.abs(np.diff(mesh.points[mesh.edges, 0])[:, 0]) < 1e-9
    areas = mesh.sum_to_edges({3: np.repeat(signed_areas(mesh.points, mesh.triangles)[:, None], 3, axis=1)})
    assert across.sum() > 4 and mesh.on_outline[across].all()
    np.testing.assert_allclose(relative[across], (areas / mesh.edge_lengths**2)[across], rtol=1e-9)


def test_axis_exact_names_the_row_that_is_furthest_off():
    """One row of another height: of nu = 0.2 among rows of 0.45."""
    mesh = lattice(5, 4, 1e-3)
    rows = np.rint(mesh.points[:, 1] / mesh.points[:, 1].max() * 4).astype(int)
    heights = 0.5e-3 / np.sqrt([0.46, 0.2, 0.45, 0.44])
    uneven = st.Mesh(np.stack([mesh.points[:, 0], np.append(0, np.cumsum(heights))[rows]], axis=1), mesh.triangles)
    with pytest.raises(st.DefinitionError, match=r"nu = 0.2 and the material 0.45;.*for bases of 1 mm"):
        st.DEFINITIONS["axis-exact"].springs(uneven, st.Material(1.0, 0.45, name="unit"), 1.0)
