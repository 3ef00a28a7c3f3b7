"""Scenes that engines are tried on: soft bodies of other sizes, meshes, loads and materials, moved by a percent."""

import springtune as st

BODIES = {"strip": ("200 mm", "40 mm"), "sheet": ("300 mm", "200 mm"), "slender": ("120 mm", "12 mm")}
SIZES = {"strip": "13 mm", "sheet": "50 mm", "slender": "6 mm"}
LOADS = ("traction", "bending", "shear", "compression")
MATERIALS = {
    "rubber": ("1 MPa", 0.45, "1100 kg/m^3"),
    "foam": ("0.2 MPa", 0.1, "80 kg/m^3"),
    "felt": ("0.2 MPa", 0.0, "80 kg/m^3"),
}
SHARE = {"traction": 0.01, "compression": -0.002, "shear": 0.005, "bending": 0.02}
"""Displacement of the loaded side over the length of the body."""


def scene(body, mesh_type, load, material, definition):
    """A scene whose linear displacement is the load's `SHARE` of the length."""
    beam, mass = st.Beam(*BODIES[body]), MATERIALS[material]
    mesh = st.make_mesh(beam, mesh_type, SIZES[body])
    made = st.Material(mass[0], mass[1], density=mass[2])
    trial = st.Scene(beam, mesh, made, load, 1.0, definition=definition, kinematics="linear")
    force = abs(SHARE[load]) * beam.length / abs(trial.solve().displacement)
    return st.Scene(beam, mesh, made, load, force, definition=definition)


CASES = [
    (body, mesh_type, load, material)
    for number, (body, load) in enumerate((body, load) for body in BODIES for load in LOADS)
    for mesh_type, material in zip(
        ("structured", "free"), ("rubber", "foam") if number // 2 % 2 else ("foam", "rubber")
    )
][:20]
"""Twenty cases: body, mesh type, load, material."""

TEN = [case for number, case in enumerate(CASES) if (number + number // 2) % 2 == 0]
"""Ten of them, of each body and load, half of them on either mesh type."""
