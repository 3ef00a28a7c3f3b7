"""Pieces of the scenes and curves of a study, see `springtune.studies.kinds.division`."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from ...config.model import CurveSpec, SceneSpec
from .plan import particles, stem

if TYPE_CHECKING:
    from ...config.model import Study
    from ...runs.plan import Costs
    from ..division import Division, Name

Asked = SceneSpec | CurveSpec

Item = TypeVar("Item")


def pieces(study: "Study", costs: "Costs", division: "Division") -> "dict[Name, float]":
    """Seconds of each piece: of a mesh's scenes and curves, of a part of them, or of a grid's."""
    if division.by == "grid":
        return {("grid", name): sum(_seconds(one, costs) for one in items) for name, items in _by_grid(study).items()}
    found: dict[Name, float] = {}
    for name, items in _by_stem(study).items():
        each = [_seconds(one, costs) for one in items]
        meshed = costs.of("mesh", particles(items[0].mesh))
        count = division.pieces(sum(each), len(each))
        for number in range(count):
            found[name, number, count] = meshed + sum(_slice(each, number, count))
    return found


def take(study: "Study", names: "Iterable[Name]") -> "Study":
    """The study with some of its pieces, and what these need, alone."""
    by_grid, by_stem = _by_grid(study), _by_stem(study)
    chosen: set[Asked] = set()
    for first, *rest in names:
        chosen.update(by_grid[str(rest[0])] if first == "grid" else _slice(by_stem[str(first)], *map(int, rest)))
    return of_scenes(study, chosen)


def of_scenes(study: "Study", chosen: "Collection[object]") -> "Study":
    """A study of a few scenes and curves of another one, and of what these need."""
    scenes = tuple(scene for scene in study.scenes if scene in chosen)
    groups = {
        (scene.mesh.mesh_type, scene.material, scene.kinematics) for scene in scenes if scene.definition == "calibrated"
    }
    curves = tuple(curve for curve in study.curves if curve in chosen or _calibrates(study, curve, groups))
    asked: list[Asked] = [*scenes, *curves]
    bodies = {(one.mesh.beam, one.material, one.load, one.force) for one in asked}
    meshes = {one.mesh for one in asked}
    return replace(
        study,
        scenes=scenes,
        curves=curves,
        meshes=tuple(mesh for mesh in study.meshes if mesh in meshes),
        references=tuple(one for one in study.references if (one.beam, one.material, one.load, one.force) in bodies),
        parts=study.parts | {"scenes": study.parts["scenes"] if asked else ()},
    )


def _calibrates(study: "Study", curve: CurveSpec, groups: "Collection[tuple[object, ...]]") -> bool:
    """Whether the stiffness of one of these groups of scenes is calibrated by a curve."""
    where = curve.mesh.beam.name, curve.load
    return where == study.calibration and (curve.mesh.mesh_type, curve.material, curve.kinematics) in groups


def _by_grid(study: "Study") -> "dict[str, list[Asked]]":
    """Scenes and curves by the first grid that asks for them."""
    found: dict[Asked, str] = {}
    for grid in study.grids:
        asked: tuple[Asked, ...] = (*grid.curves, *grid.scenes)
        for one in asked:
            found.setdefault(one, grid.name)
    grids: dict[str, list[Asked]] = defaultdict(list)
    for one, name in found.items():
        grids[name].append(one)
    return grids


def _by_stem(study: "Study") -> "dict[str, list[Asked]]":
    """Scenes and curves by the file of their mesh, which sheets of several thicknesses share."""
    found: dict[str, list[Asked]] = defaultdict(list)
    asked: tuple[Asked, ...] = (*study.curves, *study.scenes)
    for one in asked:
        found[stem(one.mesh)].append(one)
    return found


def _slice(items: "Sequence[Item]", number: int, count: int) -> "Sequence[Item]":
    """One of so many pieces, in order, of items."""
    return items[len(items) * number // count : len(items) * (number + 1) // count]


def _seconds(one: Asked, costs: "Costs") -> float:
    """What a scene or a curve is expected to take."""
    count = particles(one.mesh)
    if isinstance(one, CurveSpec):
        return costs.of("curve", count)
    return costs.of(one.kinematics, count) + costs.of(one.definition, count)
