"""What holds for the whole source: arrows between rooms, words, and what tests may touch."""

import ast
from collections import defaultdict
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from importlib.util import resolve_name
from pathlib import Path

import pytest

from springtune.kinds import kinds

REPOSITORY = Path(__file__).parents[2]
SOURCE = REPOSITORY / "src/springtune"
PARSED = {path: ast.parse(path.read_bytes()) for path in sorted(SOURCE.rglob("*.py"))}

LAYERS = (
    ("escapes", "inputs", "registry", "units"),
    ("linalg", "mesh", "problem"),
    ("mechanics",),
    ("springs", "reference"),
    ("scene",),
    ("prediction", "study", "jobs", "output", "handover"),
    ("kinds",),
    ("browse", "publication"),
    ("campaign",),
    ("cli",),
    ("__init__", "__main__"),
)
"""Rooms and modules of the package, the lowest first: imports point down, or across without a circle."""

LAYER = {room: number for number, rooms in enumerate(LAYERS) for room in rooms}

VAGUE = {"asked", "whole", "race", "laid", "tasks", "work", "code", "files", "source", "problems", "unit"}
"""Names of modules that say nothing to a reader who does not know the house."""


OWN = {"MAX_EVALUATIONS", "MAX_HALVINGS", "MAX_ITERATIONS", "SMALLEST_STEP", "TOLERANCE"}
OWN |= {"KIND", "OUTPUTS", "PAGE", "PLOTS", "STAGES", "VIEWS"}
"""Constants that say the same of each solver or each study kind, and that each has its own value of."""


def place(path):
    """Parts of a module's name from the package on."""
    parts = path.relative_to(SOURCE).with_suffix("").parts
    return parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts


def imported(path):
    """Parts of the names of the package's modules that a module imports, wherever in it, and the lines."""
    package = ".".join(path.relative_to(SOURCE.parent).parts[:-1])
    for node in ast.walk(PARSED[path]):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = resolve_name("." * node.level + (node.module or ""), package) if node.level else node.module
            names = [f"{base}.{alias.name}" for alias in node.names]
        for name in names:
            first, *parts = name.split(".")
            if first == "springtune":
                # What a module defines is no module: its own name is that of the import.
                while parts and not (
                    SOURCE.joinpath(*parts).is_dir() or SOURCE.joinpath(*parts).with_suffix(".py").is_file()
                ):
                    parts.pop()
                if parts:
                    yield tuple(parts), node.lineno


def arrows():
    """Imports between rooms: from, to, and where it stands."""
    for path in PARSED:
        for target, line in imported(path):
            if place(path)[0] != target[0]:
                yield place(path)[0], target[0], f"{path.relative_to(REPOSITORY)}:{line}"


def test_every_room_has_its_place():
    new = {place(path)[0] for path in PARSED} - set(LAYER)
    assert not new, f"say in LAYERS what {', '.join(sorted(new))} may import"


def test_no_import_points_upwards():
    up = [f"{where}: {room} imports {other}" for room, other, where in arrows() if LAYER[other] > LAYER[room]]
    assert not up, "\n".join(up)


def test_no_rooms_import_each_other_in_a_circle():
    graph = defaultdict(set)
    for room, other, _ in arrows():
        graph[room].add(other)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_no_modules_import_each_other_in_a_circle():
    """Types count, too: what two modules need to know of each other stands in one of them, or as a protocol."""
    modules = {place(path) for path in PARSED if path.name != "__init__.py"}
    graph = {place(path): {target for target, _ in imported(path)} & modules - {place(path)} for path in PARSED}
    try:
        TopologicalSorter({one: found for one, found in graph.items() if one in modules}).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(".".join(one) for one in error.args[1]))


def test_a_kind_imports_no_other_kind_but_scenes():
    found = [
        f"{path.relative_to(REPOSITORY)}:{line}: {'.'.join(target)}"
        for path in PARSED
        for target, line in imported(path)
        if place(path)[0] == target[0] == "kinds" and min(len(place(path)), len(target)) > 1
        if (SOURCE / "kinds" / place(path)[1]).is_dir() and (SOURCE / "kinds" / target[1]).is_dir()
        if target[1] not in (place(path)[1], "scenes")
    ]
    assert not found, "\n".join(found)


def test_modules_have_names_that_say_something():
    assert not [str(path.relative_to(SOURCE)) for path in PARSED if VAGUE & set(place(path))]


def test_nothing_is_chosen_by_globals():
    found = [
        f"{path.relative_to(REPOSITORY)}:{node.lineno}"
        for path, tree in PARSED.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "globals"
    ]
    assert not found


def test_a_constant_has_one_meaning():
    """Constants of one name and different values read as one to whoever knows the other."""
    values = defaultdict(dict)
    for path, tree in PARSED.items():
        for node in tree.body:
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            for target in targets if isinstance(node, ast.Assign | ast.AnnAssign) and node.value else ():
                names, parts = (
                    (target.elts, getattr(node.value, "elts", []))
                    if isinstance(target, ast.Tuple)
                    else ([target], [node.value])
                )
                for name, value in zip(names, parts):
                    if isinstance(name, ast.Name) and name.id.isupper():
                        values[name.id].setdefault(ast.dump(value), str(path.relative_to(SOURCE)))
    several = {name: sorted(found.values()) for name, found in values.items() if len(found) > 1 and name not in OWN}
    assert not several, "\n".join(f"{name}: {', '.join(found)}" for name, found in several.items())


def package_names(tree):
    """Names in a test that come from the package."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "springtune":
            yield from (alias.asname or alias.name for alias in node.names)
        elif isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.partition(".")[0] == "springtune":
                    yield alias.asname or "springtune"


def root(node):
    """Name at the beginning of a chain of attributes, or a text that is one."""
    while isinstance(node, ast.Attribute | ast.Call | ast.Subscript):
        node = node.func if isinstance(node, ast.Call) else node.value
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value.partition(".")[0]
    return node.id if isinstance(node, ast.Name) else ""


def private(name):
    return name.startswith("_") and not name.endswith("__") and name != "_"


TESTS = sorted((REPOSITORY / "tests").rglob("*.py"))


@pytest.mark.parametrize("path", TESTS, ids=lambda path: str(path.relative_to(REPOSITORY / "tests")))
def test_tests_use_what_everybody_may_use(path):
    """No private names of the package, and nothing of it patched: what a test has to change is an option.

    Entries of a registry may come and go with a test: that is what registries are for.
    """
    tree, found = ast.parse(path.read_bytes()), []
    names = {"springtune", *package_names(tree)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and private(node.attr):
            # A class of the tests may have private names of its own.
            # `os._exit` is Python's, of processes that are forked.
            if not (isinstance(node.value, ast.Name) and node.value.id in ("self", "cls", "os")):
                found.append((node.lineno, node.attr))
        elif isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "springtune":
            found += [(node.lineno, alias.name) for alias in node.names if private(alias.name)]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and root(node.func) == "monkeypatch":
            if node.func.attr in ("setattr", "delattr") and root(node.args[0]) in names:
                found.append((node.lineno, f"monkeypatch.{node.func.attr}"))
        elif isinstance(node, ast.Assign):
            targets = [target for target in node.targets if isinstance(target, ast.Attribute)]
            found += [
                (node.lineno, f"{root(target)}.{target.attr} = ...") for target in targets if root(target) in names
            ]
    assert not found, "\n".join(f"{path.relative_to(REPOSITORY)}:{line}: {what}" for line, what in found)


@pytest.mark.parametrize("stage", [one for kind in kinds() for one in kind.stages], ids=lambda one: one.name)
def test_stages_say_what_is_lost_to_limits(stage):
    """Those that attempt tasks; what has no tasks loses none."""
    module = import_module(f"springtune.{stage.module}")
    assert callable(module.run)
    text = Path(module.__file__).read_text()
    attempts = "spent.attempt" in text or "stored_interpolant.make" in text
    assert hasattr(module, "lose") == attempts == (stage.name != "calibrate")
