"""Sections of a study that describe shapes, and how their values are read."""

from typing import Annotated, Any, Self

from pydantic import Field, ValidatorFunctionWrapHandler, WithJsonSchema, WrapValidator, model_validator
from pydantic_core import PydanticCustomError

from springtune import units

from ...config import fields
from ...config.fields import Named, OneOrMore, Section, default, one_of, quantity, read_quantity
from ...config.messages import refuse, show

KINDS_OF_QUANTITY = {
    "displacement": "length",
    "stress": "stress",
    "reaction": "force",
    "area": "area",
    "energy": "energy",
}
"""Kinds of units by kind of quantity."""

PLACES = {"displacement": {"at": "a point", "of": "a group"}, "stress": {"at": "a point"}}
PLACES |= {"reaction": {"of": "a group that is held"}, "area": {}, "energy": {}}
"""Keys for the place of a quantity, and what they name, by kind of quantity."""


def both(kind: str) -> Any:
    """Note of two quantities, along x and along y."""
    example = units.QUANTITY_KINDS[kind].example
    pair = f"0, {example}" if example.startswith("-") else f"{example}, 0"
    return Field(title=f"{kind}s along x and y, such as [{pair}]")


Displacement = Annotated[float, *quantity("length", signed=True)]
PressureValue = Annotated[float, *quantity("stress", signed=True)]
SignedForce = Annotated[float, *quantity("force", signed=True)]
Acceleration = Annotated[float, *quantity("acceleration", signed=True)]
Place = Annotated[tuple[Displacement, Displacement], both("length")]
ForceVector = Annotated[tuple[SignedForce, SignedForce], both("force")]
Gravity = Annotated[tuple[Acceleration, Acceleration], both("acceleration")]
GroupName = Annotated[str, Field(min_length=1, title="the name of a group")]
PointName = Annotated[str, Field(min_length=1, title="the name of a point")]
PartName = Annotated[str, Field(min_length=1, title="the name of a part")]
ShapeName = Annotated[str, Field(title="the name of a shape"), fields.declared("shape", "shapes")]
LoadName = Annotated[str, Field(title="the name of a load of the shape")]
Axis = Annotated[str, *one_of("component", ("x", "y"))]
StressComponent = Annotated[str, *one_of("component", ("xx", "yy", "xy"))]
Anything = Annotated[str, WithJsonSchema({"type": ["string", "number"]}), Field(title="a value with its unit")]


def _or_text(*texts: str) -> Any:
    """Schema of a section that may be given as a text."""

    def extend(schema: dict[str, Any]) -> None:
        section = dict(schema)
        schema.clear()
        short = {"enum": list(texts)} if texts else {"type": "string"}
        schema |= {"anyOf": [short, section], "description": section.pop("description", "")}

    return extend


class SegmentConfig(Section):
    """A side of an outline, from its corner to that of the next one."""

    start: Place = Field(alias="from")
    """Its corner."""

    centre: Place | None = None
    """Centre of the arc that it is, the way of less than half a turn: of a circle, or of an ellipse with its axes
    along x and y where its ends are not equally far from it. It is straight without."""

    group: GroupName | None = None
    """Group that it belongs to, for supports, loads and quantities."""


class CircleConfig(Section):
    """A circle."""

    centre: Place
    """Centre."""

    radius: fields.Length
    """Radius."""


class HoleConfig(Section):
    """A hole, or what fills it: a circle, or an outline."""

    circle: CircleConfig | None = None
    """Where it is round."""

    outline: list[SegmentConfig] | None = None
    """Where it is not: a round of sides, in either sense."""

    group: GroupName | None = None
    """Group that the circle belongs to; sides of an outline have their own."""

    part: PartName | None = None
    """Part of the body that fills it, of a material under `parts`; nothing fills it without."""

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if (self.circle is None) == (self.outline is None):
            what = "neither a circle nor an outline" if self.circle is None else "both a circle and an outline"
            raise refuse(f"{what}; give one, such as circle: {{centre: [24 mm, 22 mm], radius: 5 mm}}")
        if self.group and self.outline is not None:
            raise refuse("an outline's sides have groups of their own; give it to each, or leave it out", "group")
        return self


class SupportConfig(Section):
    """Displacements that a group, or a point, is given; `fixed` stands for none along both axes."""

    model_config = {"json_schema_extra": _or_text("fixed")}

    x: Displacement | None = None
    """Along x; free without."""

    y: Displacement | None = None
    """Along y; free without."""

    @model_validator(mode="before")
    @classmethod
    def _fixed(cls, value: object) -> object:
        if isinstance(value, str):
            if value != "fixed":
                raise refuse(f"{show(value)} is no support; give fixed, or displacements such as {{y: 0 mm}}")
            return {"x": "0", "y": "0"}
        return value

    @model_validator(mode="after")
    def _something(self) -> Self:
        if self.x is None and self.y is None:
            raise refuse("holds nothing; give fixed, or displacements such as {y: 0 mm}, or remove it")
        return self


class PressureConfig(Section):
    """A pressure on a group, positive towards the body; a stress alone stands for one that keeps its direction."""

    model_config = {"json_schema_extra": _or_text()}

    pressure: PressureValue
    """Pressure."""

    follower: fields.Flag = default("false")
    """Whether it turns and grows with the sides, in nonlinear kinematics."""

    @model_validator(mode="before")
    @classmethod
    def _alone(cls, value: object) -> object:
        return {"pressure": value} if isinstance(value, str) else value


class QuantityConfig(Section):
    """A quantity of interest: one of `displacement`, `stress`, `reaction`, or the text `area` or `energy`."""

    model_config = {"json_schema_extra": _or_text("area", "energy")}

    displacement: Axis | None = None
    """Displacement along it: `at` a point, or the mean one `of` a group of sides, by length."""

    stress: StressComponent | None = None
    """Stress `at` a point, recovered from the cells around it."""

    reaction: Axis | None = None
    """Force of the supports `of` a group along it."""

    area: fields.Flag | None = None
    """Growth of the area of the body; `area` alone says so."""

    energy: fields.Flag | None = None
    """Strain energy; `energy` alone says so."""

    at: PointName | None = None
    """Point."""

    of: GroupName | None = None
    """Group of sides."""

    expected: Anything | None = None
    """Value that others give, with its unit: the dataset has errors against it, too."""

    source: fields.Text | None = None
    """Who gives it."""

    @model_validator(mode="before")
    @classmethod
    def _alone(cls, value: object) -> object:
        if isinstance(value, str):
            if value not in ("area", "energy"):
                example = "{displacement: y, at: tip}"
                raise refuse(f"{show(value)} is no quantity; give area or energy, or what it is of, such as {example}")
            return {value: "true"}
        return value

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = [name for name in KINDS_OF_QUANTITY if getattr(self, name)]
        if len(given) != 1:
            what = f"{' and '.join(given)} at once" if given else "no quantity"
            raise refuse(f"{what}; give one of {', '.join(KINDS_OF_QUANTITY)}, such as {{displacement: y, at: tip}}")
        [kind] = given
        places = [name for name in ("at", "of") if getattr(self, name) is not None]
        if len(places) > 1:
            raise refuse("both a point and a group; give 'at' or 'of'", "of")
        known = ", or ".join(f"{name}: {what}" for name, what in PLACES[kind].items())
        if known and not places:
            raise refuse(f"a {kind} of nothing; give {known}", kind)
        if set(places) - set(PLACES[kind]):
            remedy = f"give {known}" if known else "remove it"
            raise refuse(f"a {kind} has no '{places[0]}'; {remedy}", places[0])
        if self.source and self.expected is None:
            raise refuse("a source of no value; give 'expected', too, or remove it", "source")
        try:
            self.expected_value  # noqa: B018
        except PydanticCustomError as error:
            raise refuse(str(error), "expected") from None
        return self

    @property
    def kind(self) -> str:
        """Key of `KINDS_OF_QUANTITY`."""
        return next(name for name in KINDS_OF_QUANTITY if getattr(self, name))

    @property
    def component(self) -> str:
        """Of the displacement, stress or reaction; empty for others."""
        found = getattr(self, self.kind)
        return found if isinstance(found, str) else ""

    @property
    def expected_value(self) -> float | None:
        """In SI units."""
        unit = KINDS_OF_QUANTITY[self.kind]
        return None if self.expected is None else read_quantity(self.expected, unit, signed=True)


class ShapeLoadConfig(Section):
    """What is done to a shape, and what is asked of it."""

    supports: dict[str, SupportConfig] = Field(min_length=1, title="a section for each support, by name")
    """What is held, by group or point: `fixed`, or displacements such as `{y: 0 mm}`."""

    forces: dict[str, ForceVector] = Field({}, title="forces such as [10 kN, 0], by group or point")
    """Forces along x and y, by group or point: of a group the total one, spread evenly by length."""

    pressures: dict[str, PressureConfig] = Field({}, title="a stress, or a section, by group")
    """Pressures, by group; positive towards the body."""

    gravity: Gravity = default(["0", "0"])
    """Acceleration along x and y, such as `[0, -9.81 m/s^2]`; needs densities."""

    quantities: Named[QuantityConfig] = Field(title="a section for each quantity, by name")
    """Quantities of interest, by name; the first one stands for all where one is wanted."""


class ShapeFileConfig(Section):
    """A mesh file of a shape that has several."""

    file: fields.FileName
    """The file, relative to the study's folder."""

    mesh_size: fields.Length
    """Length of an edge, which names the mesh in the dataset."""


def _files(value: object, handler: ValidatorFunctionWrapHandler) -> Any:
    """List of mesh files; a path alone is a list of one, of no mesh size."""
    if isinstance(value, str):
        return [ShapeFileConfig.model_construct(file=value, mesh_size=0.0)]
    files = handler(value)
    for number, one in enumerate(files):
        if one.mesh_size in [other.mesh_size for other in files[:number]]:
            raise refuse("{value}: another file has this mesh size; correct one", number)
    return files


def _or_path(schema: dict[str, Any]) -> None:
    array = {key: schema.pop(key) for key in ("type", "items", "minItems")}
    schema["anyOf"] = [{"type": "string", "minLength": 1}, array]


class ShapeConfig(Section):
    """A body of any outline, or that of a mesh file, with named groups of its sides and points."""

    thickness: fields.Length = default("1 mm")
    """Extent out of the plane."""

    outline: list[SegmentConfig] | None = None
    """Round of its sides, counter-clockwise."""

    holes: list[HoleConfig] = []
    """Holes, and parts of other materials."""

    file: (
        Annotated[list[ShapeFileConfig], Field(min_length=1, json_schema_extra=_or_path), WrapValidator(_files)] | None
    ) = Field(None, title="the path of a file, or a list such as [{file: fine.msh, mesh_size: 2 mm}]")
    """Mesh file in the place of an outline, of a format that meshio reads, its path relative to the study's folder;
    its groups are the shape's. Or a list of several with their mesh sizes: the finest one is the geometry of the
    reference."""

    unit: fields.Length = default("1 m")
    """Unit of the coordinates in the file."""

    points: dict[str, Place] = Field({}, title="places such as [48 mm, 52 mm], by name")
    """Named points of an outline or inside of it: particles of every mesh."""

    refined: dict[str, fields.Ratio] = Field({}, title="numbers above 0, by group, point or part")
    """Where the mesh is finer: mesh size over that of the rest, by group, point or part, such as `{hole: 0.25}`;
    from there on it grows."""

    parts: dict[str, fields.MaterialName] = Field({}, title="names of materials, by part")
    """Materials of the parts, by name; the rest is of the grid's material."""

    loads: Named[ShapeLoadConfig] = Field(title="a section for each load, by name")
    """Loads, by name."""

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
    """A product of parameters: every combination of the values listed is a scene of a shape.

    A single value stands for a list of one. A scene that two grids ask for is solved once.
    """

    shape: OneOrMore[ShapeName]
    """Shapes, by name."""

    mesh_size: fields.Lengths | None = None
    """Lengths of an edge of triangles; not of shapes from files, whose mesh is that of the file."""

    material: OneOrMore[fields.MaterialName]
    """Materials, by name."""

    load: OneOrMore[LoadName] | None = None
    """Loads of the shapes, by name; all of each shape without."""

    definition: OneOrMore[fields.DefinitionName]
    """Definitions that derive a stiffness on triangles and need no reference."""

    kinematics: OneOrMore[fields.Kinematics] = default("nonlinear")
    """Whether springs keep their length law or their tangent at rest."""

    reference: fields.Flag = default("true")
    """Whether there is a converged reference; else errors are those against `expected` values alone."""

    finite_strain: fields.Flag = default("false")
    """Whether nonlinear scenes of 'neo-hooke', 'yeoh' and 'delingette' are also compared with a reference of their
    law at finite strain. The group `/shapes_finite_strain` has it and the errors. Each takes seconds."""


SHAPES_KEY = (
    Named[ShapeConfig] | None,
    Field(
        None,
        title="a section for each shape, by name",
        description="Shapes: bodies of any outline, or those of mesh files, and their loads.",
    ),
)
SHAPE_GRIDS_KEY = (
    Annotated[dict[str, ShapeGridConfig], Field(min_length=1)] | None,
    Field(
        None,
        title="a section for each grid, by name",
        description="What is to be computed of the shapes; it makes the group `/shapes`.",
    ),
)
"""Types and fields of the sections ``shapes`` and ``shape_grids`` of a study."""
