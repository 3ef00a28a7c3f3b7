"""Constraints for extended position-based dynamics (XPBD), as JSON.

A spring is the distance constraint ``C = l - L`` with the compliance 1/k [m/N] (Macklin, Mueller, Chentanez, XPBD,
Motion in Games 2016): where a solver has converged, the constraint pulls with C over its compliance, for any step.

Other energies are blocks of constraints C of a cell with a matrix of compliances A, so that ``W = C A^-1 C / 2`` is the
energy itself, at any strain: areas, Delingette's squared lengths, and rubber. With F the deformation gradient of a
triangle and J its area over the one at rest,

    D = tr F^T F - 2 J = (F_xx - F_yy)^2 + (F_xy + F_yx)^2,    2 J + J^-2 - 3 = (J - 1)^2 (2 J + 1) / J^2,

so a neo-Hookean sheet is three constraints that vanish at rest and have one compliance. That is derived here. Macklin
and Mueller (A constraint-based formulation of stable neo-Hookean materials, Motion, Interaction and Games 2021) take
tr F^T F and J for constraints; their law is another one, equal to ours at small strain alone.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..mechanics.energies import area_slopes
from .simulation import simulate
from .terms import VALUES, Net, Terms

CONTENT = {
    "points": "particles at rest [m]",
    "inverse_masses": "of the particles [1/kg]; 0 where a particle is held",
    "held_directions": "particle and axis of directions that are held, of particles that are not held as a whole",
    "forces": "of the load on each particle [N]",
    "constraints": "C = distance of the particles - rest_lengths [m], with compliance [m/N]; one list each",
    "cell_constraints": "blocks of constraints C of triangles or quadrilaterals, particles counter-clockwise, in lists "
    "with an entry for each cell; formulas say what C is, compliance is a matrix A for each cell, and the energy is C "
    "A^-1 C / 2. A projection adds dl = -(G W G^T + A / h^2)^-1 (C + A l / h^2) to the multipliers l of a block, which "
    "begin each step at 0, and W G^T dl to the positions: h is the time step, G the derivative of C by the positions, "
    "W the inverse masses, 0 for what is held",
    "time_step": "a fiftieth of the slowest period that the load excites [s]; XPBD is stable in any, and converges the "
    "sooner the shorter it is",
    "mass_damping": "damping over mass that is critical for the lowest frequency, or under large tension up to the "
    "loaded one [1/s]; velocities go down to their share 1 / (1 + mass_damping * time_step) in each step",
    "displacements": "where the load brings the particles in the end [m]; null where there is no stable equilibrium",
}
"""What each entry of a file is."""

_GRADIENT = {
    "F": "F_ab = sum over particles of position_a rest_slope_b, the deformation gradient",
    "J": "area of the triangle / rest_area",
}

_DILATION = "(r - 1) sqrt(2 r + 1) / r"

CONSTRAINTS: dict[str, dict[str, str]] = {
    "area": {"C": "(A - rest_area), A the area of the cell"},
    "biquadratic": {"C": "(l_i^2 - rest_length_i^2) for i = 0, 1, 2, l_i the side opposite particle i"},
    "incompressible": _GRADIENT
    | {
        "B": f"(F_xx - F_yy, F_xy + F_yx, {_DILATION}) with r = J",
        "e": "B_0^2 + B_1^2 + B_2^2",
        "C": "B sqrt(1 + stiffening_0 e + stiffening_1 e^2)",
    },
    "compressible": _GRADIENT
    | {
        "v": "where shear/2 (tr(F^T F) exp(-2 v/3) + J^-2 exp(4 v/3)) + bulk/2 (exp(v) - 1)^2 has its minimum; it is "
        "found in each projection, and held in the derivatives of C",
        "C": f"(p (F_xx - F_yy), p (F_xy + F_yx), {_DILATION}) with p = exp(-v/3), r = J p^2; the energy has bulk "
        "rest_area/2 (exp(v) - 1)^2 besides, which pulls on nothing",
    },
}
"""Constraints of a cell by kind of its energy."""

OWN_UNITS = {"rest_slope": "1/m", "stiffening": "1"}
"""Units of what the terms of an energy do not have."""

COMPLIANCE_UNITS = {"area": "m3/N", "biquadratic": "m3/N", "incompressible": "1/(N m)", "compressible": "1/(N m)"}


@dataclass(frozen=True, eq=False)
class Blocks:
    """Constraints of cells of one kind: `compliance` is (n_cells, m, m), `values` have a row for each cell."""

    kind: str
    cells: np.ndarray
    compliance: np.ndarray
    values: Mapping[str, np.ndarray]


def blocks(net: Net) -> list[Blocks]:
    """Constraints of the energies besides springs; ValueError if a spring or an energy has no positive compliance."""
    _check_positive(net, net.stiffness, "springs have a negative stiffness", len(net.springs))
    return [_blocks(net, terms) for terms in net.energies]


def compliances(net: Net) -> dict[str, Any]:
    """Compliances of springs and of blocks, by name; infinite where a definition gives an edge no spring."""
    with np.errstate(divide="ignore"):
        found: dict[str, Any] = {"compliance": 1 / net.stiffness} if np.any(net.stiffness) else {}
    return found | {f"{one.kind} compliance": one.compliance for one in blocks(net)}


def _check_positive(net: Net, values: np.ndarray, which: str, count: int) -> None:
    negative = int((values < 0).sum())
    if negative:
        raise ValueError(
            f"definition '{net.header['definition']}': {negative} of {count} {which}, and no compliance of XPBD is "
            "negative; take a mesh with less slender or obtuse cells, or 'patch' or 'lattice', whose springs all pull"
        )


def _blocks(net: Net, terms: Terms) -> Blocks:
    kind, there = terms.kind, terms.present
    cells, values = terms.cells[there], {name: one[there] for name, one in terms.values.items()}
    if kind == "biquadratic":
        corners = np.arange(3)
        stiffness = np.zeros((len(cells), 3, 3))
        stiffness[:, corners, corners] = values["tensile"] / 2
        for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
            stiffness[:, j, k] = stiffness[:, k, j] = values["coupling"][:, i] / 2
        least, _, most = np.linalg.eigvalsh(stiffness).T
        which = "triangles have squared lengths that are not stable by themselves"
        _check_positive(net, least - 1e-12 * most, which, len(cells))
        return Blocks(kind, cells, np.linalg.inv(stiffness), {"rest_length": values["rest_length"]})
    areas = values["rest_area"]
    if kind == "area":
        _check_positive(net, values["modulus"], "areas have a negative modulus", len(cells))
        return Blocks(kind, cells, (areas / values["modulus"])[:, None, None], {"rest_area": areas})
    slopes = area_slopes(net.points[cells].transpose(2, 1, 0)).transpose(2, 1, 0) / areas[:, None, None]
    kept = {"rest_area": areas, "rest_slope": slopes}
    if kind == "compressible":
        modulus, kept = values["shear"], kept | {name: values[name] for name in ("shear", "bulk")}
    else:
        modulus = 2 * values["c1"]
        kept["stiffening"] = np.column_stack([values["c2"], values["c3"]]) / values["c1"][:, None]
    _check_positive(net, modulus, "triangles of rubber have a negative modulus", len(cells))
    if kind == "incompressible":
        second, third = kept["stiffening"].T
        # The least factor on C, over all strains.
        least = np.where(second < 0, 1 - second**2 / (4 * np.maximum(third, 1e-300)), np.minimum(third, 0))
        _check_positive(net, least, "triangles of rubber soften until they have no energy", len(cells))
    return Blocks(kind, cells, np.eye(3) / (modulus * areas)[:, None, None], kept)


def xpbd(net: Net) -> str:
    """Particles and constraints of a net for XPBD.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("40 mm", "20 mm"), st.Material("210 GPa", 0.3, density="7850 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "right", "20 mm"), steel, "traction", "1 kN", definition="lattice")
    >>> [path] = scene.springs.write("net.xpbd.json")
    >>> found = json.loads(path.read_text())
    >>> found["inverse_masses"][0], f"{found['constraints']['compliance'][0]:.3g} m/N"
    (0.0, '1.1e-08 m/N')
    """
    simulation = simulate(net, "XPBD", CONSTRAINTS)
    of_cells = blocks(net)
    there = net.stiffness > 0
    whole = np.asarray(net.held.all(axis=1))
    displacements = simulation.displacements
    content: dict[str, Any] = {
        "header": dict(net.header) | {"springs_without_stiffness_left_out": int((~there).sum())},
        "content": CONTENT,
        "points": net.points.tolist(),
        "inverse_masses": np.where(whole, 0.0, 1 / simulation.masses).tolist(),
        "held_directions": np.argwhere(net.held & ~np.repeat(whole[:, None], 2, axis=1)).tolist(),
        "forces": net.forces.tolist(),
        "constraints": {
            "particles": net.springs[there].tolist(),
            "rest_lengths": net.rest_lengths[there].tolist(),
            "compliance": (1 / net.stiffness[there]).tolist(),
        },
        "cell_constraints": [_as_json(one) for one in of_cells],
        "time_step": simulation.implicit_step,
        "mass_damping": simulation.mass_damping,
        "displacements": None if displacements is None else displacements.tolist(),
    }
    # An entry a line: rows of their own would make most of the file blanks.
    lines = [f" {json.dumps(key)}: {json.dumps(value)}" for key, value in content.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _as_json(one: Blocks) -> dict[str, Any]:
    units = {name: VALUES[one.kind].get(name) or OWN_UNITS[name] for name in one.values}
    return {
        "kind": one.kind,
        "formulas": CONSTRAINTS[one.kind],
        "units": units | {"compliance": COMPLIANCE_UNITS[one.kind]},
        "particles": one.cells.tolist(),
        **{name: values.tolist() for name, values in one.values.items()},
        "compliance": one.compliance.tolist(),
    }
