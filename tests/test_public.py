"""Public names: each is told in full, with an example that a reader can paste, and is known to type checkers."""

import ast
import builtins
import doctest
import enum
import inspect
import re
import textwrap
from dataclasses import is_dataclass
from functools import cached_property
from pathlib import Path

import pytest

import springtune as st

TOLD = sorted(name for name in st.__all__ if callable(getattr(st, name)))
"""Classes and functions; what mappings hold is told after their assignment."""

GIVEN = {"tree"}
"""What examples may take for granted: a dataset, see `conftest.py` beside the package."""


def sections(told):
    """Sections of a numpydoc docstring: text by title, ``""`` for what stands before the first."""
    parts = re.split(r"^(\w[\w ]*)\n-{3,}$", inspect.getdoc(told) or "", flags=re.MULTILINE)
    return {"": parts[0]} | dict(zip(parts[1::2], parts[2::2]))


def examples(told):
    """Source of the examples of a docstring."""
    return "".join(one.source for one in doctest.DocTestParser().get_examples(inspect.getdoc(told) or ""))


def entries(section):
    """Names that a section describes: ``a, b : float`` is two."""
    lines = [line.partition(" : ")[0] for line in section.splitlines() if line and not line.startswith(" ")]
    return {name.strip(" *") for line in lines for name in line.split(",")}


def members(owner):
    """Public methods and properties that a class of the package defines itself, by name."""
    kinds = (property, cached_property)
    for name, member in vars(owner).items():
        if not name.startswith("_") and (inspect.isfunction(member) or isinstance(member, kinds)):
            yield name, member


def parameters(function):
    """Names of what a function or a class takes."""
    return {name for name in inspect.signature(function).parameters if name != "self"}


def raised(function):
    """Names of the exceptions that a function's own lines raise."""
    lines = textwrap.dedent(inspect.getsource(inspect.unwrap(function)))
    for node in ast.walk(ast.parse(lines)):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            yield node.exc.func.id


def check_function(function):
    """Sections that apply to a function are there."""
    told = sections(function)
    assert told[""].strip()
    assert entries(told.get("Parameters", "")) == parameters(function)
    returns = inspect.signature(function).return_annotation
    assert (returns in (None, "None")) or "Returns" in told
    assert set(raised(function)) <= entries(told.get("Raises", ""))


@pytest.mark.parametrize("name", TOLD)
def test_a_name_is_told_in_full(name):
    told = getattr(st, name)
    if inspect.isfunction(told):
        check_function(told)
    elif issubclass(told, Exception):
        assert sections(told)[""].strip()
    else:
        parts = sections(told)
        named = entries(parts.get("Parameters", "")) | entries(parts.get("Attributes", ""))
        assert named >= (set(told.__members__) if issubclass(told, enum.Enum) else parameters(told))
        made = vars(told).get("__post_init__" if is_dataclass(told) else "__init__")
        assert set(raised(made) if made else ()) <= entries(parts.get("Raises", ""))
        for _, member in members(told):
            if inspect.isfunction(member):
                check_function(member)
            else:
                assert inspect.getdoc(member)


@pytest.mark.parametrize("name", TOLD)
def test_a_name_has_an_example_that_can_be_pasted(name):
    told = getattr(st, name)
    shown = {name: examples(told)}
    if inspect.isclass(told):
        shown |= {f"{name}.{member}": examples(method) for member, method in members(told)}
        missing = [member for member, _ in members(told) if f".{member}" not in "".join(shown.values())]
        assert not missing
    assert "Examples" in sections(told) and shown[name]
    assert inspect.isclass(told) or f"st.{name}(" in shown[name]
    for place, source in shown.items():
        nodes = list(ast.walk(ast.parse(source)))
        known = {node.id for node in nodes if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load)}
        known |= {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ExceptHandler)}
        known |= {node.arg for node in nodes if isinstance(node, ast.arg)}
        imports = [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]
        known |= {alias.asname or alias.name for node in imports for alias in node.names}
        used = {node.id for node in nodes if isinstance(node, ast.Name)}
        assert used <= known | GIVEN | set(dir(builtins)), place


def test_type_checkers_know_the_same_names():
    stub = ast.parse(Path(st.__file__).with_suffix(".pyi").read_text())
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    imported = {alias.asname: f"{node.module}.{alias.name}" for node in imports for alias in node.names}
    assert set(imported) | {"__version__"} == set(st.__all__) and len(imported) + 1 == len(st.__all__)
    for name, place in imported.items():
        assert place.rpartition(".")[2] == name
        told = getattr(st, name)
        if callable(told) and told.__module__ != f"springtune.{place.rpartition('.')[0]}":
            assert told.__module__.startswith(f"springtune.{place.rpartition('.')[0]}.")
