"""Orthotropic sheets of springs alone: which are exact, and how large the error of the others is.

Springs obey Cauchy's relation C12 = C66, whatever their stiffness. Sheets with C12 = C66 are exact on rows of triangles
of height a/2 sqrt(C22/C12), and on rectangles of a suitable ratio. Other sheets get the springs that are nearest in
energy. The error is the largest one of the energy of any even strain, for sheets with C12 C66 = C11 C22 / 9.
"""

import matplotlib.pyplot as plt
import numpy as np

import springtune as st
from springtune.mechanics.continuum import unit_fields, work_of
from springtune.mechanics.network import Network
from springtune.mesh.rows import braced, lattice
from springtune.springs import DefinitionError

FIT = st.DEFINITIONS["energy-fit"]

SQUARES, ROWS = braced(0.02, 0.02, 0.01), lattice(2, 2)


def own_rows(material):
    """Rows made for a material: C12 and C66 are replaced by their geometric mean."""
    return lattice(2, 2, row_height=0.5 * np.sqrt(material.C22 / np.sqrt(material.C12 * material.C66)))


def error(mesh, material):
    """Return the largest relative error of the energy of an even strain [1]; NaN where springs would hold no shape."""
    try:
        springs = FIT.springs(mesh, material, 1.0)
    except DefinitionError:
        return np.nan
    network = Network(mesh, np.ones(mesh.points.shape, dtype=bool), springs.relative)
    fields = unit_fields(mesh)
    stiffness = work_of(fields, [network.linear_forces_over_k(field) for field in fields], mesh) * springs.reference
    values, vectors = np.linalg.eigh(material.plane_stress)
    root = vectors / np.sqrt(values)
    return np.abs(np.linalg.eigvalsh(root.T @ stiffness @ root) - 1).max()


def sheet(ratio, cauchy):
    """Return a sheet of given ratios E_x / E_y and C12 / C66."""
    return st.AnisotropicMaterial(ratio**0.5, ratio**-0.5, cauchy**0.5 / 3, cauchy**-0.5 / 3)


def main():
    """Return C12 over C66 of the springs nearest to a board."""
    ratios, cauchy = np.geomspace(1, 20, 17), np.geomspace(1 / 4, 4, 17)
    figure, panels = plt.subplots(1, 3, figsize=(7.16, 2.6), sharey=True, layout="constrained")
    titles = "squares with both diagonals", "rows of equilateral triangles", "rows made for the sheet"
    for panel, meshes, title in zip(panels, (lambda _: SQUARES, lambda _: ROWS, own_rows), titles):
        made = [[sheet(ratio, one) for ratio in ratios] for one in cauchy]
        found = np.array([[100 * error(meshes(material), material) for material in line] for line in made])
        panel.pcolormesh(ratios, cauchy, found, cmap="cividis", vmin=0, vmax=100, shading="nearest")
        lines = panel.contour(ratios, cauchy, found, [5, 10, 20, 50], colors="white", linewidths=0.8)
        panel.clabel(lines, fmt="%g %%", fontsize=7)
        panel.set(
            xscale="log", yscale="log", xlabel="$E_x / E_y$", xticks=[1, 2, 5, 10, 20], yticks=[0.25, 0.5, 1, 2, 4]
        )
        panel.xaxis.set_major_formatter("{x:g}")
        panel.yaxis.set_major_formatter("{x:g}")
        panel.minorticks_off()
        panel.set_title(title, fontsize=8, loc="left")
    panels[0].set_ylabel("$C_{12} / C_{66}$")
    figure.colorbar(panels[0].collections[0], ax=panels, label="error of the energy [%]")
    plies = {
        "carbon fibres in epoxy": ("140 GPa", "10 GPa", 0.3, "5 GPa"),
        "glass fibres in epoxy": ("40 GPa", "8 GPa", 0.26, "4 GPa"),
        "glass fabric": ("20 GPa", "20 GPa", 0.15, "4 GPa"),
    }
    for name, constants in plies.items():
        ply = st.AnisotropicMaterial.orthotropic(*constants)
        of_squares, of_rows = 100 * error(SQUARES, ply), 100 * error(own_rows(ply), ply)
        print(f"{name}: C12 / C66 = {ply.C12 / ply.C66:.2f}; squares {of_squares:.1f} %, own rows {of_rows:.1f} %")
    board = st.AnisotropicMaterial("9 GPa", "4 GPa", "1.5 GPa", "2 GPa")
    stiffness = st.moduli(SQUARES, board, "energy-fit").stiffness
    return stiffness[0, 1] / stiffness[2, 2]


if __name__ == "__main__":
    main()
    plt.show()
