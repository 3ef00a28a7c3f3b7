"""A network as plain arrays with its energies; its masses, damping, stable step and equilibrium for simulators."""

import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from scipy.sparse import diags_array
from scipy.sparse.linalg import LinearOperator, eigsh

from ..mechanics.dynamics import Motion
from ..mechanics.energies import AngleEnergy, AreaEnergy, BiquadraticEnergy, Energy, NeoHookeEnergy, YeohEnergy
from ..mechanics.network import Network
from ..mechanics.statics import SingularError, StaticProblem
from ..mesh.cells import Mesh, corner_angles, no_cells, rows_of, signed_areas
from ..problem.quantities import Status
from ..safe_io import printable, xml_comment
from ..springs.base import DefinitionError

FORMULAS = {
    "area": "W = 1/2 modulus (A - rest_area)^2 / rest_area of each cell, A its area",
    "angle": "W = 1/2 modulus sum_i (angle_i - rest_angle_i)^2 of each triangle, angle_i that at its corner i",
    "corner": "W = 1/2 sum_i rotational_i (angle_i - rest_angle_i)^2 of each triangle, angle_i that at its corner i",
    "biquadratic": (
        "W = sum_i tensile_i / 4 q_i^2 + sum_i coupling_i / 2 q_j q_k of each triangle, with q_i = l_i^2 - "
        "rest_length_i^2 of the side opposite corner i, and j, k the other two: coupling_i joins the sides that meet "
        "in corner i"
    ),
    "incompressible": (
        "W = rest_area (c1 e + c2 e^2 + c3 e^3) of each triangle, with e = T + (rest_area / A)^2 - 3, A its area, "
        "T = sum_i rest_weight_i l_i^2 / rest_area of the side opposite corner i: its first term is that of springs of "
        "zero rest length with stiffnesses 2 c1 rest_weight_i, and of areas; no triangle turns inside out"
    ),
    "compressible": (
        "W = rest_area (shear/2 (V^(-2/3) (T + z^2) - 3) + bulk/2 (V - 1)^2) of each triangle, with V = z A / "
        "rest_area, A its area, z > 0 where W has its minimum, T = sum_i rest_weight_i l_i^2 / rest_area of the side "
        "opposite corner i"
    ),
}
"""Energy of a cell by kind of terms."""

VALUES = {
    "area": {"rest_area": "m2", "modulus": "N/m"},
    "angle": {"rest_angle": "rad", "modulus": "J"},
    "corner": {"rest_angle": "rad", "rotational": "J"},
    "biquadratic": {"rest_length": "m", "tensile": "N/m3", "coupling": "N/m3"},
    "incompressible": {"rest_area": "m2", "rest_weight": "1", "c1": "N/m", "c2": "N/m", "c3": "N/m"},
    "compressible": {"rest_area": "m2", "rest_weight": "1", "shear": "N/m", "bulk": "N/m"},
}
"""Names of the values of each kind of terms, and their units."""

CORNER_VALUES = ("rest_angle", "rotational", "rest_length", "tensile", "coupling", "rest_weight")
"""Values that each corner of a cell has its own of."""

ENERGY_CLASSES: dict[str, type[Energy]] = {
    "area": AreaEnergy,
    "angle": AngleEnergy,
    "corner": AngleEnergy,
    "biquadratic": BiquadraticEnergy,
    "compressible": NeoHookeEnergy,
    "incompressible": YeohEnergy,
}
"""Energies of a network by kind of terms."""


def _rest_lengths(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    sides = np.roll(points[cells], 1, axis=1) - np.roll(points[cells], -1, axis=1)
    return np.asarray(np.linalg.norm(sides, axis=2))


REST_VALUES: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "rest_area": signed_areas,
    "rest_angle": corner_angles,
    "rest_length": _rest_lengths,
    "rest_weight": lambda points, cells: 0.5 / np.tan(corner_angles(points, cells)),
}
"""Values that follow from the points and cells at rest; the others are moduli, which the energy is proportional to."""


@dataclass(frozen=True, eq=False)
class Terms:
    """Energies of one kind besides the springs: a row for each of `cells` (n_cells, n_corners), counter-clockwise.

    Values of sides are of the side opposite to each corner, and `coupling` of the two sides that meet in it.
    """

    kind: str
    cells: np.ndarray
    values: dict[str, np.ndarray]

    @property
    def formula(self) -> str:
        """Energy of a cell."""
        return FORMULAS[self.kind]

    @property
    def units(self) -> dict[str, str]:
        """Unit of each value."""
        return VALUES[self.kind]

    @property
    def moduli(self) -> dict[str, np.ndarray]:
        """Values that the energy is proportional to."""
        return {name: self.values[name] for name in VALUES[self.kind] if name not in REST_VALUES}

    @property
    def present(self) -> np.ndarray:
        """Whether a cell has the energy; cells of other parts have zeros as moduli."""
        return np.any([one.reshape(len(one), -1).any(axis=1) for one in self.moduli.values()], axis=0)


@dataclass(frozen=True, eq=False)
class Net:
    """A network as plain arrays, which `springtune.SpringNet` describes."""

    points: np.ndarray
    springs: np.ndarray
    rest_lengths: np.ndarray
    stiffness: np.ndarray
    energies: tuple[Terms, ...]
    masses: Any  # an array, or None of a scene that does not move
    thickness: float
    held: np.ndarray
    forces: np.ndarray
    header: dict[str, Any]
    triangles: np.ndarray = field(default_factory=lambda: no_cells(3))
    quads: np.ndarray = field(default_factory=lambda: no_cells(4))


def terms_of(energy: Energy, mesh: Mesh, reference: float) -> Terms:
    """Energy of a network as plain arrays, for all cells with as many corners; moduli are over `reference` [N/m]."""
    kind = next((kind for kind, made in ENERGY_CLASSES.items() if isinstance(energy, made)), "")
    if not kind:
        own = "use those of springtune.mechanics.energies"
        raise DefinitionError(f"energy {type(energy).__name__} cannot be written out; {own}")
    given = energy.moduli
    if isinstance(energy, AngleEnergy) and energy.modulus.ndim > 1:
        kind, given = "corner", {"rotational": energy.modulus}
    elif isinstance(energy, YeohEnergy):
        given = dict(zip(("c1", "c2", "c3"), energy.coefficients.T))
    cells, values = mesh.cells[energy.corners.shape[1]], {}
    rows = rows_of(cells, energy.corners)
    for name in VALUES[kind]:
        if name in REST_VALUES:
            values[name] = REST_VALUES[name](mesh.points, cells)
        else:
            values[name] = np.zeros(cells.shape if name in CORNER_VALUES else len(cells))
            if given.get(name) is not None:
                values[name][rows] = reference * given[name]
    return Terms(kind, cells, values)


def energies_of(net: Net, reference: float) -> list[Energy]:
    """Energies that the terms of a net were written from."""
    found = []
    for terms in net.energies:
        moduli = [one[terms.present] / reference for one in terms.moduli.values()]
        if terms.kind == "incompressible":
            moduli = [np.column_stack(moduli)]
        found.append(ENERGY_CLASSES[terms.kind](net.points, terms.cells[terms.present], *moduli))
    return found


STABLE_STEP_SHARE = 0.8
"""Written step over the largest stable one, at rest, in equilibrium and as far as the net swings: fronts of waves
stretch springs further."""

ENERGY_WORDS = {
    "area": "areas",
    "angle": "angles",
    "corner": "angles",
    "biquadratic": "squared lengths",
    "incompressible": "rubber",
    "compressible": "rubber",
}
"""Words for energies besides springs, by kind."""


STEPS_PER_PERIOD = 50  # implicit steps of the slowest period that the load excites


class EquilibriumWarning(UserWarning):
    """Warning of a net without an equilibrium, or with one that is far away."""


@dataclass(frozen=True)
class Simulation:
    """Step, damping, frequencies and equilibrium of a net in a simulator.

    `force` is signed [N]; 1 for a load case, 0 without a load. `largest_step` is stable about rest, `step` also in
    motion [s]. `frequency` is the lowest, `loaded_frequency` that which the load excites [rad/s]. `mass_damping` over
    mass [1/s] is critical for the latter, or less, so that no mode comes to rest later than the lowest one.
    """

    masses: np.ndarray
    force: float
    largest_step: float
    step: float
    frequency: float
    loaded_frequency: float
    mass_damping: float
    displacements: np.ndarray | None
    why: str

    @property
    def implicit_step(self) -> float:
        """Step of unconditionally stable schemes: the slowest period that the load excites over 50 [s]."""
        return float(2 * np.pi / self.loaded_frequency / STEPS_PER_PERIOD) if self.loaded_frequency else self.step


def simulate(
    net: Net, program: str, laws: Iterable[str] = (), energies: Callable[[Net, float], list[Energy]] | None = None
) -> Simulation:
    """Masses, damping, step and equilibrium of a net for a simulator, whose own `energies` may stand for the net's."""
    _check(net, program, laws)
    reference = float(net.header["reference_stiffness"])
    load = net.header.get("load")
    # Of a shape, whose load case is of several forces, the factor on it.
    force = float(load.get("force", 1.0)) if load else 0.0
    network = network_of(net, reference, energies)
    motion = Motion(network, net.masses / reference, net.forces / reference)
    largest = motion.step_limit("symplectic-euler")
    displacements, lowest, loaded, why = None, 0.0, 0.0, "there is no load"
    if force:
        try:
            if network.rest_factor.negative_pivots:
                why = f"is unstable at rest, and flies apart in {program}; take another definition or mesh"
                raise ValueError(f"definition '{net.header['definition']}': {why}")
            lowest, loaded = _lowest_frequency(motion), motion.loaded_frequency
            problem = StaticProblem(network, net.forces / force)
            found = problem.nonlinear(force / reference)
            status, why, _ = problem.judge(force / reference, found)
            displacements = found.displacements if status is Status.SOLVED else None
        except SingularError as error:
            why = str(error)
        _warn(net, displacements, why)
    damping, stable = 2 * lowest, largest
    if displacements is not None:
        stiffened = _lowest_frequency(motion, displacements)  # by tension
        damping = max(damping, min(2 * loaded, lowest + stiffened**2 / lowest))
        # Fronts of waves stretch springs as far as the loaded mode would swing under the damping of small loads.
        ratio = min(lowest / loaded, 1.0)
        beyond = np.exp(-np.pi * ratio / np.sqrt(1 - ratio**2)) if ratio < 1 else 0.0
        tangents = (network.tangent(share * displacements) for share in (1.0, 1.0 + beyond))
        stable = min(stable, 2 / max(map(motion.highest_frequency, tangents)))
    step = STABLE_STEP_SHARE * stable
    return Simulation(net.masses, force, largest, step, lowest, loaded, damping, displacements, why)


def _warn(net: Net, displacements: np.ndarray | None, why: str) -> None:
    """Warn of a missing equilibrium, or of one that is far away."""
    if displacements is None:
        smaller = "force" if net.header.get("beam") else "scale"
        message = f"no equilibrium was found, so the file has none: {why}; give a smaller {smaller}"
    else:
        moved, extent = float(np.abs(displacements).max()), float(np.ptp(net.points, axis=0).max())
        if moved <= extent:
            return
        body = "the beam is long" if net.header.get("beam") else "the shape is wide or high"
        message = f"the equilibrium is {moved:.3g} m away from rest, further than {body} ({extent:.3g} m)"
    warnings.warn(message, EquilibriumWarning, stacklevel=2)


def load_in_words(load: Mapping[str, Any]) -> str:
    """Load of a header, with its size: the force on a beam, the factor on a load case of a shape."""
    if "force" in load:
        return f"{load['name']} of {abs(load['force']):g} N"
    return load["name"] + ("" if load["scale"] == 1 else f" times {load['scale']:g}")


def _lowest_frequency(motion: Motion, displacements: np.ndarray | None = None) -> float:
    """Lowest frequency at rest or about displacements [rad/s], by Lanczos' method on the factorized tangent."""
    size, mass, network = len(motion.mass), motion.mass, motion.network
    matrix = network.tangent(displacements)
    if size < 10:
        root = 1 / np.sqrt(mass)
        return float(np.sqrt(np.linalg.eigvalsh(root[:, None] * matrix.toarray() * root)[0]))
    factor = network.rest_factor if displacements is None else network.factorize_tangent(displacements)
    inverse = LinearOperator((size, size), matvec=factor.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(size)
    (square,) = eigsh(matrix, 1, diags_array(mass), sigma=0.0, OPinv=inverse, v0=start, return_eigenvectors=False)
    return float(np.sqrt(square))


def _check(net: Net, program: str, laws: Iterable[str]) -> None:
    """Refuse a net that a simulator cannot represent."""
    lacking = next((ENERGY_WORDS[terms.kind] for terms in net.energies if terms.kind not in laws), "")
    if lacking:
        why = f"has energies of {lacking}, and {program} has no such law"
        raise ValueError(f"definition '{net.header['definition']}': {why}; take one such as 'patch'")
    if net.masses is None:
        materials = (net.header["material"], *net.header.get("other_materials", {}).values())
        light = next(one["name"] for one in materials if one.get("density") is None)
        why = f"material '{light}' has none, and {program} moves masses"
        raise ValueError(f"density: {why}; give a density such as '7850 kg/m^3'")
    load = net.header.get("load")
    if load and load["follower"]:
        instead = "take 'pressure'" if net.header.get("beam") else "give its pressures 'follower: false'"
        why = "turns with the side that it acts on, and forces in a file do not"
        raise ValueError(f"load '{load['name']}': {why}; {instead}")
    if load and load["kinematics"] == "linear":
        raise ValueError(f"kinematics: 'linear', and springs of {program} keep their length law; take 'nonlinear'")


def network_of(net: Net, reference: float, energies: Callable[[Net, float], list[Energy]] | None = None) -> Network:
    """Network from which a net was written; all stiffnesses are over the reference stiffness."""
    mesh = Mesh(net.points, net.triangles, net.quads)
    if not np.array_equal(mesh.edges, net.springs):
        raise ValueError("springs: are not the edges of the cells in their order; write the springs of a scene anew")
    return Network(mesh, net.held, net.stiffness / reference, (energies or energies_of)(net, reference))


def lame(net: Net, terms: Terms, program: str) -> tuple[float, float]:
    """Lame constants of plane stress, times the thickness [N/m], that give all triangles their springs."""
    areas = 16 * signed_areas(net.points, terms.cells)[:, None]
    cotangents = 1 / np.tan(corner_angles(net.points, terms.cells))
    products = np.roll(cotangents, -1, axis=1) * np.roll(cotangents, -2, axis=1)
    # tensile and coupling are linear in (lambda + 2 mu) t and 2 mu t, see `springtune.springs.delingette`.
    given = np.concatenate([(areas * terms.values[name]).ravel() for name in ("tensile", "coupling")])
    factors = np.concatenate([2 * cotangents.ravel() ** 2, 2 * products.ravel()])
    signs = np.repeat([1.0, -1.0], cotangents.size)
    (total, twice), *_ = np.linalg.lstsq(np.column_stack([factors, signs]), given, rcond=None)
    first = float(total - twice)
    away = np.abs(factors * total + signs * twice - given).max() / np.abs(given).max()
    lawful, below = away <= 1e-9 and twice > 0, first <= -1e-9 * twice
    if lawful and below and net.header["definition"] == "delingette":
        why = f"has a Poisson's ratio below 0, and {program} takes none"
        raise ValueError(f"material: {why}; take springs alone, such as 'patch'")
    if not lawful or below:
        why = f"its springs of squared lengths are those of no material, and {program} has the law of a material alone"
        remedy = "take 'delingette', or springs alone such as 'patch'"
        raise ValueError(f"definition '{net.header['definition']}': {why}; {remedy}")
    return max(first, 0.0), float(twice) / 2


def comment_lines(net: Net, simulation: Simulation, integrator: str) -> list[str]:
    """Lines of comment: definition, material, load, expected errors and step; each is one line, whatever a name has."""
    header = net.header
    material, load, others = header["material"], header.get("load"), header.get("other_materials")
    constants = damping = ""
    if material["young_modulus"] is not None:
        constants = f"Young's modulus {material['young_modulus']:g} Pa, Poisson's ratio {material['poisson_ratio']:g}, "
        constants += "plane strain, " if material.get("plane") == "strain" else ""
    if simulation.frequency:
        lowest = simulation.frequency
        critical = f"{simulation.mass_damping / (2 * lowest):.3g} of the critical one of the lowest frequency"
        loaded = f"the one that the load excites is {simulation.loaded_frequency / lowest:.3g} times as high"
        damping = f"Damping over mass is {simulation.mass_damping:.4g} 1/s, {critical}; {loaded}."
    left_out = int((net.stiffness == 0).sum()) if np.any(net.stiffness) else 0
    errors = header["expected_error"].items() if isinstance(header.get("expected_error"), dict) else ()
    expected = ", ".join(f"{name} {100 * error:+.2g} %" for name, error in errors if isinstance(error, float))
    what = "Expected error of the displacement" if header.get("beam") else "Expected errors"
    lines = [
        f"{header['made_by']}: definition '{header['definition']}'. {header['formula']}.",
        f"{len(net.points)} particles, {len(net.springs) - left_out} springs; m, kg, s, N.",
        f"Material '{material['name']}': {constants}density {material['density']:g} kg/m3; thickness "
        f"{header['thickness']:g} m.",
        f"Other parts are of {', '.join(map(repr, others))}." if others else "",
        f"{left_out} springs of no stiffness are left out." if left_out else "",
        f"Load: {load_in_words(load)}." if load else "",
        f"{what}, small strain: {expected}." if expected else "",
        f"The largest stable step of explicit schemes is {simulation.largest_step:.4g} s at rest; {integrator}.",
        damping,
        f"No equilibrium was found: {simulation.why}." if simulation.force and simulation.why else "",
    ]
    return [printable(line) for line in lines if line]


def fill_template(name: str, **values: Any) -> str:
    """Fill in a template; floats get the shortest text that is read back exactly."""
    return str(_templates().get_template(f"{name}.jinja").render(values))


@cache
def _templates() -> Any:
    import jinja2
    from markupsafe import Markup

    made = jinja2.Environment(
        loader=jinja2.PackageLoader(__package__, "templates"),
        autoescape=lambda name: str(name).endswith(".xml.jinja"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters["comment"] = lambda line: Markup(f"<!-- {xml_comment(line)} -->")  # the one text without entities
    return made


def numbers(values: np.ndarray) -> str:
    """Numbers of an array in a row, each in the shortest text that is read back exactly."""
    return " ".join(map(repr, values.ravel().tolist()))
