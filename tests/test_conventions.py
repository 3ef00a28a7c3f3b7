"""Imports of the whole source: their contracts, and what is light to import."""

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

REPOSITORY = Path(__file__).parents[1]
SOURCE = REPOSITORY / "src/springtune"


def test_imports_keep_the_contracts_of_pyproject():
    """Rooms, their layers, what the library does not import, and no circles."""
    done = subprocess.run(["lint-imports", "--no-cache"], cwd=REPOSITORY, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_modules_are_imported_by_text_in_one_place():
    """import-linter cannot read such imports: all of them go through `springtune.registry`."""
    names = {"import_module", "__import__", "exec", "eval"}
    for path in sorted(SOURCE.rglob("*.py")):
        used = {getattr(node, one, "") for node in ast.walk(ast.parse(path.read_bytes())) for one in ("id", "attr")}
        assert not names & used or path.relative_to(SOURCE) == Path("registry.py"), path


@pytest.mark.parametrize(("program", "heavy"), yaml.safe_load(Path(__file__).with_name("light.yaml").read_text()))
def test_what_is_used_alone_does_not_import_what_is_heavy(program, heavy, tmp_path):
    (tmp_path / "config").symlink_to(REPOSITORY / "config")  # without the results of this checkout, which are read
    program = f"import sys; {program}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert not set(heavy.split()) & set(done.stdout.splitlines()[-1].split())


ROOT = Path(__file__).parents[1]
TIGHT = re.compile(r"(?:<=?\s*|>=?\s*|\+ |- |\b[ar]tol=|_tol=|rel=|abs=|clip\()\d(?:\.\d+)?e-(?:1\d|2\d)\b")
COMPARES = re.compile(r"\bassert\b|approx\(|allclose|\b[ar]tol=|rel_tol=")


def compared(path):
    """Lines of a test, a page, an example or a docstring's example that compare numbers."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        text = "\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"] if cell["cell_type"] == "code")
    for number, line in enumerate(text.splitlines(), 1):
        if COMPARES.search(line) if path.suffix == ".ipynb" or "src" not in path.parts else ">>>" in line:
            yield number, line


def test_no_comparison_is_tighter_than_rounding_on_another_processor():
    """What is exact by construction says why on its line."""
    paths = {path for folder in ("tests", "src", "docs", "examples") for path in (ROOT / folder).rglob("*.*")}
    found = []
    for path in sorted(paths - {Path(__file__)}):
        lines = compared(path) if path.suffix in (".py", ".md", ".ipynb") else ()
        found += [f"{path}:{number}: {line}" for number, line in lines if TIGHT.search(line) and "exact" not in line]
    assert not found, "\n".join(found)
