"""Sections of a study that describe shapes."""

from typing import Annotated, Any, Self

from pydantic import Field, ValidatorFunctionWrapHandler, WithJsonSchema, WrapValidator, model_validator
from pydantic_core import PydanticCustomError

from springtune import units

from ...config import fields
from ...config.fields import Named, OneOrMore, Section, default, one_of, quantity, read_quantity
from ...config.messages import refuse, show

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
    """A pressure on a group, positive towards the body. A stress alone keeps its direction."""

    model_config = {"json_schema_extra": _allow_text()}

    pressure: PressureValue
    """Pressure."""

    follower: fields.Flag = default("false")
    """Whether it follows the sides in nonlinear kinematics."""

    @model_validator(mode="before")
    @classmethod
    def _alone(cls, value: object) -> object:
        return {"pressure": value} if isinstance(value, str) else value


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
        given = [name for name in QUANTITIES if getattr(self, name)]
        if len(given) != 1:
            what = f"{' and '.join(given)} at once" if given else "no quantity"
            raise refuse(f"{what}; give one of {', '.join(QUANTITIES)}, such as {{displacement: y, at: tip}}")
        places, known = [name for name in ("at", "of") if getattr(self, name) is not None], QUANTITIES[self.kind][1]
        remedy = f"give {', or '.join(f'{name}: {what}' for name, what in known.items())}" if known else "remove it"
        if wrong := [*set(places) - known.keys(), *places[1:]]:
            raise refuse(f"a {self.kind} has no '{wrong[0]}'{' beside at' * (len(places) > 1)}; {remedy}", wrong[0])
        if known and not places:
            raise refuse(f"a {self.kind} of nothing; {remedy}", self.kind)
        if self.source and self.expected is None:
            raise refuse("a source of no value; give 'expected', too, or remove it", "source")
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
        dimension = QUANTITIES[self.kind][0]
        return None if self.expected is None else read_quantity(self.expected, dimension, signed=True)


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


class ShapeConfig(Section):
    """A body from an outline or a mesh file, with named groups and points."""

    thickness: fields.Length = default("1 mm")
    """Out of the plane."""

    outline: list[SegmentConfig] | None = None
    """Sides, counter-clockwise."""

    holes: list[HoleConfig] = []
    """Holes, and parts of other materials."""

    file: (
        Annotated[list[ShapeFileConfig], Field(min_length=1, json_schema_extra=_allow_path), WrapValidator(_files)]
        | None
    ) = Field(None, title="the path of a file, or a list such as [{file: fine.msh, mesh_size: 2 mm}]")
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


SHAPES_KEY = (
    Named[ShapeConfig] | None,
    Field(None, title="a section for each shape, by name", description="Bodies of any outline, and their loads."),
)
SHAPE_GRIDS_KEY = (
    Annotated[dict[str, ShapeGridConfig], Field(min_length=1)] | None,
    Field(None, title="a section for each grid, by name", description="Grids of shapes: group `/shapes`."),
)
"""Types and fields of the sections ``shapes`` and ``shape_grids`` of a study."""
