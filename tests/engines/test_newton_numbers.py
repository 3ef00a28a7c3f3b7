"""What is typed into Newton, and what it refuses; none of it needs Newton."""

import numpy as np
import pytest

import springtune as st

BEAM = st.Beam("80 mm", "40 mm", thickness="2 mm")
E, NU, H = 1e6, 0.3, 2e-3


def net(definition="delingette", nu=NU):
    rubber = st.Material(E, nu, density=1000.0)
    one = st.Scene(BEAM, st.make_mesh(BEAM, "right", "20 mm"), rubber, "traction", "0.2 N", definition=definition)
    return st.SpringNet.from_scene(one, errors=False)


def test_triangles_of_vbd_have_lame_constants():
    shear, first = E * H / (2 * (1 + NU)), E * H * NU / (1 - NU**2)
    assert st.ENGINES["newton-vbd"].typed(net()) == pytest.approx({"tri_ke": shear, "tri_ka": first})


def test_xpbd_refuses_springs_that_it_leaves_out():
    given = net("patch")
    given.stiffness[0] *= -1
    with pytest.raises(st.EngineError, match="negative stiffness, which Newton's XPBD leaves out"):
        st.ENGINES["newton-xpbd"].function(given, st.Setting(), 0.0)


def test_a_mixed_sheet_is_no_material_of_newton():
    """Triangles of one law in Newton have one material."""
    given = net()
    values = {name: one.copy() for name, one in given.energies[0].values.items()}
    values["tensile"][0] *= 2
    given.energies[0].values.update(values)
    with pytest.raises(ValueError, match="those of no material, and Newton has the law of a material alone"):
        st.ENGINES["newton-vbd"].typed(given)
    assert np.all(values["tensile"] > 0)
