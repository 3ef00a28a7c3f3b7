"""Shapes of a study: their sections, checks, and the scenes that their grids ask for."""

import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from pydantic import Field, ValidatorFunctionWrapHandler, WithJsonSchema, WrapValidator, model_validator
from pydantic_core import PydanticCustomError

from springtune import units
from springtune.mesh.cells import MeshError
from springtune.problem.boundary import free_motion
from springtune.problem.loads import KINEMATICS
from springtune.problem.quantities import nearest
from springtune.problem.shapes import (
    AssumptionWarning,
    Hole,
    LoadCase,
    Pressure,
    Quantity,
    Segment,
    Shape,
    Support,
    Traction,
    size_text,
)
from springtune.safe_io import why_unreadable
from springtune.springs.base import DEFINITIONS

from ...config import fields
from ...config.checks import FEWER_REMEDY, check_density, check_fit, check_particles
from ...config.expand import FROM_THE_STUDY
from ...config.fields import Named, OneOrMore, Section, default, one_of, optional, quantity, read_quantity
from ...config.messages import refuse, show
from .outputs import GENERATED_MESH, MESH_OF_FILE

QUANTITIES = {
    "displacement": ("length", {"at": "a point", "of": "a group"}),
    "stress": ("stress", {"at": "a point"}),
    "reaction": ("force", {"of": "a group that is held"}),
    "area": ("area", {}),
    "energy": ("energy", {}),
}
"""Quantities of interest: dimension, and keys for the place with their meanings."""


def pair_field(kind: str) -> Any:
    """Field of two quantities, along x and along y."""
    example = units.QUANTITY_DIMENSIONS[kind].example
    pair = f"0, {example}" if example.startswith("-") else f"{example}, 0"
    return Field(title=f"{kind}s along x and y, such as [{pair}]")


Displacement = Annotated[float, *quantity("length", signed=True)]
PressureValue = Annotated[float, *quantity("stress", signed=True)]
SignedForce = Annotated[float, *quantity("force", signed=True)]
Acceleration = Annotated[float, *quantity("acceleration", signed=True)]
Place = Annotated[tuple[Displacement, Displacement], pair_field("length")]
ForceVector = Annotated[tuple[SignedForce, SignedForce], pair_field("force")]
Gravity = Annotated[tuple[Acceleration, Acceleration], pair_field("acceleration")]
GroupName = Annotated[str, Field(min_length=1, title="the name of a group")]
PointName = Annotated[str, Field(min_length=1, title="the name of a point")]
PartName = Annotated[str, Field(min_length=1, title="the name of a part")]
ShapeName = Annotated[str, Field(title="the name of a shape"), fields.declared("shape", "shapes")]
LoadName = Annotated[str, Field(title="the name of a load of the shape")]
Axis = Annotated[str, *one_of("component", ("x", "y"))]
StressComponent = Annotated[str, *one_of("component", ("xx", "yy", "xy"))]
Anything = Annotated[str, WithJsonSchema({"type": ["string", "number"]}), Field(title="a value with its unit")]


def _allow_text(*texts: str) -> Any:
    """Schema of a section that may also be a text."""

    def extend(schema: dict[str, Any]) -> None:
        section = dict(schema)
        schema.clear()
        short = {"enum": list(texts)} if texts else {"type": "string"}
        schema |= {"anyOf": [short, section], "description": section.pop("description", "")}

    return extend


def or_text(texts: Mapping[str, dict[str, str]], refusal: str) -> Any:
    """Validator of a section that may also be one of some texts, each with the keys that it stands for."""

    def read(value: object) -> object:
        if isinstance(value, str) and value not in texts:
            raise refuse(f"{show(value)} is {refusal}")
        return texts[value] if isinstance(value, str) else value

    return model_validator(mode="before")(read)


class SegmentConfig(Section):
    """A side, from its corner to the corner of the next side."""

    start: Place = Field(alias="from")
    """First corner."""

    centre: Place | None = None
    """Centre of an arc of less than half a turn: of a circle, or of an ellipse with axes along x and y. Without it the
    side is straight."""

    group: GroupName | None = None
    """Group, for supports, loads and quantities."""


class CircleConfig(Section):
    """A circle."""

    centre: Place
    """Centre."""

    radius: fields.Length
    """Radius."""


class HoleConfig(Section):
    """A hole, or a part of another material: a circle or an outline."""

    circle: CircleConfig | None = None
    """A round hole."""

    outline: list[SegmentConfig] | None = None
    """Sides of another hole, in either sense."""

    group: GroupName | None = None
    """Group of the circle."""

    part: PartName | None = None
    """Part that fills the hole; its material is under `parts`."""

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if (self.circle is None) == (self.outline is None):
            what = "neither a circle nor an outline" if self.circle is None else "both a circle and an outline"
            raise refuse(f"{what}; give one, such as circle: {{centre: [24 mm, 22 mm], radius: 5 mm}}")
        if self.group and self.outline is not None:
            raise refuse("an outline's sides have groups of their own; give it to each, or leave it out", "group")
        return self


class SupportConfig(Section):
    """Prescribed displacements; `fixed` is zero along both axes."""

    model_config = {"json_schema_extra": _allow_text("fixed")}

    x: Displacement | None = None
    """Along x; free by default."""

    y: Displacement | None = None
    """Along y; free by default."""

    _fixed = or_text({"fixed": {"x": "0", "y": "0"}}, "not a support; give fixed, or displacements such as {y: 0 mm}")

    @model_validator(mode="after")
    def _something(self) -> Self:
        if self.x is None and self.y is None:
            raise refuse("holds nothing; give fixed, or displacements such as {y: 0 mm}, or remove it")
        return self


class PressureConfig(Section):
    """A pressure on a group, positive towards the body. A stress alone keeps its direction."""

    model_config = {"json_schema_extra": _allow_text()}

    pressure: PressureValue
    """Pressure."""

    follower: fields.Flag = default("false")
    """Whether it follows the sides in nonlinear kinematics."""

    _alone = model_validator(mode="before")(lambda value: {"pressure": value} if isinstance(value, str) else value)


class QuantityConfig(Section):
    """A quantity of interest: one of `displacement`, `stress`, `reaction`, or the text `area` or `energy`."""

    model_config = {"json_schema_extra": _allow_text("area", "energy")}

    displacement: Axis | None = None
    """Displacement `at` a point, or the mean `of` a group."""

    stress: StressComponent | None = None
    """Stress `at` a point."""

    reaction: Axis | None = None
    """Reaction `of` a supported group."""

    area: fields.Flag | None = None
    """Growth of the area."""

    energy: fields.Flag | None = None
    """Strain energy."""

    at: PointName | None = None
    """Point."""

    of: GroupName | None = None
    """Group of sides."""

    expected: Anything | None = None
    """Published value, with its unit; the dataset has errors against it."""

    source: fields.Text | None = None
    """Source of the published value."""

    _area_or_energy = or_text(
        {name: {name: "true"} for name in ("area", "energy")},
        "not a quantity; give area or energy, or a quantity and its place, such as {displacement: y, at: tip}",
    )

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = [name for name in QUANTITIES if getattr(self, name)]
        if len(given) != 1:
            what = f"{' and '.join(given)} at once" if given else "no quantity"
            raise refuse(f"{what}; give one of {', '.join(QUANTITIES)}, such as {{displacement: y, at: tip}}")
        places, known = [name for name in ("at", "of") if getattr(self, name) is not None], QUANTITIES[self.kind][1]
        remedy = f"give {', or '.join(f'{name}: {what}' for name, what in known.items())}" if known else "remove it"
        if wrong := [*set(places) - known.keys(), *places[1:]]:
            raise refuse(f"a {self.kind} has no '{wrong[0]}'{' beside at' * (len(places) > 1)}; {remedy}", wrong[0])
        if known and not places:
            raise refuse(f"a {self.kind} without a place; {remedy}", self.kind)
        if self.source and self.expected is None:
            raise refuse("is a source without a value; give 'expected', or remove it", "source")
        try:
            self.expected_value  # noqa: B018
        except PydanticCustomError as error:
            raise refuse(str(error), "expected") from None
        return self

    @property
    def kind(self) -> str:
        """Key of `QUANTITIES`."""
        return next(name for name in QUANTITIES if getattr(self, name))

    @property
    def component(self) -> str:
        """Component of the displacement, stress or reaction, or an empty string."""
        found = getattr(self, self.kind)
        return found if isinstance(found, str) else ""

    @property
    def expected_value(self) -> float | None:
        """Expected value in SI units, or None."""
        return None if self.expected is None else read_quantity(self.expected, QUANTITIES[self.kind][0], signed=True)


class ShapeLoadConfig(Section):
    """Supports, forces and quantities of interest."""

    supports: dict[str, SupportConfig] = Field(min_length=1, title="a section for each support, by name")
    """By group or point: `fixed`, or displacements such as `{y: 0 mm}`."""

    forces: dict[str, ForceVector] = Field({}, title="forces such as [10 kN, 0], by group or point")
    """By group or point; the total force of a group, spread evenly."""

    pressures: dict[str, PressureConfig] = Field({}, title="a stress, or a section, by group")
    """By group; positive towards the body."""

    gravity: Gravity = default(["0", "0"])
    """Needs densities."""

    quantities: Named[QuantityConfig] = Field(title="a section for each quantity, by name")
    """Quantities of interest; the first is the main one."""


class ShapeFileConfig(Section):
    """A mesh file of a shape that has several."""

    file: fields.FileName
    """The mesh file."""

    mesh_size: fields.Length
    """Its name in the dataset."""


def _files(value: object, handler: ValidatorFunctionWrapHandler) -> Any:
    """List of mesh files; a single path gets mesh size 0."""
    if isinstance(value, str):
        return [ShapeFileConfig.model_construct(file=value, mesh_size=0.0)]
    files = handler(value)
    for number, one in enumerate(files):
        if one.mesh_size in [other.mesh_size for other in files[:number]]:
            raise refuse("{value}: another file has this mesh size; correct one", number)
    return files


def _allow_path(schema: dict[str, Any]) -> None:
    array = {key: schema.pop(key) for key in ("type", "items", "minItems")}
    schema["anyOf"] = [{"type": "string", "minLength": 1}, array]


Files = Annotated[list[ShapeFileConfig], Field(min_length=1, json_schema_extra=_allow_path), WrapValidator(_files)]


class ShapeConfig(Section):
    """A body from an outline or a mesh file, with named groups and points."""

    thickness: fields.Length = default("1 mm")
    """Out of the plane."""

    outline: list[SegmentConfig] | None = None
    """Sides, counter-clockwise."""

    holes: list[HoleConfig] = []
    """Holes, and parts of other materials."""

    file: Files | None = Field(None, title="the path of a file, or a list such as [{file: fine.msh, mesh_size: 2 mm}]")
    """Mesh file with groups, instead of an outline; or several with their mesh sizes: the reference uses the finest."""

    unit: fields.Length = default("1 m")
    """Unit of the coordinates in the file."""

    points: dict[str, Place] = Field({}, title="places such as [48 mm, 52 mm], by name")
    """Named points, which are particles of every mesh."""

    refined: dict[str, fields.Ratio] = Field({}, title="numbers above 0, by group, point or part")
    """Relative mesh size at a group, point or part, such as `{hole: 0.25}`."""

    parts: dict[str, fields.MaterialName] = Field({}, title="names of materials, by part")
    """Materials of the parts."""

    loads: Named[ShapeLoadConfig] = Field(title="a section for each load, by name")
    """Loads."""

    @model_validator(mode="after")
    def _one_geometry(self) -> Self:
        if (self.outline is None) == (self.file is None):
            what = "neither 'outline' nor 'file'" if self.file is None else "both 'outline' and 'file'"
            raise refuse(f"{what}; give the sides of the body, or a mesh file")
        for name in ("holes", "points", "refined") if self.file is not None else ():
            if getattr(self, name):
                raise refuse(f"a mesh file has its own {name}; remove them here", name)
        if self.file is None and "unit" in self.model_fields_set:
            raise refuse("is of the coordinates in a mesh file, and there is none; remove it", "unit")
        return self


class ShapeGridConfig(Section):
    """Every combination of the values is a scene."""

    shape: OneOrMore[ShapeName]
    """Shapes."""

    mesh_size: fields.Lengths | None = None
    """Lengths of edges; not for shapes from files."""

    material: OneOrMore[fields.MaterialName]
    """Materials."""

    load: OneOrMore[LoadName] | None = None
    """Loads; all by default."""

    definition: OneOrMore[fields.DefinitionName]
    """Definitions that derive a stiffness on triangles without a reference."""

    kinematics: OneOrMore[fields.Kinematics] = default("nonlinear")
    """`linear` springs keep their tangent at rest."""

    reference: fields.Flag = default("true")
    """Compute a converged reference; otherwise errors are against `expected` only."""

    finite_strain: fields.Flag = default("false")
    """Whether nonlinear scenes of `neo-hooke`, `yeoh` and `delingette` also get a reference at finite strain: group
    `/shapes_finite_strain`. Each takes seconds."""


SHAPES_KEY = optional(
    Named[ShapeConfig], "Bodies of any outline, and their loads.", title="a section for each shape, by name"
)
GRIDS = Annotated[dict[str, ShapeGridConfig], Field(min_length=1)]
SHAPE_GRIDS_KEY = optional(GRIDS, "Grids of shapes: group `/shapes`.", title="a section for each grid, by name")
"""Types and fields of the sections ``shapes`` and ``shape_grids`` of a study."""


# -- scenes ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ShapeScene:
    """A scene of a shape; of a mesh file ``mesh_type`` is ``"file"``, and of a single one ``mesh_size`` is 0."""

    shape: str
    mesh_type: str
    mesh_size: float
    material: str
    load: str
    definition: str
    kinematics: str

    @property
    def law(self) -> str:
        """Law at finite strain of the network: a label of the dimension ``law``, or none."""
        return DEFINITIONS[self.definition].law if self.kinematics == "nonlinear" else ""


class Shapes(NamedTuple):
    """Shapes of a study by name, with materials of parts, scenes, refinements, mesh files and referred cases."""

    shape: dict[str, Shape]
    parts: dict[str, dict[str, str]]
    scenes: tuple[ShapeScene, ...]
    referred: tuple[tuple[str, str, str], ...]
    finite: tuple[tuple[str, str, str, str], ...]
    refined: dict[str, dict[str, float]]
    files: dict[str, dict[float, str]]


def _segments(sides):
    return tuple(Segment(side.start, side.centre, side.group or "") for side in sides)


def _hole(hole):
    if hole.circle is None:
        return Hole(_segments(hole.outline), hole.part or "")
    return Hole.circle(hole.circle.centre, hole.circle.radius, hole.group or "", hole.part or "")


def _load(name, case):
    supports = tuple(Support(group, one.x, one.y) for group, one in case.supports.items())
    forces = tuple(Traction(group, force) for group, force in case.forces.items())
    pressures = tuple(Pressure(group, one.pressure, one.follower) for group, one in case.pressures.items())
    quantities = tuple(
        Quantity(label, one.kind, one.at or one.of or "", one.component, one.expected_value, one.source or "")
        for label, one in case.quantities.items()
    )
    return LoadCase(name, supports, forces, pressures, case.gravity, quantities)


def shape_of_config(name, shape, folder):
    """Shape from its section; files are relative to a folder."""
    return Shape(
        name,
        shape.thickness,
        _segments(shape.outline or ()),
        tuple(map(_hole, shape.holes)),
        dict(shape.points),
        {label: _load(label, case) for label, case in shape.loads.items()},
        next(iter(files_of(shape, folder).values()), ""),
        shape.unit,
    )


def files_of(shape, folder):
    """Mesh files of a shape's section by mesh size, the finest first."""
    return {one.mesh_size: str(folder / one.file) for one in sorted(shape.file or (), key=attrgetter("mesh_size"))}


def expand(config, declared):
    """Shapes of a study that has any, see `springtune.studies.config.model.StudyKind`."""
    found, referred, finite = set(), set(), set()
    for grid in config.shape_grids.values():
        for name in grid.shape:
            shape = config.shapes[name]
            sizes = [one.mesh_size for one in shape.file or ()] or grid.mesh_size
            mesh = [name], [MESH_OF_FILE if shape.file else GENERATED_MESH], sizes
            axes = *mesh, grid.material, grid.load or shape.loads, grid.definition, grid.kinematics
            own = [ShapeScene(*labels) for labels in product(*axes)]
            found.update(own)
            referred.update(_case(one) for one in own if grid.reference)
            finite.update((*_case(one), one.law) for one in own if grid.finite_strain and one.law)
    shapes, materials, definitions = [*config.shapes], [*config.materials], [*DEFINITIONS]

    def order(one):
        body = shapes.index(one.shape), one.mesh_size, materials.index(one.material)
        load = list(config.shapes[one.shape].loads).index(one.load)
        return *body, load, definitions.index(one.definition), KINEMATICS.index(one.kinematics)

    scenes = sorted(found, key=order)
    return Shapes(
        shape={name: shape_of_config(name, one, declared.folder) for name, one in config.shapes.items()},
        parts={name: one.parts for name, one in config.shapes.items()},
        scenes=tuple(scenes),
        referred=tuple(dict.fromkeys(case for case in map(_case, scenes) if case in referred)),
        finite=tuple(dict.fromkeys(case for one in scenes if (case := (*_case(one), one.law)) in finite)),
        refined={name: one.refined for name, one in config.shapes.items()},
        files={name: files_of(one, declared.folder) for name, one in config.shapes.items()},
    )


_case = attrgetter("shape", "material", "load")

MOST_SHAPE_SCENES = 100_000

UNIT_NEEDED_FROM_METRES = 1.0
"""Longer side [m] from which the unit of a mesh file has to be given, or there is a warning."""

EXTENT_TOLERANCE = 0.1  # largest relative difference of the extents of meshes of one body: coarse ones cut off arcs

LARGEST_FILE_CHECKED = 1_000_000  # size of a mesh file up to which its groups are looked at as a study is read [B]


def check(config, problems):
    """Check the sections of shapes and add problems, see `springtune.studies.config.model.StudyKind`."""
    stems = {}
    for name, shape in (config.shapes or {}).items():
        path = "shapes", name
        for load in shape.loads:
            other = stems.setdefault(f"{name}_{load}".casefold(), (name, load))
            if other != (name, load):
                two = f"figures of shape '{name}' under '{load}' and of '{other[0]}' under '{other[1]}'"
                problems.add((*path, "loads", load), f"{two} would have one name; rename a shape or a load")
        for part, material in shape.parts.items():
            if any(any(case.gravity) for case in shape.loads.values()):
                check_density(config, material, (*path, "parts", part), problems)
        if shape.file is None:
            _check_outline(name, shape, path, problems)
            continue
        extents = {}
        for file in files_of(shape, problems.folder).values():
            if why := why_unreadable(file):
                problems.add((*path, "file"), f"'{file}': {why}; {FROM_THE_STUDY}")
            elif not problems.found:
                _check_file(name, shape, Path(file), path, problems, extents)
    for name, grid in (config.shape_grids or {}).items() if not problems.found else ():
        _check_grid(config, grid, ("shape_grids", name), problems)


def _check_outline(name, shape, path, problems):
    """Check the parts, the geometry, the names of groups and the supports of a shape with an outline."""
    parts = {hole.part for hole in shape.holes if hole.part}
    for part in sorted(parts - set(shape.parts)):
        problems.add((*path, "holes"), f"part '{part}' has no material; add it under 'parts'")
    for part in sorted(set(shape.parts) - parts):
        what = f"{nearest(part, parts)}; or give it to what fills a hole" if parts else "no hole has a 'part'; add it"
        problems.add((*path, "parts", part), f"unknown part '{part}'; {what}")
    made = _make_shape(name, shape, path, problems) if not problems.found else None
    if made is None:
        return
    known = [*made.groups, *made.points, *made.parts]
    for refined in shape.refined:
        if refined not in known:
            message = f"unknown group, point or part '{refined}'; {nearest(refined, known)}"
            problems.add((*path, "refined", refined), message)
    for load, case in made.loads.items():
        points, held = [], []
        for support in case.supports:
            places = [made.points[support.group]] if support.group in made.points else []
            sides = [side for one in made.rounds for side in one.sides if side.group == support.group]
            places += [side.at(share) for side in sides for share in (0.0, 0.5, 1.0)]
            points += places
            held += [(support.x is not None, support.y is not None)] * len(places)
        if free := free_motion(np.array(points), np.array(held)):
            message = f"leave the body free to {free}; hold it, such as {{left: fixed}}"
            problems.add((*path, "loads", load, "supports"), message)


def _make_shape(name, shape, path, problems):
    """Return the shape of a section; None if it is refused."""
    try:
        made = shape_of_config(name, shape, problems.folder)
    except ValueError as error:
        _add_fault(problems, path, str(error).removeprefix(f"shape '{name}': "))
        return None
    for load, case in made.loads.items():
        moved = any(one.x or one.y for one in case.supports) or any(case.gravity)
        if not (moved or any(any(one.force) for one in case.tractions) or any(one.pressure for one in case.pressures)):
            message = "neither moves nor pulls the body; give a force, or a support such as {end: {x: 1 mm}}"
            problems.add((*path, "loads", load), message)
    return made


LOAD_MESSAGE = re.compile(r"load '([^']+)'(?:, (support|traction|pressure|quantity)(?: '([^']+)')?)?: (.*)", re.DOTALL)
"""Messages on a load: its name, the kind of what is wrong, the name of a quantity, and the rest."""

LOAD_KEYS = {"support": "supports", "traction": "forces", "pressure": "pressures", "quantity": "quantities"}
"""Keys of a load's section by the kind of what messages are about."""


def _add_fault(problems, path, message):
    """Add a message on the geometry or a load of a shape at its keys."""
    keys = ("outline",) if message.startswith("outline") else ("holes",) if message.startswith("hole") else ()
    if found := LOAD_MESSAGE.fullmatch(message):
        load, kind, quantity, message = found.groups()
        group = re.search("'([^']+)'", message) if kind else None
        keys = "loads", load, *([LOAD_KEYS[kind], quantity or group[1]] if kind else [])
    elif found := re.match(r"point '([^']+)'|'([^']+)' names a point", message):
        keys = "points", found[1] or found[2]
    elif found := re.match(r"(hole |outline, side )(\d+)\b", message):
        keys = "holes" if found[1] == "hole " else "outline", int(found[2]) - 1
    problems.add((*path, *keys), message)


def _check_file(name, shape, file, path, problems, extents):
    """Check the groups and the extents of a small mesh file; faults of large files show in their scenes."""
    if file.stat().st_size > LARGEST_FILE_CHECKED:
        return
    # Here, since few studies have files, and reading one takes scipy.
    from springtune.mesh.formats import read_shape
    from springtune.mesh.sheets import parts_of
    from springtune.problem.boundary import check_case

    try:
        grouped = read_shape(file, shape.unit)
    except MeshError as error:
        problems.add((*path, "file"), str(error))
        return
    sides = np.ptp(grouped.mesh.points, axis=0)
    if max(sides) > UNIT_NEEDED_FROM_METRES and "unit" not in shape.model_fields_set:
        message = f"shape '{name}': {size_text(*sides)}, since numbers in {file.name} are read in m; give their unit"
        warnings.warn(f"{message}, such as 'unit: 1 mm', or 'unit: 1 m'", AssumptionWarning, stacklevel=2)
    first, others = next(iter(extents.items()), (file.name, sides))
    if not np.allclose(sides, others, rtol=EXTENT_TOLERANCE):
        what = f"{file.name} is {size_text(*sides)}, and {first} {size_text(*others)}"
        problems.add((*path, "file"), f"{what}; give files of one body and unit")
    extents[file.name] = sides
    parts = parts_of(grouped)
    if len(parts) > 1 and not shape.parts:
        names, first = ", ".join(f"'{one}'" for one in parts if one), next(filter(None, parts))
        remedy = f"give their materials, such as {{{first}: <material>}}; the rest has the grid's"
        problems.add((*path, "parts"), f"{file} has parts {names}; {remedy}")
    for part in sorted(set(shape.parts) - set(grouped.parts)):
        there = nearest(part, grouped.parts) if grouped.parts else "the file has none"
        problems.add((*path, "parts", part), f"unknown part '{part}'; {there}")
    made = _make_shape(name, shape, path, problems)
    for case in made.loads.values() if made else ():
        try:
            check_case(grouped, case)
        except ValueError as error:
            _add_fault(problems, path, str(error))


def _check_grid(config, grid, path, problems):
    check_fit(problems, (*path, "definition"), grid.definition, [GENERATED_MESH])
    for name in grid.definition:
        if DEFINITIONS[name].uniaxial:
            problems.add((*path, "definition"), f"'{name}' is for beams that are stretched alone; choose another one")
    shapes = {name: config.shapes[name] for name in grid.shape}
    cases = [(name, load, shape.loads) for name, shape in shapes.items() for load in grid.load or shape.loads]
    for name, load, loads in cases:
        if load not in loads:
            problems.add((*path, "load"), f"shape '{name}' has no load '{load}'; {nearest(load, loads)}")
    weighs = any(any(loads[load].gravity) for _, load, loads in cases if load in loads)
    for name, shape in shapes.items():
        if shape.file is not None and grid.mesh_size:
            message = f"shape '{name}' is a mesh file, which has its own; remove it, or give '{name}' a grid of its own"
            problems.add((*path, "mesh_size"), message)
    for material in grid.material if weighs else ():
        check_density(config, material, (*path, "material"), problems)
    made = {name: shape for name, shape in shapes.items() if shape.file is None}
    if made and grid.mesh_size is None:
        problems.add((*path, "mesh_size"), "'mesh_size' is missing; give a length such as '5 mm', a list, or a range")
    for name, shape in made.items() if not problems.found else ():
        wide, high = np.ptp(shape_of_config(name, shape, Path()).extent, axis=0)
        if max(grid.mesh_size) > min(wide, high) > 0:
            most = f"{1e3 * min(wide, high):.4g} mm"
            problems.add((*path, "mesh_size"), f"is larger than shape '{name}'; give at most {most}")
        check_particles(problems, (*path, "mesh_size"), grid.mesh_size, wide, high)
    count = len(cases) * len(grid.definition) * len(grid.kinematics) * len(grid.material) * len(grid.mesh_size or "1")
    if count > MOST_SHAPE_SCENES:
        problems.add(path, f"{count} scenes; a study has at most {MOST_SHAPE_SCENES} of shapes: {FEWER_REMEDY}")
