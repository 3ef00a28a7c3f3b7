"""A network as plain arrays in SI units: what another program needs to have the same springs.

Its energy W is the sum of ``k (l - L)^2 / 2`` over springs and of the `Terms` of cells.
"""

import inspect
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..mechanics import IMPLICIT, INTEGRATORS
from ..mechanics.dynamics import masses
from ..mesh.cells import Mesh
from ..problem.compare import error_text, sign_sentence
from ..problem.loads import LOADS
from ..problem.materials import AnyMaterial, Material
from ..problem.quantities import positive
from ..problem.shapes import Beam
from ..registry import hook
from ..safe_io import Tabled
from ..scene.boundary_problem import BeamProblem, ShapeProblem, check_filled
from ..scene.mesh_cache import AnyDefinition, MeshCache, check_type, definition_of, given_stiffness, naming_errors
from ..scene.motion import stable_steps
from ..scene.single import Scene
from ..springs.base import Definition, DefinitionError, Springs
from .simulation import Net, Terms, terms_of

UNITS = {
    "points": "m",
    "rest_lengths": "m",
    "stiffness": "N/m",
    "masses": "kg",
    "thickness": "m",
    "forces": "N",
    "energy": "J",
    "expected_error": "1",
    "largest_stable_step": "s",
}
"""Units of what a net holds; those of terms stand with them."""

MEANING_ON_SHAPES = (
    "(network - reference) / |reference| of each quantity that the load case asks for; linear kinematics, small strain"
)
"""Meaning of an expected error on a shape."""


def meaning() -> str:
    """Meaning of an expected error, for all loads."""
    signs = sign_sentence({name: load.sign for name, load in LOADS.items()})
    of = "(network - reference) / |reference| of the displacement along the axis of the force"
    return f"{of}; {signs}; linear kinematics, small strain"


MATERIAL_CONSTANTS = ("name", "young_modulus", "poisson_ratio", "plane", "density")
"""Constants of a material in a header."""

STEP_MEANING = "about rest, undamped; springs that stiffen, and damping that lags, narrow it"
"""Meaning of a largest stable step."""

NOT_COMPUTED = "not computed"  # first words of a text in the place of a number

SIZE_REASON = f"{NOT_COMPUTED}: {{}} particles, and at most {{}} are solved for a header"
"""Text in the place of expected errors on a large mesh."""


@dataclass(frozen=True, eq=False, repr=False)
class SpringNet(Tabled, Net):
    """A network of springs as plain arrays, in SI units.

    Attributes
    ----------
    points : ndarray of float, shape (n_points, 2)
        Particles at rest [m].
    springs : ndarray of int, shape (n_springs, 2)
        Particles at the two ends of each spring, counted from 0: all edges of the mesh, sorted.
    rest_lengths : ndarray of float, shape (n_springs,)
        [m]
    stiffness : ndarray of float, shape (n_springs,)
        [N/m]; 0 for edges that a definition gives no spring, as where the law of all springs is part of `energies`.
    energies : tuple of Terms
        Energies besides springs; empty for springs alone.
    masses : ndarray of float, shape (n_points,), or None
        Of particles [kg]; None where the material has no density.
    thickness : float
        Of the sheet [m].
    held : ndarray of bool, shape (n_points, 2)
        Where a particle cannot move in x or y; nowhere without a load.
    forces : ndarray of float, shape (n_points, 2)
        Of the load on each particle [N]; zero without a load.
    header : dict
        Plain texts, numbers and dicts: definition, its formula and source, beam, material, mesh, load, expected errors
        [1], largest stable time steps [s], units, and the version of springtune.
    triangles, quads : ndarray of int, shape (n, 3) or (n, 4)

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("200 mm", "40 mm"), st.Material("210 GPa", 0.3, density="7850 kg/m^3")
    >>> mesh = st.make_mesh(beam, "structured", "5 mm")
    >>> net = st.SpringNet.from_mesh(mesh, steel, "area", beam=beam)
    >>> print(f"{net.stiffness.max():.4g} N/m, {net.masses.sum():.4g} kg, {net.energies[0].formula}")
    1.865e+08 N/m, 0.0628 kg, W = 1/2 modulus (A - rest_area)^2 / rest_area of each cell, A its area
    >>> print({load: f"{100 * error:+.1f} %" for load, error in net.header["expected_error"].items()})
    {'traction': '+4.0 %', 'bending': '+1.7 %', 'shear': '-0.2 %'}
    >>> [path.name for path in net.write("net.json")]
    ['net.json']
    >>> (st.SpringNet.read("net.json").stiffness == net.stiffness).all().item()
    True
    """

    def _rows(self) -> Iterator[tuple[str, str]]:
        about = self.header
        yield "definition", about.get("definition", "")
        yield "size", f"{len(self.points)} particles, {len(self.springs)} springs, {1e3 * self.thickness:g} mm thick"
        yield "stiffness", f"{self.stiffness.min():.4g} to {self.stiffness.max():.4g} N/m" if len(self.springs) else ""
        yield "besides springs", ", ".join(f"energy of {one.kind}s" for one in self.energies)
        yield "mass", "" if self.masses is None else f"{self.masses.sum():.4g} kg"
        yield "load", load["name"] if (load := about.get("load")) else "none"
        expected = about.get("expected_error", "")
        for name, error in expected.items() if isinstance(expected, dict) else [("", expected)]:
            yield f"expected error {name}".rstrip(), error if isinstance(error, str) else error_text(error)

    @classmethod
    def from_scene(
        cls, scene: Scene, mesh_name: str = "", *, springs: Springs | None = None, errors: bool = True
    ) -> "SpringNet":
        """Springs of a scene, held and loaded as it is.

        Parameters
        ----------
        scene : Scene
        mesh_name : str, optional
            What the header calls the mesh, such as ``"structured 2 mm"``.
        springs : Springs, optional
            In the place of the scene's own.
        errors : bool, optional
            Whether to compute the expected errors for the header, one solve per load; of a shape those of its
            quantities under the scene's load, for which its reference is solved.

        Returns
        -------
        SpringNet
        """
        springs = scene.springs if springs is None else springs
        about, forces = scene.boundary_problem, scene.boundary_problem.forces(springs)
        parts = _parts(scene.definition, scene.cache, about.materials, springs, about.masses(), mesh_name, scene.held)
        header, follower = parts["header"], about.loading.follower is not None
        load = {"name": scene.load, "kinematics": scene.kinematics, "follower": follower}
        if isinstance(about, ShapeProblem):
            load |= {"scale": about.scale, "prescribed": about.loading.given is not None}
            header |= {"load": load, "shape": about.body}
        else:
            header |= {"load": load | {"force": about.force}, "beam": asdict(scene.beam)}
        if errors and isinstance(about, ShapeProblem):
            header |= {"expected_error": _errors_on_shape(scene, springs), "expected_error_means": MEANING_ON_SHAPES}
        elif errors:
            body = scene.beam, scene.material
            header["expected_error"] = _expected_errors(scene.cache, scene.definition, springs, *body, None, scene.load)
        return cls(**(parts | {"forces": forces}))

    @classmethod
    def from_mesh(
        cls,
        mesh: Mesh,
        material: Material,
        definition: AnyDefinition = "patch",
        *,
        thickness: float | str = 1e-3,
        beam: Beam | None = None,
        stiffness: float | str | None = None,
        springs: Springs | None = None,
        mesh_name: str = "",
        errors: bool = True,
        loads: Iterable[str] | None = None,
    ) -> "SpringNet":
        """Springs of a definition on a mesh of any outline, without a load.

        Parameters
        ----------
        mesh : Mesh
        material : Material
        definition : str, Definition or callable, optional
            As of `springtune.Scene`.
        thickness : float or str, optional
            Of the sheet [m]; the beam's where there is one.
        beam : Beam, optional
            That the mesh fills: with it the header says the expected errors.
        stiffness : float or str, optional
            Uniform stiffness [N/m], for definitions that need one.
        springs : Springs, optional
            In the place of the definition's.
        mesh_name, errors : optional
            As of `from_scene`.
        loads : iterable of str, optional
            Loads whose expected errors the header states; by default traction, bending and shear.

        Returns
        -------
        SpringNet

        Raises
        ------
        ValueError
            If the mesh does not fill the beam, or loads are given without a beam.
        """
        check_type(mesh, Mesh, "mesh")
        check_type(material, Material, "material")
        if beam is not None:
            check_type(beam, Beam, "beam")
            check_filled(mesh, beam)
        elif loads is not None:
            raise ValueError(f"loads: {loads!r} have expected errors on the mesh of a beam alone; give beam, too")
        chosen = definition_of(definition)
        cache = MeshCache(mesh, positive(thickness, "length", "thickness") if beam is None else beam.thickness)
        if springs is None:
            given = given_stiffness(chosen, stiffness)
            with naming_errors(chosen):
                springs = cache.derive(chosen, material, given)[0]
        inertia = None if material.density is None else masses(mesh, material.density, cache.thickness)
        parts = _parts(chosen, cache, [material], springs, inertia, mesh_name)
        header = parts["header"]
        if beam is None:
            header["expected_error"] = f"{NOT_COMPUTED}: the mesh is of no beam"
        else:
            header["beam"] = asdict(beam)
            if errors:
                header["expected_error"] = _expected_errors(cache, chosen, springs, beam, material, loads)
        return cls(**parts)

    def write(self, path: str | Path) -> list[Path]:
        """Write the net; the ending of the name sets the format, and files appear whole or not at all.

        Parameters
        ----------
        path : str or Path
            ``.csv`` has the springs as a table, with the header ahead as comments, and particles and cells in tables
            beside it, such as ``net.particles.csv``; ``.json`` has the arrays by their names here;
            ``.vtu`` has springs as lines, for ParaView and meshio. Models that run, and are not read again: ``.xml`` or
            ``.mjcf`` for MuJoCo, ``.py`` for SOFA, ``.newton.py`` for Newton, ``.xpbd.json`` for XPBD.

        Returns
        -------
        list of Path

        Raises
        ------
        ValueError
            If the name has another ending, its folder is not there, or the load prescribes displacements.
        """
        load = self.header.get("load")
        if load and load.get("prescribed"):
            why = "prescribes displacements, which no file of springs has"
            raise ValueError(f"load {load['name']!r}: {why}; take a load of forces")
        return hook("files").write(path, self)

    @classmethod
    def read(cls, path: str | Path) -> "SpringNet":
        """Read a net, with exactly the numbers that were written.

        Parameters
        ----------
        path : str or Path
            Ending in ``.json``, as `write` wrote it.

        Returns
        -------
        SpringNet
        """
        return cls(**vars(hook("files").read(path)))


def _merged(given: list[Terms]) -> tuple[Terms, ...]:
    """Terms of one kind and the same cells as one: energies are proportional to their moduli."""
    found: dict[tuple[str, int], Terms] = {}
    for one in given:
        key = one.kind, one.cells.shape[1]
        if key in found:
            sums = {name: found[key].values[name] + values for name, values in one.moduli.items()}
            one = replace(one, values=one.values | sums)
        found[key] = one
    return tuple(found.values())


def _parts(
    definition: Definition,
    cache: MeshCache,
    materials: Sequence[AnyMaterial],
    springs: Springs,
    inertia: np.ndarray | None,
    mesh_name: str,
    held: np.ndarray | None = None,
) -> dict[str, Any]:
    """Arrays and header of a net without a load."""
    mesh, (formula, source) = cache.mesh, described(definition)
    material, *others = ({name: getattr(one, name, None) for name in MATERIAL_CONSTANTS} for one in materials)
    if inertia is None:
        lacking = next(one.name for one in materials if one.density is None)
        steps: dict[str, float] | str = f"material '{lacking}' has no density"
    else:
        steps = stable_steps(cache, springs, inertia, INTEGRATORS, held)
    header = {
        "made_by": f"springtune {__version__}",
        "definition": definition.name,
        "formula": formula,
        "source": source,
        "reference_stiffness": float(springs.reference),
        # Forces on the long faces that belong to the springs; they are part of the forces of a load.
        **({"lateral_stress": springs.lateral} if springs.lateral else {}),
        "thickness": float(cache.thickness),
        "beam": None,
        "material": material,
        **({"other_materials": {one["name"]: one for one in others}} if others else {}),
        "mesh": {
            **({"name": mesh_name} if mesh_name else {}),
            "particles": len(mesh.points),
            "springs": len(mesh.edges),
            "triangles": len(mesh.triangles),
            "quads": len(mesh.quads),
        },
        "load": None,
        "expected_error": f"{NOT_COMPUTED}: not requested",
        "expected_error_means": meaning(),
        "largest_stable_step": f"{NOT_COMPUTED}: {steps}"
        if isinstance(steps, str)
        else {name: "unlimited" if name in IMPLICIT else step for name, step in steps.items()},
        "largest_stable_step_means": STEP_MEANING,
        "units": UNITS
        | {"reference_stiffness": "N/m", "lateral_stress": "axial stress", "young_modulus": "Pa", "density": "kg/m3"},
    }
    return {
        "points": mesh.points,
        "springs": mesh.edges,
        "rest_lengths": mesh.edge_lengths,
        "stiffness": springs.reference * springs.relative,
        "energies": _merged([terms_of(energy, mesh, springs.reference) for energy in springs.energies]),
        "masses": inertia,
        "thickness": cache.thickness,
        "held": np.zeros(mesh.points.shape, dtype=bool) if held is None else held,
        "forces": np.zeros(mesh.points.shape),
        "header": header,
        "triangles": mesh.triangles,
        "quads": mesh.quads,
    }


def described(definition: Definition) -> tuple[str, str]:
    """Return the formula of a definition in words, and its source."""
    function = inspect.unwrap(definition.function)
    own = inspect.getdoc(function) or ""
    module = sys.modules.get(function.__module__)
    of_package = function.__module__.startswith(f"{DefinitionError.__module__.rpartition('.')[0]}.")
    source = (inspect.getdoc(module) if of_package and module else own) or ""
    return own.partition("\n")[0].rstrip("."), source


def _expected_errors(
    cache: MeshCache,
    definition: Definition,
    springs: Springs,
    beam: Beam,
    material: Material,
    loads: Iterable[str] | None,
    *further: str,
) -> dict[str, float | str]:
    """Error by load, linear kinematics against the reference of small strain; or why it is not computed."""
    # Here, since finite elements take half a second to import.
    from ..prediction.choices import SEARCHED_PARTICLES, USUAL_LOADS, check_loads, errors_under, reference_of

    names = (*check_loads(USUAL_LOADS if loads is None else loads), *further)
    if (count := len(cache.mesh.points)) > SEARCHED_PARTICLES:
        return dict.fromkeys(names, SIZE_REASON.format(count, SEARCHED_PARTICLES))
    why = f"{NOT_COMPUTED}: definition '{definition.name}' is not for this load"
    errors: dict[str, float | str] = dict.fromkeys(names, why)
    for name in errors:
        if LOADS[name].kind.uniaxial or not definition.uniaxial:
            known = {name: reference_of(beam, material, name)}
            problem = BeamProblem(beam, cache.mesh, material, name, 1.0, "linear", cache)
            errors |= _in_words(errors_under(problem, springs, known), known)
    return errors


def _in_words(errors: dict[str, float | str], known: Mapping[str, Any]) -> dict[str, float | str]:
    """Return errors by name, and instead of a missing one the reason: no reference, or a failed network."""
    found: dict[str, float | str] = {}
    for name, error in errors.items():
        why = known[name] if isinstance(known[name], str) else "the reference is zero"
        failed = isinstance(error, str) or not np.isfinite(error)
        found[name] = f"{NOT_COMPUTED}: {error if isinstance(error, str) else why}" if failed else error
    return found


def _errors_on_shape(scene: Scene, springs: Springs) -> dict[str, float | str]:
    """Error by quantity, linear kinematics against the reference of small strain; or why it is not computed."""
    # Here, since finite elements take half a second to import.
    from ..prediction.choices import SEARCHED_PARTICLES, QuantityReference, References, errors_under, shape_references
    from ..reference.small_strain import ReferenceNotConvergedError

    if (count := len(scene.mesh.points)) > SEARCHED_PARTICLES:
        return dict.fromkeys([one.name for one in scene.case.quantities], SIZE_REASON.format(count, SEARCHED_PARTICLES))
    linear = ShapeProblem(scene.shape, scene.grouped, scene.by_part, scene.load, scene.scale, "linear", scene.cache)
    try:
        values = linear.reference_values()
        known = References({name: QuantityReference(value, np.nan) for name, value in values.items()})
    except (ReferenceNotConvergedError, ValueError):
        # One quantity without a reference, such as stress at a corner, does not cost the others theirs.
        known = shape_references(linear)
    return _in_words(errors_under(linear, springs, known), known)
