"""Which modules a stage runs on, and a digest of them.

Snakemake does not see edits of an imported package, and taking the whole package as input would solve everything
again after an edit of a plot. So each stage depends on the modules that it imports, found in their source.
"""

import ast
import hashlib
from functools import cache
from importlib.util import resolve_name
from pathlib import Path

from ..springs import DEFINITIONS

PACKAGE = Path(__file__).parents[1]


def modules(*names, definitions=False):
    """Files of the package that modules run on: their own and all that they import.

    Parameters
    ----------
    *names : str
        Modules, from the package on, such as ``"campaign.collect"``.
    definitions : bool, optional
        Whether they run definitions by name: which modules those are no import in them says.

    Returns
    -------
    tuple of str
        Paths, sorted.
    """
    found = {path for name in names for path in _closure(_place(name))}
    for name in DEFINITIONS if definitions else ():
        found |= set(_closure(_definition_file(name)))
    return tuple(sorted(found))


@cache
def digest(stage):
    """Hash of the source of a stage's modules, definitions left out."""
    return _hash(_closure(_place(stage)))


@cache
def definition_digest(name):
    """Hash of the source of a definition and of what it imports."""
    return _hash(_closure(_definition_file(name)))


def _place(stage):
    return stage.replace(".", "/") + ".py"


def _definition_file(name):
    return f"springs/{DEFINITIONS[name].place.partition(':')[0]}.py"


@cache
def _closure(start):
    """A file of the package and those that it imports, directly or not: paths, sorted."""
    found, waiting = set(), {PACKAGE / start}
    while waiting:
        path = waiting.pop()
        found.add(path)
        waiting |= set(_imported(path)) - found
    return tuple(sorted(str(path) for path in found))


def _hash(paths):
    total = hashlib.sha256()
    for path in paths:
        total.update(_source(path))
    return total.hexdigest()


@cache
def _source(path):
    return Path(path).read_bytes()


def _executed(tree):
    """Nodes of a module, without what type checkers alone read."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if not (isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"):
            waiting += ast.iter_child_nodes(node)
            yield node


@cache
def _imported(path):
    relative = path.relative_to(PACKAGE.parent).with_suffix("")
    package = ".".join(relative.parts[:-1])
    names = set()
    for node in _executed(ast.parse(_source(path))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = resolve_name("." * node.level + (node.module or ""), package) if node.level else node.module
            names |= {base} | {f"{base}.{alias.name}" for alias in node.names}
    files = []
    for name in names:
        parts = name.split(".")
        if parts[0] != PACKAGE.name:
            continue
        place = PACKAGE.joinpath(*parts[1:])
        files += [file for file in (place.with_suffix(".py"), place / "__init__.py") if file.is_file()]
    return tuple(files)
