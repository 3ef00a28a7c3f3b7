"""A scene with its mesh: a beam or shape of springs under a load, its equilibrium, and its finite-element answer."""

import time
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..mechanics.network import Network
from ..mechanics.newton import Equilibrium
from ..mechanics.statics import SingularError, StaticProblem
from ..mesh.cells import MESH_TYPES, Mesh
from ..mesh.formats import read_beam_mesh
from ..mesh.formats import read_shape as read_grouped
from ..mesh.free import mesh_shape as mesh_outlined
from ..mesh.sheets import GroupedMesh
from ..problem.compare import error_text, quantity_errors, sign_word
from ..problem.loads import KINEMATICS
from ..problem.materials import Materials
from ..problem.quantities import Status, choose, positive
from ..problem.shapes import QUANTITY_UNITS, AssumptionWarning, Beam, Shape
from ..registry import hook
from ..safe_io import Tabled, number_text
from ..springs.base import Springs
from .boundary_problem import BeamProblem, BoundaryProblem, ShapeProblem
from .mesh_cache import AnyDefinition, MeshCache, check_type, definition_of, given_stiffness, naming_errors

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..mechanics.dynamics import Motion
    from .boundary_problem import AnyReference


def make_mesh(beam: Beam, mesh_type: str, size: float | str) -> Mesh:
    """Mesh a beam.

    Parameters
    ----------
    beam : Beam
    mesh_type : str
        Key of `springtune.MESH_TYPES`.
    size : float or str
        Length of an edge [m], or a text with its unit.

    Returns
    -------
    Mesh

    Raises
    ------
    ValueError
        If the size is larger than the beam's smaller side, or makes more cells than can be meshed.

    Examples
    --------
    >>> import springtune as st
    >>> mesh = st.make_mesh(st.Beam("200 mm", "40 mm"), "structured", "5 mm")
    >>> len(mesh.points), len(mesh.edges)
    (415, 1143)
    """
    check_type(beam, Beam, "beam")
    make, edge = choose(MESH_TYPES, mesh_type, "mesh type"), positive(size, "length", "mesh size")
    if refusal := make.refusal(beam.length, beam.height, edge, f"beam {beam.name!r}"):
        raise ValueError(f"mesh size: {size!r} {refusal}")
    return make(beam.length, beam.height, edge)


def read_mesh(path: str | Path, beam: Beam, unit: float | str = "1 m") -> Mesh:
    """Read a mesh of a beam, of any format that meshio knows; its lower left corner is put at the origin.

    Parameters
    ----------
    path : str or Path
    beam : Beam
        That it fills.
    unit : float or str, optional
        Unit of the coordinates in the file [m], or a text such as ``"1 mm"``.

    Returns
    -------
    Mesh

    Examples
    --------
    >>> import springtune as st
    >>> from springtune.mesh.formats import write_mesh
    >>> beam = st.Beam("100 mm", "20 mm")
    >>> write_mesh("own.vtu", st.make_mesh(beam, "free", "5 mm"))
    >>> print(f"{1e6 * st.read_mesh('own.vtu', beam).area:.0f} mm2")
    2000 mm2
    """
    check_type(beam, Beam, "beam")
    return read_beam_mesh(path, beam.length, beam.height, positive(unit, "length", "unit"))


def mesh_shape(shape: Shape, size: float | str, refined: Mapping[str, float | str] | None = None) -> GroupedMesh:
    """Mesh a shape, with the groups of its sides, its points and parts.

    An arc has at least six edges a full turn; near much shorter ones, edges are divided further.

    Parameters
    ----------
    shape : Shape
    size : float or str
        Length of an edge [m], or a text with its unit.
    refined : mapping of str to float or str, optional
        Shorter edges at groups of sides, at points and in parts, by their name [m]; from there on they grow.

    Returns
    -------
    GroupedMesh

    Examples
    --------
    >>> import springtune as st
    >>> plate = st.Shape.rectangle("100 mm", "40 mm", holes=[st.Hole.circle(("50 mm", "20 mm"), "8 mm")])
    >>> grouped = st.mesh_shape(plate, "4 mm", refined={"hole": "1 mm"})
    >>> len(grouped.sides["hole"]), len(grouped.sides["right"])
    (52, 10)
    """
    check_type(shape, Shape, "shape")
    sizes = {name: positive(value, "length", f"refined {name!r}") for name, value in (refined or {}).items()}
    return mesh_outlined(shape, positive(size, "length", "mesh size"), sizes)


def read_shape(path: str | Path, unit: float | str = "1 m") -> GroupedMesh:
    """Read the mesh of a shape with its groups, of any format that meshio knows.

    Parameters
    ----------
    path : str or Path
        The guide on mesh files says how a group of the file becomes sides, a point or a part.
    unit : float or str, optional
        Unit of the coordinates in the file [m], or a text such as ``"1 mm"``.

    Returns
    -------
    GroupedMesh

    Examples
    --------
    >>> import springtune as st
    >>> from springtune.mesh.formats import write_mesh
    >>> plate = st.Shape.rectangle("100 mm", "40 mm", holes=[st.Hole.circle(("50 mm", "20 mm"), "8 mm")])
    >>> write_mesh("plate.vtu", st.mesh_shape(plate, "4 mm"))
    >>> sorted(st.read_shape("plate.vtu").sides)
    ['hole', 'left', 'lower', 'right', 'upper']
    """
    return read_grouped(path, positive(unit, "length", "unit"))


class Scene(Tabled):
    """A boundary-value problem: a beam or a shape, meshed by springs of a definition, under a load.

    Parameters
    ----------
    beam : Beam or Shape
        The body.
    mesh : Mesh or GroupedMesh
        That fills the beam, see `springtune.make_mesh` and `springtune.read_mesh`; of a shape with its groups.
    material : Material, AnisotropicMaterial or mapping of str to those
        Isotropic of a beam; of a shape of several parts by their names, and at ``""`` that of all others.
    load : str
        Key of `springtune.LOADS`: what is held, and where the force acts; of a shape key of its own ``loads``.
    force : float or str, optional
        Size of the force on a beam [N], above zero, or a text with its unit; its direction is the load's. The loads of
        a shape have their own sizes.
    definition : str, Definition or callable, optional
        Key of `springtune.DEFINITIONS`, or a function (mesh, material, thickness) -> `springtune.Springs`.
    kinematics : str, optional
        ``"nonlinear"``: springs keep their length law; or ``"linear"``.
    stiffness : float or str, optional
        Uniform stiffness [N/m], or a text with its unit, for definitions that need one.
    scale : float, optional
        Factor on all that the load case of a shape prescribes, forces and displacements [1].
    cache : MeshCache, optional
        Of another scene of the same mesh and thickness, to compute once what the two share.

    Attributes
    ----------
    boundary_problem : BeamProblem or ShapeProblem
        Supports, forces, quantities and reference, see `springtune.scene.boundary_problem`.
    uniform_stiffness : float or None
        The stiffness that was given [N/m].
    force, kind, follower : float, LoadKind, bool
        Of a beam: the force with its load's sign [N], and whether it turns and grows with its side, if nonlinear.
    shape, grouped, by_part, case : Shape, GroupedMesh, dict of str to Material, LoadCase
        Of a shape; the case with `scale` in it.

    Raises
    ------
    ValueError
        If an argument is unknown or out of its range, or the mesh does not fill the beam.

    Notes
    -----
    A spring of stiffness k and rest length L whose ends are l apart pulls with k (l - L), or in linear kinematics with
    k times the stretch along its direction at rest; see `springtune.mechanics.network`.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("200 mm", "40 mm"), st.Material("210 GPa", 0.3, name="steel")
    >>> mesh = st.make_mesh(beam, "structured", "5 mm")
    >>> scene = st.Scene(beam, mesh, steel, "traction", "400 kN", definition="patch")
    >>> scene
    Scene(200x40 mm, 415 particles, steel, traction of 400000 N, patch, nonlinear)
    >>> scene.title, scene.held.sum().item(), scene.network.unknowns, scene.forces.sum(axis=0).round(3).tolist()
    ('traction of 400000 N', 20, 810, [400000.0, 0.0])
    >>> scene.finite_strain, scene.objection, round(scene.displacement_of(0.01 * mesh.points), 12)
    (False, '', 0.002)
    >>> scene.springs.write("net.csv")[0].name
    'net.csv'
    >>> result = scene.solve()
    >>> print(f"{result.status}: {1e3 * result.displacement:.2f} mm, error {100 * result.error:+.1f} %")
    solved: 9.51 mm, error +0.1 %
    >>> {name: f"{1e3 * value:.2f} mm" for name, value in scene.reference_values().items()}
    {'displacement': '9.50 mm'}
    >>> scene.write("compressed.vtu", -result.displacements)[0].name
    'compressed.vtu'

    A shape, with the stress beside its hole:

    >>> pull = st.LoadCase("pull", [st.Support("left", x=0, y=0)], [st.Traction("right", ("4 kN", 0))],
    ...                    quantities=[st.Quantity("end", "displacement", "right", "x"),
    ...                                st.Quantity("rim", "stress", "rim", "xx")])
    >>> hole = st.Hole.circle(("50 mm", "20 mm"), "8 mm")
    >>> plate = st.Shape.rectangle("100 mm", "40 mm", holes=[hole], points={"rim": ("50 mm", "28 mm")},
    ...                            loads={"pull": pull})
    >>> grouped = st.mesh_shape(plate, "4 mm", refined={"hole": "0.5 mm"})
    >>> there = st.Scene(plate, grouped, steel, "pull", definition="delingette", kinematics="linear").solve()
    >>> print(f"{1e6 * there.values['end']:.1f} um, {1e-6 * there.values['rim']:.0f} MPa")
    55.9 um, 359 MPa
    >>> print(*(f"{name} {100 * error:+.1f} %" for name, error in there.errors.items()))
    end -0.5 % rim -4.5 %

    The network without units, as the mechanics have it: force and stiffness over the reference stiffness.

    >>> moved = scene.problem.nonlinear(scene.force / scene.springs.reference)
    >>> bool(abs(moved.displacements - result.displacements).max() < 1e-9 * abs(result.displacements).max())
    True
    """

    def __init__(
        self,
        beam: Beam | Shape,
        mesh: Mesh | GroupedMesh,
        material: Materials,
        load: str,
        force: float | str | None = None,
        *,
        definition: AnyDefinition = "patch",
        kinematics: str = "nonlinear",
        stiffness: float | str | None = None,
        scale: float = 1.0,
        cache: MeshCache | None = None,
    ) -> None:
        choose(dict.fromkeys(KINEMATICS), kinematics, "kinematics")
        self.kinematics = kinematics
        self.boundary_problem: BoundaryProblem
        if isinstance(beam, Shape):
            if force is not None:
                raise ValueError(f"force: {force!r} is not used, since loads of a shape have their sizes; give scale")
            about = self.boundary_problem = ShapeProblem(beam, mesh, material, load, scale, kinematics, cache)
            self.shape, self.grouped, self.case, self.scale = beam, about.grouped, about.case, about.scale
            self.by_part = about.by_part
        else:
            if scale != 1:
                raise ValueError(f"scale: {scale!r} is of loads of shapes alone; give another force")
            of_beam = self.boundary_problem = BeamProblem(beam, mesh, material, load, force, kinematics, cache)
            self.beam, self.material, self.kind = beam, of_beam.material, of_beam.kind
            self.force, self.follower = of_beam.force, of_beam.follower
        self.mesh, self.cache, self.load = self.boundary_problem.mesh, self.boundary_problem.cache, load
        self.definition = definition_of(definition)
        self.boundary_problem.check(self.definition)
        self.uniform_stiffness = given_stiffness(self.definition, stiffness)

    def __repr__(self) -> str:
        about = self.boundary_problem
        what = f"{about.body}, {len(self.mesh.points)} particles, {about.named_materials}, {about.label}"
        return f"Scene({what}, {self.definition.name}, {self.kinematics})"

    def _rows(self) -> Iterator[tuple[str, str]]:
        about = self.boundary_problem
        yield "body", f"{about.body}, {1e3 * about.thickness:g} mm thick"
        yield "mesh", f"{len(self.mesh.points)} particles, {len(self.mesh.edges)} springs"
        yield "material", about.named_materials
        yield "load", about.label
        yield "definition", self.definition.name
        yield "kinematics", self.kinematics

    @cached_property
    def _derived(self) -> tuple[Springs, float]:
        with naming_errors(self.definition):
            return self.boundary_problem.springs(self.definition, self.uniform_stiffness)

    @cached_property
    def springs(self) -> "SceneSprings":
        """Springs of the definition: stiffnesses over a reference stiffness, and energies besides them."""
        return SceneSprings(**vars(self._derived[0]) | {"scene": self})

    @property
    def title(self) -> str:
        """Load in words."""
        return self.boundary_problem.label

    def displacement_of(self, displacements: np.ndarray) -> float:
        """Displacement of the load [m]; of a shape the first one that its load case asks for, NaN where there is none.

        Parameters
        ----------
        displacements : ndarray of float, shape (n_points, 2)

        Returns
        -------
        float
        """
        return self.boundary_problem.displacement(displacements)

    @property
    def held(self) -> np.ndarray:
        """Directions of the particles that are held, shape (n_points, 2)."""
        return self.boundary_problem.loading.held

    @property
    def forces(self) -> np.ndarray:
        """Forces of the load on the particles at rest [N], shape (n_points, 2)."""
        return self.boundary_problem.forces(self.springs)

    @property
    def network(self) -> Network:
        """Network of the springs, held as the load holds them; everything over the reference stiffness."""
        return self.cache.network(self.held, self.springs)

    @property
    def problem(self) -> StaticProblem:
        """Network under the pattern of the load."""
        return self.cache.problem(self.boundary_problem.loading, self.springs)

    def solve(self) -> "Result":
        """Solve the equilibrium under the force.

        Returns
        -------
        Result

        Raises
        ------
        DefinitionError
            If the definition does not support the mesh or the material.
        """
        begin, derived = time.perf_counter(), None
        try:
            springs, derived = self._derived
            begin = time.perf_counter()
            solution = self.boundary_problem.solve(springs)
        except SingularError as error:  # of the network, or of the patch test that scales springs
            seconds = time.perf_counter() - begin
            times = (0.0, seconds) if derived is None else (seconds, derived)
            return Result(self, None, Status.FAILED, str(error), np.nan, np.nan, *times, self.boundary_problem.empty())
        seconds, values = time.perf_counter() - begin, self.boundary_problem.values(springs, solution)
        about = solution.equilibrium, solution.status, solution.message, solution.negative_pivots, solution.displacement
        return Result(self, *about, seconds, derived, values)

    @property
    def finite_strain(self) -> bool:
        """Whether the reference is at finite strain: of nonlinear `neo-hooke`, `yeoh`, on shapes also `delingette`."""
        return bool(self._law)

    @cached_property
    def _law(self) -> str:
        """Law at finite strain of the reference, or none."""
        return self.boundary_problem.law(self.definition)

    def reference(self) -> "AnyReference":
        """Solve finite elements under the same force or load case until they converge.

        In small strain, or at finite strain (`finite_strain`): of a `springtune.Rubber` by its own law, of another
        material by neo-Hooke's, of a `delingette` network by St. Venant and Kirchhoff's.

        Returns
        -------
        ReferenceSolution, FiniteStrainSolution or ShapeReference

        Raises
        ------
        ReferenceNotConvergedError
            If its error estimate stays above the tolerance, or there is no equilibrium at finite strain.

        Examples
        --------
        >>> import springtune as st
        >>> beam, steel = st.Beam("200 mm", "40 mm"), st.Material("210 GPa", 0.3)
        >>> scene = st.Scene(beam, st.make_mesh(beam, "structured", "5 mm"), steel, "traction", "400 kN")
        >>> reference = scene.reference()
        >>> print(f"{1e3 * reference.displacement:.2f} mm; F L / (E A) = {1e3 * 400e3 * 0.2 / (210e9 * 4e-5):.2f} mm")
        9.50 mm; F L / (E A) = 9.52 mm

        Rubber at a third of its length more:

        >>> rubber = st.Material("1 MPa", 0.5)
        >>> scene = st.Scene(beam, scene.mesh, rubber, "traction", "10 N", definition="neo-hooke")
        >>> print(f"{1e3 * scene.reference().displacement:.0f} mm, error {100 * scene.solve().error:+.1f} %")
        64 mm, error -0.1 %
        """
        return self.boundary_problem.reference(self._law)

    def reference_values(self) -> dict[str, float]:
        """Quantities of interest of the reference by name, in SI units.

        Returns
        -------
        dict of str to float
        """
        return self.boundary_problem.reference_values(self._law)

    @property
    def objection(self) -> str:
        """Why a small-strain reference does not apply to the network; empty where it does, or is at finite strain."""
        return "" if self.kinematics == "linear" or self.finite_strain else self.boundary_problem.objection()

    def motion(self, released: bool = False, **options: Any) -> "Motion":
        """Motion of the scene from rest, its force switched on and kept; free of damping.

        Parameters
        ----------
        released : bool, optional
            Without the force: to let go of a loaded body, start a run from the displacements of its result.
        **options
            ``mass_damping``, ``dampers`` and others as `springtune.mechanics.dynamics.Motion` takes them.

        Returns
        -------
        Motion

        Raises
        ------
        ValueError
            If the material has no density, or the load prescribes displacements, or turns and is not released.

        Examples
        --------
        >>> import springtune as st
        >>> beam, steel = st.Beam("100 mm", "20 mm"), st.Material("210 GPa", 0.3, density="7850 kg/m^3")
        >>> scene = st.Scene(beam, st.make_mesh(beam, "structured", "5 mm"), steel, "traction", "1 kN")
        >>> print(f"{1e9 * scene.motion().step_limit('central-difference'):.0f} ns")
        622 ns
        """
        inertia = self.boundary_problem.masses()
        if inertia is None:
            name = self.boundary_problem.named_materials
            raise ValueError(f"density: material {name!r} has none; give a density such as '7850 kg/m^3'")
        if self.problem.given is not None:
            raise ValueError(f"load: {self.load!r} prescribes displacements, and motions have forces; take another")
        if self.problem.follower is not None and not released:
            why = "turns with the side that it acts on, and forces of a motion do not"
            raise ValueError(f"load: {self.load!r} {why}; take another, or let go of it by released=True")
        from ..mechanics.dynamics import Motion

        reference = self.springs.reference
        load = None if released else self.forces / reference
        known: dict[str, Any] = {"linear": self.kinematics == "linear", "load": load, "reference": reference}
        return Motion(self.network, inertia / reference, **(known | options))

    def write(self, path: str | Path, displacements: np.ndarray) -> list[Path]:
        """Write the network at some displacements as VTU, for ParaView and others.

        Parameters
        ----------
        path : str or Path
            Ending in ``.vtu``; ParaView opens files with numbers in their names as one that changes in time.
        displacements : ndarray of float, shape (n_points, 2)
            Of the particles [m].

        Returns
        -------
        list of Path

        Raises
        ------
        ValueError
            If the name has another ending, or its folder is not there.
        """
        return hook("files").write_displaced(path, self, displacements, compared=False)

    def buckling_load(self) -> float:
        """Size of the force at which the path from rest bifurcates, or would if it did not bend before.

        Returns
        -------
        float
            [N], of a shape the factor on its load [1]; NaN where there is none up to a hundred times the scene's force,
            or where the path bends far below it.

        Raises
        ------
        ValueError
            If the load prescribes displacements.

        Warns
        -----
        AssumptionWarning
            If nothing bifurcates: a column on a mesh that is no mirror image, such as ``free`` or ``right``, bends
            from the first load on and stays stable. The force is then that of the nearly perfect column.

        Examples
        --------
        >>> import math
        >>> import springtune as st
        >>> column, steel = st.Beam("100 mm", "4 mm"), st.Material("210 GPa", 0.3)
        >>> mesh = st.make_mesh(column, "structured", "0.6 mm")
        >>> scene = st.Scene(column, mesh, steel, "compression", "200 N", definition="delingette")
        >>> euler = math.pi**2 * 210e9 * (1e-3 * 4e-3**3 / 12) / (2 * 0.1) ** 2
        >>> print(f"{scene.buckling_load():.0f} N; a slender column, by Euler: {euler:.0f} N")
        285 N; a slender column, by Euler: 276 N
        """
        from ..mechanics.continuation import buckling

        if self.problem.given is not None:
            raise ValueError(f"load: {self.load!r} prescribes displacements, and buckling loads are of forces")
        begin = self.boundary_problem.force / self.springs.reference
        load, restriction = buckling(self.problem, begin)
        if restriction and np.isfinite(load):
            warnings.warn(restriction, AssumptionWarning, stacklevel=2)
        return float(abs(load / begin * self.boundary_problem.size))


@dataclass(frozen=True, eq=False)
class SceneSprings(Springs):
    """Springs of a scene; they can be written to a file."""

    scene: Scene | None = field(default=None, repr=False)

    def write(self, path: str | Path, **options: Any) -> list[Path]:
        """Write the springs for another program, see `springtune.SpringNet`."""
        return hook("files").write_springs(path, self.scene, self, **options)


@dataclass(frozen=True, repr=False)
class Result(Tabled):
    r"""The answer of a scene.

    Attributes
    ----------
    scene : Scene
    equilibrium : Equilibrium or None
        What the solve found, over the reference stiffness.
    status, message : Status, str
        Whether there is a stable equilibrium, and else why not.
    negative_pivots : int or float
        Negative eigenvalues of the tangent; NaN where there is no equilibrium, or the tangent is singular.
    displacement : float
        Displacement of the load [m]: the mean one of the loaded side along the force, or that of a pressed side's
        middle; of a shape its first quantity. NaN where there is no equilibrium.
    seconds : float
        That the solve took, springs not included.
    definition_seconds : float
        That deriving the springs took.
    values : dict of str to float
        Quantities of interest by name, in SI units, NaN where there is no equilibrium; of a beam its displacement.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("200 mm", "40 mm"), st.Material("210 GPa", 0.3)
    >>> mesh = st.make_mesh(beam, "structured", "5 mm")
    >>> result = st.Scene(beam, mesh, steel, "traction", "400 kN", definition="lattice").solve()
    >>> result.status, result.message, result.negative_pivots
    (<Status.SOLVED: 1>, '', 0)
    >>> print(f"{1e3 * result.displacement:.2f} mm, by finite elements {1e3 * result.reference().displacement:.2f} mm")
    9.83 mm, by finite elements 9.50 mm
    >>> print(f"error {100 * result.error:+.2f} %, {result.sign_word}", result.sign_words, list(result.errors))
    error +3.52 %, too soft {'displacement': 'too soft'} ['displacement']
    >>> result.write("traction.vtu")[0].name, result.plot().get_title(loc="left")
    ('traction.vtu', 'traction of 400000 N, lattice\n9.83451 mm, by finite elements 9.50052 mm: +3.52 % too soft')
    >>> result.displacements.shape, result.stiffness.shape, result.spring_forces.shape
    ((415, 2), (1143,), (1143,))
    >>> print(f"{result.stiffness.max():.4g} N/m, at most {1e-3 * result.spring_forces.max():.1f} kN in a spring")
    1.819e+08 N/m, at most 50.2 kN in a spring
    >>> result.iterations, result.residual < 1e-10  # exact: the criterion itself
    (3, True)
    """

    scene: Scene = field(repr=False)
    equilibrium: Equilibrium | None = field(repr=False)
    status: Status
    message: str
    negative_pivots: float
    displacement: float
    seconds: float
    definition_seconds: float
    values: dict[str, float]

    def _rows(self) -> Iterator[tuple[str, str]]:
        about = self.scene.boundary_problem
        yield "status", str(self.status)
        yield "reason", self.message
        yield "scene", f"{about.body}, {about.label}, {self.scene.definition.name}, {self.scene.kinematics}"
        units = {one.name: QUANTITY_UNITS[one.kind] for one in about.case.quantities}
        for name, value in self.values.items():
            known = number_text(value, units[name]) if units[name] != "Pa" else f"{1e-6 * value:.6g} MPa"
            yield name, known if value == value else "none"
        yield "solved in", f"{1e3 * self.seconds:.3g} ms"

    def _computed_rows(self) -> Iterator[tuple[str, str]]:
        if self.equilibrium is None or not self.equilibrium.converged:
            return
        try:
            errors, objection = self.errors, self.scene.objection
        except (RuntimeError, ValueError) as why:  # there is no reference, or not of a quantity
            yield "error", f"no reference: {why}"
            return
        for name, error in errors.items():
            yield f"error of {name}", f"{error_text(error)} {self.sign_words[name]}".rstrip()
        yield "but", objection
        yield "reference", getattr(self.reference(), "note", "")

    @property
    def displacements(self) -> np.ndarray:
        """Displacement of each particle [m], shape (n_points, 2); NaN where there is no equilibrium."""
        if self.equilibrium is None or not self.equilibrium.converged:
            return np.full(self.scene.mesh.points.shape, np.nan)
        return self.equilibrium.displacements

    @property
    def iterations(self) -> int:
        """Newton steps."""
        return self.equilibrium.iterations if self.equilibrium else 0

    @property
    def residual(self) -> float:
        """Out-of-balance force over the load [1]."""
        return self.equilibrium.residual if self.equilibrium else np.nan

    @property
    def stiffness(self) -> np.ndarray:
        """Stiffness of each spring [N/m], shape (n_springs,); springs whose law is part of an energy have none here."""
        return self.scene.springs.reference * self.scene.springs.relative

    @property
    def spring_forces(self) -> np.ndarray:
        """Axial force of each spring [N], tension positive, shape (n_springs,); energies' part left out."""
        forces = self.scene.network.spring_forces_over_k(self.displacements, self.scene.kinematics == "linear")
        return self.scene.springs.reference * forces

    def reference(self) -> "AnyReference":
        """Converged finite-element solution under the same force, as `Scene.reference`.

        Returns
        -------
        ReferenceSolution, FiniteStrainSolution or ShapeReference
        """
        return self.scene.reference()

    @property
    def error(self) -> float:
        """Signed error (network - reference) / abs(reference) [1]; see `Scene.finite_strain`, `Scene.objection`."""
        return next(iter(self.errors.values()))

    @property
    def errors(self) -> dict[str, float]:
        """Error of each quantity of interest, see `error` [1]; NaN where the reference is missing or zero."""
        return quantity_errors(self.values, self.scene.reference_values())

    @property
    def sign_word(self) -> str:
        """Sign of `error` in words: "too soft" or "too stiff", "too large" or "too small"; empty without an error."""
        return next(iter(self.sign_words.values()))

    @property
    def sign_words(self) -> dict[str, str]:
        """Sign of the error in words by quantity of interest, see `sign_word`."""
        known = self.scene.reference_values()
        kinds = {one.name: one.kind for one in self.scene.boundary_problem.case.quantities}
        return {name: sign_word(error, known.get(name, np.nan), kinds[name]) for name, error in self.errors.items()}

    def write(self, path: str | Path) -> list[Path]:
        """Write the deformed network as VTU, for ParaView and others.

        Parameters
        ----------
        path : str or Path
            Ending in ``.vtu``: particles with displacement, that of the reference and the difference (``error``),
            springs as lines with stiffness and force, cells.

        Returns
        -------
        list of Path

        Raises
        ------
        ValueError
            If the name has another ending, its folder is not there, or there is no equilibrium.
        """
        if not np.isfinite(self.displacement):
            raise ValueError(f"there is no equilibrium to write: {self.message}")
        return hook("files").write_displaced(path, self.scene, self.displacements, compared=True)

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the deformed springs, coloured by their force, below their error.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        ValueError
            If there is no equilibrium.
        """
        if not np.isfinite(self.displacement):
            raise ValueError(f"there is no equilibrium to draw: {self.message}")
        draw, title = hook("drawing").draw_springs, self._title()
        return draw(ax, self.scene.mesh, self.displacements, self.spring_forces, title)

    def _title(self) -> str:
        """Scene and definition; below them the displacement, its reference and error."""
        lines, known = [f"{self.scene.title}, {self.scene.definition.name}"], dict(self._table())
        if one := self.scene.boundary_problem.watched:
            lines.append(known[one.name])
            if error := known.get(f"error of {one.name}"):
                reference = number_text(self.scene.reference_values().get(one.name, np.nan), "m")
                lines[-1] += f", by finite elements {reference}: {error}"
        return "\n".join(lines)
