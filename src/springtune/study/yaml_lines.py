"""YAML with the line of every key."""

from typing import Any

import yaml

from .messages import Key, Problems, StudyError


def read_yaml(text: str, file: str) -> tuple[Any, dict[tuple[Key, ...], int]]:
    r"""Content of a YAML text as dicts, lists and texts, and the line of each path of keys.

    Scalars stay the texts they are, so that names such as ``1e3`` or ``no`` are no numbers or booleans, and messages
    show what the file holds.

    Parameters
    ----------
    text : str
    file : str
        Its name, for messages.

    Returns
    -------
    content : dict, list, str or None
    lines : dict of tuple to int
        Counted from 1.

    Raises
    ------
    StudyError
        If the text is not YAML, or gives a key twice.

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
        return _content(root, (), lines, file), lines
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or getattr(error, "reason", None) or "unreadable"
        raise StudyError(
            f"{file}{line}: not YAML: {problem}; check colons, brackets and indentation of this line and the one above"
        ) from None
    except RecursionError:
        raise StudyError(f"{file}: not a study: nested too deeply; see config/README.md for what it may hold") from None


def _content(node: yaml.Node | None, path: tuple[Key, ...], lines: dict[tuple[Key, ...], int], file: str) -> Any:
    if node is None or node.tag == "tag:yaml.org,2002:null":
        return None
    lines.setdefault(path, node.start_mark.line + 1)
    if isinstance(node, yaml.ScalarNode):
        return node.value
    if isinstance(node, yaml.SequenceNode):
        return [_content(item, (*path, number), lines, file) for number, item in enumerate(node.value)]
    content: dict[str, Any] = {}
    merged: dict[str, Any] = {}
    for key, value in node.value:
        line = key.start_mark.line + 1
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
        if key.value in content:
            problems = Problems(file, {inside: line})
            problems.add(inside, f"'{key.value}' is given twice, first in line {lines[inside]}; rename or remove one")
            problems.stop()
        lines[inside] = line
        content[key.value] = _content(value, inside, lines, file)
    return merged | content
