"""Closed form of the equilateral lattice, half weight on the outline: exact E with no tuning, nu = 1/3.

An equilateral network of springs k has ``E t = 2 k / sqrt(3)`` and nu = 1/3 whatever k is (Cauchy relations of a
network of central springs). Each triangle contributes ``sqrt(3)/4 E t`` to its edges: an edge inside gets
``sqrt(3)/2 E t``, one on the outline, which belongs to one triangle, half of it. This is the triangle of Lloyd, Szekely
and Harders (IEEE TVCG 13(5):1081, 2007), for which their match with finite elements requires nu = 1/3.

With full stiffness on the outline a beam of height H with edges a is too stiff by ``1 + sqrt(3)/2 a/H`` in tension.

Assumptions: near-equilateral triangles; exact on equilateral rows.
"""

import math

import numpy as np

COEFFICIENT = math.sqrt(3) / 2
"""Stiffness of an edge inside over E t [1]."""


def springs(mesh, material, thickness, stiffness=None):
    """Springs of the lattice.

    Parameters
    ----------
    mesh : TriangleMesh
    material : Material
    thickness : float
        Thickness t of the sheet [m].
    stiffness : None
        Not used: the stiffness is derived.

    Returns
    -------
    float, ndarray
        Stiffness of an edge inside [N/m] and multiples of it [1], shape (n_edges,).
    """
    return COEFFICIENT * material.young_modulus * thickness, 0.5 * mesh.triangles_per_edge


def uniform(mesh):
    """Multiples of a uniform stiffness [1], shape (n_edges,): ones."""
    return np.ones(len(mesh.edges))


def predicted_stiffness(material, beam, mesh_size):
    """Uniform stiffness that gives a beam its axial stiffness, outline included.

    ``k = sqrt(3)/2 E t / (1 + sqrt(3)/2 a/H)``, from the excess of the full outline.

    Parameters
    ----------
    material : Material
    beam : Beam
    mesh_size : float
        Edge length a [m].

    Returns
    -------
    float
        Stiffness [N/m].
    """
    return COEFFICIENT * material.young_modulus * beam.thickness / (1.0 + COEFFICIENT * mesh_size / beam.height)
