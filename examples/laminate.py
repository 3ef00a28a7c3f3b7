"""Oblique fibres: a sheet that is pulled along x also shears.

Rollers and a point leave it in uniform strain, known from the sheet's compliance. `delingette` (linear triangles) takes
any six constants and finds it on any mesh. With a hole, errors are against the finite-element reference.
Definitions for isotropic sheets refuse the material.
"""

import matplotlib.pyplot as plt
import numpy as np

import springtune as st


def main():
    """Return the displacement of the end over F L S11 / (H t)."""
    ply = st.AnisotropicMaterial.orthotropic("12 GPa", "4 GPa", 0.3, "2 GPa", angle="30 deg", name="ply")
    force, length, height, thickness = 1e3, 0.1, 0.04, 1e-3
    pull = st.LoadCase(
        "pull",
        supports=[st.Support("left", x=0), st.Support("corner", y=0)],
        tractions=[st.Traction("right", (force, 0))],
        quantities=[st.Quantity("end", "displacement", "right", "x"), st.Quantity("lift", "displacement", "tip", "y")],
    )
    about = {"thickness": thickness, "points": {"corner": (0, 0), "tip": (length, 0)}, "loads": {"pull": pull}}
    sheet = st.Shape.rectangle(length, height, **about)
    mesh = st.mesh_shape(sheet, "8 mm")
    found = st.Scene(sheet, mesh, ply, "pull", definition="delingette", kinematics="linear").solve()
    compliance = np.linalg.inv(ply.plane_stress)
    stress = force / (height * thickness)
    exact = {"end": stress * length * compliance[0, 0], "lift": stress * length * compliance[0, 2]}
    for name, value in found.values.items():
        print(f"{name}: {1e6 * value:.6f} um, exact {1e6 * exact[name]:.6f} um")
    holed = st.Shape.rectangle(length, height, holes=[st.Hole.circle(("50 mm", "20 mm"), "8 mm")], **about)
    choices = st.predict(holed, st.mesh_shape(holed, "2 mm"), ply)
    for choice in choices:
        errors = ", ".join(f"{name} {100 * error:+.2f} %" for name, error in choice.errors.items())
        print(f"{choice.definition}: {errors}")
    for scale, colour in ((0, "lightgrey"), (20, "C0")):
        moved = 1e3 * (mesh.mesh.points + scale * found.displacements)
        plt.triplot(*moved.T, mesh.mesh.triangles, color=colour, linewidth=0.8)
    plt.gca().set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]", title="displacements 20-fold")
    return found.values["end"] / exact["end"]


if __name__ == "__main__":
    main()
    plt.show()
