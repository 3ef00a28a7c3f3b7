"""Rubber at twice its length: springs and areas of definition `neo-hooke`.

An incompressible neo-Hookean sheet at stretch l, free to become narrower and thinner, carries mu (l - 1/l^2) per area
at rest. `neo-hooke` is that law on each triangle.
"""

import matplotlib.pyplot as plt

import springtune as st


def main():
    """Return the stretch under the force that should double the length."""
    rubber = st.Material("1.2 MPa", 0.5, name="rubber")
    length, height, thickness, stretch = 0.1, 0.02, 1e-3, 2.0
    shear = rubber.young_modulus / 3
    force = shear * (stretch - stretch**-2) * height * thickness
    pull = st.LoadCase(
        "pull",
        supports=[st.Support("left", x=0), st.Support("corner", y=0)],
        tractions=[st.Traction("right", (force, 0))],
        quantities=[st.Quantity("end", "displacement", "right", "x"), st.Quantity("carried", "reaction", "left", "x")],
    )
    sheet = st.Shape.rectangle(length, height, thickness=thickness, points={"corner": (0, 0)}, loads={"pull": pull})
    scene = st.Scene(sheet, st.mesh_shape(sheet, "5 mm"), rubber, "pull", definition="neo-hooke")
    found = scene.solve()
    moved = found.values["end"]
    print(f"{scene}: {found.status}")
    print(f"{force:.3f} N: {1 + moved / length:.6f} times its length; small strain says", end=" ")
    print(f"{1 + force / (height * thickness * rubber.young_modulus):.3f}, and does not apply:")
    print(scene.objection)
    plt.triplot(*1e3 * (scene.mesh.points + found.displacements).T, scene.mesh.triangles, linewidth=0.8)
    plt.gca().set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    return 1 + moved / length


if __name__ == "__main__":
    main()
    plt.show()
