"""Calls of the library that are refused: by one message with key, value and remedy, and no file is left behind."""

import re
from contextlib import nullcontext
from functools import cache
from pathlib import Path
from pkgutil import resolve_name

import numpy as np
import pytest
import yaml

import springtune as st
from counting import counted
from springtune.mesh.cells import MeshType
from springtune.scene.boundary_problem import unit_reference
from springtune.scene.mesh_cache import MeshCache

GIVEN = {"__name__": __name__, "st": st, "np": np, "REPOSITORY": Path(__file__).parents[1]}
TABLE = yaml.load(Path(__file__).with_name("refused_calls.yaml").read_text(), yaml.CSafeLoader)
NAMES = TABLE.pop("names")


@cache
def value(name):
    """What a name of the table stands for: an expression, or an object by its module."""
    code = NAMES[name]
    return resolve_name(code) if re.fullmatch(r"[\w.]+:\w+", code) else eval(code, names_in(code))


def names_in(code):
    """What stands for the names of an expression."""
    return GIVEN | {word: value(word) for word in re.findall(r"[A-Za-z]\w*", code) if word in NAMES}


ROWS = [
    pytest.param(section, code, said, one, id=f"{section}: {code}, {number}")
    for section, rows in TABLE.items()
    for code, said, *values in rows
    for number, one in enumerate((value(values[0]) if isinstance(values[0], str) else values[0]) if values else [None])
]


@pytest.mark.filterwarnings("ignore::springtune.problem.shapes.AssumptionWarning")
@pytest.mark.parametrize(("section", "code", "said", "one"), ROWS)
def test_a_call_is_refused(section, code, said, one, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = names_in(code) | {"VALUE": one}
    program = value("PROGRAMS").get(one, "") if isinstance(one, str) else ""
    if said is None:
        eval(code, names)
        return
    work = (unit_reference, MeshType.__call__, MeshCache.__init__)
    with counted(*work) if "at once" in section else nullcontext() as calls:
        with pytest.raises((ValueError, RuntimeError, KeyError), match=said.replace("PROGRAM", program)) as caught:
            eval(code, names)
    assert "programs" not in section or "\n" not in str(caught.value)
    assert not calls and not [*tmp_path.iterdir()]
