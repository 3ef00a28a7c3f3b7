"""Search for the coarsest mesh of each type that keeps an error, with all finer ones: errors may pass through zero."""

import logging
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count, takewhile
from operator import attrgetter
from typing import cast

import numpy as np

from ..mesh.cells import MESH_TYPES
from ..mesh.free import mesh_shape
from ..mesh.rows import ROW_HEIGHT
from ..mesh.sheets import GroupedMesh
from ..problem.compare import error_text
from ..problem.materials import Material, Materials
from ..problem.quantities import quantity, whole_number
from ..problem.shapes import Beam, Shape
from ..safe_io import Tabled, mesh_size_text, number_of
from ..scene.boundary_problem import BoundaryProblem, ShapeProblem
from ..scene.mesh_cache import check_type
from . import choices
from .choices import SEARCHED_PARTICLES, USUAL_LOADS, Choice, References, Trial, error_margin, sort_by_error

logger = logging.getLogger(__name__)

FINEST_CELLS_RATIO, LEAST_FINER_MESHES = 2.0, 2
"""Cells across the finest mesh tried over those of the answer, and number of finer meshes tried, at least."""

EXTRAPOLATION_MARGIN = 1.5
"""Change still allowed to an error down to the finest mesh, over that of an error in proportion to the mesh size."""


EVERY_CELL_COUNT_UP_TO, STEPS_A_DOUBLING = 16, 4
"""Cells across up to which every number of them is tried; steps by which they double beyond that."""

FINER_SIZES = tuple(0.5 ** (step / 24) for step in range(1, 24))
"""Finer sizes that an answer is tried on, over its own: cells are stretched between whole divisions."""

ALL_FINER_BELOW_CELLS = 10
"""Cells across an answer from which on only every second of these sizes is tried: errors are less irregular."""

REGULAR_FROM_CELLS = 4  # cells across a mesh above which errors change regularly with the mesh size

ACROSS_DECIMALS = 3  # decimals of the cells across a mesh between whole divisions

SIZE_DIGITS = 4  # digits of a mesh size [mm], so that the one that is printed makes the same mesh


@dataclass(frozen=True)
class SolvedMesh:
    """A mesh that was tried.

    Attributes
    ----------
    mesh_type, size : str, float
        Key of `springtune.MESH_TYPES`, and length of an edge [m].
    cells : float
        Cells across the beam's smaller side that its size is for; not whole between whole divisions.
    particles, springs : int
    errors : dict of str to dict of str to float
        By definition that was tried, the error under each load [1]; NaN where the network fails.
    energies : tuple of str
        Definitions that need more than springs there.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("200 mm", "40 mm"), st.Material("210 GPa", 0.3)
    >>> coarsest = st.find_mesh(beam, steel, "10 %", mesh_types=["structured"], most=200).tried[0]
    >>> coarsest.cells, coarsest.particles, f"{100 * coarsest.worst('patch'):.1f} %"
    (1, 13, '63.3 %')
    """

    mesh_type: str
    size: float
    cells: float
    particles: int
    springs: int
    errors: dict[str, dict[str, float]]
    energies: tuple[str, ...]

    def worst(self, definition: str) -> float:
        """Largest size of the errors of a definition [1]; infinite where it fails under a load, or was not tried.

        Parameters
        ----------
        definition : str

        Returns
        -------
        float
        """
        sizes = [abs(error) for error in self.errors.get(definition, {}).values()]
        return math.inf if not sizes or any(size != size for size in sizes) else max(sizes)


@dataclass(frozen=True, repr=False)
class MeshChoice(Tabled):
    """A mesh and a definition that keep an error.

    Attributes
    ----------
    mesh_type, size, cells : str, float, int
        As of `SolvedMesh`.
    choice : Choice
        The definition, its stiffness and its errors.
    particles, springs : int
    step_limit : float
        Largest stable step of undamped explicit schemes about rest [s], without supports; NaN without a density.
    finer : tuple of SolvedMesh
        Finer meshes on which the definition keeps the error, too: two at least, up to one with twice as many cells
        across, and sizes between whole divisions.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("200 mm", "40 mm"), st.Material("210 GPa", 0.3)
    >>> best = st.find_mesh(beam, steel, "10 %", loads=["traction", "bending"], mesh_types=["structured"]).best
    >>> best.size, best.cells, best.particles
    (0.0231, 2, 31)
    >>> [finer.cells for finer in best.finer][:6]
    [2.244, 2.447, 2.519, 2.669, 3, 3.174]
    """

    mesh_type: str
    size: float
    cells: int
    choice: Choice
    particles: int
    springs: int
    step_limit: float
    finer: tuple[SolvedMesh, ...] = field(repr=False)

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "mesh", self.mesh_type
        yield "size", mesh_size_text(self.size)
        yield "definition", self.choice.definition
        for name in ("cells", "particles", "springs"):
            yield name, f"{getattr(self, name):,}"
        for name, error in self.choice.errors.items():
            yield name, choices.number_text(error, error_text, "")
        if not math.isnan(self.step_limit):
            yield "largest step", f"{self.step_limit:.3g} s"


def answer_text(one: MeshChoice | None) -> str:
    """Mesh and definition of an answer in words."""
    if one is None:
        return "none"
    return f"{one.mesh_type} {mesh_size_text(one.size)} with {one.choice.definition}, {one.particles:,} particles"


@dataclass(frozen=True, eq=False, repr=False)
class MeshSearch(Tabled):
    """Meshes that keep an error, as `find_mesh` found them.

    Attributes
    ----------
    error, loads, most : float, tuple of str, int
        As of `find_mesh`; of a shape quantities of interest.
    known : dict
        Reference of 1 N by load, or by quantity of interest.
    by_type, springs_by_type : dict of str to MeshChoice or None
        The coarsest mesh by mesh type, with a definition, or springs alone, that keeps the error; None if there is
        none that finer meshes of up to `most` particles confirm.
    tried : tuple of SolvedMesh
        All that was solved, each type from coarse to fine.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("200 mm", "40 mm"), st.Material("210 GPa", 0.3)
    >>> search = st.find_mesh(beam, steel, "10 %", loads=["traction", "bending"], mesh_types=["structured", "right"])
    >>> search.best.mesh_type, search.best.choice.definition, search.best_springs.choice.definition
    ('structured', 'patch-fit', 'patch-fit')
    >>> {name: found and found.choice.definition for name, found in search.springs_by_type.items()}
    {'structured': 'patch-fit', 'right': 'van-gelder'}
    """

    error: float
    loads: tuple[str, ...]
    most: int
    known: References = field(repr=False)
    by_type: dict[str, MeshChoice | None]
    springs_by_type: dict[str, MeshChoice | None]
    tried: tuple[SolvedMesh, ...] = field(repr=False)

    @property
    def best(self) -> MeshChoice | None:
        """The mesh with the fewest particles; None if no mesh keeps the error."""
        return self._least(self.by_type)

    @property
    def best_springs(self) -> MeshChoice | None:
        """The mesh with the fewest particles and springs alone; None if no mesh keeps the error."""
        return self._least(self.springs_by_type)

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "error to keep", f"{100 * self.error:.6g} %: {', '.join(self.loads)}"
        yield "best", answer_text(self.best)
        yield "best of springs alone", answer_text(self.best_springs)
        for name, one in self.by_type.items():
            yield name, answer_text(one).removeprefix(f"{name} ")
        yield "solved", f"{len(self.tried)} meshes, of at most {self.most:,} particles"

    def _least(self, found: dict[str, MeshChoice | None]) -> MeshChoice | None:
        rank = attrgetter("particles", "springs")
        ranked = sorted(filter(None, found.values()), key=rank)
        alike = [one for one in ranked if rank(one) == rank(ranked[0])]
        tie = attrgetter("choice.energies", "choice.definition", "mesh_type")
        return next(iter(sort_by_error(alike, attrgetter("choice.worst"), tie, error_margin(self.known))), None)


def asked_error(value: float | str, name: str = "error") -> float:
    """Error to keep [1], of a number or a text such as "1 %"; messages call it by a name."""
    number = value if isinstance(value, int | float) else math.nan
    if isinstance(value, str) and value.strip().endswith("%"):
        number = number_of(value.strip().removesuffix("%")) / 100
    if not 0 < number < 1:
        raise ValueError(f"{name}: {value!r} is no error above 0 and below 100 %; give one such as '1 %'")
    return float(number)


def find_mesh(
    beam: Beam | Shape,
    material: Materials,
    error: float | str,
    *,
    loads: Iterable[str] = USUAL_LOADS,
    mesh_types: Sequence[str] | None = None,
    load: str | None = None,
    make: Callable[[float], GroupedMesh] | None = None,
    most: int = SEARCHED_PARTICLES,
) -> MeshSearch:
    """Find the coarsest mesh of each type on which a definition keeps an error, by solving.

    Meshes are solved with every number of cells across up to 16, then four for each doubling, until a definition keeps
    the error on a mesh and on all finer ones up to twice as fine, with a margin: the last change may happen once more.
    Then sizes between whole divisions are solved. Kinematics are linear. The error estimate of the reference is added
    to each error; errors that differ by less are equal: springs alone come first, then names.

    Parameters
    ----------
    beam : Beam or Shape
        A shape needs an outline; all quantities of interest of a load case keep the error.
    material : Material, AnisotropicMaterial or mapping of str to those
        Of a shape of several parts by their names.
    error : float or str
        Largest size of an error to keep, a fraction or a text such as ``"1 %"``.
    loads : iterable of str, optional
        Loads of a beam that keep it: of traction, compression, bending, shear and pressure.
    mesh_types : sequence of str, optional
        Keys of `springtune.MESH_TYPES`, for a beam; all without. Meshes of shapes are free ones.
    load : str, optional
        Load case of a shape; its only one without.
    make : callable, optional
        Makes a mesh of a shape of a size [m]; `springtune.mesh_shape` without.
    most : int, optional
        Particles of the largest mesh that may be tried.

    Returns
    -------
    MeshSearch

    Raises
    ------
    ValueError
        If an argument is wrong or unknown, a load has no reference, or the error is not above its error estimate.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("200 mm", "40 mm"), st.Material("210 GPa", 0.3, density="7850 kg/m^3")
    >>> search = st.find_mesh(beam, steel, "5 %", loads=["traction", "bending"], mesh_types=["structured"])
    >>> best = search.best
    >>> print(f"{best.mesh_type} {1e3 * best.size:g} mm, {best.choice.definition}: {best.particles} particles")
    structured 15.4 mm, patch-fit: 58 particles
    >>> print(f"at worst {100 * best.choice.worst:.1f} %, steps up to {1e9 * best.step_limit:.0f} ns")
    at worst 1.0 %, steps up to 1515 ns
    """
    target = asked_error(error)
    whole_number(most, "most")
    if isinstance(beam, Shape):
        if loads is not USUAL_LOADS or mesh_types is not None:
            raise ValueError("loads, mesh types: are of beams alone; leave them out for a shape, and give its load")
        load = choices.only_load(beam, load)
        families = [_shape_family(beam, material, load, make or partial(mesh_shape, beam))]
        known = choices.shape_references(cast(ShapeProblem, families[0].problems(families[0].side / 4)[0]))
        what, remedy = f"load {load!r}", "; take it out of the quantities"
    elif load is not None or make is not None:
        raise ValueError(f"load: {load!r} is of shapes alone; give loads for a beam")
    else:
        material = check_type(material, Material, "material")
        given = MESH_TYPES if mesh_types is None else mesh_types
        names = choices.check_names("mesh types", given, MESH_TYPES, ("structured", "free"), "is unknown")
        known = choices.references(beam, material, loads)
        families = [_beam_family(beam, material, tuple(known), name) for name in names]
        what, remedy = "loads", ""
    for name, one in known.items():
        if isinstance(one, str) or not one.value:
            why = one if isinstance(one, str) else "it is zero"
            raise ValueError(f"{what}: {name!r} has no reference, so no error of it can be kept: {why}{remedy}")
    estimates = {name: one.error_estimate for name, one in known.items() if not isinstance(one, str)}
    if target <= max(estimates.values()):
        least = f"{200 * max(estimates.values()):.1g} %"
        raise ValueError(f"error: {error!r} is below the error estimate of the reference; give at least {least}")
    searches = [_Search(family, known, estimates, target, most) for family in families]
    found, of_springs = ({one.family.name: one.find(only) for one in searches} for only in (False, True))
    solved = tuple(one for search in searches for one in search.solved)
    return MeshSearch(target, tuple(known), most, known, found, of_springs, solved)


@dataclass(frozen=True)
class _Family:
    """Meshes of a body by size: `side` is its smaller side [m], `one_cell` the mesh size of one cell across it [m]."""

    name: str
    side: float
    one_cell: float
    particles: Callable[[float], float]
    problems: Callable[[float], Sequence[BoundaryProblem]]


def _beam_family(beam: Beam, material: Material, loads: tuple[str, ...], name: str) -> _Family:
    """Meshes of a beam, of one type."""
    box, make = (beam.length, beam.height), MESH_TYPES[name]
    one_cell = beam.height / make.row_height if beam.height <= beam.length else beam.length

    def problems(size: float) -> Sequence[BoundaryProblem]:
        return choices.beam_problems(beam, make(*box, size), material, loads)

    return _Family(name, min(box), one_cell, partial(make.particles, *box), problems)


def _shape_family(shape: Shape, material: Materials, load: str, make: Callable[[float], GroupedMesh]) -> _Family:
    """Meshes of a shape under a load case."""
    if shape.file:
        why = "has the mesh of its file, so there is none to be found"
        raise ValueError(f"shape {shape.name!r}: {why}; give an outline, or files of finer meshes")
    side = float(min(np.ptp(shape.extent, axis=0)))

    def problems(size: float) -> Sequence[BoundaryProblem]:
        return [ShapeProblem(shape, make(size), material, load, 1.0, "linear")]

    return _Family("free", side, side, lambda size: shape.area / (ROW_HEIGHT * size**2), problems)


def _cells(rung: int) -> int:
    """Cells across of the meshes that are tried first: 1, 2, 3, ..., 15, 16, 20, 23, 27, 32, 39, ..."""
    beyond = rung + 1 - EVERY_CELL_COUNT_UP_TO
    return rung + 1 if beyond <= 0 else math.ceil(EVERY_CELL_COUNT_UP_TO * 2 ** (beyond / STEPS_A_DOUBLING))


def tried_names(solved: Iterable[SolvedMesh], springs_alone: bool = False) -> list[str]:
    """Definitions that were tried on meshes; all of them, or those that need no more than springs."""
    names = dict.fromkeys(name for one in solved for name in one.errors)
    return [name for name in names if not (springs_alone and any(name in one.energies for one in solved))]


class _Search:
    """Search of a family of meshes, from coarse to fine; each mesh is solved once."""

    def __init__(
        self, family: _Family, known: References, estimates: dict[str, float], error: float, most: int
    ) -> None:
        self.family, self.known, self._estimates, self._error = family, known, estimates, error
        self._rungs = [*takewhile(lambda cells: family.particles(self._size(cells)) <= most, map(_cells, count()))]
        self._finest = _cells(len(self._rungs))
        self._meshes: dict[bytes, SolvedMesh] = {}  # by their points
        self._keys: dict[float, bytes] = {}  # by cells across

    @property
    def solved(self) -> list[SolvedMesh]:
        """Meshes that were solved, from coarse to fine."""
        return sorted(self._meshes.values(), key=attrgetter("cells"))

    def find(self, springs_alone: bool) -> MeshChoice | None:
        """The coarsest mesh with a definition that keeps the error on it and on finer ones; None without one."""
        for rung in (*self._rungs, None):
            names = [name for name in tried_names(self.solved, springs_alone) if self._promising(name)]
            if start := self._confirmed(springs_alone):
                return self._choice(*start, springs_alone)
            if rung is None or self._meshes and not names:
                break
            self._solve(rung, names)
        return None

    def _confirmed(self, springs_alone: bool) -> tuple[int, list[str]] | None:
        """Result of `_start` after sizes between whole divisions were tried."""
        while start := self._start(springs_alone):
            cells, names = start
            for part in FINER_SIZES[:: 1 if cells < ALL_FINER_BELOW_CELLS else 2]:
                one = round(self.family.one_cell / (self._size(cells) * part), ACROSS_DECIMALS)
                self._solve(one, names, whole=False)
                if self._start(springs_alone) != start:
                    break  # it is not kept there: on to the next one
            else:
                return start
        return None

    def _start(self, springs_alone: bool) -> tuple[int, list[str]] | None:
        """Coarsest mesh from which on a definition keeps the error, and the definitions that do; None without any."""
        starts: dict[int, list[str]] = {}
        for name in tried_names(self.solved, springs_alone):
            tried = [one for one in self.solved if name in one.errors]
            failing = max((one.cells for one in tried if not self._keeps(name, one)), default=0)
            kept = [int(one.cells) for one in self._on(name) if one.cells > failing]
            # Of those that keep the error on all finer ones, the coarsest with finer ones enough.
            enough = [cells for cells in kept[:-LEAST_FINER_MESHES] if FINEST_CELLS_RATIO * cells <= kept[-1]]
            if enough and self._steady(name):
                starts.setdefault(enough[0], []).append(name)
        return min(starts.items()) if starts else None  # no two have the same cells

    def _size(self, cells: float) -> float:
        """Mesh size [m] that gives a number of cells across the smaller side, rounded up."""
        exact = self.family.one_cell / cells * 1e3
        digit = 10.0 ** (math.floor(math.log10(exact)) + 1 - SIZE_DIGITS)
        # By its text, as the option of a command has it; what is a hair above a digit is that digit.
        text = f"{math.ceil(exact / digit * (1 - 1e-9)) * digit:.{SIZE_DIGITS}g} mm"
        return min(self.family.side, quantity(text, "length", "size"))

    def _solve(self, cells: float, names: Sequence[str], whole: bool = True) -> None:
        """Solve definitions on a mesh, all without names; nothing for a `whole` division without a mesh of its own."""
        known = self._meshes.get(self._keys.get(cells, b""))
        if known and all(name in known.errors for name in names):
            return
        size = self._size(cells)
        problems = self.family.problems(size)
        mesh = problems[0].mesh
        logger.info("solving %s %s: %s particles", self.family.name, mesh_size_text(size), len(mesh.points))
        # A mesh of its own has more particles than coarser ones and fewer than finer ones.
        others = [one for one in self.solved if one.cells == int(one.cells) != cells] if whole else []
        if any((len(mesh.points) > one.particles) != (cells > one.cells) for one in others):
            return
        key = self._keys.setdefault(cells, mesh.points.tobytes())
        new = SolvedMesh(self.family.name, size, cells, len(mesh.points), len(mesh.edges), {}, ())
        found = self._meshes.get(key, new)
        errors, energies = dict(found.errors), found.energies
        left = [name for name in names if name not in errors]
        tried = Trial(problems, self.known, left if self._meshes else None)
        for name in tried.names:
            springs = tried.springs(name)
            one = dict.fromkeys(self.known, "") if springs is None else tried.errors(name)
            errors[name] = {load: math.nan if isinstance(error, str) else error for load, error in one.items()}
            energies += (name,) * bool(springs and springs.energies)
        self._meshes[key] = replace(found, errors=errors, energies=energies)

    def _choice(self, cells: int, names: list[str], springs_alone: bool) -> MeshChoice:
        """The best of some definitions on a mesh."""
        one = self._meshes[self._keys[cells]]
        name = sort_by_error(names, one.worst, lambda name: (name in one.energies, name), error_margin(self.known))[0]
        tried = Trial(self.family.problems(one.size), self.known, [name])
        choice = replace(tried.choice(name), tried=tuple(tried_names(self.solved, springs_alone)))
        finer = tuple(each for each in self.solved if each.cells > cells and name in each.errors)
        about = one.mesh_type, one.size, cells, choice, one.particles, one.springs
        return MeshChoice(*about, tried.step_limit(name), finer)

    def _keeps(self, name: str, mesh: SolvedMesh) -> bool:
        """Whether a definition keeps the error on a mesh; the reference's error estimate is added."""
        errors = mesh.errors[name].items()
        return all(abs(error) + self._estimates[load] <= self._error for load, error in errors)  # not NaN

    def _on(self, name: str) -> list[SolvedMesh]:
        """Meshes of whole divisions that a definition was tried on, from coarse to fine."""
        return [one for one in self.solved if one.cells == int(one.cells) and name in one.errors]

    def _promising(self, name: str) -> bool:
        """Whether a definition may keep the error on the finest mesh, if the error is proportional to the mesh size."""
        on, doubling = self._on(name), self._doubling(name)
        if not doubling or FINEST_CELLS_RATIO * REGULAR_FROM_CELLS > on[-1].cells:
            return bool(on)
        left = EXTRAPOLATION_MARGIN * (1 - on[-1].cells / self._finest)
        if any(before != before and last != last for before, last in doubling):
            return False
        return not any(abs(last) - left * abs(last - before) > self._error for before, last in doubling)

    def _steady(self, name: str) -> bool:
        """Whether a definition would keep the error if it changed once more by as much as over the last doubling."""
        doubling = self._doubling(name)
        return bool(doubling) and all(abs(2 * last - before) <= self._error for before, last in doubling)

    def _doubling(self, name: str) -> list[tuple[float, float]]:
        """Errors on a mesh of half as many cells across as the finest one, or fewer, and on that; [] without one."""
        on = [(one.cells, one.errors[name]) for one in self._on(name)]
        coarser = [errors for cells, errors in on if FINEST_CELLS_RATIO * cells <= on[-1][0]]
        return [(coarser[-1][load], error) for load, error in on[-1][1].items()] if coarser else []
