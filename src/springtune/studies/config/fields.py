"""Types of the values of a study; messages tell users to give the title of a type."""

from collections.abc import Collection
from functools import partial
from itertools import chain
from typing import Annotated, Any, Self, TypeVar

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    ModelWrapValidatorHandler,
    Tag,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
    model_validator,
)

from springtune import units
from springtune.mesh.cells import MESH_TYPES
from springtune.problem.loads import KINEMATICS, LOADS
from springtune.problem.materials import MOST_TERMS
from springtune.problem.quantities import PLANES, nearest, out_of_range
from springtune.registry import NAME, NAME_RULE
from springtune.springs.base import DEFINITIONS

from .messages import OR_RANGE, explain_errors, refuse, show
from .model import FURTHER_REFERENCES

MOST_POINTS = 10_001

MOST_LISTED = 10_000

LARGEST_QUANTITY = 1e30  # size of a quantity of either sign from which nothing can be computed with it [SI units]

FEW_NAMES = 5  # most names that a message lists

Notes = tuple[Any, ...]  # notes of an `Annotated`


class Section(BaseModel):
    """A mapping of known keys in a study; the docstring of a key is its meaning in the manual."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    @model_validator(mode="wrap")
    @classmethod
    def _read(cls, value: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Read a section without its empty keys; its errors have a fault and a remedy."""
        keys = {field.alias or name: field for name, field in cls.model_fields.items()}
        if isinstance(value, dict):
            value = {key: content for key, content in value.items() if content is not None or key not in keys}
        try:
            return handler(value)
        except ValidationError as error:
            raise explain_errors(keys, value, error) from None


# -- single values -----------------------------------------------------------------------------------------------------


def read_quantity(value: object, dimension: str, signed: bool = False) -> float:
    """Return a quantity in SI units, above zero unless `signed`."""
    about = units.QUANTITY_DIMENSIONS[dimension]
    if not isinstance(value, str):
        raise refuse(f"{show(value)} instead of {about.words}; give {about.words}")
    if signed and value.strip() in ("0", "0.0", "-0"):  # which needs no unit
        return 0.0
    try:
        number = units.parse(value, dimension)
    except units.UnitError as error:
        raise refuse(str(error)) from None
    if not number > 0 and not signed:
        raise refuse(f"{show(value)} is not above zero; give a size above zero, such as '{about.example}'")
    if not abs(number) < LARGEST_QUANTITY if signed else out_of_range(number, dimension):
        raise refuse(f"{show(value)} is far out of range; give {about.words}")
    return number + 0.0


def quantity(dimension: str, signed: bool = False) -> Notes:
    """Notes of a quantity, a key of `springtune.units.QUANTITY_DIMENSIONS`; above zero unless `signed`."""
    about = units.QUANTITY_DIMENSIONS[dimension]
    pattern = r"^\s*\+?[0-9.]+([eE][+-]?[0-9]+)?\s*[^0-9\s].*$"
    form = {"type": ["string", "number"]} if signed else {"type": "string", "pattern": pattern}
    read = BeforeValidator(partial(read_quantity, dimension=dimension, signed=signed))
    return read, WithJsonSchema(form | {"examples": [about.example]}), Field(title=about.words)


def one_of(what: str, names: Collection[str]) -> Notes:
    """Notes of a name from a fixed list."""

    def known(name: str) -> str:
        if name not in names:
            raise refuse(f"unknown {what} {show(name)}; {nearest(name, names)}")
        return name

    title = f"a name such as '{next(iter(names))}'" if len(names) > FEW_NAMES else " or ".join(map(repr, names))
    return AfterValidator(known), WithJsonSchema({"enum": list(names)}), Field(title=title)


def declared(what: str, *sections: str, beside: Collection[str] = ()) -> AfterValidator:
    """Note of a name that sections of the study declare; the context of validation has them."""

    def known(name: str, info: ValidationInfo) -> str:
        found = [() if info.context is None else info.context.get(section, ()) for section in sections]
        if info.context is not None and None not in found and name not in (names := [*beside, *chain(*found)]):
            raise refuse(f"unknown {what} {show(name)}; {nearest(name, names)}; or declare it under {sections[0]}")
        return name

    return AfterValidator(known)


FILES = "files that a study names"  # key of the list of files in the context of validation


def _note_file(name: str, info: ValidationInfo) -> str:
    if info.context is not None:
        info.context[FILES].append(name)
    return name


Length = Annotated[float, *quantity("length")]
Force = Annotated[float, *quantity("force")]
Stiffness = Annotated[float, *quantity("stiffness")]
Stress = Annotated[float, *quantity("stress")]
Density = Annotated[float, *quantity("density")]
Angle = Annotated[float, *quantity("angle", signed=True)]
SignedStress = Annotated[float, *quantity("stress", signed=True)]
OrthotropicRatio = Annotated[float, Field(ge=-100, le=100, title="a number such as 0.3")]
PoissonRatio = Annotated[float, Field(gt=-1, le=0.5, title="a number above -1 and at most 0.5, such as 0.3")]
Ratio = Annotated[float, Field(gt=0, allow_inf_nan=False, title="a number above 0")]
Terms = Annotated[int, Field(ge=1, le=MOST_TERMS, title=f"a whole number from 1 to {MOST_TERMS}")]
Points = Annotated[int, Field(ge=2, le=MOST_POINTS, title=f"a whole number from 2 to {MOST_POINTS}, such as 61")]
Flag = Annotated[bool, Field(title="true or false")]
MeshType = Annotated[
    str,
    Field(title="a mesh type such as 'structured'", examples=list(MESH_TYPES)),
    declared("mesh type", "mesh_files", beside=MESH_TYPES),
]
MadeType = Annotated[str, *one_of("mesh type", MESH_TYPES)]
Load = Annotated[str, *one_of("load", LOADS)]
Plane = Annotated[str, *one_of("plane", PLANES)]
FurtherReference = Annotated[str, *one_of("reference", FURTHER_REFERENCES)]
Kinematics = Annotated[str, *one_of("kinematics", KINEMATICS)]
DefinitionName = Annotated[str, *one_of("definition", DEFINITIONS)]
Text = Annotated[str, Field(min_length=1, title="a text")]
FileName = Annotated[str, Field(min_length=1, title="the path of a file"), AfterValidator(_note_file)]
BeamName = Annotated[str, Field(title="the name of a beam"), declared("beam", "beams")]
MaterialName = Annotated[str, Field(title="the name of a material"), declared("material", "materials")]

# -- lists and ranges --------------------------------------------------------------------------------------------------

Item = TypeVar("Item")


def or_item(schema: dict[str, Any]) -> None:
    """Let the schema of a list allow a single item."""
    if "items" in schema:
        array = {key: schema.pop(key) for key in ("type", "items", "minItems", "maxItems")} | {"uniqueItems": True}
        schema["anyOf"] = [array["items"], array]


def _read_list(value: object, handler: ValidatorFunctionWrapHandler) -> Any:
    """List of one value or several; only a tuple, the column of a file of rows, may have a value twice."""
    items = handler([value] if isinstance(value, str) else value)
    if isinstance(value, list) and len(set(items)) < len(items):
        number = next(number for number, item in enumerate(items) if item in items[:number])
        raise refuse("{value} is listed twice; remove one", number)
    return items


OneOrMore = Annotated[
    list[Item], Field(min_length=1, max_length=MOST_LISTED, json_schema_extra=or_item), WrapValidator(_read_list)
]
"""A list without duplicates; a single value is a list of one."""


class Range(Section):
    """Numbers between two ends, both included."""

    first: Annotated[str, Field(alias="from", title="the first value")]
    last: Annotated[str, Field(alias="to", title="the last value")]
    points: Annotated[int, Field(ge=2, le=MOST_LISTED, title=f"a whole number from 2 to {MOST_LISTED}, such as 9")]
    spacing: Annotated[str, *one_of("spacing", ("linear", "logarithmic"))] = "linear"


RANGE_KEYS = frozenset(field.alias or name for name, field in Range.model_fields.items())

RANGE_DIGITS = 12  # significant digits of the inner values of a range, so that 1.5 mm is 1.5e-3 m


def spaced(first: float, last: float, points: int, spacing: str) -> list[float]:
    """Values of a range, with both ends unchanged.

    >>> spaced(1e-3, 4e-3, 3, "linear"), spaced(1e-3, 4e-3, 3, "logarithmic")
    ([0.001, 0.0025, 0.004], [0.001, 0.002, 0.004])
    """
    values = (np.linspace if spacing == "linear" else np.geomspace)(first, last, points)
    return [first, *(float(f"{value:.{RANGE_DIGITS}g}") for value in values[1:-1]), last]


def _read_range(value: object, handler: ValidatorFunctionWrapHandler) -> Any:
    """Expand a range such as ``{from: 1 mm, to: 5 mm, points: 9}`` to numbers; other values stay."""
    if not isinstance(value, dict) or RANGE_KEYS.isdisjoint(value):
        return handler(value)
    ends = Range.model_validate(value)
    first, last = handler((ends.first, ends.last))
    if not first < last:
        remedy = "exchange them" if last < first else "give that one value, or a larger 'to'"
        raise refuse(f"{{value}} is not below 'to', {show(ends.last)}; {remedy}", "from")
    if ends.spacing == "logarithmic" and not first > 0:
        raise refuse("{value} has no logarithm; give a number above zero, or linear spacing", "from")
    return spaced(first, last, ends.points, ends.spacing)


def _or_range(schema: dict[str, Any]) -> None:
    or_item(schema)
    between = Range.model_json_schema()
    between["properties"] |= dict.fromkeys(("from", "to"), schema["anyOf"][0])
    schema["anyOf"].append(between)


Angles = Annotated[
    list[Angle],
    Field(min_length=1, title="an angle such as '30 deg', or a list"),
    BeforeValidator(
        lambda value: [value] if isinstance(value, str) else value, json_schema_input_type=Angle | list[Angle]
    ),
]
Numbers = Annotated[OneOrMore[Item], Field(json_schema_extra=_or_range), WrapValidator(_read_range), OR_RANGE]
"""Numbers: one, a list, or a range."""

DefinitionNames = OneOrMore[DefinitionName]
Lengths = Numbers[Length]
Forces = Numbers[Force]
Stresses = Numbers[Stress]
PoissonRatios = Numbers[PoissonRatio]
Ratios = Numbers[Ratio]
ForceOwner = Annotated[
    str,
    Field(title="the name of a beam, material or load"),
    declared("beam, material or load", "beams", "materials", beside=LOADS),
]
GridForces = Annotated[
    Annotated[Forces, Tag("of all")] | Annotated[dict[ForceOwner, Forces], Field(min_length=1), Tag("of each")],
    Discriminator(lambda value: "of each" if isinstance(value, dict) and not RANGE_KEYS & value.keys() else "of all"),
    Field(title="a force such as '400 kN', a list, or a range; or these for each beam, material or load"),
]

# -- sections by name --------------------------------------------------------------------------------------------------


def _check_names(sections: dict[str, Item]) -> dict[str, Item]:
    """Refuse names that are no file names, or differ in case only."""
    seen: dict[str, str] = {}
    for name in sections:
        if not NAME.fullmatch(name):
            raise refuse(f"{show(name)} cannot be a name here; {NAME_RULE}", name)
        other = seen.setdefault(name.casefold(), name)
        if other != name:
            raise refuse(f"'{name}' and '{other}' differ in case only, which file systems may ignore; rename one", name)
    return sections


Named = Annotated[
    dict[str, Item],
    Field(min_length=1, json_schema_extra={"propertyNames": {"pattern": f"^{NAME.pattern}$"}}),
    AfterValidator(_check_names),
]
"""Sections whose names may become file names."""


def default(value: Any, **options: Any) -> Any:
    """Field with a default, written as in a study."""
    return Field(value, validate_default=True, **options)


def optional(section: Any, description: str, **options: Any) -> tuple[Any, Any]:
    """Type and field of a section that a study may leave out."""
    return section | None, Field(None, description=description, **options)
