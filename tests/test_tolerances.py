"""Comparisons are relative and no tighter than 1e-9: sums round otherwise on another processor."""

import json
import re
from pathlib import Path

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
    paths = [path for folder in ("tests", "src", "docs", "examples") for path in (ROOT / folder).rglob("*")]
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in sorted(paths)
        if path.suffix in (".py", ".md", ".ipynb") and path != Path(__file__)
        for number, line in compared(path)
        if TIGHT.search(line) and "exact" not in line
    ]
    assert not found, "\n".join(found)
