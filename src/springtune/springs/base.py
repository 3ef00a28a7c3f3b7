"""Declaration of definitions, their result and their errors."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from ..mesh.cells import Mesh
from ..problem.materials import AnyMaterial, Material
from ..problem.quantities import out_of_range
from ..registry import Declaration, Registry

EQUAL_STIFFNESS = 1e-5  # relative difference below which stiffnesses count as equal: five digits are shown


class DefinitionError(ValueError):
    """A definition does not support a mesh or material; the message gives the reason and the remedy.

    Examples
    --------
    >>> import springtune as st
    >>> mesh = st.make_mesh(st.Beam("200 mm", "40 mm"), "structured", "5 mm")
    >>> try:
    ...     st.moduli(mesh, st.Material("210 GPa", 0.3), "baudet")
    ... except st.DefinitionError as error:
    ...     print(error)
    definition 'baudet': needs rectangles with both diagonals and the mesh has triangles; use mesh type 'braced'
    """


@dataclass(frozen=True, eq=False)
class Springs:
    """Parameters of a network.

    Attributes
    ----------
    reference : float
        Reference stiffness [N/m], of which `relative` gives multiples.
    relative : ndarray of float, shape (n_edges,)
        Stiffness of each spring over the reference stiffness [1], in the order of `Mesh.edges`.
    energies : tuple
        Other energies of `springtune.mechanics.energies`, with moduli over the reference stiffness.
    lateral : float
        Stress on the long faces over the axial stress [1], in uniaxial scenes.
    evaluations : int
        Solves that finding the parameters took.
    linear_springs : ndarray of float, shape (n_edges,), or None
        Stiffness at rest over the reference stiffness [1] of springs that belong to an energy.

    Raises
    ------
    DefinitionError
        If the reference stiffness is not above zero, or a stiffness is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> import springtune as st
    >>> springs = st.Springs(2e8, np.array([1.0, 0.5, 0.25]))
    >>> springs.reference * springs.relative
    array([2.e+08, 1.e+08, 5.e+07])
    >>> springs.spring_ratio
    4.0
    """

    reference: float
    relative: np.ndarray
    energies: tuple[Any, ...] = ()
    lateral: float = 0.0
    evaluations: int = 0
    linear_springs: np.ndarray | None = None

    def __post_init__(self) -> None:
        number = isinstance(self.reference, int | float | np.number) and not isinstance(self.reference, bool)
        if not (number and 0 < self.reference < math.inf):
            raise DefinitionError(f"reference stiffness {self.reference!r} is not a number above zero; give one in N/m")
        relative = self.relative
        if not (isinstance(relative, np.ndarray) and relative.ndim == 1 and np.isfinite(relative).all()):
            raise DefinitionError(f"relative stiffnesses {relative!r} are not finite; give an array, one for each edge")

    @property
    def spring_ratio(self) -> float:
        """Largest stiffness of a spring over the smallest one [1]; infinite if one is zero."""
        springs = np.abs(self.relative if self.linear_springs is None else self.linear_springs)
        return float(springs.max() / springs.min()) if springs.min() > 0 else np.inf


@dataclass(frozen=True, eq=False)
class Definition(Declaration):
    """A definition of a study; made by the decorator `definition`.

    Attributes
    ----------
    name, order : str, float
        Label in a study and in the dataset, and its place in the order of labels.
    function : callable
        Its formula: (mesh, material, thickness), and what it `needs`, -> `Springs`. The material has the constants of
        its plane, see `springtune.Material.in_plane`.
    uniform : bool
        Whether all springs have one stiffness, which is then reported.
    cells : tuple of int
        Supported cells, by number of corners.
    uniaxial : bool
        Whether it supports only loads along the beam, see `LoadKind.uniaxial`.
    needs : str
        Fourth argument: ``"stiffness"``, a given one; ``"cases"``, loads with displacements to match; or none.
    anisotropic : bool
        Whether it supports anisotropic materials.
    finite_strain : bool
        Whether it has the material's law at finite strain; its nonlinear error is then against a reference of that law.
    st_venant : bool
        Whether it is linear triangles of St. Venant and Kirchhoff's law in nonlinear kinematics.
    cost : int
        What deriving springs costs: 0 for closed forms, 1 for a few solves, 2 for a search of seconds, which
        `springtune.predict` tries only if it is asked to.

    Examples
    --------
    >>> import springtune as st
    >>> lattice, paper = st.DEFINITIONS["lattice"], st.DEFINITIONS["paper"]
    >>> lattice.cells, lattice.uniform, paper.uniform, paper.needs
    ((3, 4), False, True, 'stiffness')
    >>> lattice.summary
    'Closed form of the equilateral lattice, half weight on the outline: exact E with no tuning, nu = 1/3'
    >>> [st.DEFINITIONS[name].law for name in ("neo-hooke", "delingette", "lattice")]
    ['rubber', 'st-venant', '']
    >>> mesh = st.make_mesh(st.Beam("200 mm", "40 mm"), "structured", "5 mm")
    >>> found = lattice.springs(mesh, st.Material("210 GPa", 0.3), thickness=1e-3)
    >>> print(f"{found.reference:.4g} N/m, sqrt(3)/2 E t = {3**0.5 / 2 * 210e9 * 1e-3:.4g} N/m")
    1.819e+08 N/m, sqrt(3)/2 E t = 1.819e+08 N/m
    """

    uniform: bool
    cells: tuple[int, ...]
    uniaxial: bool
    needs: str
    anisotropic: bool
    finite_strain: bool
    st_venant: bool = False
    cost: int = 0

    @property
    def law(self) -> str:
        """Law at finite strain, ``"rubber"`` (that of the material), ``"st-venant"`` or none."""
        return "rubber" if self.finite_strain else "st-venant" if self.st_venant else ""

    def springs(self, mesh: Mesh, material: AnyMaterial, thickness: float, given: object = None) -> Springs:
        """Return the springs of a mesh.

        Parameters
        ----------
        mesh : Mesh
        material : Material or AnisotropicMaterial
        thickness : float
            Thickness of the sheet [m].
        given : float or sequence of Case, optional
            What the definition `needs`: a stiffness [N/m] or cases; else unused.

        Returns
        -------
        Springs

        Raises
        ------
        DefinitionError
            If the definition does not support the mesh or the material.
        """
        if not isinstance(mesh, Mesh):
            raise DefinitionError(f"mesh: {mesh!r} is not a Mesh; give a springtune.Mesh")
        if not isinstance(material, AnyMaterial):
            raise DefinitionError(f"material: {material!r} is not a Material; give a springtune.Material")
        if not (material.isotropic or self.anisotropic):
            able = [name for name, one in DEFINITIONS.items() if one.anisotropic and not one.needs]
            fitting = [name for name in able if set(mesh.cells) <= set(DEFINITIONS[name].cells)]
            remedy = f"choose one of {', '.join(map(repr, fitting or able))}"
            raise DefinitionError(f"needs an isotropic material and {material.name!r} is anisotropic; {remedy}")
        numbers = [("thickness", thickness), *([("stiffness", given)] if self.needs == "stiffness" else [])]
        for name, value in numbers:
            if isinstance(value, bool) or not isinstance(value, int | float | np.number) or out_of_range(value, name):
                raise DefinitionError(f"{name}: {value!r} is not a number above zero; give one in SI units")
        if self.needs == "cases" and not (isinstance(given, list | tuple) and given):
            raise DefinitionError(f"cases: {given!r} is no list of loads; give what identification.patch_cases returns")
        if self.finite_strain and isinstance(material, Material) and material.plane == "strain":
            why = f"has a law of sheets whose thickness is free, and {material.name!r} is in plane strain"
            raise DefinitionError(f"{why}; choose 'delingette', or plane 'stress'")
        if 4 not in self.cells:
            check_triangles(mesh)
        arguments = (given,) if self.needs else ()
        found = self.function(mesh, material.in_plane, thickness, *arguments)
        if not isinstance(found, Springs) or len(found.relative) != len(mesh.edges):
            what = f"{len(found.relative)} springs" if isinstance(found, Springs) else type(found).__name__
            raise DefinitionError(f"returns {what}; return springtune.Springs, one for each of {len(mesh.edges)} edges")
        if not found.energies:
            _held_together(mesh, found.relative)
        return found


NEEDS = ("", "stiffness", "cases")  # possible fourth arguments of a definition

Function = TypeVar("Function", bound=Callable[..., Springs])

DEFINITIONS: Registry[Definition] = Registry(__package__, "definition", "definitions")
"""Definitions by name, in the order of their labels."""


def definition(
    name: str,
    *,
    order: float = math.inf,
    uniform: bool = False,
    cells: tuple[int, ...] = (3, 4),
    uniaxial: bool = False,
    needs: str = "",
    anisotropic: bool = False,
    finite_strain: bool = False,
    st_venant: bool = False,
    cost: int = 0,
) -> Callable[[Function], Function]:
    """Declare a function as a definition, by a decorator that returns it unchanged.

    Parameters
    ----------
    name : str
        Label in a study and in the dataset.
    order : float, optional
        Place in the order of labels, between its neighbours' numbers; by default last.
    uniform, cells, uniaxial, needs, anisotropic, finite_strain, st_venant, cost
        As of `Definition`.

    Returns
    -------
    callable

    Raises
    ------
    ValueError
        If another function has that name; the same function, declared again, replaces the former.

    Examples
    --------
    >>> import numpy as np
    >>> import springtune as st
    >>> @st.definition("half", uniform=True)
    ... def half(mesh, material, thickness):
    ...     "Half of E t for every spring."
    ...     return st.Springs(0.5 * material.young_modulus * thickness, np.ones(len(mesh.edges)))
    >>> beam, steel = st.Beam("100 mm", "20 mm"), st.Material("210 GPa", 0.3)
    >>> scene = st.Scene(beam, st.make_mesh(beam, "free", "5 mm"), steel, "traction", "20 kN", definition="half")
    >>> scene.springs.reference
    105000000.0
    >>> st.DEFINITIONS.discard("half")
    """
    if not isinstance(cells, tuple | list | set) or not set(cells) <= {3, 4} or not cells:
        raise ValueError(f"definition {name!r}: cells {cells!r}; give the corners of cells that it can have: 3, 4")
    if needs not in NEEDS:
        raise ValueError(f"definition {name!r}: needs {needs!r}; give one of {', '.join(map(repr, NEEDS))}")
    traits = uniform, tuple(cells), uniaxial, needs, anisotropic, finite_strain, st_venant, cost
    return lambda function: DEFINITIONS.declare(Definition(name, function, order, *traits))


def membrane_stiffness(material: AnyMaterial, thickness: float) -> float:
    """Reference stiffness [N/m] for any material: E t, or the largest stiffness in plane stress by the thickness."""
    if isinstance(material, Material):
        return material.young_modulus * thickness
    return float(np.diag(material.plane_stress).max()) * thickness


def check_triangles(mesh: Mesh) -> None:
    """Refuse a mesh of quadrilaterals."""
    if len(mesh.quads):
        raise DefinitionError("needs triangles and the mesh has quadrilaterals; choose another mesh type")


def rectangle_sides(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the lengths [m] of each rectangle's first and second side, shape (n_quads,); refuse any other mesh."""
    if len(mesh.triangles):
        raise DefinitionError("needs rectangles with both diagonals and the mesh has triangles; use mesh type 'braced'")
    lengths = mesh.edge_lengths[mesh.cell_edges[4]]
    tolerance = 1e-9 * lengths.max(axis=1)
    pairs = ((0, 2), (1, 3), (4, 5))  # opposite sides, and diagonals
    if any((np.abs(lengths[:, i] - lengths[:, j]) > tolerance).any() for i, j in pairs):
        raise DefinitionError("needs rectangles and the mesh has other quadrilaterals; use mesh type 'braced'")
    return lengths[:, 0], lengths[:, 1]


def from_rectangles(mesh: Mesh, first: np.ndarray, second: np.ndarray, diagonal: np.ndarray) -> np.ndarray:
    """Springs from the stiffness that each rectangle gives its first and second pair of sides and its diagonals."""
    return mesh.sum_to_edges({4: np.stack([first, second, first, second, diagonal, diagonal], axis=1)})


NO_STIFFNESS = 1e-12  # stiffness over E t that counts as zero: of terms that cancel rounding decides the sign


def _held_together(mesh: Mesh, stiffness: np.ndarray) -> None:
    """Refuse springs that are fewer than n particles need, 2 n - 3 (Maxwell 1864), once those without stiffness go."""
    none = np.abs(stiffness) <= 1e3 * NO_STIFFNESS * np.abs(stiffness).max()
    free = 2 * len(mesh.points) - 3 - int((~none).sum())
    if none.any() and free > 0:
        why = f"gives {none.sum()} of {len(stiffness)} springs no stiffness, and without them {free} or more motions"
        remedy = "use a mesh without right angles, such as mesh type 'structured' or 'free'"
        raise DefinitionError(f"{why} of the mesh meet no resistance; {remedy}")


def check_not_negative(stiffness: np.ndarray) -> np.ndarray:
    """Return stiffnesses; refuse negative ones, with which a network may be unstable."""
    stiffness = np.where(np.abs(stiffness) <= NO_STIFFNESS, 0.0, stiffness)
    bad = int((stiffness < 0).sum())
    if bad:
        why = f"gives {bad} of {len(stiffness)} springs a negative stiffness"
        raise DefinitionError(f"{why}; use a mesh with less slender or obtuse cells")
    return stiffness
