"""Bounded YAML with the line of every key, and messages on it that name line, key, value and remedy."""

from collections.abc import Iterable, Mapping
from functools import reduce
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

import yaml
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from springtune.problem.quantities import nearest
from springtune.safe_io import UNSEEN_PATTERN, BeyondSize, clipped, read, shown

Model = TypeVar("Model", bound=BaseModel)

Key = str | int  # step of a path into a file: a key or a list index

Lines = Mapping[tuple[Key, ...], int]

SHOWN_PROBLEMS = 5  # problems that one message lists; the rest are counted


class StudyError(ValueError):
    """A study cannot be run; the message names file, line, key, value and remedy.

    Examples
    --------
    >>> import springtune as st
    >>> try:
    ...     st.load_study("config/papers.yaml")
    ... except st.StudyError as error:
    ...     print(error)
    config/papers.yaml: cannot be read: No such file or directory; give the path of a study; `springtune new` writes one
    """

    def __init__(self, *lines: str) -> None:
        super().__init__(*map(shown, lines))

    def __str__(self) -> str:
        return "\n".join(self.args)


class Problems:
    """Collect problems of a file and raise them as one `StudyError`."""

    def __init__(self, file: str, lines: Lines | None = None, content: Any = None, folder: Path = Path()) -> None:
        self._file, self._lines, self.content, self.folder = file, lines or {}, content, folder
        self.places: dict[tuple[Key, ...], str] = {}  # of values that come from other files
        self.found: list[tuple[int, str]] = []

    def add(self, path: Iterable[Key], message: str, line: int = 0) -> None:
        """Add a problem."""
        path = tuple(path)
        # A missing key has no line, so the line of its section is used.
        above = (path[:size] for size in range(len(path), 0, -1))
        line = line or next((self._lines[keys] for keys in above if keys in self._lines), 0)
        place = self.places.get(path) or (f"{self._file}:{line}" if line else self._file)
        keys = "".join(f"[{key}]" if isinstance(key, int) else f".{clipped(key)}" for key in path).removeprefix(".")
        self.found.append((line, f"{place}: {keys}: {message}" if keys else f"{place}: {message}"))

    def stop_at(self, path: Iterable[Key], message: str, line: int = 0) -> None:
        """Add a problem, and raise."""
        self.add(path, message, line)
        self.stop()

    def stop(self) -> None:
        """Raise if a problem was added."""
        messages = list(dict.fromkeys(message for _, message in sorted(self.found, key=lambda found: found[0])))
        more = len(messages) - SHOWN_PROBLEMS
        messages[SHOWN_PROBLEMS:] = [f"... and {more} more"] if more > 0 else []
        if messages:
            raise StudyError(*messages)


def refuse(message: str, *path: Key) -> PydanticCustomError:
    """Create the error of a validator; ``{value}`` in the message stands for the value at the path."""
    return PydanticCustomError("study", "{message}", {"message": message, "path": path})


def part_of(content: Any, path: Iterable[Key]) -> tuple[tuple[Key, ...], Any]:
    """Return the part of a path that exists in a content, and the value there; a single value has no items.

    >>> part_of({"beam": ["a", "b"], "load": "traction"}, ("beam", 1)), part_of({"load": "traction"}, ("load", 0))
    ((('beam', 1), 'b'), (('load',), 'traction'))
    """
    found: list[Key] = []
    for step in path:
        is_item = isinstance(content, list | tuple) and isinstance(step, int)
        if is_item or isinstance(content, dict) and step in content:
            found.append(step)
            content = content[step]
    return tuple(found), content


def words(annotation: Any) -> str:
    """Words for a value of a field or type: its title, or a description."""
    origin, (inside, *notes) = _parts(annotation)
    if origin is Annotated:
        found = next((note.title for note in notes if isinstance(note, FieldInfo) and note.title), words(inside))
        return found.replace(", or a list", OR_RANGE) if OR_RANGE in notes else found
    if origin in (Union, UnionType):
        return words(inside)
    if origin is list:
        return "a list of sections" if words(inside) == SECTION else f"{words(inside)}, or a list"
    return SECTION


SECTION, OR_RANGE = "a section", ", a list, or a range"
"""Words for a section, and for more than one number, a note of lists that may be ranges."""


def _parts(annotation: Any) -> tuple[Any, tuple[Any, ...]]:
    """Origin and arguments of a type; a field is its type, annotated."""
    if isinstance(annotation, FieldInfo):
        annotation = Annotated[annotation.annotation, annotation, *annotation.metadata]
    return get_origin(annotation), get_args(annotation) or (annotation,)


def _item(annotation: Any) -> Any:
    """Type of the items of a list or mapping that a field or type is."""
    origin, parts = _parts(annotation)
    return _item(parts[0]) if origin in (Annotated, Union, UnionType) else parts[-1]


REASONS = {"int_parsing": "is not a whole number"}
REASONS |= dict.fromkeys(("float_parsing", "decimal_parsing"), "is not a number")
REASONS |= dict.fromkeys(("greater_than", "greater_than_equal", "less_than_equal", "finite_number"), "is out of range")
"""Fault of a value, by the type of pydantic's error."""


def explain_errors(keys: Mapping[str, FieldInfo], content: Any, error: ValidationError) -> ValidationError:
    """Give the errors of a section messages with value, fault and remedy; inner sections have explained theirs."""
    errors: list[Any] = error.errors(include_url=False)
    found: list[Any] = []
    kinds = [details["type"] for details in errors]
    for number, details in enumerate(errors):
        kind, place, (path, value) = details["type"], details["loc"], part_of(content, details["loc"])
        if kind == "study":
            one = refuse(details["ctx"]["message"], *details["ctx"]["path"])
        elif kind == "model_type":
            one = refuse(f"{show(value)} instead of keys and values; give the keys {', '.join(keys)}")
        elif kind == "extra_forbidden":
            after_comma = value is None and place[0][:1].isdigit()  # as in {poisson_ratio: 0,3}
            remedy = "in numbers write a decimal point, no comma" if after_comma else nearest(place[0], keys)
            one = refuse(f"unknown key {show(place[0])}; {remedy}")
        elif kind == "missing":
            if "extra_forbidden" in kinds or kind in kinds[:number]:
                continue  # a misspelt key, or the first missing one, is enough
            one = refuse(f"'{place[0]}' is missing; give {words(keys[place[0]])}", place[0])
        elif kind == "too_long":
            one = refuse(f"{len(value)} values; give at most {details['ctx']['max_length']}, or split the study")
        else:
            given = words(reduce(lambda inside, _: _item(inside), path[1:], keys[place[0]]))
            why = REASONS.get(kind, "does not fit") if isinstance(value, str) else f"instead of {given}"
            one = refuse(f"{show(value)} {why}; give {given}")
        found.append({"type": one, "loc": place, "input": value})
    return ValidationError.from_exception_data("section", found)


def validate(
    model: type[Model], content: Any, problems: Problems, line: int = 0, context: Mapping[str, Any] | None = None
) -> Model:
    """Return the model of a content; each error of pydantic is a problem with place, value and remedy."""
    try:
        return model.model_validate(content, context=context)
    except ValidationError as error:
        for details in error.errors(include_url=False):
            # The path of pydantic has steps that the file has not: branches of a union, the item of a single value.
            path, value = part_of(content, details["loc"])
            path += details["ctx"]["path"] if isinstance(value, list | dict) else ()
            problems.add(path, details["ctx"]["message"].replace("{value}", show(part_of(content, path)[1])), line)
        problems.stop()
        raise


def show(value: object) -> str:
    """Format a value for a message.

    >>> show("200 mm"), show([]), show({"length": "1 m"})
    ("'200 mm'", 'an empty list', 'a mapping')
    """
    if isinstance(value, dict | list):
        return f"{'a' if value else 'an empty'} {'mapping' if isinstance(value, dict) else 'list'}"
    return "nothing" if value is None else f"'{clipped(str(value))}'"


def control_character_fault(text: str) -> str:
    """Return why a text is not one line of visible characters, or an empty string."""
    found = UNSEEN_PATTERN.search(text)
    return f"{show(text)} has '{shown(found[0])}'; write one line of characters that can be seen" if found else ""


# -- YAML --------------------------------------------------------------------------------------------------------------

LARGEST_STUDY = 500_000

MOST_VALUES = 100_000  # limit of values and keys, with aliases expanded


def read_study(path: str | Path) -> tuple[str, Any, Lines]:
    """Return the text, the content and the line of each key of a study."""
    example = "give the path of a study; `springtune new` writes one"
    try:
        found = read(path, LARGEST_STUDY)
    except ValueError as error:
        remedy = ", or split it into several" if isinstance(error, BeyondSize) else ""
        raise StudyError(f"{path}: cannot be read: {error}; {example}{remedy}") from None
    try:
        text = found.decode()
    except UnicodeDecodeError as error:
        line = found[: error.start].count(b"\n") + 1
        byte = f"byte 0x{found[error.start]:02x}"
        raise StudyError(f"{path}:{line}: not UTF-8 text: {byte}; save the file in UTF-8") from None
    return text, *read_yaml(text, str(path))


def read_yaml(text: str, file: str) -> tuple[Any, Lines]:
    r"""Content of a YAML text, whose scalars stay texts, and the line of each path of keys.

    >>> content, lines = read_yaml("title: no\nbeams:\n  small: {length: 50 mm}", "study.yaml")
    >>> content, lines["beams", "small", "length"]
    ({'title': 'no', 'beams': {'small': {'length': '50 mm'}}}, 3)
    """
    reader = _Reader(file)
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
        if root is None:
            return None, {}
        yaml.constructor.SafeConstructor().construct_document(root)  # refuses what Snakemake would, and merges `<<`
        return reader.content(root, ()), reader.lines
    except StudyError:
        raise
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or getattr(error, "reason", None) or "unreadable"
        remedy = "check colons, brackets and indentation of this line and the one above"
        if mark and "\t" in "".join(text.splitlines()[mark.line : mark.line + 1]):
            remedy = "write spaces in place of the tab in this line"
        if isinstance(error, yaml.constructor.ConstructorError):
            remedy = "take tags (!) out, put a lone = in quotes, and give '<<' an alias such as *name"
        raise StudyError(f"{file}{line}: not YAML: {problem}; {remedy}") from None
    except ValueError as error:
        raise StudyError(f"{file}: not YAML: a date or number cannot be read: {error}; put it in quotes") from None
    except RecursionError:
        why = "nested too deeply, or an alias (*name) inside of what it stands for"
        raise StudyError(f"{file}: not a study: {why}; see config/README.md for what a study may hold") from None


class _Reader:
    """Content of the nodes of a YAML file, aliases expanded up to a limit."""

    def __init__(self, file: str) -> None:
        self.problems, self.values = Problems(file), 0
        self.lines: dict[tuple[Key, ...], int] = {}

    def content(self, node: yaml.Node, path: tuple[Key, ...]) -> Any:
        self.values += 1
        line = node.start_mark.line + 1
        if self.values > MOST_VALUES:
            most = f"more than {MOST_VALUES} values, aliases (*name) as what they stand for"
            self.problems.stop_at((), f"{most}; give ranges of fewer values, or split the study into several", line)
        if node.tag == "tag:yaml.org,2002:null":
            return None
        self.lines.setdefault(path, line)
        if isinstance(node, yaml.ScalarNode):
            return self.text(node, path)
        if isinstance(node, yaml.SequenceNode):
            return [self.content(item, (*path, number)) for number, item in enumerate(node.value)]
        found, own = dict[str, Any](), dict[str, int]()
        for key, value in node.value:  # what is merged comes first, from elsewhere in the file
            inside, line = (*path, key.value), key.start_mark.line + 1
            name = self.text(key, inside)
            if node.start_mark.index <= key.start_mark.index < node.end_mark.index:
                if name in own:
                    why = f"'{name}' is given twice, first in line {own[name]}; rename or remove one"
                    self.problems.stop_at(inside, why, line)
                own[name] = line
            found[name] = self.content(value, inside)
            self.lines[inside] = line
        return found

    def text(self, node: yaml.ScalarNode, path: tuple[Key, ...]) -> str:
        """Text of a scalar in one line; the line break that ends a block is not the text's."""
        text: str = node.value.rstrip("\n") if node.style in ("|", ">") else node.value
        if why := control_character_fault(text):
            self.problems.stop_at(path, why, node.start_mark.line + 1)
        return text
