"""Imports of the whole source: their contracts, and what is light to import."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

REPOSITORY = Path(__file__).parents[1]
SOURCE = REPOSITORY / "src/springtune"
PARSED = {path: ast.parse(path.read_bytes()) for path in sorted(SOURCE.rglob("*.py"))}


def test_imports_keep_the_contracts_of_pyproject():
    """Rooms, their layers, what the library does not import, and no circles."""
    done = subprocess.run(["lint-imports", "--no-cache"], cwd=REPOSITORY, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_modules_are_imported_by_text_in_one_place():
    """import-linter cannot read such imports: all of them go through `springtune.registry`."""
    found = [
        str(path.relative_to(SOURCE))
        for path, tree in PARSED.items()
        for node in ast.walk(tree)
        if {"import_module", "__import__", "exec", "eval"} & {getattr(node, "id", ""), getattr(node, "attr", "")}
    ]
    assert set(found) == {"registry.py"}


@pytest.mark.parametrize(("program", "heavy"), yaml.safe_load(Path(__file__).with_name("light.yaml").read_text()))
def test_what_is_used_alone_does_not_import_what_is_heavy(program, heavy):
    program = f"import sys; {program}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], cwd=REPOSITORY, capture_output=True, text=True, check=True)
    assert not set(heavy.split()) & set(done.stdout.splitlines()[-1].split())
