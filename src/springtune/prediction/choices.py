"""Definitions and stiffnesses to use on a mesh, with their errors, solved in linear kinematics."""

import logging
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf, nan
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np

from ..mechanics.continuum import PatchTest
from ..mechanics.energies import AngleEnergy, AreaEnergy, BiquadraticEnergy, Energy
from ..mechanics.statics import SingularError
from ..mesh.cells import Mesh
from ..mesh.sheets import GroupedMesh
from ..problem.compare import error_text, quantity_errors
from ..problem.loads import LOADS
from ..problem.materials import AnyMaterial, Material, Materials
from ..problem.quantities import Status, choose, nearest
from ..problem.shapes import Beam, Shape
from ..reference.small_strain import ReferenceNotConvergedError
from ..safe_io import Tabled, TabledList
from ..scene.boundary_problem import BeamProblem, BoundaryProblem, ShapeProblem, unit_reference
from ..scene.mesh_cache import MeshCache, check_type
from ..scene.motion import stable_steps
from ..springs.base import DEFINITIONS, EQUAL_STIFFNESS, Definition, DefinitionError, Springs

logger = logging.getLogger(__name__)

USUAL_LOADS = ("traction", "bending", "shear")  # loads that are predicted where none are named

SHORTEST_SIDE, LONGEST_SIDE, MOST_SLENDER = 1e-9, 1e7, 1e4
"""Limits of a beam's sides [m] and aspect ratio: beyond them the unit is likely wrong, or bending has no reference."""

MOST_CHOICES = 4  # choices that are kept of all definitions, and of those of springs alone

EQUAL_FORCES = 1e-11  # relative difference below which stiffness matrices count as equal, but for rounding

SEARCHED_PARTICLES, SOLVED_PARTICLES = 20_000, 100_000
"""Particles up to which meshes are searched, in some six seconds each; up to which one is solved, in a minute."""


ROUNDING_ERROR = 1e-5  # errors that differ by less are equal [1]; references of closed form have a smaller estimate

_T = TypeVar("_T")


class QuantityReference(NamedTuple):
    """A displacement or another quantity of interest by finite elements, and its relative error estimate [1]."""

    value: float
    error_estimate: float


References = dict[str, QuantityReference | str]
"""References by load of 1 N on a beam, or by quantity of interest of a shape; or why one is missing."""


@dataclass(frozen=True, repr=False)
class Choice(Tabled):
    """A definition on a mesh: its stiffness and its errors there.

    Attributes
    ----------
    definition : str
        Key of `springtune.springs.DEFINITIONS`.
    inside, outline : float
        Stiffness of the sides of cells inside and on the outline [N/m]; NaN where they differ from one to the next.
    extra : str
        Energies and diagonals besides these springs, in words.
    energies : bool
        Whether it needs more than springs.
    errors : dict of str to float
        Deformation error by load, of a shape by quantity, linear kinematics against the reference of small strain,
        (network - reference) / abs(reference) [1]: positive means too soft; where displacements are negative, as under
        compression and pressure, negative does. NaN without a reference, for the reason in `failures`, and of a
        quantity that is negligible beside others of its kind.
    young_modulus_error, poisson_ratio : float
        Young's modulus along x between rollers over the material's, less one, and Poisson's ratio there [1], in the
        plane: in plane strain nu / (1 - nu) is exact.
    failures : dict of str to str
        Why numbers are missing, by load, ``"patch test"`` or ``"springs"``: the network is unstable, singular or
        ill-conditioned at rest, or the definition does not support the mesh.
    tried : tuple of str
        All definitions that were tried there; those without a choice are no better than those with one.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("100 mm", "20 mm"), st.Material("210 GPa", 0.3)
    >>> choices = st.predict(beam, st.make_mesh(beam, "structured", "5 mm"), steel)
    >>> [choice.definition for choice in choices if not choice.energies]
    ['van-gelder-general', 'element-fit', 'patch', 'energy-fit']
    >>> best = choices[2]
    >>> print(f"{best.inside:.4g} N/m inside, {best.outline:.4g} N/m on the outline, {best.extra}")
    1.742e+08 N/m inside, 8.71e+07 N/m on the outline, area energy, K_A = -1.078e+04 MPa
    >>> print(*(f"{load} {100 * error:+.1f} %," for load, error in best.errors.items()))
    traction +0.4 %, bending -6.3 %, shear +1.6 %,
    >>> print(f"{100 * best.worst:.1f} % at worst; E off by {100 * abs(best.young_modulus_error):.1f} %, "
    ...       f"nu = {best.poisson_ratio:.3f}")
    6.3 % at worst; E off by 0.0 %, nu = 0.345
    """

    definition: str
    inside: float
    outline: float
    extra: str
    energies: bool
    errors: dict[str, float]
    young_modulus_error: float
    poisson_ratio: float
    failures: dict[str, str] = field(default_factory=dict)
    tried: tuple[str, ...] = ()

    @property
    def worst(self) -> float:
        """Largest size of an error under the loads that have a reference [1]; infinite where the network fails."""
        return inf if self.failures else worst_of(self.errors.values())

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "definition", self.definition
        for label, value in (("springs inside", self.inside), ("on the outline", self.outline)):
            yield label, number_text(value, "{:.5g} N/m".format, "each its own")
        for name, error in self.errors.items():
            yield name, number_text(error, error_text, self._missing(name))
        missing = self._missing("patch test")
        if missing != NO_REFERENCE or self.young_modulus_error == self.young_modulus_error:
            yield "E", number_text(self.young_modulus_error, error_text, missing)
            yield "nu", number_text(self.poisson_ratio, lambda ratio: f"{round(ratio, 3) + 0.0:.3f}", missing)
        yield "besides springs", self.extra

    def _missing(self, part: str) -> str:
        """Word that stands for a missing number."""
        if "springs" in self.failures:
            return "refused"
        others = (why for name, why in self.failures.items() if name not in self.errors)
        why = self.failures.get(part, next(others, ""))
        return NO_REFERENCE if not why else "unstable" if "unstable" in why else "unsolved"


NO_REFERENCE = "no reference"


def worst_of(errors: Iterable[float]) -> float:
    """Largest size of errors [1]; infinite if all are missing."""
    return max((abs(error) for error in errors if error == error), default=inf)


def number_text(value: float, form: Callable[[float], str], missing: str) -> str:
    """A number as text, or a word for a missing one."""
    return form(value) if value == value else missing


def check_beam(beam: Beam) -> None:
    """Refuse a beam of absurd size, or too slender for its references."""
    check_type(beam, Beam, "beam")
    for word, side in {"long": beam.length, "high": beam.height, "thick": beam.thickness}.items():
        if not SHORTEST_SIDE <= side <= LONGEST_SIDE:
            remedy = f"give {1e3 * SHORTEST_SIDE:g} to {1e3 * LONGEST_SIDE:g} mm, or correct its unit"
            raise ValueError(f"beam {beam.name!r}: is {1e3 * side:.6g} mm {word}, which no beam is; {remedy}")
    slenderness = max(beam.length, beam.height) / min(beam.length, beam.height)
    if slenderness > MOST_SLENDER:
        why = f"one side is {slenderness:.3g} times the other, and at most {MOST_SLENDER:g} times has a reference"
        raise ValueError(f"beam {beam.name!r}: {why}; such shapes are for beam theory")


def predictable_loads() -> tuple[str, ...]:
    """Loads that can be predicted: not followers, which do not differ from other loads in linear kinematics."""
    return tuple(name for name, load in LOADS.items() if not load.follower)


def check_loads(loads: Iterable[str]) -> tuple[str, ...]:
    """Return the names of loads, each once; refuse those that cannot be predicted."""
    return check_names("loads", loads, predictable_loads(), USUAL_LOADS, "cannot be predicted")


def check_names(
    what: str, given: Iterable[str], known: Collection[str], examples: Sequence[str], wrong: str
) -> tuple[str, ...]:
    """Return names, such as of loads, each once; refuse those that are not `known`."""
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise ValueError(f"{what}: {given!r} is no list of {what}; give one such as {list(examples)}")
    names = tuple(given)
    for name in names:
        if not (isinstance(name, str) and name in known):
            raise ValueError(f"{what}: {name!r} {wrong}; {nearest(str(name), known)}")
    if not names:
        raise ValueError(f"{what}: none; give some of {', '.join(known)}")
    return tuple(dict.fromkeys(names))


def references(beam: Beam, material: Material, loads: Iterable[str] = USUAL_LOADS) -> References:
    """References of a beam by load, for 1 N."""
    check_beam(beam)
    return {load: reference_of(beam, material, load) for load in check_loads(loads)}


def reference_of(beam: Beam, material: Material, load: str) -> QuantityReference | str:
    """Reference of any load for 1 N, or the reason why it is missing."""
    try:
        found = unit_reference(beam, material, LOADS[load].kind, LOADS[load].sign)
    except ReferenceNotConvergedError as error:
        return str(error)
    return QuantityReference(found.displacement, found.error_estimate)


def predict(
    beam: Beam | Shape,
    mesh: Mesh | GroupedMesh,
    material: Materials,
    known: References | None = None,
    *,
    loads: Iterable[str] = USUAL_LOADS,
    load: str | None = None,
    also: Iterable[str] = (),
) -> list[Choice]:
    """Solve definitions on a mesh and return the best ones, by their worst load or quantity of a shape.

    All of `springtune.DEFINITIONS` are tried that suit the cells and the material, in linear kinematics, but for
    searches and for those that need a stiffness or a uniaxial load.

    Parameters
    ----------
    beam, mesh, material
        As of `Scene`.
    known : dict, optional
        References of the loads or quantities, as `springtune.prediction.choices.references` returns them.
    loads : iterable of str, optional
        Loads of a beam that count: of traction, compression, bending, shear and pressure.
    load : str, optional
        Load case of a shape; its only one without.
    also : iterable of str, optional
        Definitions to try in any case, such as ``["best-springs"]``, a search that takes seconds.

    Returns
    -------
    list of Choice
        The best four of all definitions, and the best four of springs alone, the same springs once. Errors that differ
        by less than the reference's error estimate are equal: springs alone come first, then names. On a shape moduli
        are NaN.

    Raises
    ------
    ValueError
        If an argument is wrong, the mesh does not fill the beam, or a load cannot be predicted.
    DefinitionError
        If no definition supports the mesh.


    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("100 mm", "20 mm"), st.Material("210 GPa", 0.3)
    >>> mesh = st.make_mesh(beam, "structured", "5 mm")
    >>> best = st.predict(beam, mesh, steel)[0]
    >>> print(f"{best.definition}: {100 * best.worst:.1f} % at worst")
    van-gelder-general: 5.0 % at worst
    >>> best = st.predict(beam, mesh, steel, loads=["traction", "pressure"])[0]
    >>> print(best.definition, *(f"{load} {100 * error:+.2f} %" for load, error in best.errors.items()))
    delingette traction -0.09 % pressure +0.05 %

    The quantities that a load case of a shape asks for:

    >>> pull = st.LoadCase("pull", [st.Support("left", x=0, y=0)], [st.Traction("right", ("4 kN", 0))],
    ...                    quantities=[st.Quantity("end", "displacement", "right", "x")])
    >>> hole = st.Hole.circle(("50 mm", "20 mm"), "8 mm")
    >>> plate = st.Shape.rectangle("100 mm", "40 mm", holes=[hole], loads={"pull": pull})
    >>> for choice in st.predict(plate, st.mesh_shape(plate, "2 mm"), steel, load="pull")[:2]:
    ...     print(choice.definition, f"{100 * choice.errors['end']:+.1f} %")
    element-fit +0.0 %
    energy-fit -0.5 %
    """
    tried = trial(beam, mesh, material, known, loads=loads, load=load, also=also)
    found = tried.choices()
    if all("springs" in one.failures for one in found):
        raise DefinitionError("; ".join(f"{name}: {why['springs']}" for name, why in tried.failures.items()))
    return found


def trial(
    beam: Beam | Shape,
    mesh: Mesh | GroupedMesh,
    material: Materials,
    known: References | None = None,
    *,
    loads: Iterable[str] = USUAL_LOADS,
    load: str | None = None,
    also: Iterable[str] = (),
) -> "Trial":
    """Return a `Trial` of the definitions on a mesh; the arguments are those of `predict`."""
    more = [choose(DEFINITIONS, name, "also").name for name in also]
    if isinstance(beam, Shape):
        problem = ShapeProblem(beam, mesh, material, only_load(beam, load), 1.0, "linear")
        return Trial([problem], shape_references(problem) if known is None else known, also=more)
    if load is not None:
        raise ValueError(f"load: {load!r} is of shapes alone; give loads for a beam")
    check_beam(beam)
    under_loads = beam_problems(beam, mesh, material, loads)
    known = known or references(beam, under_loads[0].material, [one.load for one in under_loads])
    return Trial(under_loads, {one.load: known[one.load] for one in under_loads}, also=more)


def beam_problems(beam: Beam, mesh: Mesh | GroupedMesh, material: Materials, loads: Iterable[str]) -> list[BeamProblem]:
    """Boundary-value problems of 1 N in linear kinematics, one for each load."""
    first, *others = check_loads(loads)
    one = BeamProblem(beam, mesh, material, first, 1.0, "linear")
    return [one, *(BeamProblem(beam, mesh, material, load, 1.0, "linear", one.cache) for load in others)]


def error_margin(known: Mapping[str, Any]) -> float:
    """Largest difference of two errors that counts as none [1]: the error estimate of the references."""
    return max([one.error_estimate for one in known.values() if not isinstance(one, str)] + [ROUNDING_ERROR])


def sort_by_error(
    those: Iterable[_T], worst: Callable[[_T], float], tie: Callable[[_T], tuple[Any, ...]], equal: float
) -> list[_T]:
    """Sort by an error, and by `tie` those whose errors are above the least of them by no more than `equal`."""
    left, found = sorted(those, key=worst), []
    while left:
        limit = worst(left[0]) + equal
        alike = [one for one in left if worst(one) <= limit]
        left = left[len(alike) :]
        found += sorted(alike, key=tie)
    return found


def only_load(shape: Shape, load: str | None) -> str:
    """Load case of a shape by name, or its only one."""
    if load is not None:
        return load
    if len(shape.loads) != 1:
        remedy = f"give one of them, such as load='pull'; known: {', '.join(shape.loads) or 'none'}"
        raise ValueError(f"load: none, and {shape.name!r} has {len(shape.loads)}; {remedy}")
    return next(iter(shape.loads))


def shape_references(problem: ShapeProblem) -> References:
    """Return the references of a load case by quantity; instead of a missing one the reason."""
    from ..reference.shapes import solve_each  # here, since finite elements take half a second to import

    case, as_read = problem.case, problem.grouped if problem.shape.file else None
    solved, lacking = solve_each(problem.shape, case, problem.by_part, as_read)
    found = References(lacking)
    for one in solved:
        for name, value in one.values.items():
            found[name] = QuantityReference(float(value), float(one.error_estimates[name]))
    small = {name for one in solved for name in one.negligible if one.values[name]}
    if len(small) < len(case.quantities):
        found |= dict.fromkeys(small, "next to nothing beside what is largest of its kind; an error would say nothing")
    return {one.name: found[one.name] for one in case.quantities}


def errors_under(problem: BoundaryProblem, springs: Springs, known: References) -> dict[str, float | str]:
    """Errors [1] by load of a beam or quantity of a shape; NaN without a reference, or why the network fails."""
    labels = [problem.load] if isinstance(problem, BeamProblem) else list(known)
    try:
        found = problem.solve(springs)
    except SingularError as error:
        return dict.fromkeys(labels, f"unstable: {error}")
    if found.status is not Status.SOLVED:
        return dict.fromkeys(labels, found.message)
    values = {problem.load: found.displacement} | problem.values(springs, found)
    target = {name: one.value for name, one in known.items() if not isinstance(one, str)}
    return dict(quantity_errors({name: values[name] for name in labels}, target))


class Trial:
    """Definitions solved on a mesh, under loads of a beam or a load case of a shape; equal springs once."""

    def __init__(
        self,
        problems: Sequence[BoundaryProblem],
        known: References,
        among: Iterable[str] | None = None,
        also: Iterable[str] = (),
    ) -> None:
        self.problems, self.known, first = problems, known, problems[0]
        self.mesh, self.materials, self.thickness = first.mesh, first.materials, first.thickness
        first.cache.networks = len({one.loading.held.tobytes() for one in problems})
        self._errors: dict[str, dict[str, float | str]] = {}
        self._forces: dict[str, np.ndarray] = {}
        self._test = PatchTest(self.mesh) if isinstance(first, BeamProblem) else None
        self._springs: dict[str, Springs] = {}
        self._first: dict[tuple[object, ...], str] = {}  # definition by its springs
        self._also = tuple(also)
        suited = (one for one in DEFINITIONS.values() if _suits(one, self.mesh, self.materials))
        cheap_first = [one.name for one in sorted(suited, key=lambda one: one.cost)]
        self.names = [*dict.fromkeys((*(cheap_first if among is None else among), *self._also))]
        self.same, self.failures = dict[str, str](), dict[str, dict[str, str]]()

    def springs(self, name: str) -> Springs | None:
        """Springs of a definition, derived once; None with a reason in `failures`."""
        if name not in self.same and name not in self.failures:
            logger.info("solving %s: %s particles", name, len(self.mesh.points))
            try:
                springs = self.problems[0].springs(DEFINITIONS[name], None)[0]
            except DefinitionError as error:
                self.failures[name] = {"springs": str(error)}
            except SingularError as error:
                self.failures[name] = {"patch test": f"unstable: {error}"}
            except Exception as error:
                if name not in DEFINITIONS.packages:
                    raise
                self.failures[name] = {"springs": f"{type(error).__name__}: {error}"}  # another package's fault
            else:
                # Some are the same network: at nu = 1/3 no energy is left, on rectangles no scalar.
                label = f"{springs.reference:.9g}", *key_of(springs)
                self.same[name] = self._first.setdefault(label, name)
                self._springs.setdefault(self.same[name], springs)
        return self._springs.get(self.same.get(name, ""))

    def errors(self, name: str) -> dict[str, float | str]:
        """Errors of a definition [1] by load or quantity; NaN without a reference, or why the network fails."""
        if (name := self.same[name]) not in self._errors:
            if (first := self._alike(name)) not in self._errors:
                each = (errors_under(one, self._springs[name], self.known) for one in self.problems)
                self._errors[first] = {label: error for one in each for label, error in one.items()}
            self._errors[name] = self._errors[first]
        return self._errors[name]

    def _alike(self, name: str) -> str:
        """The first definition with the same stiffness matrix, and so the same errors, by its forces on some motion."""
        springs, first = self._springs[name], self.problems[0]
        if any(one.kind == "stress" for one in first.case.quantities):  # that is of single springs
            return name
        motion = np.random.default_rng(0).standard_normal(self.mesh.points.shape)
        forces = springs.reference * first.cache.network(first.loading.held, springs).linear_forces_over_k(motion)
        for other, known in self._forces.items():
            if np.linalg.norm(forces - known) <= EQUAL_FORCES * np.linalg.norm(known):
                return other
        self._forces[name] = forces
        return name

    def choices(self, without: Collection[str] = ()) -> TabledList[Choice]:
        """Best choices, see `sort_by_error`; the definitions `without` are left out."""
        names = [name for name in self.names if name not in without]
        measured, equal = {name: one for name in names if (one := self.measured(name))}, error_margin(self.known)
        order = sort_by_error(measured, lambda name: measured[name][1], lambda name: (measured[name][0], name), equal)
        best = order[:MOST_CHOICES] + [name for name in order if not measured[name][0]][:MOST_CHOICES]
        found = [self.choice(name) for name in order if name in best or name in self._also]
        # The patch test is for the best ones alone, and may find one of them unstable.
        failed = {one.definition for one in found if one.failures and {*one.failures} <= {"patch test"}} - {*self._also}
        if failed and len(failed) < len(names):
            return self.choices({*without, *failed})
        return TabledList(replace(one, tried=self.tried) for one in found)

    @property
    def tried(self) -> tuple[str, ...]:
        """Definitions that were solved, or have no stable network."""
        return tuple(name for name in self.names if name in self.same or "patch test" in self.failures.get(name, ()))

    def measured(self, name: str) -> tuple[bool, float] | None:
        """Return whether a definition has energies, and its worst error; None if it has no springs of its own."""
        springs = self.springs(name)
        if springs is None:
            return None if "springs" in self.failures[name] and name not in self._also else (False, inf)
        errors = self.errors(name).values()
        worst = inf if any(isinstance(one, str) for one in errors) else worst_of(cast(Iterable[float], errors))
        return None if self.same[name] != name else (bool(springs.energies), worst)

    def choice(self, name: str) -> Choice:
        """Choice of a definition; one without springs has NaN for all numbers."""
        springs = self.springs(name)
        if springs is None:
            return Choice(name, nan, nan, "", False, dict.fromkeys(self.known, nan), nan, nan, self.failures[name])
        found = self.errors(name)
        failures = {label: error for label, error in found.items() if isinstance(error, str)}
        if failures and self._test is None:
            failures = {self.problems[0].load: next(iter(failures.values()))}
        young = poisson = nan
        if self._test is not None:
            target = cast(Material, self.materials[0]).in_plane.young_modulus * self.thickness
            logger.info("measuring the moduli of %s", name)
            try:
                modulus, poisson = self._test.axial(springs)
                young = modulus * springs.reference / target - 1
            except SingularError as error:
                failures["patch test"] = f"unstable: {error}"
        errors = {label: nan if isinstance(error, str) else error for label, error in found.items()}
        words = in_words(self.problems[0].cache, springs)
        return Choice(name, *words, bool(springs.energies), errors, float(young), float(poisson), failures)

    def step_limit(self, name: str) -> float:
        """Largest stable explicit step [s]; NaN without masses or where it is not found."""
        inertia = self.problems[0].masses()
        if inertia is None:
            return nan
        steps = stable_steps(self.problems[0].cache, self._springs[name], inertia, ["central-difference"])
        return nan if isinstance(steps, str) else float(steps["central-difference"])


ENERGY_WORDS = (
    (AngleEnergy, "springs at the corners of each triangle"),
    (BiquadraticEnergy, "coupling of the sides of each triangle"),
    (Energy, "a law of each triangle"),
)
"""Words for energies besides areas."""


def in_words(cache: MeshCache, springs: Springs) -> tuple[float, float, str]:
    """Stiffness of sides inside and on the outline, and the rest in words."""
    mesh = cache.mesh
    stiffness = springs.reference * springs.relative
    inside, at_outline, diagonals = (_common_value(stiffness[part]) for part in edge_places(mesh).values())
    extra = []
    for energy in springs.energies:
        if isinstance(energy, AreaEnergy):
            modulus = _common_value(springs.reference * energy.modulus) / cache.thickness
            extra.append(f"area energy, K_A = {1e-6 * modulus:.4g} MPa")
        else:
            extra.append(next(words for kind, words in ENERGY_WORDS if isinstance(energy, kind)))
    if len(mesh.quads):
        extra.append(f"diagonals {diagonals:.5g} N/m" if diagonals == diagonals else "diagonals each its own")
    return inside, at_outline, "; ".join(extra) or "none"


def edge_places(mesh: Mesh) -> dict[str, np.ndarray]:
    """Which edges of a mesh are inside, on the outline, or diagonals of its cells, in words."""
    outline, several = mesh.on_outline, mesh.cells_per_edge > 1
    return {"inside": several, "on the outline": outline, "on diagonals": ~outline & ~several}


def _common_value(values: np.ndarray) -> float:
    """The common value of all, NaN where they differ."""
    alike = len(values) and values.any() and np.ptp(values) <= EQUAL_STIFFNESS * np.abs(values).max()
    return float(np.median(values)) if alike else nan


def _suits(one: Definition, mesh: Mesh, materials: Collection[AnyMaterial]) -> bool:
    """Whether a definition is for cells and materials, and gives springs to type, without a search."""
    given = one.needs or one.uniaxial or one.cost > 1
    return not given and set(mesh.cells) <= set(one.cells) and (one.anisotropic or all(m.isotropic for m in materials))


def key_of(springs: Springs) -> tuple[bytes, ...]:
    """Key of a network up to its reference stiffness."""
    return springs.relative.tobytes(), *(energy.key for energy in springs.energies)
