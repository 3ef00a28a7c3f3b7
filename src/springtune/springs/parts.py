"""Springs of a body of several materials: a definition on each part, added up.

Parts of one material are one body, derived as if alone; then

- springs between two materials are the sum of both sides' outline springs. This is exact for definitions that give
  each cell's share to its edges, such as half weight on the outline: equal materials give what one material gives;
- energies of one kind are joined over all parts, over the first part's reference stiffness;
- a definition of one stiffness gives each part its own, and springs between parts the mean.

`patch`, `patch-area` and `adjoint` test each part alone, and `density` and `oriented` count each part's own springs:
with equal materials they give nearly what one material gives.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..mesh.cells import Mesh, no_cells
from ..mesh.sheets import GroupedMesh, part_names
from ..problem.materials import AnyMaterial
from .base import DefinitionError, Springs


def derive_by_parts(
    definition: Any, grouped: GroupedMesh, materials: Mapping[str, AnyMaterial], thickness: float, given: object = None
) -> Springs:
    """Return the springs of a body with parts of several materials, by a definition or the user's own function."""
    mesh, labels = grouped.mesh, part_names(grouped)
    groups: dict[AnyMaterial, list[str]] = {}
    for name in ("", *grouped.parts):
        if any((names == name).any() for names in labels.values()):
            groups.setdefault(materials[name], []).append(name)
    if len(groups) == 1:
        return definition.springs(mesh, next(iter(groups)), thickness, given)
    if definition.needs or definition.uniaxial:
        why = "needs a given stiffness" if definition.needs == "stiffness" else "needs the response of the whole body"
        why = "is for sheets of one stress" if definition.uniaxial else why
        remedy = "choose one that derives each part's springs, such as 'van-gelder', 'area' or 'delingette'"
        raise DefinitionError(f"{why} and the body has {len(groups)} materials; {remedy}")
    found: list[tuple[Springs, np.ndarray, dict[int, np.ndarray]]] = []
    for material, names in groups.items():
        cells = {count: np.isin(labels[count], names) for count in mesh.cells}
        part, edges = _part(mesh, cells)
        try:
            found.append((definition.springs(part, material, thickness), edges, cells))
        except DefinitionError as error:
            shown = " and ".join(repr(name) if name else "the main part" for name in names)
            raise DefinitionError(f"on {shown}: {error}") from None
    return _sum(mesh, found, definition.uniform)


def _part(mesh: Mesh, cells: Mapping[int, np.ndarray]) -> tuple[Mesh, np.ndarray]:
    """Mesh of some cells, its particles in the order of the whole one's, and the edge of that for each of its own."""
    chosen = {count: corners[cells[count]] for count, corners in mesh.cells.items()}
    particles = np.unique(np.concatenate([corners.ravel() for corners in chosen.values()]))
    cells_of = (np.searchsorted(particles, chosen.get(count, no_cells(count))) for count in (3, 4))
    part = Mesh(mesh.points[particles], *cells_of)
    codes = particles[part.edges] @ [len(mesh.points), 1]
    return part, np.searchsorted(mesh.edges @ [len(mesh.points), 1], codes)


def _sum(mesh: Mesh, found: list[tuple[Springs, np.ndarray, dict[int, np.ndarray]]], uniform: bool) -> Springs:
    """Springs of all parts over the first one's reference stiffness."""
    reference, count = found[0][0].reference, len(mesh.edges)
    relative, linear, owners = np.zeros(count), np.zeros(count), np.zeros(count)
    energies: dict[tuple[object, ...], list[tuple[Any, np.ndarray, float]]] = {}
    for springs, edges, cells in found:
        scale = springs.reference / reference
        relative[edges] += scale * springs.relative
        linear[edges] += scale * (springs.relative if springs.linear_springs is None else springs.linear_springs)
        owners[edges] += 1
        kinds: list[tuple[object, ...]] = []
        for energy in springs.energies:
            corners = energy.corners.shape[1]
            kind = type(energy), corners, *_law(energy)
            energies.setdefault((*kind, kinds.count(kind)), []).append((energy, np.flatnonzero(cells[corners]), scale))
            kinds.append(kind)
    if uniform:
        relative, linear = relative / owners, linear / owners
    lawful = any(springs.linear_springs is not None for springs, _, _ in found)
    together = tuple(_joined(mesh, parts) for parts in energies.values())
    evaluations = sum(springs.evaluations for springs, _, _ in found)
    return Springs(reference, relative, together, evaluations=evaluations, linear_springs=linear if lawful else None)


def _law(energy: Any) -> tuple[object, ...]:
    """Return what energies of one kind must share to be joined; rubber laws may differ in terms and range of data."""
    values = [value for name, value in energy.moduli.items() if name not in ("coefficients", "largest")]
    return tuple(value.shape[1:] if isinstance(value, np.ndarray) else value for value in values if value is not None)


def _joined(mesh: Mesh, parts: list[tuple[Any, np.ndarray, float]]) -> Any:
    """Join the energies of several parts: each with its cells in the whole mesh, and the factor on its moduli."""
    first = parts[0][0]
    if any(len(energy.corners) != len(where) for energy, where, _ in parts):
        raise DefinitionError("has an energy of some cells alone; derive it for one material")
    cells = np.concatenate([where for _, where, _ in parts])
    order = np.argsort(cells)
    moduli: dict[str, Any] = {}
    for name in first.moduli:
        own = [energy.moduli[name] for energy, _, _ in parts]
        if name == "largest":  # a range of data, not a modulus
            own = [np.broadcast_to(one, len(where)) for one, (_, where, _) in zip(own, parts)]
        elif own[0] is None:  # and so in all parts, see `_law`
            continue
        else:  # what an energy has besides its cells is in proportion to its stiffness
            own = [scale * one for one, (_, _, scale) in zip(own, parts)]
        if name == "coefficients":  # of laws with fewer terms the others are zero
            most = max(one.shape[1] for one in own)
            own = [np.pad(one, ((0, 0), (0, most - one.shape[1]))) for one in own]
        moduli[name] = np.concatenate(own)[order]
    corners = mesh.cells[first.corners.shape[1]][cells[order]]
    return replace(first, points=mesh.points, corners=corners, **moduli)
