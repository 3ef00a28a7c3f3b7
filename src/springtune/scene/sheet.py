"""Springs of a sheet, whatever load it gets: their effective moduli by patch tests, and the best ones of a search."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..mechanics.continuum import PatchTest
from ..mesh.cells import Mesh
from ..mesh.sheets import bonded
from ..problem.materials import AnyMaterial, Material
from ..problem.quantities import choose, positive, whole_number
from ..safe_io import Tabled
from ..springs.base import DEFINITIONS, DefinitionError, Springs
from ..springs.best_springs import EVALUATIONS, LoadSpace
from .mesh_cache import AnyDefinition, MeshCache, check_type, definition_of, naming_errors

START_DEFINITIONS = ("van-gelder", "lattice", "energy-fit")  # definitions from whose springs searches start


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
        target = self.material.in_plane.plane_stress
        # Twice the shear and its couplings: the norm of the tensor, which no turn of the axes changes.
        weights = np.sqrt(np.outer([1.0, 1.0, 2.0], [1.0, 1.0, 2.0]))
        return float(np.linalg.norm(weights * (self.stiffness - target)) / np.linalg.norm(weights * target))


class MeshModuli:
    """Patch tests of many definitions on one mesh; networks that differ in reference stiffness alone once."""

    def __init__(self, mesh: Mesh) -> None:
        self.cache = MeshCache(mesh, 1.0)
        self._test = PatchTest(mesh)
        self._found: dict[tuple[object, ...], tuple[float, float, float]] = {}

    def __call__(self, material: AnyMaterial, definition: AnyDefinition) -> Moduli:
        """Moduli of a definition, see `moduli`."""
        springs, seconds = self.cache.derive(definition, material)
        origin = springs, seconds, self.cache.mesh, material
        if not isinstance(material, Material):
            return Moduli(np.nan, np.nan, np.nan, *origin)
        name = springs.relative.tobytes(), springs.lateral, *(energy.key for energy in springs.energies)
        if name not in self._found:
            self._found[name] = *self._test.axial(springs), self._test.shear(springs)
        young, poisson, shear = self._found[name]
        target = material.in_plane
        scale = springs.reference / (target.young_modulus * self.cache.thickness)
        return Moduli(young * scale - 1, poisson, shear * scale * 2 * (1 + target.poisson_ratio) - 1, *origin)


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
    check_type(mesh, Mesh, "mesh")
    check_type(material, AnyMaterial, "material")
    definition = definition_of(definition)
    if definition.needs == "stiffness":
        raise DefinitionError(f"definition {definition.name!r} needs a given stiffness; choose one such as 'uniform'")
    with naming_errors(definition):
        return MeshModuli(mesh)(material, definition)


@dataclass(frozen=True, eq=False, repr=False)
class BestSprings(Tabled):
    """Springs that `springtune.best_springs` found; they can stand in for a definition.

    Attributes
    ----------
    springs : Springs
    mesh : Mesh
        With the bonds of second neighbours, if asked for.
    material : Material
    thickness, negative : float, bool
        As they were given; the thickness in m.
    energy_error, further_error : float
        Worst error of the energy [1] over all loads of the fitted space, polynomial stresses up to cubic ones, and
        under quartic and quintic ones.
    displacement_error : float
        Worst error of the displacement field there [1], root mean square over that of the load, of which a hundredth of
        the largest load's counts at least.
    stretch_error : float
        Worst error of a spring's stretch there, over the largest one that it has under a load of the same energy [1].
    lower_bound : float or None
        Proven: no stiffnesses >= 0 on this mesh have a smaller `stretch_error` [1]. None where negative ones are
        allowed.
    objectives, seconds : dict of str to float, float
        What the search minimised [1], by its start: searches that agree may be near the best there is.

    Examples
    --------
    >>> import springtune as st
    >>> beam, third = st.Beam("60 mm", "20 mm"), st.Material("1 MPa", 1 / 3)
    >>> found = st.best_springs(st.make_mesh(beam, "free", "5 mm"), third, "1 mm", starts=["van-gelder"])
    >>> found.lower_bound < found.stretch_error
    True
    >>> scene = st.Scene(beam, found.mesh, third, "bending", "1 N", definition=found, kinematics="linear")
    >>> abs(scene.solve().error) < 0.05
    True
    """

    springs: Springs
    mesh: Mesh = field(repr=False)
    material: Material
    thickness: float
    negative: bool
    energy_error: float
    displacement_error: float
    stretch_error: float
    further_error: float
    lower_bound: float | None
    objectives: dict[str, float]
    seconds: float

    def __call__(self, mesh: Mesh, material: AnyMaterial, thickness: float) -> Springs:
        """Return the springs, of their own mesh, material and thickness alone."""
        if mesh is not self.mesh or material != self.material.in_plane or thickness != self.thickness:
            raise DefinitionError("best springs are of one mesh, material and thickness; search again for another")
        return self.springs

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "springs", f"{len(self.springs.relative)}, {'of any sign' if self.negative else 'none negative'}"
        for label, error in (
            ("worst energy, fitted loads", self.energy_error),
            ("worst energy, other stresses", self.further_error),
            ("worst displacement field", self.displacement_error),
            ("worst stretch of a spring", self.stretch_error),
            ("no springs >= 0 below, proven", self.lower_bound),
        ):
            yield label, "" if error is None else f"{100 * error:.2g} %"
        yield "searches", f"{len(self.objectives)}, {self.springs.evaluations} networks, {self.seconds:.1f} s"


def best_springs(
    mesh: Mesh,
    material: Material,
    thickness: float | str,
    *,
    negative: bool = False,
    reach: float | str | None = None,
    starts: Sequence[str] = START_DEFINITIONS,
    evaluations: int = EVALUATIONS,
) -> BestSprings:
    """Search for the stiffnesses with the least error over a space of loads, see `springtune.springs.best_springs`.

    Parameters
    ----------
    mesh : Mesh
        Triangles, in one part.
    material : Material
        Isotropic; springs alone do best near nu = 1/3, in plane strain near 1/4.
    thickness : float or str
        [m], or a text with its unit.
    negative : bool, optional
        Whether to search on among negative stiffnesses, too, as long as the network is stable.
    reach : float or str, optional
        Springs also between all points up to so far apart [m], such as second neighbours.
    starts : sequence of str, optional
        Keys of `springtune.DEFINITIONS` from whose springs a search starts each.
    evaluations : int, optional
        Networks that a search tries at most.

    Returns
    -------
    BestSprings
        The best of all searches: nothing says that there is no better one, but `BestSprings.lower_bound`.

    Raises
    ------
    ValueError
        If an argument is unknown or out of its range.
    DefinitionError
        If the mesh has quadrilaterals or several parts, or a start does not support it.

    Examples
    --------
    >>> import springtune as st
    >>> mesh = st.make_mesh(st.Beam("60 mm", "20 mm"), "free", "5 mm")
    >>> found = st.best_springs(mesh, st.Material("1 MPa", 1 / 3), "1 mm", evaluations=100)
    >>> sorted(found.objectives), bool(found.springs.relative.min() > 0)
    (['energy-fit', 'lattice', 'van-gelder'], True)
    """
    check_type(mesh, Mesh, "mesh")
    check_type(material, AnyMaterial, "material")
    if not isinstance(material, Material):
        raise DefinitionError("material: best springs are of isotropic ones; take definition 'energy-fit' for others")
    thickness = positive(thickness, "length", "thickness")
    whole_number(evaluations, "evaluations")
    if isinstance(starts, str) or not starts:
        raise ValueError(f"starts: {starts!r} is no list of definitions; give some such as {list(START_DEFINITIONS)}")
    begin, sought = time.perf_counter(), material.in_plane
    space = LoadSpace(mesh if reach is None else bonded(mesh, positive(reach, "length", "reach")), sought.poisson_ratio)
    scale, found = sought.young_modulus * thickness, {}
    for name in starts:
        one = choose(DEFINITIONS, name, "starts")
        with naming_errors(one):
            springs = one.springs(space.mesh, material, thickness)
        found[name] = space.search(springs.relative * springs.reference / scale, False, evaluations)
    if negative:
        found = {name: space.search(stiffness, True, evaluations) for name, (stiffness, _, _) in found.items()}
    each, values, counts = zip(*found.values())
    stiffness = each[np.argmin(values)]
    springs, objectives = Springs(scale, stiffness, evaluations=sum(counts)), dict(zip(found, values))
    errors, bound = space.errors(stiffness), None if negative else space.stretch_bound()
    seconds = time.perf_counter() - begin
    return BestSprings(springs, space.mesh, material, thickness, negative, *errors, bound, objectives, seconds)
