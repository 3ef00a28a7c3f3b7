"""Constraints for extended position-based dynamics (XPBD), as JSON.

A spring is the distance constraint ``C = l - L`` with the compliance 1/k [m/N] (Macklin, Mueller, Chentanez, XPBD,
Motion in Games 2016). Other energies are blocks of constraints C of a cell with compliances A and ``W = C A^-1 C / 2``,
exact at any strain. With F the deformation gradient of a triangle and J its area over the one at rest,

    D = tr F^T F - 2 J = (F_xx - F_yy)^2 + (F_xy + F_yx)^2,    2 J + J^-2 - 3 = (J - 1)^2 (2 J + 1) / J^2,

so a neo-Hookean sheet is three constraints that vanish at rest and have one compliance; derived here. Macklin and
Mueller (A constraint-based formulation of stable neo-Hookean materials, Motion, Interaction and Games 2021) have
another law, equal to ours at small strain alone.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..mechanics.energies import area_slopes
from .simulation import VALUES, Net, Terms, fill_template, simulate

OWN_UNITS = {"rest_slope": "1/m", "stiffening": "1"}  # units of what the terms of an energy do not have

COMPLIANCE_UNITS = {"area": "m3/N", "biquadratic": "m3/N", "incompressible": "1/(N m)", "compressible": "1/(N m)"}


MESH_REMEDY = "take a mesh with less slender or obtuse cells"


@dataclass(frozen=True, eq=False)
class Blocks:
    """Constraints of cells of one kind: `compliance` is (n_cells, m, m), `values` have a row for each cell."""

    kind: str
    cells: np.ndarray
    compliance: np.ndarray
    values: Mapping[str, np.ndarray]


def blocks(net: Net) -> list[Blocks]:
    """Constraints of the energies besides springs; ValueError if a spring or an energy has no positive compliance."""
    _check_positive(net, net.stiffness, "springs have a negative stiffness")
    return [_blocks(net, terms) for terms in net.energies]


def compliances(net: Net) -> dict[str, Any]:
    """Compliances of springs and of blocks, by name; infinite where a definition gives an edge no spring."""
    with np.errstate(divide="ignore"):
        found: dict[str, Any] = {"compliance": 1 / net.stiffness} if np.any(net.stiffness) else {}
    return found | {f"{one.kind} compliance": one.compliance for one in blocks(net)}


def _check_positive(net: Net, values: np.ndarray, which: str, remedy: str = MESH_REMEDY) -> None:
    negative = int((values < 0).sum())
    if negative:
        why = f"{negative} of {len(values)} {which}, and no compliance of XPBD is negative"
        remedy += ", or 'patch' or 'lattice', whose springs all pull"
        raise ValueError(f"definition '{net.header['definition']}': {why}; {remedy}")


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
        _check_positive(net, least - 1e-12 * most, "triangles have squared lengths that are not stable by themselves")
        return Blocks(kind, cells, np.linalg.inv(stiffness), {"rest_length": values["rest_length"]})
    areas = values["rest_area"]
    if kind == "area":
        which = "areas have a negative modulus: springs alone have a Poisson's ratio of 1/3, the material a smaller one"
        _check_positive(net, values["modulus"], which, "take 'delingette'")
        return Blocks(kind, cells, (areas / values["modulus"])[:, None, None], {"rest_area": areas})
    slopes = area_slopes(net.points[cells].transpose(2, 1, 0)).transpose(2, 1, 0) / areas[:, None, None]
    kept = {"rest_area": areas, "rest_slope": slopes}
    if kind == "compressible":
        modulus, kept = values["shear"], kept | {name: values[name] for name in ("shear", "bulk")}
    else:
        modulus = 2 * values["c1"]
        kept["stiffening"] = np.column_stack([values["c2"], values["c3"]]) / values["c1"][:, None]
    _check_positive(net, modulus, "triangles of rubber have a negative modulus")
    if kind == "incompressible":
        second, third = kept["stiffening"].T
        # The least factor on C, over all strains.
        least = np.where(second < 0, 1 - second**2 / (4 * np.maximum(third, 1e-300)), np.minimum(third, 0))
        _check_positive(net, least, "triangles of rubber soften until they have no energy")
    return Blocks(kind, cells, np.eye(3) / (modulus * areas)[:, None, None], kept)


def xpbd(net: Net) -> str:
    """Return particles and constraints of a net for XPBD, as JSON."""
    simulation = simulate(net, "XPBD", COMPLIANCE_UNITS)
    there, whole = net.stiffness > 0, np.asarray(net.held.all(axis=1))
    return fill_template(
        "xpbd.json",
        dumps=json.dumps,
        header=dict(net.header) | {"springs_without_stiffness_left_out": int((~there).sum())},
        net=net,
        simulation=simulation,
        sweeps=max(10, int((2 * simulation.implicit_step / simulation.largest_step) ** 2)),
        calibrated=net.header.get("calibrated"),
        there=there,
        inverse_masses=np.where(whole, 0.0, 1 / simulation.masses),
        held_directions=np.argwhere(net.held & ~whole[:, None]),
        cell_constraints=[(one.kind, _entries(one)) for one in blocks(net)],
    )


def _entries(one: Blocks) -> dict[str, Any]:
    """Entries of a file for blocks of a kind, besides the kind and its formulas."""
    units = {name: VALUES[one.kind].get(name) or OWN_UNITS[name] for name in one.values}
    return {
        "units": units | {"compliance": COMPLIANCE_UNITS[one.kind]},
        "particles": one.cells.tolist(),
        **{name: values.tolist() for name, values in one.values.items()},
        "compliance": one.compliance.tolist(),
    }
