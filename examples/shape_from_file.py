"""A shape from a mesh file: a quarter of a ring in VTU, with named groups, under inner pressure.

Lame's solution: the inner rim moves outwards by p a / E ((b^2 + a^2) / (b^2 - a^2) + nu).
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import springtune as st
from springtune.mesh.formats import write_mesh


def mesher(path, inner, outer):
    """Write a mesh file of a quarter of a ring, as a mesher does."""
    corners = [((inner, 0), None, "lower"), ((outer, 0), (0, 0), "outer"), ((0, outer), None, "left")]
    sides = [st.Segment(*corner) for corner in [*corners, ((0, inner), (0, 0), "inner")]]
    ring = st.Shape("ring", 1e-3, sides, points={"rim": (inner, 0)})
    write_mesh(path, st.mesh_shape(ring, "1 mm"))


def main():
    """Return the displacement of the rim over Lame's."""
    inner, outer, pressure, steel = 0.02, 0.04, 10e6, st.Material("210 GPa", 0.3, name="steel")
    press = st.LoadCase(
        "press",
        supports=[st.Support("lower", y=0), st.Support("left", x=0)],
        pressures=[st.Pressure("inner", pressure)],
        quantities=[st.Quantity("rim", "displacement", "rim", "x")],
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "ring.vtu"
        mesher(path, inner, outer)
        ring = st.Shape("ring", "1 mm", loads={"press": press}, file=str(path))
        mesh = st.read_shape(path)
    print(f"groups of the file: {', '.join(mesh.sides)}; points: {', '.join(mesh.points)}")
    scene = st.Scene(ring, mesh, steel, "press", definition="delingette", kinematics="linear")
    found = scene.solve()
    squares = (outer**2 + inner**2) / (outer**2 - inner**2)
    exact = pressure * inner / steel.young_modulus * (squares + steel.poisson_ratio)
    print(f"{scene}: {1e6 * found.values['rim']:.4f} um, Lame {1e6 * exact:.4f} um")
    plt.triplot(*1e3 * mesh.mesh.points.T, mesh.mesh.triangles, linewidth=0.8)
    plt.gca().set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    return found.values["rim"] / exact


if __name__ == "__main__":
    main()
    plt.show()
