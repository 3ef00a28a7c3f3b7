"""Build a paper: numbers, tables, figures, then the PDF."""

import os
import re
import sys
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from springtune.safe_io import atomic

from ..runs import records
from . import PaperError

if TYPE_CHECKING:
    from .numbers import Dataset

MAIN = "main.typ"


def run(source: str | Path, folder: str | Path, output: str | Path, *paths: str | Path) -> None:
    """Build a paper; the same inputs give the same bytes: Typst's own fonts, no date."""
    source, folder = Path(source), Path(folder)
    check_typst()
    _check_texts(source)
    # Here, so that what is wrong with the source is told at once.
    from . import figures, numbers

    declared, printed = numbers.load(source / "numbers.yaml"), numbers.load(source / "printed.yaml")
    datasets = numbers.read(paths)
    content = {
        "numbers": numbers.numbers(declared.get("numbers", {}), printed, datasets),
        "tables": {
            name: numbers.table(entry, datasets, f"table {name}") for name, entry in declared.get("tables", {}).items()
        },
        "figures": figures.draw(
            numbers.load(source / "figures.yaml"), datasets, folder, source.resolve().parents[1] / "examples"
        ),
        "datasets": [one.origin() for one in datasets.values()],
        "labels": _labels(datasets),
    }
    atomic.write_json(folder / "numbers.json", content)
    atomic.write_bytes(output, typeset(source, folder))


def main(source: str, folder: str, output: str, record: str, digest: str, *paths: str) -> None:
    """Build a paper and write its record."""
    checksums = [records.checksum(path) for path in paths]
    run(source, folder, output, *paths)
    records.write(record, digest, [output], read=checksums)


def typeset(source: Path, folder: Path) -> bytes:
    """Typeset a paper whose numbers and figures are made."""
    import typst

    source, folder = source.resolve(), folder.resolve()
    root = Path(os.path.commonpath([source, folder]))
    try:
        made = typst.compile(
            source / MAIN, root=root, ignore_system_fonts=True,
            sys_inputs={"data": "/" + folder.relative_to(root).as_posix()},
        )  # fmt: skip
    except typst.TypstError as error:
        raise PaperError(getattr(error, "diagnostic", "") or str(error)) from None
    return bytes(made)


def check_typst() -> None:
    """Raise if Typst is not installed."""
    if find_spec("typst") is None:
        raise PaperError('the paper is set with Typst, which is not installed: pip install "springtune[paper]"')


def _check_texts(source: Path) -> None:
    if not (source / MAIN).is_file():
        raise PaperError(f"{source / MAIN}: there is no such file; give the folder of a paper's source")
    found = [
        f"{path}:{line}: '{number}' is typed; declare it in numbers.yaml, or printed.yaml, and write #n(\"its name\")"
        for path in sorted(source.glob("*.typ"))
        if path.name != "template.typ"
        for line, number in typed_numbers(path.read_text(encoding="utf-8"))
    ]
    if found:
        raise PaperError("\n".join(found))


def _labels(datasets: Mapping[str, "Dataset"]) -> list[str]:
    """Labels of all dimensions."""
    found = {str(label) for one in datasets.values() for name in ("beam", "definition", "mesh_type", "material")
             if name in one.tree.coords for label in one.tree.coords[name].values}  # fmt: skip
    return sorted(found)


# -- numbers typed into the text ---------------------------------------------------------------------------------------

FUNCTIONS = ("beam", "drawing", "has", "n", "named", "range", "tabular", "v")
"""Template functions whose arguments are names or layout."""

_BLANKED = (
    re.compile(r"/\*.*?\*/", re.DOTALL),
    re.compile(r"(?<!:)//[^\n]*"),
    re.compile(r"^#(?:import|include|set|show)\b[^\n]*", re.MULTILINE),
    re.compile(rf"#?\b(?:{'|'.join(FUNCTIONS)})\([^()\[\]]*\)"),
    re.compile(r"\b(?:columns|width|height|gap|above|below|size|breakable|placement):\s*[\w.%()+, ]+(?=[,)\n])"),
    re.compile(r"@[\w-]+(?:\[[^\]]*\])?"),
    re.compile(r"<[\w-]+>"),
    re.compile(r"https?://\S+"),
)
_REFERENCE = re.compile(
    r"\b(?:[Tt]ables?|[Ff]igures?|[Ee]quations?|[Ss]ections?)[\s~]+\d+(?:\.\d+)*(?:(?:,|[\s~]+to|[\s~]+and|–|-)[\s~]*\d+(?:\.\d+)*)*"
)
_NAME = re.compile(r"\b[23]-?D\b|(?<=[A-Za-z_])\d+\w*")
_FORMULA = re.compile(r"\$[^$]*\$")
_STRUCTURE = re.compile(r"(?<![\d.,])\d(?![\d.,]*\d)")
_NUMBER = re.compile(r"\d[\d.,]*(?:\s*%|\s*[a-zA-Zµ°]+\b)?")


def _blank(found: re.Match[str]) -> str:
    """Replace a match by empty lines."""
    return re.sub(r"[^\n]", " ", found.group())


def typed_numbers(text: str) -> Iterator[tuple[int, str]]:
    r"""Yield numbers typed into Typst text in place of dataset values, with their lines.

    Digits are allowed in names (``2-D``, ``P1``, ``@tab-1``), after *Table*, *Figure*, *Equation* and *section*, and in
    arguments of `FUNCTIONS`. Formulas may hold one-digit integers, as :math:`2 k / \sqrt 3`.

    Examples
    --------
    >>> list(typed_numbers("The error is 3.4 %, see Table 1."))
    [(1, '3.4 %')]
    >>> list(typed_numbers('The error is #n("worst"), see @tab-1; $k = sqrt(3)/2 E t$ in 2-D.'))
    []
    >>> list(typed_numbers("As a formula: $k = 0.866 E t$."))
    [(1, '0.866 E')]
    """
    for pattern in _BLANKED:
        text = pattern.sub(_blank, text)
    text = _FORMULA.sub(lambda formula: _STRUCTURE.sub(_blank, formula.group()), text)
    for pattern in (_REFERENCE, _NAME):
        text = pattern.sub(_blank, text)
    for found in _NUMBER.finditer(text):
        yield text.count("\n", 0, found.start()) + 1, found.group().strip()


if __name__ == "__main__":
    os.environ["MPLBACKEND"] = "Agg"
    try:
        main(*sys.argv[1:])
    except PaperError as problem:
        sys.exit(str(problem))
