"""Types of the values of a study: how their text is read, and words for what is expected."""

import math
import re
from collections.abc import Callable, Collection
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from .. import units
from ..mesh import MESH_TYPES
from ..problem.loads import KINEMATICS, LOADS
from ..problem.quantities import beyond, nearest
from ..registry import NAME, NAME_RULE
from ..springs import DEFINITIONS
from .messages import refuse, show
from .model import FURTHER_REFERENCES

MOST_POINTS = 10_001
"""Most points of a sensitivity curve."""

LONGEST_TEXT = 1000
"""Most characters of a value."""

MOST_LISTED = 10_000
"""Most values of a list."""


class Scalar:
    """Annotation of a field.

    Parameters
    ----------
    read : callable
        From the field's text to its value.
    schema : dict
        JSON schema.
    words : str
        What is expected, for messages and the manual.
    """

    def __init__(self, read: Callable[[str], Any], schema: dict[str, Any], words: str) -> None:
        self.read, self.schema, self.words = read, schema, words

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return dict(self.schema)

    def _read(self, value: object) -> Any:
        if not isinstance(value, str) or not value.strip():
            raise refuse(f"{show(value)} instead of {self.words}; give {self.words}")
        if len(value) > LONGEST_TEXT:
            raise refuse(f"{show(value)}, {len(value)} characters; give {self.words}, of at most {LONGEST_TEXT}")
        return self.read(value)


def quantity(kind: str, negative: str = "give a size above zero") -> Scalar:
    """Annotation of a quantity above zero, of a key of `springtune.units.QUANTITY_KINDS`."""
    example = units.QUANTITY_KINDS[kind].example

    def read(value: str) -> float:
        try:
            number = units.parse(value, kind)
        except units.UnitError as error:
            raise refuse(str(error)) from None
        if not number > 0:
            raise refuse(f"{show(value)} is not above zero; {negative}, such as '{example}'")
        if beyond(number, kind):
            raise refuse(f"{show(value)} is beyond all measure; give a {kind} such as '{example}'")
        return number

    schema = {"type": "string", "pattern": r"^\s*\+?[0-9.]+([eE][+-]?[0-9]+)?\s*[^0-9\s].*$", "examples": [example]}
    return Scalar(read, schema, f"a {kind} such as '{example}'")


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


_MEMORY = re.compile(r"\+?([0-9]+(?:\.[0-9]*)?)\s*([MGT])B")


def _read_memory(value: str) -> float:
    found = _MEMORY.fullmatch(value.strip())
    size = float(found[1]) * {"M": 1e6, "G": 1e9, "T": 1e12}[found[2]] if found else 0.0
    if not 1e8 <= size <= 1e15:
        raise refuse(f"{show(value)} is no memory that a scene could take; give at least '100 MB', such as '8 GB'")
    return size


def one_of(what: str, names: Collection[str]) -> Scalar:
    """Annotation of a name out of some."""

    def read(value: str) -> str:
        if value not in names:
            raise refuse(f"unknown {what} {show(value)}; {nearest(value, names)}")
        return value

    return Scalar(read, {"enum": list(names)}, " or ".join(f"'{name}'" for name in names))


def _read_flag(value: str) -> bool:
    if value.lower() not in ("true", "false"):
        raise refuse(f"{show(value)} is neither true nor false; give one of them")
    return value.lower() == "true"


Length = Annotated[float, quantity("length")]
Force = Annotated[float, quantity("force", "the load's name carries the sign: give a magnitude")]
Stiffness = Annotated[float, quantity("stiffness")]
Stress = Annotated[float, quantity("stress")]
Density = Annotated[float, quantity("density")]
PoissonRatio = Annotated[float, number("a number from 0 to 0.5, such as 0.3", 0, 0.5)]
Ratio = Annotated[float, number("a number above 0", 0, math.inf, above=True)]
Points = Annotated[int, number(f"a whole number from 2 to {MOST_POINTS}, such as 61", 2, MOST_POINTS, whole=True)]
MeshType = Annotated[
    str, Scalar(str, {"type": "string", "examples": list(MESH_TYPES)}, "a mesh type such as 'structured'")
]
Load = Annotated[str, one_of("load", LOADS)]
FurtherReference = Annotated[str, one_of("reference", FURTHER_REFERENCES)]
Kinematics = Annotated[str, one_of("kinematics", KINEMATICS)]
DefinitionName = Annotated[str, one_of("definition", DEFINITIONS)]
LimitSeconds = Annotated[float, number("a number of seconds from 1, such as 600", 1, 1e9)]
Memory = Annotated[
    float,
    Scalar(
        _read_memory, {"type": "string", "pattern": _MEMORY.pattern, "examples": ["8 GB"]}, "a memory such as '8 GB'"
    ),
]
Flag = Annotated[bool, Scalar(_read_flag, {"type": "boolean"}, "true or false")]
Text = Annotated[str, Scalar(str, {"type": "string", "minLength": 1}, "a text")]
FileName = Annotated[str, Scalar(str, {"type": "string", "minLength": 1}, "the path of a file")]
BeamName = Annotated[str, Scalar(str, {"type": "string"}, "the name of a beam")]
MaterialName = Annotated[str, Scalar(str, {"type": "string"}, "the name of a material")]


class OneOrMore:
    """Annotation of a list: no duplicates, not empty; a single value stands for a list of one."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_wrap_validator_function(self._read, handler(source))

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        array = handler(schema["schema"]) | {"minItems": 1, "uniqueItems": True}
        return {"anyOf": [array["items"], array]}

    @staticmethod
    def _read(value: object, handler: core_schema.ValidatorFunctionWrapHandler) -> Any:
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
            if item in seen:
                raise refuse(f"{show(listed[number])} is listed twice; remove one", number)
            seen.add(item)
        return items


class PerBeam:
    """Annotation of a mapping from beams to quantities; a single quantity, kept under None, stands for all beams."""

    words = "a force such as '400 kN', or one for each beam"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        single = handler.generate_schema(Force)
        each = core_schema.no_info_wrap_validator_function(self._read_each, handler(source))
        everywhere = core_schema.no_info_after_validator_function(lambda force: {None: force}, single)
        choices: dict[Any, CoreSchema] = {"single": everywhere, "each": each}
        return core_schema.tagged_union_schema(choices, lambda value: "each" if isinstance(value, dict) else "single")

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        each = handler(schema["choices"]["each"]["schema"])
        return {"anyOf": [each["additionalProperties"], each | {"minProperties": 1}]}

    @staticmethod
    def _read_each(value: object, handler: core_schema.ValidatorFunctionWrapHandler) -> Any:
        if not value:
            raise refuse("no force at all; give one for each beam, such as {200x40: 400 kN}")
        return handler(value)


class Named:
    """Annotation of a mapping from names to sections: names that can be parts of file names, and at least one.

    Parameters
    ----------
    what : str
        What is named, for messages.
    for_files : bool, optional
        Whether the names become parts of file names.
    """

    def __init__(self, what: str, for_files: bool = True) -> None:
        self.what, self.for_files = what, for_files
        self.words = f"a section for each {what}, by name; see below"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_wrap_validator_function(self._read, handler(source))

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
