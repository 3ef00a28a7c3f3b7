"""Keys of results: hashes of all inputs, of the code that a result depends on, and of its packages.

Python's minor version counts: sums of floats change with 3.12, and compiled packages differ.

Snakemake does not see edits of imported packages, and the whole package as input would rerun everything. So a module's
closure is all modules that it imports, directly or not, and their packages. All imports that can run count, also inside
functions and ``try``; type-checking imports do not. Of an ``__init__`` that only imports, only the requested names are
followed.

Imports by a name in a text are not seen. Definitions and mesh types are added where they are chosen
(`definition_closure`, `mesh_type_closure`), and modules of outputs in `rerun`. A template counts with the module that
has its name, such as ``templates/mujoco.xml.jinja`` with ``mujoco``.
"""

import ast
import hashlib
import inspect
import os
import sys
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from springtune.mesh import MESH_TYPES
from springtune.registry import Declared, full_name, plugin_packages
from springtune.springs import DEFINITIONS

from .source import PACKAGE, hash_of

if TYPE_CHECKING:
    from springtune.problem.geometry import Beam
    from springtune.problem.materials import Material

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
    reader = _ForComputing()
    bare = ast.dump(reader.visit(tree))
    imports = reader.imports | (_attributes(tree, package) if package else set())
    return Source(_mark(bare.encode()), frozenset(imports), _face(tree))


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


class _ForComputing(ast.NodeTransformer):
    """Remove docstrings, `pass` and type-checking code from a tree; note imports that can run."""

    def __init__(self) -> None:
        self.imports: set[Import] = set()

    def visit(self, node: ast.AST) -> Any:
        if _says_nothing(node):
            return None
        if isinstance(node, ast.If) and _for_type_checkers(node):
            return [kept for one in node.orelse if (kept := self.visit(one))]
        if isinstance(node, ast.Import):
            self.imports |= {(0, alias.name, "") for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            self.imports |= {(node.level, node.module or "", alias.name) for alias in node.names}
        elif isinstance(node, ast.Constant):
            node.kind = None  # u"" is ""
        return self.generic_visit(node)


NOT_COUNTED = {
    ("studies/output/browse/page.py", "h5py"): "numbers come out of a dataset as they went in, or not at all",
    ("safe_io/inputs.py", "h5py"): "it refuses files, and reads none of their numbers",
    ("safe_io/atomic.py", "psutil"): "it says which processes live",
    ("handover/simulation.py", "jinja2"): "it puts texts and numbers into files as they are",
    ("studies/runs/store.py", "h5py"): "numbers come out of a file as they went in, or not at all",
    ("studies/output/dataset.py", "h5py"): "texts go into a dataset as they are",
    ("studies/output/reading.py", "h5py"): "it refuses files, and reads none of their numbers",
    ("mesh/exodus.py", "h5py"): "numbers come out of a file as they went in, or not at all",
    ("mesh/formats.py", "meshio"): "as of the store; `mesh_file_closure` counts it where a study's own file is read",
    ("units.py", "pint"): "what a study says with units is in the parameters as numbers",
}
"""Packages that do not influence results, and why."""

DISTRIBUTIONS = {"PIL": "pillow", "netgen": "netgen-mesher", "skfem": "scikit-fem", "yaml": "pyyaml"}
"""Distributions with another name than their package; looking one up takes a third of a second."""


class Closure(NamedTuple):
    """Files and packages that a module depends on; `packages` are import names."""

    files: tuple[Path, ...]
    packages: tuple[str, ...]
    digest: str


class Code:
    """Files of code, each parsed once."""

    def __init__(self, package: Path = PACKAGE) -> None:
        self.package = package
        self._sources: dict[Path, Source] = {}
        self._closures: dict[tuple[Path, frozenset[Path], str], Closure] = {}
        self._taken: dict[Path, tuple[set[Path], set[tuple[str, str]]]] = {}

    def closure(self, start: Path, without: frozenset[Path] = frozenset(), counted: str = "") -> Closure:
        """A file and all its direct and indirect imports."""
        known = start, without, counted
        if known not in self._closures:
            found: set[Path] = set()
            packages: set[str] = set()
            waiting = {start}
            while waiting:
                path = waiting.pop()
                found.add(path)
                if path not in self._taken:
                    self._taken[path] = self._imported(path, self._source(path).imports)
                files, taken = self._taken[path]
                waiting |= files - found - without
                packages |= {
                    package for place, package in taken if package == counted or (place, package) not in NOT_COUNTED
                }
            self._closures[known] = self._closed(found, packages)
        return self._closures[known]

    def union(self, closures: Iterable[Closure]) -> Closure:
        """Union of closures."""
        found = list(closures)
        files = {file for one in found for file in one.files}
        return self._closed(files, {package for one in found for package in one.packages})

    def of_text(self, text: str) -> Closure:
        """Closure of a text that is in no file."""
        try:
            source = read(textwrap.dedent(text), self.package.name)
        except SyntaxError:
            source = Source(hashlib.sha256(text.encode()).hexdigest(), frozenset(), None)
        files, taken = self._imported(Path.cwd() / "text.py", source.imports)
        found = self.union(map(self.closure, files))
        return self._closed(set(found.files), {*found.packages, *(package for _, package in taken)}, source.digest)

    def _closed(self, files: set[Path], packages: set[str], text: str = "") -> Closure:
        digests = sorted(self._source(file).digest for file in files)
        digest = hashlib.sha256("".join([text, *digests]).encode()).hexdigest()
        return Closure(tuple(sorted(files)), tuple(sorted(packages)), digest)

    def _source(self, path: Path) -> Source:
        if path not in self._sources:
            content = path.read_bytes()
            if path.suffix == ".jinja":
                self._sources[path] = Source(_mark(content), frozenset(), None)
            else:
                self._sources[path] = read(content, "" if self._has(path) else self.package.name)
        return self._sources[path]

    def _has(self, path: Path) -> bool:
        return path.is_relative_to(self.package)

    def _imported(self, path: Path, imports: Iterable[Import]) -> tuple[set[Path], set[tuple[str, str]]]:
        """Imported files, and packages with the importing file as in `NOT_COUNTED`."""
        packages: set[tuple[str, str]] = set()
        ours = self._has(path)
        files = set((path.parent / "templates").glob(f"{path.stem}.*.jinja")) if ours else set()
        where = path.relative_to(self.package).as_posix() if ours else str(path)
        for name in () if ours else plugin_packages():
            place = _own(name)
            if place and path.with_suffix("").is_relative_to(place):  # its version counts, not only this code
                packages.add((where, name))
        for one in imports:
            for found in self._followed(path, one):
                if isinstance(found, Path):
                    files.add(found)
                elif found not in sys.stdlib_module_names:
                    packages.add((where, found))
        return files, packages

    def _followed(self, path: Path, one: Import, faces: frozenset[Path] = frozenset()) -> list[Path | str]:
        """Files that an import reads through ``__init__`` files, or the name of an external package."""
        _, module, name = one
        place = self._place(path, *one[:2])
        if place is None:
            return [module.partition(".")[0]]
        file = _file(place)
        if not name and place == self.package:
            return []  # its attributes say what of it
        if name in ("", "*"):
            return [file] if file else []
        face = self._source(file).face if file else {}
        if file and file not in faces and face is not None and name in face:
            return self._followed(file, face[name], faces | {file})
        if file == PACKAGE / "__init__.py" and (lazy := _lazy_names().get(name)):
            return self._followed(file, (1, lazy, name), faces)
        below = _file(place / name)
        # What a face lacks may come from any of its modules.
        return [found for found in (file if face is None or not below else None, below) if found]

    def _place(self, path: Path, level: int, module: str) -> Path | None:
        """Path of a module without ending; None for an external package."""
        parts = module.split(".") if module else []
        if level:
            return path.parents[level - 1].joinpath(*parts)
        if parts[0] == self.package.name:
            return self.package.joinpath(*parts[1:])
        if self._has(path) or parts[0] in sys.stdlib_module_names:
            return None
        beside = path.parent / parts[0]
        root = beside if beside.is_dir() or _file(beside) else _own(parts[0])
        return root and root.joinpath(*parts[1:])


def _mark(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


OURS = Code()


def modules(*names: str) -> tuple[str, ...]:
    """Files of modules and all their imports.

    Examples
    --------
    >>> [Path(file).name for file in modules("registry")]
    ['registry.py']
    """
    return tuple(sorted({str(file) for name in names for file in OURS.closure(_module(name)).files}))


def stage_closure(*names: str, without: tuple[str, ...] = ()) -> Closure:
    """Closure of modules without the definitions and mesh types that they may choose."""
    return OURS.union(OURS.closure(_module(name), frozenset(map(_module, without))) for name in names)


def definition_closure(name: str, code: Code = OURS) -> Closure:
    """Closure of a definition, which may be outside this package."""
    return _declared_closure(DEFINITIONS[name], code)


def mesh_type_closure(name: str) -> Closure:
    """Closure of a mesh type."""
    return _declared_closure(MESH_TYPES[name], OURS)


def mesh_file_closure() -> Closure:
    """Closure of reading mesh files, with meshio."""
    return OURS.closure(_module("mesh.formats"), counted="meshio")


@cache
def _declared_closure(one: Declared, code: Code) -> Closure:
    if one.file is not None:
        return code.closure(one.file)
    function = inspect.unwrap(one.function)
    try:  # of a notebook: the function is all that is known
        return code.of_text(inspect.getsource(function))
    except OSError:  # a prompt that keeps no text
        made = function.__code__
        constants = [value for value in made.co_consts if not hasattr(value, "co_code")]
        return code.of_text(f"({made.co_code!r}, {made.co_names!r}, {constants!r})")


@cache
def distribution(package: str) -> str:
    """Distribution that contains a package.

    Examples
    --------
    >>> distribution("skfem"), distribution("numpy")
    ('scikit-fem', 'numpy')
    """
    if package in DISTRIBUTIONS:
        return DISTRIBUTIONS[package]
    from importlib.metadata import PackageNotFoundError, packages_distributions, version

    try:
        version(package)
    except PackageNotFoundError:
        return packages_distributions().get(package, [package])[0]
    return package


def _module(name: str) -> Path:
    ours = PACKAGE / (name.replace(".", "/") + ".py")
    spec = None if ours.is_file() else find_spec(full_name(name))
    return Path(spec.origin) if spec and spec.origin else ours


@cache
def _own(package: str) -> Path | None:
    """Path of a package without distribution, such as one on PYTHONPATH, or with entry points for springtune."""
    if package in plugin_packages() or installed(distribution(package)) == "none":
        spec = find_spec(package)
        origin = Path(spec.origin) if spec and spec.origin else Path()
        if origin.suffix == ".py":
            return origin.parent if origin.stem == "__init__" else origin.with_suffix("")
    return None


@cache
def _lazy_names() -> dict[str, str]:
    """Modules of the names that `springtune` imports lazily."""
    places: dict[str, str] = vars(sys.modules[PACKAGE.name])["_PLACES"]
    return places


def _file(place: Path) -> Path | None:
    return next((file for file in (place.with_suffix(".py"), place / "__init__.py") if file.is_file()), None)


# -- keys --------------------------------------------------------------------------------------------------------------


@cache
def installed(distribution: str) -> str:
    """Version of a distribution; "none" if it is not installed or not wanted."""
    from importlib.metadata import PackageNotFoundError, version  # here: it costs as much as the rest of a key

    unused = distribution == "cvxopt" and os.environ.get("SPRINGTUNE_SOLVER") == "superlu"
    try:
        return "none" if unused else version(distribution)
    except PackageNotFoundError:
        return "none"


@cache
def stage_key(*modules: str, without: tuple[str, ...] = ()) -> str:
    """Key of modules' code and the versions of their packages."""
    return code_key(stage_closure(*modules, without=without))


def definition_key(name: str) -> str:
    """Key of a definition's code."""
    return code_key(definition_closure(name))


def declared_key(one: Declared) -> str:
    """Key of the code of a declared function, such as an engine."""
    return code_key(_declared_closure(one, OURS))


def mesh_type_key(name: str) -> str:
    """Key of a mesh type's code; for mesh files of the reader's."""
    if name not in MESH_TYPES:
        return code_key(mesh_file_closure())
    return code_key(mesh_type_closure(name))


@cache
def code_key(code: Closure) -> str:
    """Key of code and the versions of its packages."""
    versions = (f"{name} {installed(name)}" for name in map(distribution, code.packages))
    return hash_of(code.digest, [f"python {sys.version_info[0]}.{sys.version_info[1]}", *sorted(set(versions))])


@cache
def beam_key(beam: "Beam") -> dict[str, Any]:
    """Properties of a beam that results depend on; its label is not one."""
    return asdict(beam) | {"name": ""}


@cache
def material_key(material: "Material", density: bool = False) -> dict[str, Any]:
    """Properties of a material that results depend on; statics ignore density."""
    known = asdict(material) | {"name": ""}
    known.pop("test_errors", None)
    if known.get("plane") == "stress":
        del known["plane"]
    if not density:
        del known["density"]
    return known
