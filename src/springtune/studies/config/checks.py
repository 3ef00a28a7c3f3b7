"""Checks that the values of a study agree with each other."""

import math
import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

from springtune.mesh.cells import MESH_TYPES, too_many
from springtune.problem.loads import LOADS
from springtune.problem.materials import INCOMPRESSIBLE_REASON
from springtune.problem.quantities import MOST_SCENES, MOST_SCENES_VARIABLE
from springtune.safe_io import number_text
from springtune.springs.base import DEFINITIONS
from springtune.springs.lattice import COEFFICIENT

from .messages import Key, Problems, part_of, show
from .model import Grid
from .sections import GRID_PARAMETERS, SAME_VALUE, StatedStiffness, StudyConfig, factors

Place = Sequence[Key]  # path in a study

Names = Iterable[str]

PLAUSIBLE_FACTOR = 20.0
"""Factor on sqrt(3)/2 E t beyond which a stated stiffness is an error of units, as the paper's 170E6 N/mm."""

MOST_CELLS = 2_500_000  # limit of label combinations over all dimensions, requested or not

MOST_CURVE_POINTS = 10_000_000

FEWER_REMEDY = "give shorter lists, or split the study into several"

MORE_SCENES_REMEDY = f"or allow more by {MOST_SCENES_VARIABLE} in the environment"

DEFINITION_REMEDY = "take another definition, or give each a grid of its own"


# -- names -------------------------------------------------------------------------------------------------------------


def check_beam_material(problems: Problems, path: Place, name: str, config: StudyConfig) -> None:
    """Check that a beam material is isotropic."""
    given = config.materials[name]
    if given.young_modulus is None and given.uniaxial_test is None:
        why = f"'{name}' is anisotropic, and beams are of isotropic materials, as their references are"
        problems.add(path, f"{why}; put the sheet under 'shapes', whose references take any material")


def check_density(config: StudyConfig, name: str, path: Place, problems: Problems) -> None:
    """Check that a declared material has a density."""
    if config.materials[name].density is None:
        problems.add(path, f"'{name}' has no density; add one to it under materials, such as density: 7850 kg/m^3")


def check_scene(
    problems: Problems, path: Place, scene: Any, config: StudyConfig, able: Callable[[str], bool], why: str
) -> None:
    """Check that the material of a scene is isotropic with a density, and that its load is supported."""
    check_beam_material(problems, (*path, "material"), scene.material, config)
    check_density(config, scene.material, (*path, "material"), problems)
    if not able(scene.load):
        problems.add((*path, "load"), f"'{scene.load}' {why}; choose of {', '.join(filter(able, LOADS))}")


def stated_rows(config: StudyConfig) -> list[StatedStiffness]:
    """Rows of stated stiffnesses of a study; empty without the definition `paper`."""
    return config.definitions.paper.stiffness if config.definitions.paper else []


def check_names(config: StudyConfig, problems: Problems) -> None:
    """Check the materials and forces of grids, and duplicates of stated stiffnesses."""
    for name, grid in config.grids.items():
        path = ("grids", name)
        for material in grid.material:
            check_beam_material(problems, (*path, "material"), material, config)
            for key in ("young_modulus", "poisson_ratio") if config.materials[material].uniaxial_test else ():
                if getattr(grid, key):
                    why = f"material '{material}' has a uniaxial_test, which says its moduli"
                    problems.add((*path, key), f"{why}; take it out of this grid, or remove the key")
            if config.materials[material].plane == "strain" and 0.5 in (grid.poisson_ratio or ()):
                what = f"material '{material}' is in plane strain, and this ratio is {INCOMPRESSIBLE_REASON}"
                problems.add((*path, "poisson_ratio"), what)
        if isinstance(grid.force, dict):
            for owner in dict.fromkeys(getattr(grid, grid.force_owner)):
                if owner not in grid.force:
                    what = f"no force for {grid.force_owner} '{owner}'"
                    problems.add((*path, "force"), f"{what}; add '{owner}: <force>'")
    seen = set()
    for number, row in enumerate(stated_rows(config)):
        where = ("definitions", "paper", "stiffness", number)
        if (row.mesh_type, row.material) in seen:
            problems.add(where, f"a second stiffness for {row.mesh_type} meshes of {row.material}; remove one")
        seen.add((row.mesh_type, row.material))


# -- counts ------------------------------------------------------------------------------------------------------------


def most_scenes(problems: Problems) -> int:
    """Return the limit of scenes, which the environment may change."""
    text = os.environ.get(MOST_SCENES_VARIABLE) or str(MOST_SCENES)
    try:
        return int(float(text))
    except (ValueError, OverflowError):
        remedy = "give one such as 2000000, or none"
        problems.stop_at((), f"{MOST_SCENES_VARIABLE}: '{text}' is not a number of scenes; {remedy}")
        raise


def check_count(
    problems: Problems,
    path: Place,
    lists: Mapping[str, Collection[Any]],
    most: int,
    what: str = "combinations",
    remedy: str = FEWER_REMEDY,
) -> int:
    """Check the product of the lengths of lists, and return it."""
    count = math.prod(map(len, lists.values()))
    if count > most:
        shown = " x ".join(f"{len(values)} {name}" for name, values in lists.items() if len(values) > 1)
        problems.add(path, f"{count} {what} ({shown}); a study has at most {most}: {remedy}")
    return count


def check_product(problems: Problems, section: object, path: Place, labels: Iterable[str], most: int) -> None:
    """Check the product of a section's lists before it is expanded."""
    check_count(problems, path, {label: getattr(section, label) for label in labels}, most)


def check_scenes(config: StudyConfig, problems: Problems) -> None:
    """Check the number of scenes, and of cells, before grids are expanded."""
    left, what = most_scenes(problems), "scenes"
    for name, grid in config.grids.items():
        lists = {" and ".join(group): rows for group, rows in factors(grid)}
        left -= check_count(problems, ("grids", name), lists, left, what, f"{FEWER_REMEDY}, {MORE_SCENES_REMEDY}")
        what = "scenes beside those of the grids above"
    problems.stop()
    labels = [name for name in GRID_PARAMETERS if name not in ("force", "pressure")]
    used = {name: {value for grid in config.grids.values() for value in getattr(grid, name) or ()} for name in labels}
    check_cells(config, {name: values for name, values in used.items() if values}, False, problems)


def check_cells(config: StudyConfig, lists: Mapping[str, set[Any]], curves: bool, problems: Problems) -> None:
    """Check the labels of the dataset, which has a cell for each combination of them."""
    further = "parameters that change together are better drawn under 'samples'"
    check_count(problems, ("grids",), lists, MOST_CELLS, "cells of all labels together", f"{FEWER_REMEDY}; {further}")
    if curves:
        of_curves = {name: one for name, one in lists.items() if name not in ("definition", "stiffness_scale")}
        of_curves["points"] = set(range(config.sensitivity.points))
        remedy = "give fewer, or set sensitivity: false in grids that need no curves"
        check_count(problems, ("sensitivity", "points"), of_curves, MOST_CURVE_POINTS, "points of curves", remedy)
    for name, values in lists.items():
        for one, other in pairwise(sorted(value for value in values if isinstance(value, float))):
            if other - one <= SAME_VALUE * other:
                problems.add(("grids",), f"{name} has {one!r} and {other!r}, which are one label; write them alike")


# -- meshes ------------------------------------------------------------------------------------------------------------


def check_particles(problems: Problems, path: Place, sizes: Iterable[float], length: float, height: float) -> None:
    """Refuse mesh sizes that give too many particles in a box."""
    size = min(sizes)
    count = MESH_TYPES["structured"].particles(length, height, size)
    if why := too_many(count, size, min(length, height), f"box of '{path[0]}'"):
        problems.add(path, f"{number_text(size, 'm')} {why}")


def check_meshes(config: StudyConfig, grids: Iterable[Grid], problems: Problems) -> None:
    """Check mesh sizes against the size of their beams."""
    for grid in grids:
        for mesh in dict.fromkeys(scene.mesh for scene in grid.scenes if scene.mesh.file is None):
            size, beam = mesh.mesh_size, mesh.beam
            if why := MESH_TYPES[mesh.mesh_type].refusal(beam.length, beam.height, size, f"beam '{beam.name}'"):
                number = config.grids[grid.name].mesh_size.index(size)
                path, written = part_of(problems.content, ("grids", grid.name, "mesh_size", number))
                problems.add(path, f"{show(written) if isinstance(written, str) else number_text(size, 'm')} {why}")


# -- definitions -------------------------------------------------------------------------------------------------------


def check_fit(
    problems: Problems, path: Place, names: Names, mesh_types: Names = (), loads: Names = (), derived: bool = True
) -> None:
    """Check that definitions fit mesh types and loads, and, if `derived`, need no reference and no stated stiffness."""
    for name in names:
        one = DEFINITIONS[name]
        if derived and one.needs:
            problems.add(path, f"'{name}' needs a reference or a stated stiffness of a grid; {DEFINITION_REMEDY}")
        for mesh_type in mesh_types:
            made = MESH_TYPES.get(mesh_type)
            if made and made.corners not in one.cells:
                needs, has = ("triangles", "quadrilaterals") if made.corners == 4 else ("rectangles", "triangles")
                problems.add(path, f"'{name}' needs {needs} and mesh type '{mesh_type}' has {has}; {DEFINITION_REMEDY}")
        for load in loads if one.uniaxial else ():
            if not LOADS[load].kind.uniaxial:
                kinds = " and ".join(name for name, load in LOADS.items() if load.kind.uniaxial)
                problems.add(path, f"'{name}' is for {kinds} and load '{load}' is neither; {DEFINITION_REMEDY}")


def check_definitions(config: StudyConfig, grids: Sequence[Grid], problems: Problems) -> None:
    """Check that definitions fit the cells and loads of their grids, and have the sections they need."""
    stated = {(row.mesh_type, row.material): (number, row.value) for number, row in enumerate(stated_rows(config))}
    for grid in grids:
        path = ("grids", grid.name, "definition")
        for name, mesh_type, load in dict.fromkeys((s.definition, s.mesh.mesh_type, s.load) for s in grid.scenes):
            check_fit(problems, path, [name], [mesh_type], [load], derived=False)
            if name == "calibrated" and not config.definitions.calibrated:
                problems.add(path, "'calibrated' needs a beam and a load to calibrate on; add definitions.calibrated")
        paper = (scene for scene in grid.scenes if scene.definition == "paper")
        sheets = dict.fromkeys((scene.mesh.mesh_type, scene.material, scene.mesh.beam.thickness) for scene in paper)
        for mesh_type, material, thickness in sheets:
            number, value = stated.get((mesh_type, material.name), (0, None))
            expected = COEFFICIENT * material.young_modulus * thickness
            if value is None:
                example = f"{{mesh_type: {mesh_type}, material: {material.name}, value: <stiffness> N/m}}"
                lack = f"'paper' has no stiffness for {mesh_type} meshes of {material.name}"
                problems.add(path, f"{lack}; add {example} to definitions.paper.stiffness")
            elif not expected / PLAUSIBLE_FACTOR <= value <= expected * PLAUSIBLE_FACTOR:
                place, written = part_of(problems.content, ("definitions", "paper", "stiffness", number, "value"))
                sheet = f"{material.name}, {1e3 * thickness:g} mm thick and of {material.young_modulus:.4g} Pa"
                why = f"{show(written)} is implausible: sqrt(3)/2 E t of {sheet}, is {expected:.4g} N/m"
                problems.add(place, f"{why}; give a stiffness near that, in N/m")
