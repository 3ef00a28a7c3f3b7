"""Which modules a stage runs on, and a digest of them.

Snakemake does not see edits of an imported package, and taking the whole package as input would solve everything
again after an edit of a plot. So each stage depends on the modules that it imports, found in their source.
"""

import ast
import hashlib
import inspect
from collections.abc import Iterable, Iterator
from functools import cache
from importlib.util import resolve_name
from pathlib import Path

from ..mesh import MESH_TYPES, MeshType
from ..springs import DEFINITIONS, Definition

PACKAGE = Path(__file__).parents[1]


def modules(*names: str, definitions: bool = False, mesh_types: bool = False) -> tuple[str, ...]:
    """Files that modules run on: their own, all that they import and what they may choose by name.

    Parameters
    ----------
    *names : str
        Modules, from the package on, such as ``"campaign.collect"``.
    definitions, mesh_types : bool, optional
        Whether they run definitions and make meshes by name: which modules those are no import in them says.

    Returns
    -------
    tuple of str
        Paths, sorted.

    Examples
    --------
    >>> [Path(file).name for file in modules("jobs.atomic")]
    ['atomic.py']
    """
    found = {path for name in names for path in _closure(_place(name))}
    declared: list[Definition | MeshType] = [*DEFINITIONS.values()] if definitions else []
    declared += MESH_TYPES.values() if mesh_types else ()
    for file in {one.file for one in declared if one.file}:
        found |= set(_closure(file))
    return tuple(sorted(found))


@cache
def digest(stage: str) -> str:
    """Hash of the source of the files that a stage runs on, without definitions and mesh types that it may choose.

    Parameters
    ----------
    stage : str
        Its module, as `modules` takes it.

    Returns
    -------
    str
    """
    return _hash(modules(stage))


def definition_digest(name: str) -> str:
    """Hash of the source of a definition and of what it imports of this package, or from beside it.

    Parameters
    ----------
    name : str
        Key of `springtune.springs.DEFINITIONS`.

    Returns
    -------
    str
    """
    return _declared_digest(DEFINITIONS[name])


def mesh_type_digest(name: str) -> str:
    """Hash of the source of a mesh type and of what it imports, as `definition_digest`.

    Parameters
    ----------
    name : str
        Key of `springtune.mesh.MESH_TYPES`.

    Returns
    -------
    str
    """
    return _declared_digest(MESH_TYPES[name])


def _declared_digest(one: Definition | MeshType) -> str:
    if one.file is None:  # of a notebook: the function is all that is known
        return hashlib.sha256(inspect.getsource(one.function).encode()).hexdigest()
    return _file_digest(one.file)


@cache
def _file_digest(path: Path) -> str:
    return _hash(_closure(path))


def _place(stage: str) -> str:
    return stage.replace(".", "/") + ".py"


@cache
def _closure(start: str | Path) -> tuple[str, ...]:
    """A file, from the package on, and those that it imports, directly or not: paths, sorted."""
    found: set[Path] = set()
    waiting = {PACKAGE / start}
    while waiting:
        path = waiting.pop()
        found.add(path)
        waiting |= set(_imported(path)) - found
    return tuple(sorted(str(path) for path in found))


def _hash(paths: Iterable[str]) -> str:
    total = hashlib.sha256()
    for path in paths:
        total.update(_source(path))
    return total.hexdigest()


@cache
def _source(path: str | Path) -> bytes:
    return Path(path).read_bytes()


def _executed(tree: ast.AST) -> Iterator[ast.AST]:
    """Statements of a module, without what type checkers alone read."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if not (isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"):
            for part in ("body", "orelse", "finalbody", "handlers", "cases"):
                inside = getattr(node, part, ())
                waiting += inside if isinstance(inside, list) else ()  # a lambda's body is an expression
            yield node


@cache
def _imported(path: Path) -> tuple[Path, ...]:
    inside = path.is_relative_to(PACKAGE)
    package = ".".join(path.parent.relative_to(PACKAGE.parent).parts) if inside else ""
    names: set[str] = set()
    for node in _executed(ast.parse(_source(path))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            relative = node.level and inside
            base = resolve_name("." * node.level + (node.module or ""), package) if relative else node.module or ""
            names |= {base} | {f"{base}.{alias.name}" for alias in node.names}
    files: list[Path] = []
    for name in names:
        parts = name.strip(".").split(".")
        if parts[0] == PACKAGE.name:
            place = PACKAGE.joinpath(*parts[1:])
        elif not inside:  # a module beside it
            place = path.parent.joinpath(*parts)
        else:
            continue
        files += [file for file in (place.with_suffix(".py"), place / "__init__.py") if file.is_file()]
    return tuple(files)
