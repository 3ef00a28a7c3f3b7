"""A sensitivity curve: which uniform stiffness gives a beam its displacement.

Springs on the outline belong to one triangle, not two, and make the beam too stiff. So the best stiffness is below
sqrt(3)/2 E t, by 1 + sqrt(3)/2 a/H. The paper found 170e6 N/m by hand, for all mesh sizes.
"""

import matplotlib.pyplot as plt

import springtune as st


def main():
    """Return the best stiffness [N/m]."""
    beam, steel = st.Beam("200 mm", "30 mm"), st.Material("210 GPa", 0.3)
    mesh = st.make_mesh(beam, "structured", "5 mm")
    scene = st.Scene(beam, mesh, steel, "traction", "300 kN", definition="uniform")
    curve = st.sensitivity(scene)
    lowest, highest = 100 * curve.error.min(), 100 * curve.error.max()
    print(f"{len(curve.stiffness)} stiffnesses, errors from {lowest:+.0f} to {highest:+.0f} %")
    print(f"best {curve.best_stiffness / 1e6:.1f}e6 N/m, closed form {curve.predicted_stiffness / 1e6:.1f}e6 N/m")
    curve.plot()
    return curve.best_stiffness


if __name__ == "__main__":
    main()
    plt.show()
