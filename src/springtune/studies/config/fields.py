"""Types of the values of a study: parsing, and the expected form in words."""

import math
from collections.abc import Callable, Collection
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from springtune import units
from springtune.mesh import MESH_TYPES
from springtune.problem.loads import KINEMATICS, LOADS
from springtune.problem.materials import MOST_TERMS
from springtune.problem.parameters import PLANES
from springtune.problem.quantities import beyond, nearest
from springtune.registry import NAME, NAME_RULE
from springtune.springs import DEFINITIONS

from .messages import refuse, show
from .model import FURTHER_REFERENCES

MOST_POINTS = 10_001

LONGEST_TEXT = 1000

MOST_LISTED = 10_000

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
        try:
            number = units.parse(value, kind)
        except units.UnitError as error:
            raise refuse(str(error)) from None
        if not number > 0 and not signed:
            raise refuse(f"{show(value)} is not above zero; {negative}, such as '{about.example}'")
        if not signed and beyond(number, kind):
            raise refuse(f"{show(value)} is beyond all measure; give {about.words}")
        return number

    sign = "[+-]" if signed else r"\+"
    pattern = rf"^\s*{sign}?[0-9.]+([eE][+-]?[0-9]+)?\s*[^0-9\s].*$"
    return Scalar(read, {"type": "string", "pattern": pattern, "examples": [about.example]}, about.words)


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


def _read_flag(value: str) -> bool:
    if value.lower() not in ("true", "false"):
        raise refuse(f"{show(value)} is neither true nor false; give one of them")
    return value.lower() == "true"


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
# Mesh types, beams and materials may be names that a study declares: a type takes any text, `checks` looks it up.
MeshType = Annotated[
    str, Scalar(str, {"type": "string", "examples": list(MESH_TYPES)}, "a mesh type such as 'structured'")
]
MadeType = Annotated[str, one_of("mesh type", MESH_TYPES)]
Load = Annotated[str, one_of("load", LOADS)]
Plane = Annotated[str, one_of("plane", PLANES)]
FurtherReference = Annotated[str, one_of("reference", FURTHER_REFERENCES)]
Kinematics = Annotated[str, one_of("kinematics", KINEMATICS)]
DefinitionName = Annotated[str, one_of("definition", DEFINITIONS)]
_COUNT = number(f"a whole number from 2 to {MOST_LISTED}, such as 9", 2, MOST_LISTED, whole=True)
Flag = Annotated[bool, Scalar(_read_flag, {"type": "boolean"}, "true or false")]
Text = Annotated[str, Scalar(str, {"type": "string", "minLength": 1}, "a text")]
FileName = Annotated[str, Scalar(str, {"type": "string", "minLength": 1}, "the path of a file")]
BeamName = Annotated[str, Scalar(str, {"type": "string"}, "the name of a beam")]
MaterialName = Annotated[str, Scalar(str, {"type": "string"}, "the name of a material")]


class Wrapped:
    """Annotation whose `_read` checks the form of a value before pydantic reads its items."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_wrap_validator_function(self._read, handler(source))

    _read: Callable[..., Any]


class OneOrMore(Wrapped):
    """Annotation of a non-empty list without duplicates; a single value is a list of one."""

    def __init__(self, repeats: bool = False) -> None:
        self.repeats = repeats

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        array = handler(schema["schema"]) | {"minItems": 1} | ({} if self.repeats else {"uniqueItems": True})
        return {"anyOf": [array["items"], array]}

    def _read(self, value: object, handler: core_schema.ValidatorFunctionWrapHandler) -> Any:
        listed = [value] if isinstance(value, str) else value
        if not isinstance(listed, list):
            raise refuse(f"{show(value)} instead of a value or a list; write it as [first, second]")
        if not listed:
            raise refuse("an empty list leaves the grid empty; give at least one value, or remove the grid")
        if len(listed) > MOST_LISTED:
            raise refuse(f"{len(listed)} values; give at most {MOST_LISTED}, or split the study into several")
        items = handler(listed)
        seen = set()
        for number, item in enumerate(items):
            if item in seen and not self.repeats:
                raise refuse(f"{show(listed[number])} is listed twice; remove one", number)
            seen.add(item)
        return items


SPACINGS = ("linear", "logarithmic")

RANGE_KEYS = ("from", "to", "points", "spacing")

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
        self.item, self.words = words, f"{words}, a list, or a range"

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        found = super().__get_pydantic_json_schema__(schema, handler)
        (item, array), whole = found["anyOf"], {"type": "integer", "minimum": 2, "maximum": MOST_LISTED}
        keys = {"from": item, "to": item, "points": whole, "spacing": {"enum": list(SPACINGS)}}
        between = {
            "type": "object",
            "properties": keys,
            "required": list(RANGE_KEYS[:3]),
            "additionalProperties": False,
        }
        return {"anyOf": [item, array, between]}

    def _read(self, value: object, handler: core_schema.ValidatorFunctionWrapHandler) -> Any:
        return self._read_range(value, handler) if isinstance(value, dict) else super()._read(value, handler)

    def _read_range(self, value: dict[str, Any], handler: core_schema.ValidatorFunctionWrapHandler) -> list[float]:
        given = {key: text for key, text in value.items() if text is not None}
        if not set(given) & set(RANGE_KEYS):
            raise refuse(f"a mapping instead of {self.words}; a range is {{from: .., to: .., points: 9}}")
        for key in given:
            if key not in RANGE_KEYS:
                raise refuse(f"unknown key {show(key)} of a range; {nearest(key, RANGE_KEYS)}", key)
        for key in RANGE_KEYS[:3]:
            if key not in given:
                raise refuse(f"a range without '{key}'; give from, to and points: {{from: .., to: .., points: 9}}")
        spacing = given.get("spacing", SPACINGS[0])
        if spacing not in SPACINGS:
            raise refuse(f"{show(spacing)} is no spacing; give {' or '.join(SPACINGS)}", "spacing")
        points = _COUNT.read(given["points"]) if isinstance(given["points"], str) else 0
        if not points:
            raise refuse(f"{show(given['points'])} instead of a number; give {_COUNT.words}", "points")
        first, last = handler([given["from"], given["to"]])
        if not first < last:
            remedy = "exchange them" if last < first else "give that one value, or a larger 'to'"
            raise refuse(f"{show(given['from'])} is not below 'to', {show(given['to'])}; {remedy}", "from")
        if spacing != SPACINGS[0] and not first > 0:
            raise refuse(f"{show(given['from'])} has no logarithm; give a number above zero, or linear spacing", "from")
        return spaced(first, last, points, spacing)


DefinitionNames = Annotated[list[DefinitionName], OneOrMore()]
Lengths = Annotated[list[Length], Values("a length such as '5 mm'")]
Forces = Annotated[list[Force], Values("a force such as '400 kN'")]
Stresses = Annotated[list[Stress], Values("a stress such as '210 GPa'")]
PoissonRatios = Annotated[list[PoissonRatio], Values("a number above -1 and at most 0.5")]
Ratios = Annotated[list[Ratio], Values("a number above 0")]


class PerBeam:
    """Annotation of forces by beam; forces for all beams have the key None."""

    words = "a force such as '400 kN', a list, or a range; or these for each beam"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        single = handler.generate_schema(Forces)
        each = core_schema.no_info_wrap_validator_function(self._read_each, handler(source))
        everywhere = core_schema.no_info_after_validator_function(lambda forces: {None: forces}, single)
        choices: dict[Any, CoreSchema] = {"single": everywhere, "each": each}
        return core_schema.tagged_union_schema(choices, self._kind)

    @staticmethod
    def _kind(value: object) -> str:
        between = isinstance(value, dict) and value and set(value) <= set(RANGE_KEYS)
        return "each" if isinstance(value, dict) and not between else "single"

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        each = handler(schema["choices"]["each"]["schema"])
        return {"anyOf": [*each["additionalProperties"]["anyOf"], each | {"minProperties": 1}]}

    @staticmethod
    def _read_each(value: object, handler: core_schema.ValidatorFunctionWrapHandler) -> Any:
        if not value:
            raise refuse("no force at all; give one for each beam, such as {200x40: 400 kN}")
        return handler(value)


class Named(Wrapped):
    """Annotation of a non-empty mapping whose names may become file names."""

    def __init__(self, what: str, for_files: bool = True) -> None:
        self.what, self.for_files = what, for_files
        self.words = f"a section for each {what}, by name; see below"

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        described = handler(schema["schema"]) | {"minProperties": 1}
        if self.for_files:
            described["propertyNames"] = {"pattern": f"^{NAME.pattern}$"}
        return described

    def _read(self, value: object, handler: core_schema.ValidatorFunctionWrapHandler) -> Any:
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


class Groups:
    """Annotation of groups of at least two names, each used once; one group may stand alone."""

    words = "a list of parameters such as [mesh_size, force], or several such lists"

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        group = {"type": "array", "items": {"enum": list(self.names)}, "minItems": 2, "uniqueItems": True}
        return {"anyOf": [group, {"type": "array", "items": group}]}

    def _read(self, value: object) -> list[list[str]]:
        groups = [value] if isinstance(value, list) and value and isinstance(value[0], str) else value
        if not isinstance(groups, list) or not groups:
            raise refuse(f"{show(value)} instead of parameters that go together; give {self.words}")
        seen: set[str] = set()
        for group in groups:
            if not isinstance(group, list) or len(group) < 2:
                raise refuse(f"{show(group)} instead of two parameters or more; give {self.words}")
            for name in group:
                if not isinstance(name, str) or name not in self.names:
                    raise refuse(f"unknown parameter {show(name)}; {nearest(str(name), self.names)}")
                if name in seen:
                    raise refuse(f"'{name}' is zipped twice; name it once")
                seen.add(name)
        return groups


class Sections(Wrapped):
    """Annotation of a list of sections; a single one is a list of one."""

    words = "a section, or a list of sections; see below"

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        array = handler(schema["schema"])
        return {"anyOf": [array["items"], array]}

    def _read(self, value: object, handler: core_schema.ValidatorFunctionWrapHandler) -> Any:
        listed = [value] if isinstance(value, dict) else value
        if not isinstance(listed, list) or not all(isinstance(one, dict) for one in listed):
            raise refuse(
                f"{show(value)} instead of keys and values; give those to leave out, such as {{mesh_size: 1 mm}}"
            )
        return handler(listed)
