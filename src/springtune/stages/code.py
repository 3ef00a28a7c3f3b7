"""Which modules a stage runs on, and a digest of them.

Snakemake does not see edits of an imported package, and taking the whole package as input would solve everything
again after an edit of a plot. So each stage depends on the modules that it imports, found in their source.
"""

import ast
import hashlib
from functools import cache
from importlib.util import resolve_name
from pathlib import Path

PACKAGE = Path(__file__).parents[1]


@cache
def modules(stage):
    """Files of the package that a stage imports, directly or not, and its own.

    Parameters
    ----------
    stage : str
        Name of a module in `springtune.stages`.

    Returns
    -------
    tuple of str
        Paths, sorted.
    """
    found, waiting = set(), {PACKAGE / "stages" / f"{stage}.py"}
    while waiting:
        path = waiting.pop()
        found.add(path)
        waiting |= set(_imported(path)) - found
    return tuple(sorted(str(path) for path in found))


@cache
def digest(stage):
    """Hash of the source of a stage's modules."""
    total = hashlib.sha256()
    for path in modules(stage):
        total.update(Path(path).read_bytes())
    return total.hexdigest()


@cache
def _imported(path):
    relative = path.relative_to(PACKAGE.parent).with_suffix("")
    package = ".".join(relative.parts[:-1])
    names = set()
    for node in ast.walk(ast.parse(path.read_bytes())):
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
