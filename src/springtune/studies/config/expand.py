"""Load a study from YAML: validate it, and expand its sections into meshes, scenes and curves, each once and sorted."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar

from pydantic import AfterValidator, Field

from springtune.mesh.cells import MESH_TYPES
from springtune.problem.loads import KINEMATICS, LOADS
from springtune.problem.materials import AnyMaterial, Material, Rubber, check_isotropic
from springtune.problem.quantities import SWEPT, nearest
from springtune.problem.shapes import Beam
from springtune.registry import NAME, NAME_RULE
from springtune.safe_io import Rows, csv_rows, why_unreadable
from springtune.springs.base import DEFINITIONS
from springtune.springs.lattice import COEFFICIENT

from . import checks
from .fields import FILES, RANGE_DIGITS, BeamName, Load, MaterialName, MeshType, Section
from .messages import Key, Problems, StudyError, control_character_fault, read_study, show, validate
from .model import FURTHER_REFERENCES, CurveSpec, Grid, MeshFiles, MeshSpec, Reference, SceneSpec, Study, StudyKind
from .sections import GRID_PARAMETERS, StudyConfig, combinations, study_model

Item = TypeVar("Item", MeshSpec, SceneSpec, CurveSpec, Reference)

FROM_THE_STUDY = "give its path relative to the study's folder"


def load(path: str | Path, kinds: tuple[StudyKind, ...]) -> Study:
    """Read, validate and expand a study."""
    path, file = Path(path), str(path)
    text, content, lines = read_study(path)
    if not NAME.fullmatch(path.stem):
        raise StudyError(f"{file}: '{path.stem}' cannot name a study; rename the file: {NAME_RULE}")
    problems = Problems(file, lines, content, path.parent)
    files: list[str] = []
    add_rows(content, problems, files)
    # Names that sections refer to; of a section that is no mapping, whose error is enough, nothing is known.
    given = content.items() if isinstance(content, dict) else ()
    sections: dict[str, Any] = {key: one if isinstance(one, dict) else None for key, one in given} | {FILES: files}
    config = validate(study_model(kinds), content, problems, context=sections)
    for check in (checks.check_names, checks.check_scenes):
        check(config, problems)
        problems.stop()
    for kind in filter(lambda kind: kind.requested_by(config), kinds):
        kind.check(config, problems)
    problems.stop()
    about = {"name": path.stem, "path": path, "text": text, "files": tuple(path.parent / name for name in files)}
    return build(config, kinds, problems, about)


def files_of_meshes(config: StudyConfig, beams: Mapping[str, Beam], problems: Problems) -> MeshFiles:
    """Meshes from files by (mesh type, beam's name, mesh size)."""
    found: MeshFiles = {}
    for name, rows in (config.mesh_files or {}).items():
        for number, row in enumerate(rows):
            path, label = problems.folder / row.file, (name, row.beam, row.mesh_size)
            where = ("mesh_files", name, number)
            if why := why_unreadable(path):
                problems.add((*where, "file"), f"'{path}': {why}; {FROM_THE_STUDY}")
            if label in found:
                problems.add(where, f"a second file for beam '{row.beam}' at this mesh size; remove one")
            found[label] = MeshSpec(beams[row.beam], name, row.mesh_size, path, row.unit)
    problems.stop()
    return found


class Declared(NamedTuple):
    """Bodies and materials that a study declares, by name; `folder` is where its file names start."""

    beams: dict[str, Beam]
    materials: dict[str, AnyMaterial]
    folder: Path


def declared(config: StudyConfig, problems: Problems) -> Declared:
    """Bodies and materials that a study declares; files of material tests are read."""
    beams = {name: Beam(beam.length, beam.height, beam.thickness, name) for name, beam in config.beams.items()}
    materials = {}
    for name, material in config.materials.items():
        try:
            materials[name] = material.material(name, problems.folder)
        except ValueError as error:
            problems.add(("materials", name), str(error).removeprefix(f"material '{name}': "))
    problems.stop()
    return Declared(beams, materials, problems.folder)


def _ranks(config: StudyConfig) -> dict[str, dict[Any, int]]:
    """Rank of each label, by dimension."""
    names: dict[str, Iterable[str]] = {
        "beam": config.beams,
        "mesh_type": [*MESH_TYPES, *(config.mesh_files or ())],
        "material": config.materials,
        "load": LOADS,
        "definition": DEFINITIONS,
        "kinematics": KINEMATICS,
    }
    return {dimension: {name: rank for rank, name in enumerate(labels)} for dimension, labels in names.items()}


def swept(config: StudyConfig, references: Iterable[Reference]) -> tuple[str, ...]:
    """Parameters that are dimensions: the ones given in a grid, and a force with several values."""
    found = {name for grid in config.grids.values() for name in SWEPT if name != "force" and getattr(grid, name)}
    loaded = [(one.beam, one.material, one.load) for one in {*references}]
    return tuple(name for name in SWEPT if name in found or (name == "force" and len({*loaded}) < len(loaded)))


def expand(config: StudyConfig, bodies: Declared, mesh_files: MeshFiles, problems: Problems) -> tuple[Grid, ...]:
    """Expand grids into scenes and curves; each beam, material and mesh is made once."""

    @cache
    def make_beam(name: str, thickness: float | None) -> Beam:
        return bodies.beams[name] if thickness is None else replace(bodies.beams[name], thickness=thickness)

    @cache
    def make_material(name: str, young_modulus: float | None, poisson_ratio: float | None) -> Material:
        found = check_isotropic(bodies.materials[name], "put the sheet under 'shapes'")
        if isinstance(found, Rubber):  # it keeps the moduli of its law; `check_names` refuses others
            return found
        ratio = found.poisson_ratio if poisson_ratio is None else poisson_ratio
        return replace(found, young_modulus=young_modulus or found.young_modulus, poisson_ratio=ratio)

    @cache
    def make_mesh(beam: Beam, mesh_type: str, size: float) -> MeshSpec | None:
        if mesh_type in MESH_TYPES:
            return MeshSpec(beam, mesh_type, size)
        # A file is of a beam's extent; its thickness is the combination's. It may be missing.
        found = mesh_files.get((mesh_type, beam.name, size))
        return found if found is None or found.beam == beam else replace(found, beam=beam)

    grids = []
    for name, grid in config.grids.items():
        scenes, curves = list[SceneSpec](), dict[CurveSpec, None]()
        absent = set()
        signs = {load: (LOADS[load].sign, LOADS[load].follower) for load in grid.load}
        for one in combinations(grid):
            beam, load = make_beam(one["beam"], one.get("thickness")), one["load"]
            material = make_material(one["material"], one.get("young_modulus"), one.get("poisson_ratio"))
            if "pressure" in one:  # a force on the upper side, rounded so that equal forces share a label
                one["force"] = float(f"{one['pressure'] * beam.length * beam.thickness:.{RANGE_DIGITS}g}")
            mesh = make_mesh(beam, one["mesh_type"], one["mesh_size"])
            if mesh is None:
                absent.add((one["mesh_type"], beam.name, f"{1e3 * one['mesh_size']:g} mm"))
                continue
            sign, follows = signs[load]
            common = (mesh, material, load, sign * one["force"])
            scenes.append(SceneSpec(*common, one["definition"], one["kinematics"], one.get("stiffness_scale", 1.0)))
            if grid.sensitivity and not follows:  # k enters as F/k only where forces stay
                curves[CurveSpec(*common, one["kinematics"])] = None
        for mesh_type, beam_name, length in sorted(absent):
            row = f"{{file: <path>, beam: {beam_name}, mesh_size: {length}}}"
            problems.add(("grids", name, "mesh_size"), f"no file for {length}; add {row} to mesh_files.{mesh_type}")
        grids.append(Grid(name, tuple(scenes), tuple(curves)))
    problems.stop()
    return tuple(grids)


def _calibrating(config: StudyConfig, scenes: Sequence[SceneSpec], problems: Problems) -> list[CurveSpec]:
    """Curves that calibrate the scenes of the definition ``calibrated``."""
    if not config.definitions.calibrated:
        return []
    beam, load = config.definitions.calibrated.beam, config.definitions.calibrated.load
    there = [one for one in scenes if one.mesh.beam.name == beam and one.load == load]
    calibrated = (one for one in scenes if one.definition == "calibrated")
    cases = dict.fromkeys((one.mesh.mesh_type, one.material, one.kinematics) for one in calibrated)
    curves: list[CurveSpec] = []
    for mesh_type, material, kinematics in cases:
        alike = (one for one in there if one.mesh.mesh_type == mesh_type and one.material == material)
        found = [*dict.fromkeys(CurveSpec(one.mesh, material, one.load, one.force, kinematics) for one in alike)]
        curves += found
        path = ("definitions", "calibrated")
        where = f"beam '{beam}' in {load} on {mesh_type} meshes of {material.name}"
        if not found:
            what = f"no grid has {where}, but scenes there are 'calibrated'"
            problems.add(path, f"{what}; add it to a grid, or calibrate on another beam or load")
        elif len({(one.force, one.mesh.beam.thickness) for one in found}) > 1:
            what = f"{where} has several forces or thicknesses, and one stiffness is calibrated"
            problems.add(path, f"{what}; give it one value, or calibrate on a beam or load that is not swept")
    return curves


def build(config: StudyConfig, kinds: Sequence[StudyKind], problems: Problems, about: dict[str, Any]) -> Study:
    """Build the study with the parts of all study kinds; `about` has its name, path, text and files."""
    bodies = declared(config, problems)
    mesh_files = files_of_meshes(config, bodies.beams, problems)
    grids = expand(config, bodies, mesh_files, problems)
    checks.check_meshes(config, grids, problems)
    checks.check_definitions(config, grids, problems)
    problems.stop()
    # By their places: hashing a beam and a material for each of 100,000 scenes is slow.
    every = [scene for grid in grids for scene in grid.scenes]
    loaded = {(id(one.mesh.beam), id(one.material), one.load, one.force): one for one in every}
    references = [Reference(one.mesh.beam, one.material, one.load, one.force) for one in loaded.values()]
    ranks, names = _ranks(config), swept(config, references)

    def order(item: Item) -> list[Any]:
        labels = item.labels | {"thickness": item.beam.thickness} if isinstance(item, MeshSpec) else item.labels(names)
        return [ranks[name][label] if name in ranks else label for name, label in labels.items()]

    def in_order(items: Iterable[Item]) -> tuple[Item, ...]:
        return tuple(sorted(dict.fromkeys(items), key=order))

    scenes = in_order(every)
    curves = [curve for grid in grids for curve in grid.curves] + _calibrating(config, scenes, problems)
    meshes = in_order(scene.mesh for scene in scenes)
    found, used = [mesh.labels for mesh in meshes] + [one.labels(names) for one in references], dict[str, set[Any]]()
    for name in (*ranks, "mesh_size", *names):
        own = name in ("definition", "kinematics", "stiffness_scale")
        used[name] = {getattr(one, name) for one in scenes} if own else {one[name] for one in found if name in one}
    checks.check_cells(config, used, bool(curves), problems)
    problems.stop()
    parts = {kind.name: kind.expand(config, bodies) if kind.requested_by(config) else () for kind in kinds}
    if config.printed and names:
        why = f"printed cells know no {' or '.join(names)}, which grids sweep"
        problems.stop_at(("printed",), f"{why}; give the sweep a study of its own, or remove the key")
    first, last, points = config.sensitivity.start, config.sensitivity.stop, config.sensitivity.points
    calibrated = config.definitions.calibrated
    printed_path = problems.folder / config.printed if config.printed else None
    study = Study(
        title=config.title,
        meshes=meshes,
        scenes=scenes,
        curves=in_order(curves),
        references=in_order(references),
        mesh_files=mesh_files,
        outputs=tuple(output.name for kind in kinds for output in kind.outputs if output.name in config.outputs),
        style=config.style.model_dump(exclude_none=True),
        further_references=tuple(name for name in FURTHER_REFERENCES if name in config.further_references),
        materials=bodies.materials,
        parts=parts,
        grids=grids,
        stiffness_ratios=tuple(COEFFICIENT * (first + (last - first) * n / (points - 1)) for n in range(points)),
        stiffness_table={(row.mesh_type, row.material): row.value for row in checks.stated_rows(config)},
        calibration=(calibrated.beam, calibrated.load) if calibrated else None,
        printed=read_printed(printed_path, config, problems) if printed_path else (),
        printed_path=printed_path,
        axes=_axes(ranks, used, [kind.axes(parts[kind.name]) for kind in kinds if parts[kind.name]]),
        swept=names,
        **about,
    )
    for name, output in ((kind.name, one) for kind in kinds for one in kind.outputs if one.name in study.outputs):
        none = f"shows {output.shows} and the study has none; add a section '{name}'"
        if lack := none if output.shows and not parts[name] else output.lack(study):
            problems.add(("outputs",), f"'{output.name}' {lack}")
    problems.stop()
    return study


def _axes(
    ranks: dict[str, dict[Any, int]], used: dict[str, set[Any]], further: Sequence[Mapping[str, Collection[Any]]]
) -> dict[str, tuple[Any, ...]]:
    """Labels of each dimension; groups share those of the root."""
    # A study kind may have labels that no beam has, such as loads of its own.
    more = {name: [*chain.from_iterable(labels.get(name, ()) for labels in further)] for name in used}
    found = {name: {*labels, *more[name]} for name, labels in used.items()}
    own = {name: tuple(values) for labels in further for name, values in labels.items() if name not in used}
    order = {name: dict.fromkeys([*labels, *more[name]]) for name, labels in ranks.items()}
    axes = {name: tuple(label for label in labels if label in found[name]) for name, labels in order.items()}
    return axes | {name: tuple(sorted(labels)) for name, labels in found.items() if name not in ranks} | own


# -- CSV files ---------------------------------------------------------------------------------------------------------


def _table(path: Path, where: Sequence[Key], problems: Problems, example: str) -> Rows:
    """Rows of a CSV file with their lines, the head first; `where` is the key of the file."""
    try:
        rows = csv_rows(path, ValueError, "give the path of a CSV file, or remove the key")
    except ValueError as error:
        problems.stop_at(where, str(error))
    own = Problems(str(path))
    for line, row in rows:
        for why in filter(None, map(control_character_fault, row)):
            own.add((), why, line)
        if len(row) != len(rows[0][1]):
            own.add((), f"{len(row)} values in {len(rows[0][1])} columns; give one for each", line)
    if len(rows) == 1:
        own.add((), f"no rows below the head; give {example}")
    own.stop()
    return rows


def add_rows(content: Any, problems: Problems, files: list[str]) -> None:
    """Add the columns of the file of rows to each grid that has one, and note the file."""
    grids = content.get("grids") if isinstance(content, dict) else None
    for name, grid in grids.items() if isinstance(grids, dict) else ():
        file = grid.get("rows") if isinstance(grid, dict) else None
        if not isinstance(file, str) or not file.strip():
            continue  # validation refuses it
        where, path = ("grids", name), problems.folder / file
        example = "a head such as beam,mesh_size [mm],force and a line for each combination"
        (first, head), *rows = _table(path, (*where, "rows"), problems, example)
        problems.places[(*where, "rows")] = f"{path}:{first}"
        columns: dict[str, list[str]] = {}
        for place, cell in enumerate(head):
            key, _, unit = (part.strip(" ]") for part in cell.partition("["))
            if key not in GRID_PARAMETERS:
                problems.add((*where, "rows"), f"unknown column {show(cell)}; {nearest(key, GRID_PARAMETERS)}")
            if key in columns or grid.get(key) is not None:
                problems.add((*where, key), f"'{file}' has a column '{key}', too; remove one of them")
            columns[key] = [f"{row[place].strip()} {unit}".strip() for _, row in rows]
            problems.places |= {(*where, key, item): f"{path}:{line}" for item, (line, _) in enumerate(rows)}
        problems.stop()
        grid |= {key: tuple(values) for key, values in columns.items()} | {"rows": [file, *columns]}
        files.append(file)


def _printed(unit: str) -> tuple[Any, ...]:
    """Notes of a printed number in a unit of this size."""
    title = "the printed number, of 0 or more and unsigned"
    return Field(ge=0, le=Decimal("1e30"), title=title), AfterValidator(lambda found: float(found * Decimal(unit)))


class PrintedCell(Section):
    """A printed table cell in SI units; magnitudes only. `remark` names contradictions in the print."""

    table: Annotated[int, Field(ge=1, title="a whole number from 1")]
    beam: BeamName
    mesh_type: MeshType
    mesh_size: Annotated[Decimal, *_printed("1e-3")] = Field(alias="mesh_size_mm")
    material: MaterialName
    load: Load
    force: Annotated[Decimal, *_printed("1")] = Field(alias="force_N")
    stiffness: Annotated[Decimal, *_printed("1")] = Field(alias="stiffness_N_per_m")
    reference_displacement: Annotated[Decimal, *_printed("1e-3")] = Field(alias="reference_displacement_mm")
    displacement: Annotated[Decimal, *_printed("1e-3")] = Field(alias="displacement_mm")
    deformation_error: Annotated[Decimal, *_printed("1e-2")] = Field(alias="deformation_error_percent")
    remark: str


def read_printed(path: Path, config: StudyConfig, problems: Problems) -> tuple[PrintedCell, ...]:
    """Read printed cells from CSV; lines that start with # are comments."""
    columns = ",".join(field.alias or name for name, field in PrintedCell.model_fields.items())
    (_, head), *rows = _table(path, ("printed",), problems, f"the head {columns} and a line for each cell")
    own = Problems(str(path))
    cells: dict[tuple[Any, ...], tuple[int, PrintedCell]] = {}
    known = {"mesh_files": config.mesh_files or (), "beams": None, "materials": None}  # print may have others
    for line, row in rows:
        cell = validate(PrintedCell, dict(zip(head, row)), own, line, known)
        first, _ = cells.setdefault((cell.beam, cell.mesh_type, cell.mesh_size, cell.material, cell.load), (line, cell))
        if first != line:
            own.add((), f"is the cell of line {first} again; remove one", line)
    own.stop()
    return tuple(cell for _, cell in cells.values())
