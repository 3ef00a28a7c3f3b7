"""Meaning and imports of source code, without comments and docstrings."""

import ast
import hashlib
from collections.abc import Mapping
from itertools import groupby
from typing import NamedTuple

Import = tuple[int, str, str]
"""Level of a relative import, module, and imported name: empty for a plain import, or an asterisk."""


class Source(NamedTuple):
    """Parsed source.

    `digest` ignores comments, docstrings, formatting and type-checking code. `imports` are all that can run. `face`
    maps names to imports if the source only imports names, else it is None.
    """

    digest: str
    imports: frozenset[Import]
    face: Mapping[str, Import] | None


def read(text: str | bytes, package: str = "") -> Source:
    r"""Parse source code.

    Examples
    --------
    >>> read("def f():\n    return 1").digest == read("def f(): return 1  # one").digest
    True
    >>> read("from numpy import pi").imports
    frozenset({(0, 'numpy', 'pi')})
    """
    tree = ast.parse(text)
    reader = _Reader()
    reader.read(tree)
    imports = reader.imports | (_attributes(tree, package) if package else set())
    digest = hashlib.sha256("\n".join(reader.parts).encode()).hexdigest()
    return Source(digest, frozenset(imports), _face(tree))


def _face(tree: ast.Module) -> dict[str, Import] | None:
    names: dict[str, Import] = {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.names[0].name != "*":
            for alias in node.names:
                names[alias.asname or alias.name] = (node.level, node.module or "", alias.name)
        elif not _says_nothing(node) and not (isinstance(node, ast.Assign) and _is_all(node.targets)):
            return None
    return names


def _is_all(targets: list[ast.expr]) -> bool:
    return [target.id for target in targets if isinstance(target, ast.Name)] == ["__all__"]


def _attributes(tree: ast.Module, package: str) -> set[Import]:
    """Names used as attributes of a package."""
    nodes = list(ast.walk(tree))
    names = {
        alias.asname or alias.name
        for node in nodes
        if isinstance(node, ast.Import)
        for alias in node.names
        if alias.name == package
    }
    return {
        (0, package, node.attr)
        for node in nodes
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in names
    }


def _says_nothing(node: ast.AST) -> bool:
    """Return whether a statement is a docstring or `pass`."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    return isinstance(node, ast.Pass)


def _for_type_checkers(node: ast.If) -> bool:
    test = node.test
    return "TYPE_CHECKING" in (getattr(test, "id", ""), getattr(test, "attr", ""))


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant)


class _Reader:
    """Read a syntax tree as text that is the same in all versions of Python, and its imports.

    Newer versions add fields, which are empty for older syntax: empty fields are left out.
    """

    SKIPPED = ("ctx", "kind", "type_comment")  # follow from the rest, or are said for readers

    def __init__(self) -> None:
        self.parts: list[str] = []
        self.imports: set[Import] = set()
        self.fields: dict[type, tuple[str, ...]] = {}

    def read(self, node: object) -> None:
        add = self.parts.append
        kind = node.__class__
        # The first four are most of what there is.
        if kind is ast.Name:
            add(node.id)  # type: ignore[attr-defined]
        elif kind is ast.Attribute:
            self.read(node.value)  # type: ignore[attr-defined]
            add(f".{node.attr}")  # type: ignore[attr-defined]
        elif kind is ast.Constant:
            add(f"={node.value!r}")  # type: ignore[attr-defined]
        elif kind is list:
            add("[")
            for one in node:  # type: ignore[attr-defined]
                self.read(one)
            add("]")
        elif isinstance(node, ast.JoinedStr):  # versions of Python cut its texts in different places
            add("(f")
            for is_text, values in groupby(node.values, key=_is_text):
                if is_text:
                    text = "".join(str(value.value) for value in values if isinstance(value, ast.Constant))
                    self.parts += [f"={text!r}"] if text else []
                else:
                    self.read(list(values))
            add(")")
        elif isinstance(node, ast.AST):
            if isinstance(node, ast.stmt):
                if _says_nothing(node):
                    return
                if isinstance(node, ast.If) and _for_type_checkers(node):
                    for one in node.orelse:
                        self.read(one)
                    return
                if isinstance(node, ast.Import):
                    self.imports |= {(0, alias.name, "") for alias in node.names}
                elif isinstance(node, ast.ImportFrom):
                    self.imports |= {(node.level, node.module or "", alias.name) for alias in node.names}
            add(f"({kind.__name__}")
            fields = self.fields.get(kind)
            if fields is None:
                fields = self.fields[kind] = tuple(name for name in node._fields if name not in self.SKIPPED)
            for name in fields:
                value = getattr(node, name, None)
                if value is not None and value != []:
                    add(name)
                    self.read(value)
            add(")")
        else:
            add(repr(node))
