"""Bounded YAML with the line of every key, and messages on it that name line, key, value and remedy."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic_core import PydanticCustomError

from springtune.safe_io.escapes import UNSEEN, clipped, shown
from springtune.safe_io.inputs import BeyondSize, read

Key = str | int
"""Step of a path into a file: a key or a list index."""

SHOWN_PROBLEMS = 5
"""Problems that one message lists; the rest are counted."""


class StudyError(ValueError):
    r"""A study that cannot be run; the message names file, line, key, value and remedy.

    Parameters
    ----------
    *lines : str
        Lines of the message; control characters in them are shown as ``\x1b``.

    Examples
    --------
    >>> import springtune as st
    >>> try:
    ...     st.load_study("config/papers.yaml")
    ... except st.StudyError as error:
    ...     print(error)
    config/papers.yaml: cannot be read: No such file or directory; give the path of a study such as config/paper.yaml
    """

    def __init__(self, *lines: str) -> None:
        super().__init__(*map(shown, lines))

    def __str__(self) -> str:
        return "\n".join(self.args)


class Problems:
    """Collect problems of a file and raise them as one `StudyError`.

    Examples
    --------
    >>> problems = Problems("study.yaml", {("beams",): 3})
    >>> problems.add(("beams", "small"), "no length; give one such as '200 mm'")
    >>> problems.stop()
    Traceback (most recent call last):
    ...
    springtune.studies.config.messages.StudyError: study.yaml:3: beams.small: no length; give one such as '200 mm'
    """

    def __init__(self, file: str, lines: Mapping[tuple[Key, ...], int] | None = None, folder: Path = Path()) -> None:
        self._file, self._lines, self.folder = file, lines or {}, folder
        self._places: dict[tuple[Key, ...], str] = {}
        self._found: list[tuple[int, str]] = []

    def add(self, path: Iterable[Key], message: str, line: int = 0) -> None:
        """Add a problem."""
        path = tuple(path)
        # A missing key has no line, so the line of its section is used.
        above = (path[:size] for size in range(len(path), 0, -1))
        line = line or next((self._lines[keys] for keys in above if keys in self._lines), 0)
        place = self._places.get(path) or (f"{self._file}:{line}" if line else self._file)
        keys = "".join(f"[{key}]" if isinstance(key, int) else f".{clipped(key)}" for key in path).removeprefix(".")
        self._found.append((line, f"{place}: {keys}: {message}" if keys else f"{place}: {message}"))

    def located(self, path: tuple[Key, ...], place: str) -> None:
        """Set the place of a value that comes from another file."""
        self._places[path] = place

    @property
    def nothing(self) -> bool:
        """Return whether no problem was added."""
        return not self._found

    def stop_at(self, path: Iterable[Key], message: str, line: int = 0) -> None:
        """Add a problem, and raise."""
        self.add(path, message, line)
        self.stop()

    def stop(self) -> None:
        """Raise if a problem was added."""
        if not self._found:
            return
        messages = list(dict.fromkeys(message for _, message in sorted(self._found, key=lambda found: found[0])))
        more = len(messages) - SHOWN_PROBLEMS
        messages[SHOWN_PROBLEMS:] = [f"... and {more} more"] if more > 0 else []
        raise StudyError(*messages)


def refuse(message: str, *path: Key) -> PydanticCustomError:
    """Create the error of a validator."""
    return PydanticCustomError("study", "{message}", {"message": message, "path": path})


def show(value: object) -> str:
    """Format a value for a message.

    Examples
    --------
    >>> show("200 mm"), show([]), show({"length": "1 m"})
    ("'200 mm'", 'an empty list', 'a mapping')
    """
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return "a list" if value else "an empty list"
    if value is None:
        return "nothing"
    return f"'{clipped(str(value))}'"


def unseen(text: str) -> str:
    """Return why a text is not one line of visible characters, or an empty string."""
    found = UNSEEN.search(text)
    return f"{show(text)} has '{shown(found[0])}'; write one line of characters that can be seen" if found else ""


# -- YAML --------------------------------------------------------------------------------------------------------------

LARGEST_STUDY = 500_000

MOST_VALUES = 100_000
"""Limit of values and keys, with aliases expanded."""

DEEPEST = 20
"""Limit of nested lists and mappings."""

_TAGS = frozenset(
    f"tag:yaml.org,2002:{name}" for name in ("bool", "float", "int", "map", "merge", "null", "seq", "str", "timestamp")
)
"""Allowed tags; others, such as sets, need an explicit tag."""

_values = yaml.constructor.SafeConstructor()


def read_study(path: str | Path) -> tuple[str, Any, dict[tuple[Key, ...], int]]:
    """Return the text, the content and the line of each key of a study."""
    example = "give the path of a study such as config/paper.yaml"
    try:
        found = read(path, LARGEST_STUDY)
    except BeyondSize:
        most = f"{LARGEST_STUDY // 1000} kB"
        raise StudyError(
            f"{path}: larger than {most}, which no study is; {example}, or split it into several"
        ) from None
    except ValueError as error:
        raise StudyError(f"{path}: cannot be read: {error}; {example}") from None
    try:
        text = found.decode()
    except UnicodeDecodeError as error:
        line = found[: error.start].count(b"\n") + 1
        byte = f"byte 0x{found[error.start]:02x}"
        raise StudyError(f"{path}:{line}: not UTF-8 text: {byte}; save the file in UTF-8") from None
    return text, *read_yaml(text, str(path))


def read_yaml(text: str, file: str) -> tuple[Any, dict[tuple[Key, ...], int]]:
    r"""Content of a YAML text as dicts, lists and texts, and the line of each path of keys.

    Scalars stay texts: names such as ``1e3`` or ``no`` are not numbers or booleans.

    Examples
    --------
    >>> content, lines = read_yaml("title: no\nbeams:\n  small: {length: 50 mm}", "study.yaml")
    >>> content
    {'title': 'no', 'beams': {'small': {'length': '50 mm'}}}
    >>> lines["beams", "small", "length"]
    3
    """
    lines: dict[tuple[Key, ...], int] = {}
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
        if root is not None:
            _check_size(root, file)
        return _content(root, (), lines, file), lines
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or getattr(error, "reason", None) or "unreadable"
        remedy = "check colons, brackets and indentation of this line and the one above"
        lines_of_text = text.splitlines()
        if mark and mark.line < len(lines_of_text) and "\t" in lines_of_text[mark.line]:
            remedy = "write spaces in place of the tab in this line"
        raise StudyError(f"{file}{line}: not YAML: {problem}; {remedy}") from None
    except RecursionError:
        raise StudyError(f"{file}: {_TOO_DEEP}") from None


_TOO_DEEP = "not a study: nested too deeply; see config/README.md for what it may hold"


def _check_size(root: yaml.Node, file: str) -> None:
    """Refuse content that grows too large when aliases are expanded, without expanding it."""
    sizes: dict[int, tuple[int, int]] = {}  # values and levels of each node; empty while it is counted

    def count(node: yaml.Node) -> tuple[int, int]:
        known = sizes.get(id(node))
        if known:
            return known
        if id(node) in sizes:
            line = node.start_mark.line + 1
            raise StudyError(f"{file}:{line}: an alias stands for what it is part of; write the values themselves")
        sizes[id(node)] = ()  # type: ignore[assignment]
        values, levels = 1, 1
        if isinstance(node, yaml.CollectionNode):
            for item in node.value:
                for part in item if isinstance(item, tuple) else (item,):
                    more, deep = count(part)
                    values, levels = values + more, max(levels, deep + 1)
        if levels > DEEPEST:
            raise StudyError(f"{file}:{node.start_mark.line + 1}: {_TOO_DEEP}")
        if values > MOST_VALUES:
            line = node.start_mark.line + 1
            most = f"more than {MOST_VALUES} values, aliases (*name) as what they stand for"
            raise StudyError(f"{file}:{line}: {most}; give ranges of fewer values, or split the study into several")
        sizes[id(node)] = values, levels
        return values, levels

    count(root)


def _check_value(node: yaml.Node, file: str) -> None:
    """Refuse values that YAML, and so Snakemake, would not accept."""
    line = node.start_mark.line + 1
    if node.tag == "tag:yaml.org,2002:value":
        raise StudyError(f"{file}:{line}: not YAML: '=' means nothing by itself; put it in quotes")
    if node.tag not in _TAGS:
        tag = node.tag.replace("tag:yaml.org,2002:", "!!")
        raise StudyError(f"{file}:{line}: a study has no tags such as '{tag}'; remove it")
    if isinstance(node, yaml.ScalarNode) and node.tag.endswith((":bool", ":float", ":int", ":timestamp")):
        try:
            _values.construct_object(node)
        except (ValueError, ArithmeticError, KeyError, IndexError):
            shown, what = show(node.value), node.tag.removeprefix("tag:yaml.org,2002:")
            raise StudyError(f"{file}:{line}: not YAML: {shown} is no {what}; put it in quotes") from None
        finally:
            _values.constructed_objects.clear()


def _check_seen(text: str, path: tuple[Key, ...], node: yaml.Node, file: str) -> None:
    """Refuse line breaks and control characters in texts."""
    why = unseen(text)
    if why:
        Problems(file).stop_at(path, why, node.start_mark.line + 1)


def _content(node: yaml.Node | None, path: tuple[Key, ...], lines: dict[tuple[Key, ...], int], file: str) -> Any:
    if node is None:
        return None
    _check_value(node, file)
    if node.tag == "tag:yaml.org,2002:null":
        return None
    lines.setdefault(path, node.start_mark.line + 1)
    if isinstance(node, yaml.ScalarNode):
        # The line break that ends a block is not the text's.
        text = node.value.rstrip("\n") if node.style in ("|", ">") else node.value
        _check_seen(text, path, node, file)
        return text
    if isinstance(node, yaml.SequenceNode):
        return [_content(item, (*path, number), lines, file) for number, item in enumerate(node.value)]
    content: dict[str, Any] = {}
    merged: dict[str, Any] = {}
    for key, value in node.value:
        line = key.start_mark.line + 1
        _check_value(key, file)
        if not isinstance(key, yaml.ScalarNode):
            raise StudyError(f"{file}:{line}: a list or mapping cannot be a key; write a name before the colon")
        if key.tag == "tag:yaml.org,2002:merge":
            for base in value.value if isinstance(value, yaml.SequenceNode) else [value]:
                inherited = _content(base, path, {}, file)
                if not isinstance(inherited, dict):
                    raise StudyError(f"{file}:{line}: '<<' merges mappings only; give it an alias such as *name")
                merged = inherited | merged
            continue
        inside = (*path, key.value)
        _check_seen(key.value, inside, key, file)
        if key.value in content:
            why = f"'{key.value}' is given twice, first in line {lines[inside]}; rename or remove one"
            Problems(file).stop_at(inside, why, line)
        lines[inside] = line
        content[key.value] = _content(value, inside, lines, file)
    return merged | content
