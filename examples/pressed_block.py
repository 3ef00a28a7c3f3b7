"""A pressed block: why the paper's stiffness seems to depend on the load (its section 4.1).

A rubber block is fixed on one long face and pressed on the other. It cannot widen, so Poisson's ratio matters. Springs
alone have the mesh's, springs with coupling (`delingette`) the material's. The paper's finite elements move the middle
of the face by 3.14 mm.
"""

import springtune as st


def main():
    """Return the displacement of the middle of the face with `delingette` [m]."""
    block, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.5)
    mesh = st.make_mesh(block, "structured", "2 mm")
    for definition in ("patch", "delingette"):
        pressed, pulled = (
            st.Scene(block, mesh, rubber, load, force, definition=definition, kinematics="linear").solve()
            for load, force in (("pressure", "20 N"), ("traction", "0.4 N"))
        )
        print(f"{definition}: pressed {100 * pressed.error:+.1f} %, pulled {100 * pulled.error:+.1f} %")
    return abs(pressed.displacement)


if __name__ == "__main__":
    main()
