"""Effective moduli of a definition on a mesh, by patch tests."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..mechanics.continuum import PatchTest
from ..mesh.cells import Mesh
from ..problem.materials import AnyMaterial, Material
from ..springs.base import DefinitionError, Springs
from .mesh_cache import AnyDefinition, MeshCache, definition_of, naming_errors
from .meshes import A_MATERIAL, A_MESH, is_a


@dataclass(frozen=True)
class Moduli:
    """Effective moduli of a network; Young's modulus, Poisson's ratio and shear modulus are NaN if it is not isotropic.

    Attributes
    ----------
    young_modulus_error, shear_modulus_error : float
        Young's modulus along x, and shear modulus, over the material's, less one [1].
    poisson_ratio : float
        Poisson's ratio along x [1].
    springs, seconds : Springs, float
        Of a sheet that is 1 m thick: moduli do not depend on the thickness; and what deriving them took.
    mesh : Mesh
    material : Material or AnisotropicMaterial

    Examples
    --------
    On squares with both diagonals, springs alone have the wanted Young's modulus, and always nu = 1/3:

    >>> import springtune as st
    >>> mesh = st.make_mesh(st.Beam("100 mm", "20 mm"), "braced", "5 mm")
    >>> found = st.moduli(mesh, st.Material("210 GPa", 0.3), "lattice")
    >>> f"{abs(found.young_modulus_error):.4f} {found.poisson_ratio:.4f} {found.shear_modulus_error:+.4f}"
    '0.0000 0.3333 -0.0250'

    They always have C12 = C66:

    >>> found = st.moduli(mesh, st.AnisotropicMaterial("9 GPa", "4 GPa", "1.5 GPa", "2 GPa"), "energy-fit")
    >>> print((abs(found.stiffness) / 1e9).round(2).tolist(), f"{found.stiffness_error:.1%}")
    [[9.29, 1.91, 0.0], [1.91, 4.13, 0.0], [0.0, 0.0, 1.91]] 6.4%
    """

    young_modulus_error: float
    poisson_ratio: float
    shear_modulus_error: float
    springs: Springs
    seconds: float
    mesh: Mesh = field(repr=False)
    material: AnyMaterial

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Stiffness in plane stress [Pa], shape (3, 3), as of `Material.plane_stress`; NaN where loads change it.

        By even strains of the whole outline, see `springtune.mechanics.continuum.PatchTest.stiffness`.
        """
        if self.springs.lateral:
            return np.full((3, 3), np.nan)
        return PatchTest(self.mesh).stiffness(self.springs) * self.springs.reference

    @property
    def stiffness_error(self) -> float:
        """Norm of the difference of `stiffness` from the material's, over the norm of the material's [1]."""
        wanted = self.material.in_plane.plane_stress
        # Twice the shear and its couplings: the norm of the tensor, which no turn of the axes changes.
        weights = np.sqrt([1.0, 1.0, 2.0])
        weights = weights[:, None] * weights
        return float(np.linalg.norm(weights * (self.stiffness - wanted)) / np.linalg.norm(weights * wanted))


class MeshModuli:
    """Patch tests of many definitions on one mesh; networks that differ in reference stiffness alone once."""

    def __init__(self, mesh: Mesh) -> None:
        self.sheet = MeshCache(mesh, 1.0)
        self._test = PatchTest(mesh)
        self._found: dict[tuple[object, ...], tuple[float, float, float]] = {}

    def __call__(self, material: AnyMaterial, definition: AnyDefinition) -> Moduli:
        """Moduli of a definition, see `moduli`."""
        springs, seconds = self.sheet.derive(definition, material)
        origin = springs, seconds, self.sheet.mesh, material
        if not isinstance(material, Material):
            return Moduli(np.nan, np.nan, np.nan, *origin)
        name = springs.relative.tobytes(), springs.lateral, *(energy.key for energy in springs.energies)
        if name not in self._found:
            self._found[name] = *self._test.axial(springs), self._test.shear(springs)
        young_modulus, poisson_ratio, shear_modulus = self._found[name]
        wanted = material.in_plane
        scale = wanted.young_modulus * self.sheet.thickness
        young_modulus_error = young_modulus * springs.reference / scale - 1
        shear_modulus_error = shear_modulus * springs.reference / scale * 2 * (1 + wanted.poisson_ratio) - 1
        return Moduli(young_modulus_error, poisson_ratio, shear_modulus_error, *origin)


def moduli(mesh: Mesh, material: AnyMaterial, definition: AnyDefinition) -> Moduli:
    """Measure the effective moduli of a definition on a mesh, by patch tests with an even strain.

    Young's modulus and Poisson's ratio are those of a strip whose ends slide; of other meshes means over all
    directions, see `springtune.mechanics.continuum`. Rows of triangles that are stretched to fit a box are not
    isotropic.

    Parameters
    ----------
    mesh : Mesh
    material : Material or AnisotropicMaterial
    definition : str, Definition or callable
        As of `Scene`.

    Returns
    -------
    Moduli

    Raises
    ------
    DefinitionError
        If the definition does not support the mesh or the material, or needs a uniform stiffness.
    SingularError
        If the network is singular or unstable at rest.
    MeshError
        If the mesh is no strip and the springs go with a lateral stress.

    Examples
    --------
    >>> import springtune as st
    >>> mesh = st.make_mesh(st.Beam("100 mm", "20 mm"), "right", "5 mm")
    >>> found = st.moduli(mesh, st.Material("1 MPa", 1 / 3), "delingette")
    >>> f"{abs(found.young_modulus_error):.6f} {found.poisson_ratio:.4f} {abs(found.shear_modulus_error):.6f}"
    '0.000000 0.3333 0.000000'
    """
    is_a(mesh, Mesh, "mesh", A_MESH)
    is_a(material, AnyMaterial, "material", A_MATERIAL)
    definition = definition_of(definition)
    if definition.needs == "stiffness":
        raise DefinitionError(f"definition {definition.name!r} is told its stiffness; choose one such as 'uniform'")
    with naming_errors(definition):
        return MeshModuli(mesh)(material, definition)
