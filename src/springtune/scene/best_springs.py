"""The best springs that a search finds on a mesh, how far they are off, and what no springs can do."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from ..mesh.cells import Mesh
from ..mesh.sheets import bonded
from ..problem.materials import AnyMaterial, Material
from ..problem.quantities import positive
from ..safe_io.tables import Tabled
from ..springs.base import DEFINITIONS, DefinitionError, Springs
from ..springs.best_springs import EVALUATIONS, LoadSpace
from .mesh_cache import choose, naming_errors
from .meshes import A_MATERIAL, A_MESH, is_a

START_DEFINITIONS = ("van-gelder", "lattice", "energy-fit")
"""Definitions from whose springs searches start."""


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
    further_error : float
        Worst error of the energy under quartic and quintic stresses [1], which are not fitted.
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
    is_a(mesh, Mesh, "mesh", A_MESH)
    is_a(material, AnyMaterial, "material", A_MATERIAL)
    if not isinstance(material, Material):
        raise DefinitionError("material: best springs are of isotropic ones; take definition 'energy-fit' for others")
    thickness = positive(thickness, "length", "thickness")
    if isinstance(evaluations, bool) or not (isinstance(evaluations, int) and evaluations > 0):
        raise ValueError(f"evaluations: {evaluations!r} is not a whole number above zero")
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
    stiffness = min(found.values(), key=lambda one: one[1])[0]
    springs = Springs(scale, stiffness, evaluations=sum(count for _, _, count in found.values()))
    errors, bound = space.errors(stiffness), None if negative else space.stretch_bound()
    objectives = {name: value for name, (_, value, _) in found.items()}
    seconds = time.perf_counter() - begin
    return BestSprings(springs, space.mesh, material, thickness, negative, *errors, bound, objectives, seconds)
