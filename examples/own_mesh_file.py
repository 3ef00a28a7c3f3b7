"""A mesh of one's own: a graded mesh of triangles, written and read by meshio.

At Poisson's ratio 0 the clamp does not hold the bar across, and it elongates by exactly F L / (E H t). `delingette`
(linear triangles) reproduces that on any mesh.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import meshio
import numpy as np

import springtune as st


def graded_mesh(length, height):
    """Return a mesh of a box whose columns narrow towards the right end."""
    x, y = np.meshgrid(length * np.linspace(0, 1, 21) ** 0.7, height * np.linspace(0, 1, 5))
    corner = (np.arange(4)[:, None] * 21 + np.arange(20)).ravel()  # lower left one of each rectangle
    triangles = np.concatenate(
        [np.stack([corner, corner + 1, corner + 22], axis=1), np.stack([corner, corner + 22, corner + 21], axis=1)]
    )
    return meshio.Mesh(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), {"triangle": triangles})


def main():
    """Return the displacement over F L / (E H t)."""
    beam, cork = st.Beam("100 mm", "20 mm"), st.Material("20 MPa", 0.0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "graded.vtu"
        graded_mesh(100, 20).write(path)  # in millimetres
        mesh = st.read_mesh(path, beam, unit="1 mm")
    scene = st.Scene(beam, mesh, cork, "traction", "4 N", definition="delingette", kinematics="linear")
    result = scene.solve()
    exact = 4 * beam.length / (cork.young_modulus * beam.height * beam.thickness)
    print(f"{len(mesh.points)} particles: {1e6 * result.displacement:.6f} um, exact {1e6 * exact:.6f} um")
    plt.triplot(*1e3 * mesh.points.T, mesh.triangles, linewidth=0.8)
    plt.gca().set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    return result.displacement / exact


if __name__ == "__main__":
    main()
    plt.show()
