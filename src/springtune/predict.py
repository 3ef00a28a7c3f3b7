"""Which definition and stiffness to use on a mesh, and how far off it will be: closed forms and one patch test.

What a user without a study needs. Springs alone have the mesh's Poisson's ratio whatever was asked for; the patch test
measures it, and Young's modulus, on the mesh itself.
"""

from dataclasses import dataclass

import numpy as np

from .moduli import axial_moduli
from .springs import area, delingette, lattice

BENDING_LOCKING = 1.6
"""Error in bending of linear triangles over (a/H)^2 [1]; measured in the study of definitions: .4 % at a/H = .05, 1.5 %
at .1. Springs with energies of areas or angles share it."""


@dataclass(frozen=True)
class Choice:
    """A definition with its numbers.

    Attributes
    ----------
    definition : str
        Key of `springtune.springs.DEFINITIONS`.
    inside, outline : float
        Stiffness of a spring inside and on the outline [N/m]; NaN where they differ from spring to spring.
    extra : str
        What there is besides springs.
    traction, bending, shear : float
        Expected deformation error under each load [1].
    poisson_ratio : float
        Effective Poisson's ratio [1].
    """

    definition: str
    inside: float
    outline: float
    extra: str
    traction: float
    bending: float
    shear: float
    poisson_ratio: float


def predict(mesh, beam, material):
    """Choices for a mesh, the recommended ones first: with energies besides springs, then springs alone.

    Parameters
    ----------
    mesh : Mesh
        That fills the beam.
    beam : Beam
    material : Material

    Returns
    -------
    list of Choice
        ``delingette`` on triangles or ``area`` on rectangles, ``area`` on triangles, ``patch``, and on triangles
        ``uniform`` with its outline corrected in tension.

    Raises
    ------
    DefinitionError
        If the springs of `springtune.springs.lattice` cannot live on the mesh.

    Notes
    -----
    Errors are of displacements. In shear springs alone have ``G = E / (2 (1 + nu_eff))``, as an isotropic sheet with
    their Poisson's ratio.
    """
    nu, membrane = material.poisson_ratio, material.young_modulus * beam.thickness
    springs = lattice.springs(mesh, material, beam.thickness)
    young, ratio = axial_moduli(mesh, springs)
    scalar = membrane / (young * springs.reference)
    faces = np.concatenate([mesh.outline_edges(1, value) for value in (0.0, beam.height)])
    size = float(np.median(np.abs(np.diff(mesh.points[faces, 0]))))
    locking = -BENDING_LOCKING * (size / beam.height) ** 2
    shear = (1 + ratio) / (1 + nu) - 1
    sides = mesh.cells_per_edge == 2
    inside = float(np.median(springs.relative[sides])) * springs.reference
    outline = float(np.median(springs.relative[mesh.on_outline])) * springs.reference
    with_area = area.springs(mesh, material, beam.thickness)
    modulus = 1e-6 * material.young_modulus * (3 * nu - 1) / (2 * (1 - nu**2))
    part = with_area.reference / springs.reference
    choices, diagonals = [], " diagonals as the outline;" if len(mesh.quads) else ""
    if not len(mesh.quads):
        delingette.springs(mesh, material, beam.thickness)
        choices.append(
            Choice("delingette", np.nan, np.nan, "coupling of the sides of each triangle", 0.0, locking, 0.0, nu)
        )
    choices.append(
        Choice(
            "area", part * inside, part * outline, f"area energy, K_A = {modulus:.4g} MPa;{diagonals}".rstrip(";"),
            scalar - 1, scalar * (1 + locking) - 1, scalar - 1, nu,
        )
    )  # fmt: skip
    choices.append(
        Choice(
            "patch",
            scalar * inside,
            scalar * outline,
            f"none;{diagonals} the scalar is {scalar:.5f}",
            0.0,
            locking,
            shear,
            ratio,
        )
    )
    if len(mesh.quads):
        return choices  # their uniform stiffness has nu = 1/2 and no closed form for the outline
    uniform = lattice.predicted_stiffness(material, beam, size)
    bent = lattice.predicted_stiffness(material, beam, size, "bending") / uniform - 1
    choices.append(
        Choice("uniform", uniform, uniform, "none; corrected for the outline", scalar - 1, bent, shear, ratio)
    )
    return choices
