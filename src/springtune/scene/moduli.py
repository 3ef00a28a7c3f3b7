"""Effective moduli of a definition on a mesh, by patch tests."""

from dataclasses import dataclass
from typing import Any

from ..mechanics.moduli import PatchTest
from ..mesh import Mesh
from ..problem.materials import Material
from ..springs import Springs
from .sheet import Sheet


@dataclass(frozen=True)
class Moduli:
    """What a network is as a material.

    Attributes
    ----------
    young_modulus_error : float
        Young's modulus along x between rollers over the material's, less one [1].
    poisson_ratio : float
        Poisson's ratio there [1].
    shear_modulus_error : float
        Shear modulus under even shear of the outline over the material's, less one [1].
    springs : Springs
    seconds : float
        That deriving the springs took.
    """

    young_modulus_error: float
    poisson_ratio: float
    shear_modulus_error: float
    springs: Springs
    seconds: float


class MeshModuli:
    """Patch tests of many definitions on one mesh; networks that differ in reference stiffness alone once.

    Parameters
    ----------
    mesh : Mesh
    """

    def __init__(self, mesh: Mesh) -> None:
        self.sheet = Sheet(mesh, 1.0)
        self._test = PatchTest(mesh)
        self._found: dict[tuple[Any, ...], tuple[float, float, float]] = {}

    def __call__(self, material: Material, definition: Any) -> Moduli:
        """As `moduli`."""
        springs, seconds = self.sheet.derive(definition, material)
        name = springs.relative.tobytes(), springs.lateral, *(energy.key for energy in springs.energies)
        if name not in self._found:
            self._found[name] = *self._test.axial(springs), self._test.shear(springs)
        young_modulus, poisson_ratio, shear_modulus = self._found[name]
        scale = material.young_modulus * self.sheet.thickness
        return Moduli(
            young_modulus * springs.reference / scale - 1,
            poisson_ratio,
            shear_modulus * springs.reference / scale * 2 * (1 + material.poisson_ratio) - 1,
            springs,
            seconds,
        )


def moduli(mesh: Mesh, material: Material, definition: Any) -> Moduli:
    """Effective moduli of a definition on a mesh, by patch tests with an even strain.

    Parameters
    ----------
    mesh : Mesh
    material : Material
        What the springs are derived from.
    definition : str, Definition or callable
        Key of `springtune.springs.DEFINITIONS`, or a function (mesh, material, thickness) -> Springs.

    Returns
    -------
    Moduli

    Raises
    ------
    DefinitionError
        If the definition cannot live on the mesh or with the material, or is told a stiffness.
    SingularError
        If the network is singular or unstable at rest.

    Notes
    -----
    They are those of the mesh that is given: rows of triangles that are fitted to a box are stretched, and not
    isotropic.

    Examples
    --------
    >>> import springtune as st
    >>> mesh = st.make_mesh(st.Beam("100 mm", "20 mm"), "right", "5 mm")
    >>> found = moduli(mesh, st.Material("1 MPa", 1 / 3), "delingette")
    >>> f"{abs(found.young_modulus_error):.6f} {found.poisson_ratio:.4f} {abs(found.shear_modulus_error):.6f}"
    '0.000000 0.3333 0.000000'
    """
    return MeshModuli(mesh)(material, definition)
