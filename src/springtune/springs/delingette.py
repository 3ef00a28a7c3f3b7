r"""Triangular biquadratic springs (Delingette, IEEE TVCG 14(2):329, 2008): linear triangles written as springs.

With ``lambda = E nu / (1 - nu^2)``, ``mu = E (1 - nu) / (1 - nu^2)`` and c_i the cotangent of the angle at corner i
of a triangle of area A, its side opposite corner i has the tensile and two sides i, j the coupling stiffness

.. math:: k_i = t \frac{2 c_i^2 (\lambda + \mu) + \mu}{16 A}, \quad
          \gamma_{ij} = t \frac{2 c_i c_j (\lambda + \mu) - \mu}{16 A},

.. math:: W = \sum_i \tfrac{k_i}{4} (l_i^2 - L_i^2)^2
            + \sum_{i<j} \tfrac{\gamma_{ij}}{2} (l_i^2 - L_i^2) (l_j^2 - L_j^2).

Together they are exactly the St. Venant-Kirchhoff energy of the linear triangle, for any mesh, nu and strain. At rest
side i has the spring constant ``2 L_i^2 k_i``. On an equilateral triangle the coupling vanishes at nu = 1/3; without
it E is wrong by (10 - 6 nu) / (9 (1 - nu^2)).

For any anisotropy (derived here): Green's strains are linear in the changes q_i of the squared lengths. With n_i the
side opposite corner i, turned by a right angle, q_i alone is the strain

.. math:: e_i = - \frac{1}{8 A^2} \left( n_{jx} n_{kx}, \; n_{jy} n_{ky}, \; n_{jx} n_{ky} + n_{jy} n_{kx} \right)

in Voigt's order, so the energy ``A t/2 e^T C e`` has ``k_i = 2 A t e_i^T C e_i`` and ``gamma_ij = 2 A t e_i^T C
e_j``: six coefficients, one to one with the material's six constants.
"""

import numpy as np

from ..mesh.cells import Mesh, corner_angles, signed_areas
from ..problem.materials import AnyMaterial, Material
from .base import Springs, definition, membrane_stiffness


@definition("delingette", order=230, cells=(3,), anisotropic=True, st_venant=True)
def springs(mesh: Mesh, material: AnyMaterial, thickness: float) -> Springs:
    """Tensile and coupling springs of squared lengths (Delingette 2008): equal to linear triangles of any material.

    Source: Delingette, IEEE TVCG 14(2):329, 2008, and SOFA's code; any anisotropy is ours (read, derived).
    """
    return _springs(mesh, material, thickness, coupled=True)


@definition("delingette-tensile", order=180, cells=(3,), anisotropic=True)
def tensile(mesh: Mesh, material: AnyMaterial, thickness: float) -> Springs:
    """The tensile part of Delingette's springs alone, without coupling.

    Source: Delingette, IEEE TVCG 14(2):329, 2008, and SOFA's code (read).
    """
    return _springs(mesh, material, thickness, coupled=False)


def _springs(mesh: Mesh, material: AnyMaterial, thickness: float, coupled: bool) -> Springs:
    from ..mechanics.energies import BiquadraticEnergy  # here: see `springtune.springs`

    if isinstance(material, Material):
        stiffness, coupling = _isotropic(mesh, material)
    else:
        stiffness, coupling = _anisotropic(mesh, material)
    squares = mesh.edge_lengths[mesh.cell_edges[3]] ** 2
    energy = BiquadraticEnergy(mesh.points, mesh.triangles, stiffness, coupling if coupled else None)
    reference, linear = membrane_stiffness(material, thickness), mesh.sum_to_edges({3: 2 * squares * stiffness})
    return Springs(reference, np.zeros(len(mesh.edges)), (energy,), linear_springs=linear)


def _isotropic(mesh: Mesh, material: Material) -> tuple[np.ndarray, np.ndarray]:
    """Tensile and coupling stiffness of each triangle over E t [1/m2], shape (n_triangles, 3), by cotangents."""
    nu = material.poisson_ratio
    first, second = nu / (1 - nu**2), 1 / (1 + nu)  # lambda and mu over E
    cotangents = 1 / np.tan(corner_angles(mesh.points, mesh.triangles))
    areas = signed_areas(mesh.points, mesh.triangles)[:, None]
    stiffness = (2 * (first + second) * cotangents**2 + second) / (16 * areas)
    products = np.roll(cotangents, -1, axis=1) * np.roll(cotangents, -2, axis=1)
    return stiffness, (2 * (first + second) * products - second) / (16 * areas)


def _anisotropic(mesh: Mesh, material: AnyMaterial) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients of any material over the largest of its constants."""
    here = mesh.points[mesh.triangles]
    sides = np.roll(here, 1, axis=1) - np.roll(here, -1, axis=1)  # opposite each corner
    x, y = sides[..., 1], -sides[..., 0]
    (jx, jy), (kx, ky) = ((np.roll(x, -turn, axis=1), np.roll(y, -turn, axis=1)) for turn in (1, 2))
    areas = signed_areas(mesh.points, mesh.triangles)
    strains = np.stack([jx * kx, jy * ky, jx * ky + jy * kx], axis=2) / (-8 * areas**2)[:, None, None]
    elasticity = material.plane_stress / membrane_stiffness(material, 1.0)
    form = 2 * areas[:, None, None] * (strains @ elasticity @ strains.transpose(0, 2, 1))
    return form[:, [0, 1, 2], [0, 1, 2]], form[:, [1, 2, 0], [2, 0, 1]]
