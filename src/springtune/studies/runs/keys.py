"""Keys of results, and the origin of a dataset: hashes of all inputs, of the code and of its packages.

The code of a module is its closure: all modules that it imports, directly or not, by grimp, also inside functions, but
not for type checkers. Import from modules, not from packages: an ``__init__`` brings in all that it imports. Imports by
name are not seen. Python's minor version counts, since sums of floats change with it.
"""

import ast
import hashlib
import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from datetime import UTC, datetime
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from springtune import __version__
from springtune.mesh.cells import MESH_TYPES
from springtune.problem.loads import LOADS
from springtune.problem.materials import Material
from springtune.problem.shapes import Beam
from springtune.registry import Declaration, ExtensibleMapping, plugin_packages
from springtune.springs.base import DEFINITIONS

from ..config.model import Study, kinds
from .source import COMMIT_FILE, DIGESTS, PACKAGE, STATE, checksum, clone, hash_of, source_state

CARRIER_PACKAGES = {"h5py", "jinja2", "markupsafe", "meshio", "pint", "psutil", "pydantic"}
"""Packages whose versions do not influence results: they carry numbers as they are."""

DISTRIBUTIONS = {"PIL": "pillow", "netgen": "netgen-mesher", "skfem": "scikit-fem", "yaml": "pyyaml"}
"""Distributions with another name than their package; a search takes a third of a second."""


def is_for_readers(one: Any) -> bool:
    """Return whether a statement is a docstring, ``pass`` or for type checkers."""
    if isinstance(one, ast.Expr):
        return isinstance(one.value, ast.Constant) and isinstance(one.value.value, str)
    if isinstance(one, ast.If):
        return not one.orelse and "TYPE_CHECKING" in (getattr(one.test, "id", ""), getattr(one.test, "attr", ""))
    return isinstance(one, ast.Pass)


def _add_parts(node: Any, parts: list[str]) -> None:
    """Add the parts of a syntax tree; `ast.dump` takes twice as long."""
    if isinstance(node, list):
        parts.append("[")
        for one in node:
            if not is_for_readers(one):
                _add_parts(one, parts)
        parts.append("]")
    elif isinstance(node, ast.AST):
        parts.append(type(node).__name__)
        for name in node._fields:
            _add_parts(getattr(node, name), parts)
    else:
        parts.append(repr(node))


def digest_of(text: str | bytes) -> str:
    """Hash source code as it computes: without comments, docstrings and layout."""
    parts: list[str] = []
    _add_parts(ast.parse(text), parts)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


@cache
def package_digests() -> dict[str, str]:
    """Digests of modules of the package by path: at first those that a run hands to its jobs, unless one changed."""
    known: dict[str, str] = json.loads(os.environ.get(DIGESTS, "{}"))
    return known if known and os.environ.get(STATE) == source_state() else {}


@cache
def file_digest(path: Path) -> str:
    """Hash of a file of code as it computes, or of a template."""
    if path.suffix != ".py":
        return checksum(path)
    known = package_digests() if path.is_relative_to(PACKAGE) else {}
    return known.get(str(path)) or known.setdefault(str(path), digest_of(path.read_bytes()))


class Closure(NamedTuple):
    """Files and packages that code depends on; `packages` are import names."""

    files: frozenset[Path] = frozenset()
    packages: frozenset[str] = frozenset()

    @property
    def digest(self) -> str:
        """Hash of the code, wherever it is."""
        return hash_of(sorted(map(file_digest, self.files)))

    def union(self, other: "Closure") -> "Closure":
        """Union of two closures."""
        return Closure(self.files | other.files, self.packages | other.packages)


@cache
def imports_graph() -> Any:
    """Imports of all modules of this package."""
    import grimp  # here: a job asks for few keys

    return grimp.build_graph(
        PACKAGE.name, include_external_packages=True, exclude_type_checking_imports=True, cache_dir=None
    )


@cache
def closure(*names: str, without: tuple[str, ...] = ()) -> Closure:
    """Closure of modules of this package, except some modules and their own imports."""
    graph, left_out = imports_graph(), {full_name(name) for name in without}
    found, waiting = set[str](), {full_name(name) for name in names}
    while waiting:
        found.add(one := waiting.pop())
        waiting |= graph.find_modules_directly_imported_by(one) - found - left_out
    ours = {name for name in found if name.partition(".")[0] == PACKAGE.name}
    files = {file for name in ours for file in _files(name)}
    return Closure(frozenset(files), frozenset(found - ours - CARRIER_PACKAGES - sys.stdlib_module_names))


def full_name(module: str) -> str:
    """Name under which a module of this package is imported."""
    return f"{PACKAGE.name}.{module}".rstrip(".")


def _files(name: str) -> Iterator[Path]:
    """File of a module of this package, and the table, the style and the templates of its name."""
    path = PACKAGE.parent.joinpath(*name.split("."))
    yield module if (module := path.with_suffix(".py")).is_file() else path / "__init__.py"
    yield from (table for ending in (".csv", ".mplstyle") if (table := path.with_suffix(ending)).is_file())
    yield from (path.parent / "templates").glob(f"{path.name}.*.jinja")


def mesh_type_closure(name: str) -> Closure:
    """Closure of a mesh type; mesh files have the closure of their reader, with meshio."""
    if name in MESH_TYPES:
        return declared_closure(MESH_TYPES[name])
    return closure("mesh.formats").union(Closure(packages=frozenset({"meshio"})))


# -- code outside of this package --------------------------------------------------------------------------------------


@cache
def declared_closure(one: Declaration) -> Closure:
    """Closure of the module of a declared function."""
    if one.file is None:
        raise ValueError(f"'{one.name}' was typed, and jobs of a study do not find it; put it into a module of yours")
    if one.file.is_relative_to(PACKAGE):
        return closure(".".join(one.file.relative_to(PACKAGE).with_suffix("").parts))
    return closure_outside(one.file)


def closure_outside(path: Path) -> Closure:
    """Closure of code outside of this package, with the files of modules that no distribution has."""
    files, waiting = {path}, [path]
    ours, packages = set[str](), plugin_packages() & {*path.with_suffix("").parts}  # a package's version counts, too
    for place in waiting:
        for level, name in _imports(ast.parse(place.read_bytes())):
            top, *parts = name.split(".")
            if top == PACKAGE.name and not level:
                ours |= _modules_of(parts)
                continue
            root = place.parents[level - 1] if level else _root(place.parent, top)
            packages |= {top} - sys.stdlib_module_names if root is None else set()
            found = _files_below(root, [top, *parts]) - files if root else set()
            waiting += found
            files |= found
    return closure(*ours).union(Closure(frozenset(files), frozenset(packages)))


def _imports(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield level and full name of each import, and of each attribute of this package that code uses."""
    nodes = [*ast.walk(tree)]
    aliases = [alias for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    yield from ((0, alias.name) for alias in aliases)
    whole = {alias.asname or alias.name for alias in aliases if alias.name == PACKAGE.name}
    for node in nodes:
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                yield node.level, ".".join(filter(None, (node.module, alias.name)))
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in whole:
            yield 0, f"{PACKAGE.name}.{node.attr}"


def _modules_of(parts: list[str]) -> set[str]:
    """Module of this package that defines a dotted name."""
    places: dict[str, str] = vars(sys.modules[PACKAGE.name])["_PLACES"]
    if len(parts) == 1 and parts[0] in places:
        return {places[parts[0]]}
    ways = (".".join(parts[:size]) for size in range(len(parts), 0, -1))
    return {next((way for way in ways if full_name(way) in imports_graph().modules), "")} - {""}


def _root(folder: Path, package: str) -> Path | None:
    """Folder of a package that no distribution has, beside code or on PYTHONPATH, or that has entry points."""
    if package in sys.stdlib_module_names:
        return None
    if (folder / package).is_dir() or (folder / f"{package}.py").is_file():
        return folder
    if package in plugin_packages() or version_of(distribution(package)) == "none":
        spec = find_spec(package)
        origin = Path(spec.origin) if spec and spec.origin else Path()
        if origin.suffix == ".py":
            return origin.parents[origin.stem == "__init__"]
    return None


def _files_below(root: Path, parts: list[str]) -> set[Path]:
    """Files of a module and of the packages above it."""
    places = (root.joinpath(*parts[:size]) for size in range(1, len(parts) + 1))
    return {file for one in places for file in (one.with_suffix(".py"), one / "__init__.py") if file.is_file()}


# -- keys --------------------------------------------------------------------------------------------------------------


@cache
def distribution(package: str) -> str:
    """Distribution that contains a package, as ``scikit-fem`` for ``skfem``."""
    if package in DISTRIBUTIONS or package in SOFTWARE or version_of(package) != "none":
        return DISTRIBUTIONS.get(package, package)
    from importlib.metadata import packages_distributions

    return packages_distributions().get(package, [package])[0]


@cache
def version_of(distribution: str) -> str:
    """Version of a distribution; "none" if it is absent or disabled."""
    from importlib.metadata import PackageNotFoundError, version  # here: it costs as much as the rest of a key

    unused = distribution == "cvxopt" and os.environ.get("SPRINGTUNE_SOLVER") == "superlu"
    try:
        return "none" if unused else version(distribution)
    except PackageNotFoundError:
        return "none"


@cache
def stage_key(*modules: str, without: tuple[str, ...] = ()) -> str:
    """Key of modules' code and the versions of their packages."""
    return code_key(closure(*modules, without=without))


def definition_key(name: str) -> str:
    """Key of a definition's code."""
    return declared_key(DEFINITIONS[name])


def declared_key(one: Declaration) -> str:
    """Key of the code of a declared function, such as an engine."""
    return code_key(declared_closure(one))


def mesh_type_key(name: str) -> str:
    """Key of a mesh type's code; of mesh files of the reader's."""
    return code_key(mesh_type_closure(name))


@cache
def code_key(code: Closure) -> str:
    """Key of code and the versions of its packages."""
    versions = (f"{name} {version_of(name)}" for name in map(distribution, code.packages))
    return hash_of(code.digest, [f"python {sys.version_info[0]}.{sys.version_info[1]}", *sorted(set(versions))])


@cache
def beam_key(beam: Beam) -> dict[str, Any]:
    """Properties of a beam that results depend on; its label is not one."""
    return asdict(beam) | {"name": ""}


@cache
def material_key(material: Material, density: bool = False) -> dict[str, Any]:
    """Properties of a material that results depend on; statics ignore density."""
    known = asdict(material) | {"name": ""}
    known.pop("test_errors", None)
    if known.get("plane") == "stress":
        del known["plane"]
    if not density:
        del known["density"]
    return known


# -- origin of a dataset -----------------------------------------------------------------------------------------------

SOFTWARE = ("cvxopt h5netcdf h5py meshio netgen-mesher numba numpy scikit-fem scipy snakemake xarray").split()
"""Distributions whose versions a dataset holds."""

CHANGED_ENDING = "+changes"  # ending of `git_commit` if files differ from the commit

PRINTED_SOURCES = {"paper_tables.csv": "the paper Mass-Spring Parameters Definition in 2D for Simulation"}
"""Sources of printed values by file name."""


def origin(study: Study, package: Path = PACKAGE) -> dict[str, str]:
    """Attributes of the root of a study's dataset."""
    created = datetime.now(UTC).isoformat(timespec="seconds")
    used = {label for labels in study.axes.values() for label in labels}
    tables: tuple[ExtensibleMapping[Any], ...] = (DEFINITIONS, MESH_TYPES, LOADS)
    plugins = {package for table in tables for name, package in table.packages.items() if name in used}
    software = {name: version_of(name) for name in (*SOFTWARE, *plugins)} | {"python": platform.python_version()}
    found = {
        "title": study.title,
        "Conventions": "CF-1.11",
        "history": f"{created} springtune {__version__}: collected from the results of the study {study.name}",
        "source": f"springtune {__version__}: mass-spring networks, and finite elements as their references",
        "study": study.name,
        "config": study.text,
        "config_sha256": hashlib.sha256(study.text.encode()).hexdigest(),
        "inputs": json.dumps(inputs(study), sort_keys=True),
        "springtune_version": __version__,
        "git_commit": library_commit(package),
        "created": created,
        "software": json.dumps(software, sort_keys=True),
    }
    if study.printed_path:
        name = study.printed_path.name
        found["references"] = f"paper_*: as printed in {PRINTED_SOURCES.get(name, name)}"
    found |= {f"figure_{name}": str(value) for name, value in study.style.items()}
    return found | ({"plane_strain": ", ".join(study.plane_strain)} if study.plane_strain else {})


def inputs(study: Study) -> dict[str, str]:
    """SHA-256 of each input file, by its path in the study's folder; elsewhere by its last folder and name."""
    folder, found = study.path.parent.resolve(), {}
    for file in map(Path.resolve, input_files(study)):
        inside = file.is_relative_to(folder)
        found[file.relative_to(folder).as_posix() if inside else f"{file.parent.name}/{file.name}"] = checksum(file)
    return found


def input_files(study: Study) -> list[Path]:
    """The study's file and all files that it names."""
    further = (file for kind in kinds() for file in kind.files(study.parts[kind.name]))
    return sorted({study.path, *study.files, *further})


def library_commit(package: Path = PACKAGE) -> str:
    """Commit of the library, empty if unknown; it ends with `CHANGED_ENDING` if files of the clone differ."""
    noted, root = package / COMMIT_FILE, clone(package)
    if noted.is_file() or root is None:
        return noted.read_text().strip() if noted.is_file() else ""
    command = ["git", "describe", "--always", "--abbrev=40", f"--dirty={CHANGED_ENDING}", "--exclude=*"]
    try:
        return subprocess.run(command, cwd=root, capture_output=True, check=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
