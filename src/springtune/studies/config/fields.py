"""Types of the values of a study: parsing, and the expected form in words."""

import math
from collections.abc import Callable, Collection, Mapping
from typing import Annotated, Any, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    Tag,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, core_schema

from springtune import units
from springtune.mesh.types import MESH_TYPES
from springtune.problem.loads import KINEMATICS, LOADS
from springtune.problem.materials import MOST_TERMS
from springtune.problem.parameters import PLANES
from springtune.problem.quantities import beyond, nearest
from springtune.registry import NAME, NAME_RULE
from springtune.springs.base import DEFINITIONS

from .messages import Key, refuse, show
from .model import FURTHER_REFERENCES

MOST_POINTS = 10_001

LONGEST_TEXT = 1000

MOST_LISTED = 10_000

BEYOND_MEASURE = 1e30
"""Size of a quantity of either sign from which nothing can be computed with it [SI units]."""

FEW_NAMES = 5
"""Most names that a message lists."""


class Scalar:
    """Annotation of a scalar field."""

    def __init__(self, read: Callable[[str], Any], schema: dict[str, Any], words: str, short: str = "") -> None:
        self.read, self.schema, self.words, self.short = read, schema, words, short or words

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return dict(self.schema)

    def _read(self, value: object) -> Any:
        if not isinstance(value, str) or not value.strip():
            raise refuse(f"{show(value)} instead of {self.short}; give {self.short}")
        if len(value) > LONGEST_TEXT:
            raise refuse(f"{show(value)}, {len(value)} characters; give {self.short}, of at most {LONGEST_TEXT}")
        return self.read(value)


def quantity(kind: str, negative: str = "give a size above zero", signed: bool = False) -> Scalar:
    """Annotation of a quantity, a key of `springtune.units.QUANTITY_KINDS`; above zero unless `signed`."""
    about = units.QUANTITY_KINDS[kind]

    def read(value: str) -> float:
        if signed and value.strip() in ("0", "0.0", "-0"):  # which needs no unit
            return 0.0
        try:
            number = units.parse(value, kind)
        except units.UnitError as error:
            raise refuse(str(error)) from None
        if not number > 0 and not signed:
            raise refuse(f"{show(value)} is not above zero; {negative}, such as '{about.example}'")
        if not abs(number) < BEYOND_MEASURE if signed else beyond(number, kind):
            raise refuse(f"{show(value)} is beyond all measure; give {about.words}")
        return number + 0.0

    pattern = r"^\s*\+?[0-9.]+([eE][+-]?[0-9]+)?\s*[^0-9\s].*$"
    form = {"type": ["string", "number"]} if signed else {"type": "string", "pattern": pattern}
    return Scalar(read, form | {"examples": [about.example]}, about.words)


def number(words: str, low: float, high: float, *, above: bool = False, whole: bool = False) -> Scalar:
    """Annotation of a number from `low`, or `above` it, to `high`."""

    def read(value: str) -> float:
        try:
            number = int(value) if whole else float(value)
        except ValueError:
            raise refuse(f"{show(value)} is not a {'whole ' if whole else ''}number; give {words}") from None
        if not (low < number if above else low <= number) or not number <= high or not math.isfinite(number):
            raise refuse(f"{show(value)} is out of range; give {words}")
        return number

    schema: dict[str, Any] = {"type": "integer" if whole else "number", "exclusiveMinimum" if above else "minimum": low}
    if math.isfinite(high):
        schema["maximum"] = high
    return Scalar(read, schema, words)


def one_of(what: str, names: Collection[str]) -> Scalar:
    """Annotation of a name from a fixed list."""

    def read(value: str) -> str:
        if value not in names:
            raise refuse(f"unknown {what} {show(value)}; {nearest(value, names)}")
        return value

    words = " or ".join(f"'{name}'" for name in names)
    short = f"a name such as '{next(iter(names))}'" if len(names) > FEW_NAMES else words
    return Scalar(read, {"enum": list(names)}, words, short)


Length = Annotated[float, quantity("length")]
Force = Annotated[float, quantity("force", "the load's name carries the sign: give a magnitude")]
Stiffness = Annotated[float, quantity("stiffness")]
Stress = Annotated[float, quantity("stress")]
Density = Annotated[float, quantity("density")]
Angle = Annotated[float, quantity("angle", signed=True)]
SignedStress = Annotated[float, quantity("stress", signed=True)]
OrthotropicRatio = Annotated[float, number("a number such as 0.3", -100, 100)]
POISSON_RATIO = number("a number above -1 and at most 0.5, such as 0.3", -1, 0.5, above=True)
PoissonRatio = Annotated[float, POISSON_RATIO]
Ratio = Annotated[float, number("a number above 0", 0, math.inf, above=True)]
Terms = Annotated[int, number(f"a whole number from 1 to {MOST_TERMS}", 1, MOST_TERMS, whole=True)]
Points = Annotated[int, number(f"a whole number from 2 to {MOST_POINTS}, such as 61", 2, MOST_POINTS, whole=True)]


def declared(what: str, section: str, beside: Collection[str] = ()) -> AfterValidator:
    """Annotation of a name that a section of the study declares; the context of validation has its sections."""

    def known(name: str, info: ValidationInfo) -> str:
        names = () if info.context is None else info.context.get(section, ())
        if info.context is not None and names is not None and name not in names and name not in beside:
            raise refuse(f"unknown {what} '{name}'; {nearest(name, [*beside, *names])}; or declare it under {section}")
        return name

    return AfterValidator(known)


FILES = "files that a study names"
"""Key of their list in the context of validation."""


def _noted(name: str, info: ValidationInfo) -> str:
    if info.context is not None:
        info.context[FILES].append(name)
    return name


MeshType = Annotated[
    str,
    Scalar(str, {"type": "string", "examples": list(MESH_TYPES)}, "a mesh type such as 'structured'"),
    declared("mesh type", "mesh_files", MESH_TYPES),
]
MadeType = Annotated[str, one_of("mesh type", MESH_TYPES)]
Load = Annotated[str, one_of("load", LOADS)]
Plane = Annotated[str, one_of("plane", PLANES)]
FurtherReference = Annotated[str, one_of("reference", FURTHER_REFERENCES)]
Kinematics = Annotated[str, one_of("kinematics", KINEMATICS)]
DefinitionName = Annotated[str, one_of("definition", DEFINITIONS)]
Text = Annotated[str, Scalar(str, {"type": "string", "minLength": 1}, "a text")]
FileName = Annotated[str, Scalar(str, {"type": "string", "minLength": 1}, "the path of a file"), AfterValidator(_noted)]
BeamName = Annotated[str, Scalar(str, {"type": "string"}, "the name of a beam"), declared("beam", "beams")]
MaterialName = Annotated[
    str, Scalar(str, {"type": "string"}, "the name of a material"), declared("material", "materials")
]


class Wrapped:
    """Annotation whose `_read` checks the form of a value before pydantic reads its items."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_wrap_validator_function(self._read, handler(source))

    _read: Callable[..., Any]


class Words(Wrapped):
    """Annotation with words for the expected value."""

    def __init__(self, words: str) -> None:
        self.words = words

    def _read(self, value: object, handler: ValidatorFunctionWrapHandler) -> Any:
        try:
            return handler(value)
        except ValidationError as error:
            if any(details["type"] == "study" for details in error.errors(include_url=False)):
                raise
            raise refuse(f"{show(value)} does not fit; give {self.words}") from None


Flag = Annotated[bool, Words("true or false")]


def once(values: list[Any], *path: Key) -> list[Any]:
    """Return the values of a list, whose place in a section is given, if none stands twice."""
    seen = set()
    for number, value in enumerate(values):
        if value in seen:
            raise refuse("{value} is listed twice; remove one", *path, number)
        seen.add(value)
    return values


class OneOrMore(Wrapped):
    """Annotation of a non-empty list without duplicates; a single value is a list of one."""

    def __init__(self, repeats: bool = False) -> None:
        self.repeats = repeats

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        array = handler(schema["schema"]) | {"minItems": 1} | ({} if self.repeats else {"uniqueItems": True})
        return {"anyOf": [array["items"], array]}

    def _read(self, value: object, handler: ValidatorFunctionWrapHandler) -> Any:
        listed = [value] if isinstance(value, str) else value
        if not isinstance(listed, list):
            raise refuse(f"{show(value)} instead of a value or a list; write it as [first, second]")
        if not listed:
            raise refuse("an empty list leaves the grid empty; give at least one value, or remove the grid")
        if len(listed) > MOST_LISTED:
            raise refuse(f"{len(listed)} values; give at most {MOST_LISTED}, or split the study into several")
        items = handler(listed)
        return items if self.repeats else once(items)


def default(value: Any, **options: Any) -> Any:
    """Field with a default, written as in a study."""
    return Field(value, validate_default=True, **options)


def optional(section: Any, description: str) -> tuple[Any, Any]:
    """Type and field of a section that a study may leave out."""
    return section | None, Field(None, description=description)


def expected_value(field: FieldInfo) -> str:
    """Expected value of a field in words, such as ``a length such as '200 mm'``."""
    # A field that may be absent has its notes one level deeper.
    for annotation, notes in ((field.annotation, field.metadata), *map(_parts, get_args(field.annotation))):
        for note in notes:
            if hasattr(note, "words"):
                return str(note.words)
            if isinstance(note, OneOrMore):
                item = get_args(annotation)[0]
                return f"{get_args(item)[1].words}, or a list"
    listed = get_origin(field.annotation) is list
    return "a list of sections; see below" if listed else "a section; see below"


def _parts(annotation: Any) -> tuple[Any, tuple[Any, ...]]:
    """Type and notes of an `Annotated`; any other annotation has no notes."""
    if get_origin(annotation) is not Annotated:
        return annotation, ()
    inside, *notes = get_args(annotation)
    return inside, tuple(notes)


class Section(BaseModel):
    """A mapping of known keys in a study; the text below a key is its meaning in the manual."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True, use_attribute_docstrings=True)

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        for field in cls.model_fields.values():
            field.description = field.description and " ".join(field.description.split())

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, value: object) -> dict[str, object]:
        names = {field.alias or name: field for name, field in cls.model_fields.items()}
        if not isinstance(value, dict):
            raise refuse(f"{show(value)} instead of keys and values; give the keys {', '.join(names)}")
        for key in value:
            if key not in names:
                raise refuse(f"unknown key {show(key)}; {nearest(key, names)}", key)
        given = {key: content for key, content in value.items() if content is not None}
        for name, remedy in cls._needed(given).items():
            if name not in given:
                raise refuse(f"'{name}' is missing; give {expected_value(names[name])}{remedy}", name)
        return given

    @classmethod
    def _needed(cls, given: Mapping[str, object]) -> dict[str, str]:
        """Required keys, each with a remedy besides giving it."""
        return {field.alias or name: "" for name, field in cls.model_fields.items() if field.is_required()}


class Range(Section):
    """Numbers between two ends, both included."""

    first: Annotated[str, Scalar(str, {}, "the first value")] = Field(alias="from")
    last: Annotated[str, Scalar(str, {}, "the last value")] = Field(alias="to")
    points: Annotated[int, number(f"a whole number from 2 to {MOST_LISTED}, such as 9", 2, MOST_LISTED, whole=True)]
    spacing: Annotated[str, one_of("spacing", ("linear", "logarithmic"))] = "linear"


RANGE_KEYS = frozenset(field.alias or name for name, field in Range.model_fields.items())

RANGE_DIGITS = 12
"""Significant digits of the inner values of a range, so that 1.5 mm is 1.5e-3 m."""


def spaced(first: float, last: float, points: int, spacing: str) -> list[float]:
    """Values of a range, with both ends unchanged.

    Examples
    --------
    >>> spaced(1e-3, 4e-3, 3, "linear"), spaced(1e-3, 4e-3, 3, "logarithmic")
    ([0.001, 0.0025, 0.004], [0.001, 0.002, 0.004])
    """
    shares = [number / (points - 1) for number in range(1, points - 1)]
    if spacing == "linear":
        inside = [first + (last - first) * share for share in shares]
    else:
        inside = [math.exp((1 - share) * math.log(first) + share * math.log(last)) for share in shares]
    return [first, *(float(f"{value:.{RANGE_DIGITS}g}") for value in inside), last]


class Values(OneOrMore):
    """Annotation of numbers: one, a list, or a range such as ``{from: 1 mm, to: 5 mm, points: 9}``."""

    def __init__(self, words: str) -> None:
        super().__init__(repeats=True)
        self.words = f"{words}, a list, or a range"

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        item, array = super().__get_pydantic_json_schema__(schema, handler)["anyOf"]
        between = Range.model_json_schema()
        between["properties"] |= {"from": item, "to": item}
        return {"anyOf": [item, array, between]}

    def _read(self, value: object, handler: ValidatorFunctionWrapHandler) -> Any:
        if not isinstance(value, dict):
            return super()._read(value, handler)
        if RANGE_KEYS.isdisjoint(value):
            raise refuse(f"a mapping instead of {self.words}; a range is {{from: .., to: .., points: 9}}")
        ends = Range.model_validate(value)
        first, last = handler([ends.first, ends.last])
        if not first < last:
            remedy = "exchange them" if last < first else "give that one value, or a larger 'to'"
            raise refuse(f"{{value}} is not below 'to', {show(ends.last)}; {remedy}", "from")
        if ends.spacing == "logarithmic" and not first > 0:
            raise refuse("{value} has no logarithm; give a number above zero, or linear spacing", "from")
        return spaced(first, last, ends.points, ends.spacing)


DefinitionNames = Annotated[list[DefinitionName], OneOrMore()]
Lengths = Annotated[list[Length], Values("a length such as '5 mm'")]
Forces = Annotated[list[Force], Values("a force such as '400 kN'")]
Stresses = Annotated[list[Stress], Values("a stress such as '210 GPa'")]
PoissonRatios = Annotated[list[PoissonRatio], Values("a number above -1 and at most 0.5")]
Ratios = Annotated[list[Ratio], Values("a number above 0")]


def _given(forces: dict[str, list[float]]) -> dict[str, list[float]]:
    if not forces:
        raise refuse("no force at all; give one for each beam, such as {200x40: 400 kN}")
    return {beam: once(values, beam) for beam, values in forces.items()}


BeamForces = Annotated[
    Annotated[Forces, Tag("all")] | Annotated[dict[BeamName, Forces], AfterValidator(_given), Tag("each")],
    Discriminator(lambda value: "each" if isinstance(value, dict) and not RANGE_KEYS & value.keys() else "all"),
    Words("a force such as '400 kN', a list, or a range; or these for each beam"),
]


class Named(Wrapped):
    """Annotation of a non-empty mapping whose names may become file names."""

    def __init__(self, what: str, for_files: bool = True) -> None:
        self.what, self.for_files = what, for_files
        self.words = f"a section for each {what}, by name; see below"

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        names = {"propertyNames": {"pattern": f"^{NAME.pattern}$"}} if self.for_files else {}
        return handler(schema["schema"]) | {"minProperties": 1} | names

    def _read(self, value: object, handler: ValidatorFunctionWrapHandler) -> Any:
        if not isinstance(value, dict) or not value:
            shown = show(value) if value else f"no {self.what} at all"
            raise refuse(f"{shown}; give at least one {self.what}, its name followed by a colon and its keys")
        seen: dict[str, str] = {}
        for name in value if self.for_files else ():
            if not NAME.fullmatch(name):
                raise refuse(f"{show(name)} cannot name a {self.what}; {NAME_RULE}", name)
            other = seen.setdefault(name.casefold(), name)
            if other != name:
                message = f"'{name}' and '{other}' differ in case only, which file systems may ignore; rename one"
                raise refuse(message, name)
        return handler(value)
