"""Checks that the values of a study agree with each other."""

import math
import os
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from springtune.mesh import MESH_TYPES
from springtune.mesh.types import MOST_MESHED
from springtune.problem.loads import LOADS
from springtune.problem.materials import INCOMPRESSIBLE
from springtune.problem.parameters import MOST_SCENES, MOST_SCENES_VARIABLE
from springtune.problem.quantities import nearest
from springtune.springs import DEFINITIONS
from springtune.springs.lattice import COEFFICIENT

from .combinations import SAME_VALUE, check_groups, count, values_of
from .messages import Key, Problems
from .model import Grid, MeshSpec, Reference, SceneSpec
from .sections import GRID_PARAMETERS, PLAUSIBLE, StatedStiffness, StudyConfig

MOST_CELLS = 2_500_000
"""Limit of label combinations over all dimensions, requested or not."""

MOST_CURVE_POINTS = 10_000_000

FEWER = "give shorter lists, or split the study into several"

MORE_SCENES = f"or allow more by 'springtune run --max-scenes', or by {MOST_SCENES_VARIABLE} in the environment"


def check_known(
    problems: Problems, path: Sequence[Key], what: str, name: str, names: Iterable[str], section: str | None = ""
) -> None:
    """Check that a name is known; a study declares it in a section of its kind, in another one, or nowhere (None)."""
    if name not in names:
        declared = "" if section is None else f"; or declare it under {section or f'{what}s'}"
        problems.add(path, f"unknown {what} '{name}'; {nearest(name, names)}{declared}")


def check_beam_material(problems: Problems, path: Sequence[Key], name: str, config: StudyConfig) -> None:
    """Check that a beam material is declared and isotropic."""
    check_known(problems, path, "material", name, config.materials)
    given = config.materials[name] if name in config.materials else None
    if given and given.young_modulus is None and given.uniaxial_test is None:
        problems.add(
            path,
            f"'{name}' is anisotropic, and beams are of isotropic materials, as their references are; put the sheet "
            "under 'shapes', whose references take any material",
        )


def check_compressible(problems: Problems, path: Sequence[Key], name: str, config: StudyConfig) -> None:
    """Check that a material, which is asked for with a Poisson's ratio of 0.5, is in plane stress."""
    if name in config.materials and config.materials[name].plane == "strain":
        problems.add(path, f"material '{name}' is in plane strain, and this ratio is {INCOMPRESSIBLE}")


def check_names(config: StudyConfig, problems: Problems) -> None:
    """Check the names that refer to declared sections, and the sensitivity range."""
    mesh_types = mesh_type_names(config)
    for name, rows in (config.mesh_files or {}).items():
        if name in MESH_TYPES:
            problems.add(("mesh_files", name), f"'{name}' is a mesh type that is made; rename yours")
        for number, one in enumerate(rows):
            check_known(problems, ("mesh_files", name, number, "beam"), "beam", one.beam, config.beams)
    for name, grid in config.grids.items():
        for mesh_type in grid.mesh_type:
            check_known(problems, ("grids", name, "mesh_type"), "mesh type", mesh_type, mesh_types, "mesh_files")
        for beam in grid.beam:
            check_known(problems, ("grids", name, "beam"), "beam", beam, config.beams)
        for material in grid.material:
            check_beam_material(problems, ("grids", name, "material"), material, config)
            if 0.5 in (grid.poisson_ratio or ()):
                check_compressible(problems, ("grids", name, "poisson_ratio"), material, config)
        for beam in grid.force or ():
            if beam is not None:
                check_known(problems, ("grids", name, "force", beam), "beam", beam, config.beams)
        if grid.force and None not in grid.force:
            for beam in grid.beam:
                if beam not in grid.force:
                    problems.add(("grids", name, "force"), f"no force for beam '{beam}'; add '{beam}: <force>'")
    calibrated, paper = config.definitions.calibrated, config.definitions.paper
    if calibrated:
        check_known(problems, ("definitions", "calibrated", "beam"), "beam", calibrated.beam, config.beams)
    seen = set()
    for number, row in enumerate(paper.stiffness if paper else ()):
        path = ("definitions", "paper", "stiffness", number)
        check_known(problems, (*path, "material"), "material", row.material, config.materials)
        check_known(problems, (*path, "mesh_type"), "mesh type", row.mesh_type, mesh_types, "mesh_files")
        if (row.mesh_type, row.material) in seen:
            problems.add(path, f"a second stiffness for {row.mesh_type} meshes of {row.material}; remove one")
        seen.add((row.mesh_type, row.material))
    if not config.sensitivity.start < config.sensitivity.stop:
        start, stop = config.sensitivity.start, config.sensitivity.stop
        problems.add(("sensitivity", "from"), f"{start:g} is not below 'to', {stop:g}; give a smaller 'from'")


def most_scenes() -> int:
    """Return the limit of scenes, which the environment may change."""
    text = os.environ.get(MOST_SCENES_VARIABLE) or str(MOST_SCENES)
    try:
        found = int(float(text))
    except (ValueError, OverflowError):
        found = 0
    if found < 1:
        raise ValueError(
            f"{MOST_SCENES_VARIABLE}: '{text}' is not a number of scenes; give one such as 2000000, or none"
        )
    return found


def check_counts(config: StudyConfig, content: dict[str, Any], problems: Problems) -> None:
    """Check the number of scenes and of zipped values before grids are expanded."""
    for name, grid in config.grids.items():
        check_groups(name, grid, content["grids"][name], problems)
    problems.stop()
    try:
        most = most_scenes()
    except ValueError as error:
        problems.stop_at((), str(error))
    before = 0
    for name, grid in config.grids.items():
        number, lengths = count(grid)
        if before + number > most:
            shown = " x ".join(f"{size} {label}" for label, size in lengths.items() if size > 1)
            beside = f" beside {before} of the grids above" if before else ""
            problems.add(
                ("grids", name),
                f"{_counted(number)} scenes ({shown}){beside}; a study has at most {most}: {FEWER}, {MORE_SCENES}",
            )
            return
        before += number
    _check_labels(config, problems)


def _check_labels(config: StudyConfig, problems: Problems) -> None:
    """Estimate the size of the dataset before grids are expanded."""
    if not config.grids or any(grid.exclude for grid in config.grids.values()):
        return  # exclusions may leave labels out
    labelled = (name for name in GRID_PARAMETERS if name != "pressure")
    lists = {name: {value for grid in config.grids.values() for value in values_of(grid, name)} for name in labelled}
    check_cells(config, {name: values for name, values in lists.items() if values}, False, problems)


def check_scene(
    problems: Problems, path: Sequence[Key], scene: Any, config: StudyConfig, able: Callable[[str], bool], why: str
) -> None:
    """Check that the beam of a scene is declared, its material, too, with a density, and that its load is able."""
    check_known(problems, (*path, "beam"), "beam", scene.beam, config.beams)
    check_beam_material(problems, (*path, "material"), scene.material, config)
    check_density(config, scene.material, (*path, "material"), problems)
    if not able(scene.load):
        problems.add((*path, "load"), f"'{scene.load}' {why}; choose of {', '.join(filter(able, LOADS))}")


def check_made(
    problems: Problems, path: Sequence[Key], mesh_type: str, size: float, name: str, config: StudyConfig
) -> None:
    """Check that a mesh type that is made has a mesh of a size on a beam, if that is declared."""
    if beam := config.beams.get(name):
        refusal = MESH_TYPES[mesh_type].refusal(beam.length, beam.height, size, f"beam '{name}'")
        if refusal:
            problems.add(path, f"{in_mm(size)} {refusal}")


def check_product(problems: Problems, section: object, path: Sequence[Key], labels: Iterable[str], most: int) -> None:
    """Check the product of a section's lists before it is expanded."""
    lists = {label: len(getattr(section, label)) for label in labels}
    count = math.prod(lists.values())
    if count > most:
        shown = " x ".join(f"{size} {label}" for label, size in lists.items() if size > 1)
        problems.add(path, f"{_counted(count)} combinations ({shown}); a study has at most {most}: {FEWER}")


def check_particles(
    problems: Problems, path: Sequence[Key], sizes: Iterable[float], length: float, height: float
) -> None:
    """Refuse mesh sizes that give too many particles."""
    if refusal := _too_many(min(sizes), length, height):
        problems.add(path, f"{in_mm(min(sizes))} gives {refusal}")


def _too_many(size: float, length: float, height: float) -> str:
    """Return how many particles a mesh has beyond the limit, and the remedy, or an empty string."""
    particles = length * height / (COEFFICIENT * size**2) if size**2 else math.inf
    if particles <= MOST_MESHED:
        return ""
    least = 1.05e3 * math.sqrt(length * height / COEFFICIENT / MOST_MESHED)
    return f"{particles:.0e} particles; give {least:.2g} mm or more"


def check_labels(problems: Problems, path: Sequence[Key], lists: Mapping[str, set[Any]], further: str = "") -> int:
    """Check the number of cells that labels have together, and return it."""
    cells = math.prod(map(len, lists.values()))
    if cells > MOST_CELLS:
        shown = " x ".join(f"{len(values)} {label}" for label, values in lists.items() if len(values) > 1)
        most = f"a dataset has at most {MOST_CELLS}: {FEWER}{further}"
        problems.add(path, f"{_counted(cells)} cells of all labels together ({shown}); {most}")
    return cells


def check_cells(config: StudyConfig, lists: dict[str, set[Any]], curves: bool, problems: Problems) -> None:
    """Check the size of the dataset, which has a cell for each combination of labels."""
    further = "; parameters that change together are better drawn under 'samples'"
    cells = check_labels(problems, ("grids",), lists, further)
    if not cells:
        return  # a study of study kinds alone
    once = cells // len(lists["definition"]) // len(lists.get("stiffness_scale", "1"))
    points = once * config.sensitivity.points
    if curves and points > MOST_CURVE_POINTS:
        of = f"{config.sensitivity.points} on each of {once} curves"
        most = f"give at most {MOST_CURVE_POINTS}, or set sensitivity: false in grids that need no curves"
        problems.add(("sensitivity", "points"), f"{_counted(points)} points, {of}; {most}")


def check_numbers(lists: dict[str, set[Any]], problems: Problems) -> None:
    """Check that numeric labels differ by more than `SAME_VALUE`."""
    for name, values in lists.items():
        numbers = sorted(value for value in values if isinstance(value, float))
        for one, other in zip(numbers, numbers[1:]):
            if other - one <= SAME_VALUE * other:
                problems.add(("grids",), f"{name} has {one!r} and {other!r}, which are one label; write them alike")


def _counted(count: int) -> str:
    return str(count) if count < 1e7 else f"{count:.3g}"


def check_able(
    problems: Problems, path: Sequence[Key], names: Iterable[str], why: str, corners: int = 0, stretched: bool = True
) -> None:
    """Check that definitions need no reference and no stated stiffness, and have cells of so many corners.

    Where a beam is not stretched they must not be uniaxial.
    """
    able = [
        name
        for name, one in DEFINITIONS.items()
        if not one.needs and (not corners or corners in one.cells) and (stretched or not one.uniaxial)
    ]
    for name in names:
        if name not in able:
            problems.add(path, f"'{name}' {why} choose of {', '.join(able)}")


def check_for_triangles(names: Iterable[str], path: Sequence[Key], problems: Problems) -> None:
    """Check that definitions work on triangles without a reference or a stated stiffness."""
    why = "is for triangles with a reference or a stated stiffness, or for rectangles;"
    check_able(problems, path, names, why, 3)


def check_density(config: StudyConfig, name: str, path: Sequence[Key], problems: Problems) -> None:
    """Check that a declared material has a density."""
    if name in config.materials and config.materials[name].density is None:
        problems.add(path, f"'{name}' has no density; add one to it under materials, such as density: 7850 kg/m^3")


def mesh_type_names(config: StudyConfig) -> list[str]:
    """Names of all mesh types, generated ones first."""
    return [*MESH_TYPES, *(config.mesh_files or ())]


def check_meshes(config: StudyConfig, content: dict[str, Any], grids: Iterable[Grid], problems: Problems) -> None:
    """Check mesh sizes against the size of their beams."""
    for expanded in grids:
        name, grid = expanded.name, config.grids[expanded.name]
        made = {(scene.mesh.mesh_size, scene.mesh.beam.name) for scene in expanded.scenes if scene.mesh.file is None}
        written = content["grids"][name]["mesh_size"]
        for number, size in enumerate(grid.mesh_size):
            listed = isinstance(written, list)
            shown = f"'{written[number]}'" if listed else f"'{written}'" if isinstance(written, str) else in_mm(size)
            path = ("grids", name, "mesh_size", number) if listed else ("grids", name, "mesh_size")
            for beam in dict.fromkeys(grid.beam):
                if (size, beam) not in made:
                    continue
                length, height = config.beams[beam].length, config.beams[beam].height
                if size > min(length, height):
                    side = in_mm(min(length, height))
                    problems.add(path, f"{shown} is larger than beam '{beam}'; give at most its smaller side, {side}")
                elif refusal := _too_many(size, length, height):
                    problems.add(path, f"{shown} gives beam '{beam}' {refusal}")


def in_mm(length: float) -> str:
    """Length as messages show it."""
    return f"{1e3 * length:g} mm"


def _check_kinds(grids: Iterable[Grid], problems: Problems) -> None:
    """Check that definitions fit the cells and loads of their grids."""
    for grid in grids:
        found: dict[str, None] = {}
        for name, mesh_type, on in dict.fromkeys((one.definition, one.mesh.mesh_type, one.load) for one in grid.scenes):
            definition = DEFINITIONS[name]
            made = MESH_TYPES.get(mesh_type)
            if made and made.corners not in definition.cells:
                needs, has = ("triangles", "quadrilaterals") if made.corners == 4 else ("rectangles", "triangles")
                found[f"'{definition.name}' needs {needs} and mesh type '{mesh_type}' has {has}; {SEPARATE}"] = None
            if definition.uniaxial and not LOADS[on].kind.uniaxial:
                kinds = " and ".join(name for name, load in LOADS.items() if load.kind.uniaxial)
                found[f"'{definition.name}' is for {kinds} and load '{on}' is neither; {SEPARATE}"] = None
        for message in found:
            problems.add(("grids", grid.name, "definition"), message)


SEPARATE = "give them grids of their own"


def check_definitions(config: StudyConfig, content: dict[str, Any], grids: Sequence[Grid], problems: Problems) -> None:
    """Check that the study states what its definitions need."""
    _check_kinds(grids, problems)
    stated = {(row.mesh_type, row.material): row.value for row in stated_rows(config)}
    sheets: dict[tuple[str, str], dict[tuple[float, float], None]] = {}  # thickness and Young's modulus
    for grid in grids:
        lacking = set()
        for scene in grid.scenes:
            pair = (scene.mesh.mesh_type, scene.material.name)
            if scene.definition == "paper":
                sheets.setdefault(pair, {})[scene.mesh.beam.thickness, scene.material.young_modulus] = None
                if pair not in stated and pair not in lacking:
                    lacking.add(pair)
                    example = f"{{mesh_type: {pair[0]}, material: {pair[1]}, value: <stiffness> N/m}}"
                    problems.add(
                        ("grids", grid.name, "definition"),
                        f"'paper' has no stiffness for {pair[0]} meshes of {pair[1]}; "
                        f"add {example} to definitions.paper.stiffness",
                    )
        if not config.definitions.calibrated and any(scene.definition == "calibrated" for scene in grid.scenes):
            problems.add(
                ("grids", grid.name, "definition"),
                "'calibrated' needs to know on what; add definitions.calibrated with a beam and a load",
            )
    for number, row in enumerate(stated_rows(config)):
        modulus = config.materials[row.material].young_modulus
        if modulus is None:
            continue  # there is no E t to judge it by
        every = {(beam.thickness, modulus): None for beam in config.beams.values()}
        for thickness, modulus in sheets.get((row.mesh_type, row.material), every):
            expected = COEFFICIENT * modulus * thickness
            if not expected / PLAUSIBLE <= row.value <= expected * PLAUSIBLE:
                written = content["definitions"]["paper"]["stiffness"][number]["value"]
                other = "" if modulus == config.materials[row.material].young_modulus else f" and of {modulus:.4g} Pa"
                problems.add(
                    ("definitions", "paper", "stiffness", number, "value"),
                    f"'{written}' cannot be meant: sqrt(3)/2 E t of {row.material}, {1e3 * thickness:g} mm thick"
                    f"{other}, is {expected:.4g} N/m; give a stiffness near that, in N/m",
                )
                break


def stated_rows(config: StudyConfig) -> list[StatedStiffness]:
    """Rows of stated stiffnesses; empty if the study states none."""
    return config.definitions.paper.stiffness if config.definitions.paper else []


def check_files(
    meshes: Iterable[MeshSpec], scenes: Iterable[SceneSpec], references: Iterable[Reference], problems: Problems
) -> None:
    """Check that different things do not share a file name."""
    parts = {(scene.mesh.beam.name, scene.mesh.mesh_type, scene.material.name) for scene in scenes}
    pairs = {(reference.beam.name, reference.material.name) for reference in references}
    flat = {
        replace(mesh, beam=replace(mesh.beam, thickness=min(mesh.beam.length, mesh.beam.height))) for mesh in meshes
    }
    sizes = {mesh.mesh_size for mesh in meshes}
    boxes = {(mesh.beam.length, mesh.beam.height) for mesh in meshes}
    extents = [f"{1e3 * length:g} x {1e3 * height:g} mm" for length, height in boxes]
    for path, what, names, remedy in (
        (("grids",), "mesh sizes", [f"{1e3 * size:g} mm" for size in sizes], "merge them, names keep six digits"),
        (("beams",), "extents of beams", extents, "give these beams the same, names keep six digits"),
        (("beams",), "meshes", [mesh.name for mesh in flat], "rename a beam"),
        (("materials",), "references", ["_".join(pair) for pair in pairs], "rename a beam or a material"),
        (("materials",), "scenes", ["_".join(part) for part in parts], "rename a beam or a material"),
    ):
        for name, number in Counter(name.casefold() for name in names).most_common(1):
            if number > 1:
                problems.add(path, f"{number} different {what} are all named '{name}'; {remedy}")
                return
