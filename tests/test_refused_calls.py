"""Calls of the library that are refused: by one message with the key, the value and what to give."""

from pathlib import Path

import numpy as np
import pytest
import yaml

import springtune as st
from springtune.mesh import lattice

BEAM, STEEL = st.Beam("60 mm", "20 mm"), st.Material("210 GPa", 0.3, density="7850 kg/m^3")
MESH, RUBBER = st.make_mesh(BEAM, "free", "5 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
HOLES = [st.Hole.circle((0.05, 0.02), 0.008), st.Hole.circle((0.02, 0.02), 0.005, part="core")]
NAMES = {
    "st": st, "np": np, "lattice": lattice, "BEAM": BEAM, "STEEL": STEEL, "MESH": MESH,
    "SQUARE": np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), "HALVES": np.array([[0, 1, 2], [0, 2, 3]]),
    "PLATE": st.Shape.rectangle(0.1, 0.04, name="plate", holes=HOLES),
    "SOFT": st.Scene(BEAM, MESH, RUBBER, "traction", "0.1 N", definition="lattice"),
}  # fmt: skip
TABLE = yaml.safe_load(Path(__file__).with_name("refused_calls.yaml").read_text())
ROWS = [
    (code, said, value)
    for rows in TABLE.values()
    for code, said, *values in rows
    for value in (values[0] if values else [None])
]


@pytest.mark.parametrize(("code", "said", "value"), ROWS)
def test_a_call_is_refused(code, said, value):
    with pytest.raises(ValueError, match=said):
        eval(code, NAMES | {"VALUE": value})
