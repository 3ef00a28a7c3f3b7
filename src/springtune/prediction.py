"""Which definition and stiffness to use on a mesh, and how far off it is: solved, with linear kinematics.

What a user without a study needs. Every definition worth a choice is solved on the mesh itself under three loads and
compared with the converged reference of small strain; a patch test between rollers measures Young's modulus and
Poisson's ratio of the network. Meshes too large for that have bands from coarser ones of their type.
"""

from dataclasses import dataclass, field, fields, replace
from math import inf, nan, sqrt
from typing import Any

import numpy as np

from .linalg.factors import SingularError
from .mechanics.energies import AreaEnergy
from .mechanics.moduli import PatchTest
from .mesh import MESH_TYPES, Mesh
from .problem.geometry import Beam
from .problem.loads import LOADS, LoadKind
from .problem.materials import Material
from .problem.status import Status
from .reference.small_strain import ReferenceNotConvergedError, ReferenceSolution, solve_small_strain
from .scene.curve import face_edge
from .scene.meshes import A_BEAM, A_MATERIAL, A_MESH, check_filled, is_a
from .scene.sheet import Sheet
from .springs import DefinitionError, Springs, lattice
from .springs.lattice import uniform

CASES = ("traction", "bending", "shear")
"""Loads that are solved, keys of `springtune.problem.loads.LOADS`."""

ON_TRIANGLES = ("patch", "lattice", "van-gelder", "uniform", "delingette", "area", "patch-area")
"""Definitions that are tried on triangles, springs alone first: of all that need no tuning, those that are the best one
by their worst load on many beams; without any of them the choice is worse by points of percent."""

ON_QUADS = ("patch", "baudet", "element-fit", "area")
"""As `ON_TRIANGLES`, on meshes that have quadrilaterals. On rectangles a patch test changes nothing."""

NEED_ENERGIES = ("delingette", "area", "patch-area")
"""Those of them that need more than springs."""

ALIKE = 1e-5
"""Difference of stiffnesses, relative, below which they are one: they are shown with five digits."""

SOLVED, SOLVED_FROM_FILE = 20_000, 100_000
"""Particles up to which a mesh is solved, in some three seconds; up to which one from a file is, in some twenty."""

BANDS_FROM = 10_000
"""Particles of the finest mesh that a band is from."""

FEWEST_CELLS = 4
"""Cells across a beam from which on errors are taken to change regularly with the mesh size."""

COARSER, TRIED = 6, 30
"""Meshes that a band is from, and sizes of which each of them is chosen."""

MARGIN, LEAST_MARGIN = 1.0, 5e-4
"""What is added to a band at either end, over its width, and at least [1]."""


Number = float | tuple[float, float]
"""A number, or the two bounds of a band."""

References = dict[str, ReferenceSolution | str]
"""References of 1 N by load, or why there is none."""

_Solved = tuple[dict[str, float], tuple[float, float], dict[str, str]]


@dataclass(frozen=True)
class Choice:
    """A definition on a mesh: its stiffness, and what it gets wrong there.

    Numbers are those of the mesh. Where it is too large to solve they are bands, pairs of a lower and an upper bound.

    Attributes
    ----------
    definition : str
        Key of `springtune.springs.DEFINITIONS`; ``"uniform"`` with its stiffness corrected for the outline, see
        `springtune.springs.lattice.predicted_stiffness`.
    inside, outline : float
        Stiffness of the sides of cells inside and on the outline [N/m]; NaN where they differ from one to the next.
    extra : str
        What there is besides these springs.
    energies : bool
        Whether a simulator needs more than springs for it.
    traction, bending, shear : float
        Deformation error under each load, linear kinematics against the reference of small strain [1]; NaN where there
        is none, because of the reference or for the reason in `failures`.
    young_modulus_error : float
        Young's modulus along x between rollers over the material's, less one [1].
    poisson_ratio : float
        Poisson's ratio there [1].
    failures : dict of str to str
        What has no number on this mesh, a load, the ``"patch test"`` or the ``"springs"`` themselves, and why: the
        network is unstable or singular at rest, or too ill-conditioned, or the definition refuses the mesh.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("100 mm", "20 mm"), st.Material("210 GPa", 0.3)
    >>> choices = st.predict(beam, st.make_mesh(beam, "structured", "5 mm"), steel)
    >>> [choice.definition for choice in choices if not choice.energies]
    ['patch', 'van-gelder', 'lattice', 'uniform']
    >>> best = choices[0]
    >>> print(f"{best.inside:.4g} N/m inside, {best.outline:.4g} N/m on the outline, {best.extra}")
    1.742e+08 N/m inside, 8.71e+07 N/m on the outline, area energy, K_A = -1.078e+04 MPa; 0.93393 times area
    >>> print(*(f"{100 * error:+.1f} %" for error in (best.traction, best.bending, best.shear)))
    +0.4 % -6.3 % +1.6 %
    >>> print(f"{100 * best.worst:.1f} % at worst; E off by {100 * abs(best.young_modulus_error):.1f} %, "
    ...       f"nu = {best.poisson_ratio:.3f}")
    6.3 % at worst; E off by 0.0 %, nu = 0.345
    """

    definition: str
    inside: Number
    outline: Number
    extra: str
    energies: bool
    traction: Number
    bending: Number
    shear: Number
    young_modulus_error: Number
    poisson_ratio: Number
    failures: dict[str, str] = field(default_factory=dict)

    @property
    def worst(self) -> float:
        """Largest size of an error under the loads that have a reference [1]; infinite where the network fails."""
        errors = np.abs([np.broadcast_to(getattr(self, load), 2) for load in CASES])
        return inf if self.failures or np.isnan(errors).all() else float(np.nanmax(errors))


def references(beam: Beam, material: Material) -> References:
    """References of the loads.

    Parameters
    ----------
    beam : Beam
    material : Material

    Returns
    -------
    dict of str to ReferenceSolution or str
        For 1 N, by load; where there is none the reason.
    """
    found: References = {}
    for load in CASES:
        try:
            found[load] = solve_small_strain(beam, material, 1.0, kind=LOADS[load].kind)
        except ReferenceNotConvergedError as error:
            found[load] = str(error)
    return found


def predict(beam: Beam, mesh: Mesh, material: Material, known: References | None = None) -> list[Choice]:
    """Choices for a mesh, solved on it, the best one by its worst load first.

    Parameters
    ----------
    beam : Beam
    mesh : Mesh
        That fills the beam.
    material : Material
    known : dict, optional
        What `references` gave for the beam and the material.

    Returns
    -------
    list of Choice
        Of `ON_TRIANGLES` or `ON_QUADS`, the same springs once; those that fail come last.

    Raises
    ------
    DefinitionError
        If none of them can live on the mesh.

    Examples
    --------
    >>> import springtune as st
    >>> beam = st.Beam("100 mm", "20 mm")
    >>> best = st.predict(beam, st.make_mesh(beam, "structured", "5 mm"), st.Material("210 GPa", 0.3))[0]
    >>> print(f"{best.definition}: {100 * best.worst:.1f} % at worst")
    patch-area: 6.3 % at worst
    """
    is_a(beam, Beam, "beam", A_BEAM)
    is_a(mesh, Mesh, "mesh", A_MESH)
    is_a(material, Material, "material", A_MATERIAL)
    check_filled(mesh, beam)
    if known is not None and not (isinstance(known, dict) and set(CASES) <= set(known)):
        raise ValueError(f"known: {known!r} has no references; give what springtune.prediction.references returns")
    known = references(beam, material) if known is None else known
    sheet, seen, refusals = _Sheet(mesh, beam, material, known), set(), []
    choices: list[Choice] = []
    for name in ON_QUADS if len(mesh.quads) else ON_TRIANGLES:
        try:
            springs = sheet.springs(name)
        except DefinitionError as error:
            refusals.append(f"{name}: {error}")
            choices.append(sheet.failed(name, "springs", str(error)))
            continue
        except SingularError as error:
            choices.append(sheet.failed(name, "patch test", f"unstable: {error}"))
            continue
        # Some are the same network: at nu = 1/3 no energy is left, on rectangles no scalar.
        same = f"{springs.reference:.9g}", *sheet.key(springs)
        if same not in seen:
            seen.add(same)
            choices.append(sheet.choice(name, springs))
    if len(refusals) == len(choices):
        raise DefinitionError("; ".join(refusals))
    return sorted(choices, key=lambda choice: choice.worst)


def extrapolate(
    mesh_type: str,
    size: float,
    beam: Beam,
    material: Material,
    known: References | None = None,
    most: int = BANDS_FROM,
) -> tuple[list[Choice], list[float]]:
    """Choices for a mesh that is too large to solve: bands from coarser meshes of its type.

    What a network gets wrong depends on the shape of its cells, which are stretched to fit the beam, and changes about
    in proportion to the mesh size or to a higher power of it. So a band holds what meshes give whose sizes cover an
    octave, chosen for cells that are stretched a little more and a little less than those asked for, and what a
    straight line through these gives; its width is added at either end.

    Parameters
    ----------
    mesh_type : str
        Key of `springtune.mesh.MESH_TYPES`.
    size : float
        Length of an edge [m].
    beam : Beam
    material : Material
    known : dict, optional
        What `references` gave for the beam and the material.
    most : int, optional
        Largest number of particles to solve.

    Returns
    -------
    choices : list of Choice
        Their numbers are pairs of bounds; what fails on one of the meshes fails.
    sizes : list of float
        Mesh sizes that were solved [m].

    Raises
    ------
    ValueError
        If the beam is so slender that a mesh of so many particles has less than four cells across.
    DefinitionError
        If no definition can live on meshes of the type.
    """
    finest = sqrt(beam.length * beam.height / most)
    while MESH_TYPES[mesh_type].particles(beam.length, beam.height, finest) > most:
        finest *= 1.02
    if 2 * finest > min(beam.length, beam.height) / FEWEST_CELLS:
        raise ValueError(
            f"a mesh of {1e3 * size:.6g} mm is too large to be solved here, and coarser ones that are not have less "
            f"than {FEWEST_CELLS} cells across beam '{beam.name}'; make it a scene of a study"
        )
    parts = np.geomspace(finest, 2 * finest, COARSER * TRIED).reshape(COARSER, TRIED)
    sizes = [_like(mesh_type, beam, size, part, sign) for part, sign in zip(parts, COARSER // 2 * (1, -1))]
    known = references(beam, material) if known is None else known
    solved = []
    for one in sizes:
        mesh = MESH_TYPES[mesh_type](beam.length, beam.height, one)
        solved.append({choice.definition: choice for choice in predict(beam, mesh, material, known)})
    # The same springs may go by one name on one mesh and by two on another.
    names = [name for name in solved[0] if all(name in one for one in solved)]
    choices = [_band([one[name] for one in solved], sizes, size) for name in names]
    return sorted(choices, key=lambda choice: choice.worst), sizes


def _like(mesh_type: str, beam: Beam, size: float, sizes: np.ndarray, sign: int) -> float:
    """Of some mesh sizes that whose cells are next to those of a size in their stretch, on one side of it if any is."""
    stretch, box = MESH_TYPES[mesh_type].stretch, (beam.length, beam.height)
    apart = sign * np.array([stretch(*box, one) / stretch(*box, size) - 1 for one in sizes])
    return float(sizes[np.argmin(np.where(apart >= -1e-9, np.abs(apart), 1 + np.abs(apart)))])


def _band(choices: list[Choice], sizes: list[float], size: float) -> Choice:
    """Bands of a definition at a size, from choices on meshes of other sizes."""
    bands: dict[str, Any] = {}  # by attribute
    failures: dict[str, str] = {}
    for part in fields(Choice):
        if part.type is Number:
            values = np.array([getattr(choice, part.name) for choice in choices])
            values = np.append(values, np.polyval(np.polyfit(sizes, values, 1), size))
            low, high = values.min(), values.max()
            margin = MARGIN * (high - low)
            if part.name not in ("inside", "outline") and margin > 1e-9:  # what is exact is so on every mesh
                margin = max(margin, LEAST_MARGIN)
            bands[part.name] = float(low - margin), float(high + margin)
    for choice in choices:
        failures |= choice.failures
    extra = "" if failures else _band_in_words([choice.extra.split(" ") for choice in choices])
    return replace(choices[0], **bands, extra=extra, failures=failures)


def _band_in_words(texts: list[list[str]]) -> str:
    """One text of several that differ in their numbers, given in words."""
    merged = []
    for words in zip(*texts):
        ends = [words[0]] if len(set(words)) == 1 else [min(words, key=float), max(words, key=float)]
        merged.append(" to ".join(ends))
    return " ".join(merged)


class _Sheet:
    """A mesh on which springs are solved; networks that differ in their reference stiffness alone once."""

    def __init__(self, mesh: Mesh, beam: Beam, material: Material, known: References) -> None:
        self.mesh, self.beam, self.material, self.known = mesh, beam, material, known
        # Loads that hold the same follow each other.
        self._sheet, self._test = Sheet(mesh, beam.thickness, networks=1), PatchTest(mesh)
        self._found: dict[tuple[bytes, ...], _Solved] = {}

    def springs(self, name: str) -> Springs:
        """Springs of a definition."""
        if name != "uniform":
            return self._sheet.derive(name, self.material)[0]
        return Springs(lattice.predicted_stiffness(self.material, self.beam, face_edge(self.mesh)), uniform(self.mesh))

    @staticmethod
    def key(springs: Springs) -> tuple[bytes, ...]:
        """What tells networks apart but for their reference stiffness."""
        return springs.relative.tobytes(), *(energy.key for energy in springs.energies)

    def choice(self, name: str, springs: Springs) -> Choice:
        """What springs are worth."""
        displacements, moduli, failures = self._solved(springs)
        errors = dict.fromkeys(CASES, nan)
        for load, displacement in displacements.items():
            known = self.known[load]
            if not isinstance(known, str):
                errors[load] = displacement / (springs.reference * float(known.displacement)) - 1
        young, ratio = moduli
        young *= springs.reference / (self.material.young_modulus * self.beam.thickness)
        return Choice(
            name,
            *self._parts(name, springs),
            bool(springs.energies),
            traction=errors["traction"],
            bending=errors["bending"],
            shear=errors["shear"],
            young_modulus_error=float(young) - 1,
            poisson_ratio=float(ratio),
            failures=failures,
        )

    def failed(self, name: str, part: str, reason: str) -> Choice:
        """Choice of a definition that gives no springs here."""
        return Choice(name, nan, nan, "", name in NEED_ENERGIES, nan, nan, nan, nan, nan, {part: reason})

    def _solved(self, springs: Springs) -> _Solved:
        """Displacement of each load for unit force over reference stiffness [1]; E and nu; what has none and why."""
        key = self.key(springs)
        if key not in self._found:
            displacements: dict[str, float] = {}
            failures: dict[str, str] = {}
            moduli = nan, nan
            for load in CASES:
                try:
                    displacements[load] = self._displacement(springs, LOADS[load].kind)
                except SingularError as error:
                    failures[load] = str(error)
            try:
                moduli = self._test.axial(springs)
            except SingularError as error:
                failures["patch test"] = f"unstable: {error}"
            self._found[key] = displacements, moduli, failures
        return self._found[key]

    def _displacement(self, springs: Springs, kind: LoadKind) -> float:
        try:
            found = self._sheet.solve(kind, springs, springs.reference, "linear")
        except SingularError as error:
            raise SingularError(f"unstable: {error}") from None
        if found.status is not Status.SOLVED:
            raise SingularError(found.message)
        return found.displacement

    def _parts(self, name: str, springs: Springs) -> tuple[float, float, str]:
        """Stiffness of sides inside and on the outline, and in words what else there is."""
        outline, several = self.mesh.on_outline, self.mesh.cells_per_edge > 1

        def common(values: np.ndarray) -> float:
            values = springs.reference * values
            alike = len(values) and values.any() and np.ptp(values) <= ALIKE * np.abs(values).max()
            return float(np.median(values)) if alike else nan

        inside, at_outline, diagonals = (
            common(springs.relative[part]) for part in (several, outline, ~outline & ~several)
        )
        extra = []
        for energy in springs.energies:
            if isinstance(energy, AreaEnergy):
                modulus = common(energy.modulus) / self.beam.thickness
                extra.append(f"area energy, K_A = {1e-6 * modulus:.4g} MPa")
            else:
                extra.append("coupling of the sides of each triangle")
        if len(self.mesh.quads):
            extra.append(f"diagonals {diagonals:.5g} N/m" if diagonals == diagonals else "diagonals each its own")
        plain = {"patch": "lattice", "patch-area": "area"}.get(name)
        if plain and not len(self.mesh.quads):
            extra.append(f"{springs.reference / self.springs(plain).reference:.5f} times {plain}")
        if name == "uniform":
            extra.append("corrected for the outline")
        return inside, at_outline, "; ".join([*(() if springs.energies else ("none",)), *extra])
