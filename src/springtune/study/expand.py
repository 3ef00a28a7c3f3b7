"""From the sections of a study to all that they ask for."""

import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, TypeVar, cast

from ..mesh import MESH_TYPES
from ..mesh.formats import LARGEST_FILE
from ..problem.geometry import Beam
from ..problem.loads import KINEMATICS, LOADS
from ..problem.materials import Material
from ..springs import DEFINITIONS
from ..springs.lattice import COEFFICIENT
from .checks import check_cells, check_files, mesh_type_names, stated_rows
from .config import StudyConfig
from .messages import Problems
from .model import FURTHER_REFERENCES, CurveSpec, Grid, MeshFiles, MeshSpec, Reference, SceneSpec, Study, StudyKind
from .printed import read_printed

Ranks = dict[str, dict[str, int]]
"""Place of each label in the order of its dimension."""

Item = TypeVar("Item", MeshSpec, SceneSpec, CurveSpec, Reference)


def files_of_meshes(config: StudyConfig, folder: Path, problems: Problems) -> MeshFiles:
    """Meshes from files by (mesh type, beam's name, mesh size)."""
    found: MeshFiles = {}
    beams = declared(config).beams
    for name, rows in (config.mesh_files or {}).items():
        for number, row in enumerate(rows):
            path, label = folder / row.file, (name, row.beam, row.mesh_size)
            where = ("mesh_files", name, number)
            fault = _file_fault(path)
            if fault:
                problems.add((*where, "file"), f"'{path}' {fault}")
            if label in found:
                problems.add(where, f"a second file for beam '{row.beam}' at this mesh size; remove one")
            found[label] = MeshSpec(beams[row.beam], name, row.mesh_size, path, row.unit)
    problems.stop()
    return found


def _file_fault(path: Path) -> str:
    """Why a mesh file cannot be what is meant, and the remedy; empty where it may be. Its content is not looked at."""
    try:
        if path.is_file():
            if path.stat().st_size > LARGEST_FILE:
                return f"is larger than {LARGEST_FILE // 1_000_000} MB, the most that is read; write a coarser mesh"
            return "" if os.access(path, os.R_OK) else "may not be read; change its permissions"
    except (OSError, ValueError):  # a name that no file can have
        pass
    return "is not a file; give its path relative to the study's folder"


@dataclass(frozen=True)
class Declared:
    """Bodies and materials that a study declares, by name.

    Attributes
    ----------
    beams : dict of str to Beam
    materials : dict of str to Material
    """

    beams: dict[str, Beam]
    materials: dict[str, Material]


def declared(config: StudyConfig) -> Declared:
    """What a study declares.

    Parameters
    ----------
    config : StudyConfig

    Returns
    -------
    Declared
    """
    return Declared(
        {name: Beam(beam.length, beam.height, beam.thickness, name) for name, beam in config.beams.items()},
        {
            name: Material(material.young_modulus, material.poisson_ratio, material.density, name)
            for name, material in config.materials.items()
        },
    )


def _ranks(config: StudyConfig) -> Ranks:
    """Place of each label in the order of its dimension."""
    names: dict[str, Iterable[str]] = {
        "beam": config.beams,
        "mesh_type": mesh_type_names(config),
        "material": config.materials,
        "load": LOADS,
        "definition": DEFINITIONS,
        "kinematics": KINEMATICS,
    }
    return {dimension: {name: rank for rank, name in enumerate(labels)} for dimension, labels in names.items()}


def _order(ranks: Ranks) -> Callable[[MeshSpec | SceneSpec | CurveSpec | Reference], list[float]]:
    """Sort key of meshes, scenes, curves and references."""

    def key(item: MeshSpec | SceneSpec | CurveSpec | Reference) -> list[float]:
        mesh = item if isinstance(item, MeshSpec) else None if isinstance(item, Reference) else item.mesh
        beam = item.beam if isinstance(item, MeshSpec | Reference) else item.mesh.beam
        found: list[float] = [ranks["beam"][beam.name]]
        if mesh:
            found += [ranks["mesh_type"][mesh.mesh_type], mesh.mesh_size]
        if not isinstance(item, MeshSpec):
            found += [ranks["material"][item.material.name], ranks["load"][item.load]]
            for label in ("definition", "kinematics"):
                if hasattr(item, label):
                    found.append(ranks[label][getattr(item, label)])
        return found

    return key


def expand(config: StudyConfig, mesh_files: MeshFiles, problems: Problems) -> tuple[Grid, ...]:
    """Grids with their scenes and curves, in canonical order."""
    order = _order(_ranks(config))
    beams, materials = declared(config).beams, declared(config).materials
    forces: dict[tuple[str, str, str], tuple[float, str]] = {}
    grids = []
    for name, grid in config.grids.items():
        scenes: list[SceneSpec] = []
        curves: list[CurveSpec] = []
        absent = set()
        for beam, material, load in product(grid.beam, grid.material, grid.load):
            if grid.pressure is not None:
                magnitude = grid.pressure * beams[beam].length * beams[beam].thickness
            else:
                given = cast("dict[str | None, float]", grid.force)  # see `PerBeam`
                magnitude = given[beam if beam in given else None]
            other, other_grid = forces.setdefault((beam, material, load), (magnitude, name))
            if other != magnitude:
                problems.add(
                    ("grids", name, "force"),
                    f"{magnitude:g} N on beam '{beam}' of {material} in {load}, but grid '{other_grid}' has "
                    f"{other:g} N; give both the same force, or the other one a study of its own",
                )
            force = LOADS[load].sign * magnitude
            for mesh_type, size, kinematics in product(grid.mesh_type, grid.mesh_size, grid.kinematics):
                mesh = MeshSpec(beams[beam], mesh_type, size)
                if mesh_type not in MESH_TYPES:
                    if (mesh_type, beam, size) not in mesh_files:
                        absent.add((mesh_type, beam, f"{1e3 * size:g} mm"))
                        continue
                    mesh = mesh_files[mesh_type, beam, size]
                common = (mesh, materials[material], load, force)
                scenes += [SceneSpec(*common, definition, kinematics) for definition in grid.definition]
                if grid.sensitivity and not LOADS[load].follower:  # k enters as F/k only where forces stay
                    curves.append(CurveSpec(*common, kinematics))
        for mesh_type, beam, length in sorted(absent):
            row = f"{{file: <path>, beam: {beam}, mesh_size: {length}}}"
            problems.add(("grids", name, "mesh_size"), f"no file for {length}; add {row} to mesh_files.{mesh_type}")
        grids.append(Grid(name, tuple(sorted(scenes, key=order)), tuple(sorted(curves, key=order))))
    problems.stop()
    return tuple(grids)


def _calibrating(config: StudyConfig, scenes: Sequence[SceneSpec], problems: Problems) -> list[CurveSpec]:
    """Curves that calibrate the scenes of the definition ``calibrated``."""
    calibration = config.definitions.calibrated
    if not calibration:
        return []
    cells = {
        (scene.mesh, scene.material, scene.load, scene.force): None
        for scene in scenes
        if (scene.mesh.beam.name, scene.load) == (calibration.beam, calibration.load)
    }
    needed = {
        (scene.mesh.mesh_type, scene.material, scene.kinematics): None
        for scene in scenes
        if scene.definition == "calibrated"
    }
    groups: dict[tuple[str, Material], list[tuple[MeshSpec, Material, str, float]]] = {}
    for cell in cells:
        groups.setdefault((cell[0].mesh_type, cell[1]), []).append(cell)
    curves: list[CurveSpec] = []
    for mesh_type, material, kinematics in needed:
        found = [CurveSpec(*cell, kinematics) for cell in groups.get((mesh_type, material), ())]
        if not found:
            problems.add(
                ("definitions", "calibrated"),
                f"no grid has beam '{calibration.beam}' in {calibration.load} on {mesh_type} meshes of {material.name}"
                ", but scenes there are 'calibrated'; add it to a grid, or calibrate on another beam or load",
            )
        curves += found
    return curves


def build(
    config: StudyConfig, grids: tuple[Grid, ...], kinds: Sequence[StudyKind], problems: Problems, about: dict[str, Any]
) -> Study:
    """Study of a config and its grids, with the parts of all study kinds."""
    ranks = _ranks(config)
    order = _order(ranks)

    def in_order(items: Iterable[Item]) -> tuple[Item, ...]:
        return tuple(sorted(dict.fromkeys(items), key=order))

    scenes = in_order(scene for grid in grids for scene in grid.scenes)
    curves = [curve for grid in grids for curve in grid.curves] + _calibrating(config, scenes, problems)
    meshes = in_order(scene.mesh for scene in scenes)
    references = in_order(Reference(scene.mesh.beam, scene.material, scene.load, scene.force) for scene in scenes)
    check_files(meshes, scenes, references, problems)
    problems.stop()
    check_cells(config, meshes, scenes, curves, problems)
    problems.stop()
    parts = {kind.name: kind.expand(config, declared(config)) for kind in kinds}
    names = [output.name for kind in kinds for output in kind.outputs]
    first, last, points = config.sensitivity.start, config.sensitivity.stop, config.sensitivity.points
    steps = [first + (last - first) * step / (points - 1) for step in range(points)]
    calibrated = config.definitions.calibrated
    study = Study(
        title=config.title,
        meshes=meshes,
        scenes=scenes,
        curves=in_order(curves),
        references=references,
        outputs=tuple(name for name in names if name in config.outputs),
        further_references=tuple(name for name in FURTHER_REFERENCES if name in config.further_references),
        parts=parts,
        limits={"seconds": config.limits.seconds, "memory": config.limits.memory},
        grids=grids,
        stiffness_ratios=tuple(COEFFICIENT * step for step in steps),
        stiffness_table={(row.mesh_type, row.material): row.value for row in stated_rows(config)},
        calibration=(calibrated.beam, calibrated.load) if calibrated else None,
        printed=read_printed(about["printed_path"], mesh_type_names(config), problems) if about["printed_path"] else (),
        axes=_axes(ranks, meshes, scenes, [kind.axes(parts[kind.name]) for kind in kinds if parts[kind.name]]),
        **about,
    )
    for output in (output for kind in kinds for output in kind.outputs if output.name in study.outputs):
        lack = output.lack(study)
        if lack:
            problems.add(("outputs",), f"'{output.name}' {lack}")
    problems.stop()
    return study


def _axes(
    ranks: Ranks,
    meshes: Iterable[MeshSpec],
    scenes: Sequence[SceneSpec],
    further: Iterable[Mapping[str, Collection[str | float]]],
) -> dict[str, tuple[str | float, ...]]:
    """Labels of each dimension; groups of a dataset share those that its root has."""
    used = {name: {getattr(scene, name) for scene in scenes} for name in ("load", "definition", "kinematics")}
    used["beam"] = {mesh.beam.name for mesh in meshes}
    used["mesh_type"] = {mesh.mesh_type for mesh in meshes}
    used["material"] = {scene.material.name for scene in scenes}
    used["mesh_size"] = {mesh.mesh_size for mesh in meshes}
    own = {}
    for labels in further:
        for name, values in labels.items():
            if name in used:
                used[name] |= set(values)
            else:
                own[name] = values
    axes = {name: tuple(label for label in ranks[name] if label in used[name]) for name in ranks}
    return axes | {"mesh_size": tuple(sorted(used["mesh_size"]))} | own
