"""One scene: the paper's steel beam in traction, against finite elements.

The paper's finite elements give 9.49 mm (its table 1). `patch` derives its springs from one patch test of the mesh.
"""

import matplotlib.pyplot as plt

import springtune as st


def main():
    """Return the displacement of the network [m]."""
    beam, steel = st.Beam("200 mm", "40 mm", thickness="1 mm"), st.Material("210 GPa", 0.3)
    mesh = st.make_mesh(beam, "structured", "2 mm")
    scene = st.Scene(beam, mesh, steel, "traction", "400 kN", definition="patch")
    result = scene.solve()
    reference = result.reference()
    print(f"network {1e3 * result.displacement:.4f} mm, {result.status} in {result.seconds:.2g} s")
    print(f"reference {1e3 * reference.displacement:.4f} mm: error {100 * result.error:+.2f} %")
    result.plot()
    return result.displacement


if __name__ == "__main__":
    main()
    plt.show()
