"""Build a paper: numbers, tables, figures as ``figures.yaml`` declares them, then the PDF."""

import io
import os
import re
import runpy
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from springtune.safe_io import write_bytes, write_json

from ..output.text import cell_text
from . import PaperError, check_typst, numbers
from .numbers import HASH_DIGITS, Dataset, Entry, dataset_of, validate_entry

MAIN = "main.typ"


def run(source: str | Path, folder: str | Path, output: str | Path, *paths: str | Path) -> None:
    """Build a paper; the same inputs give the same bytes: Typst's own fonts, no date."""
    source, folder = Path(source), Path(folder)
    check_typst()
    _check_texts(source)
    declared, printed, drawings = (numbers.load(source / f"{name}.yaml") for name in ("numbers", "printed", "figures"))
    datasets, tables = numbers.read(paths), declared.get("tables", {})
    content = {
        "numbers": numbers.numbers(declared.get("numbers", {}), printed, datasets),
        "tables": {name: numbers.table(entry, datasets, f"table {name}") for name, entry in tables.items()},
        "figures": draw(drawings, datasets, folder, source.resolve().parents[1] / "examples"),
        "datasets": [one.origin() for one in datasets.values()],
        "labels": _labels(datasets),
    }
    write_json(folder / "numbers.json", content)
    write_bytes(output, typeset(source, folder))


def main(source: str, folder: str, output: str, record: str, digest: str, *paths: str) -> None:
    """Build a paper and write its record."""
    run(source, folder, output, *paths)
    write_json(record, {"digest": digest})


def typeset(source: Path, folder: Path) -> bytes:
    """Typeset a paper from its numbers and figures."""
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


def _check_texts(source: Path) -> None:
    """Raise if numbers are typed into the text."""
    if not (source / MAIN).is_file():
        raise PaperError(f"{source / MAIN}: there is no such file; give the folder of a paper's source")
    if found := [
        f"{path}:{line}: '{number}' is typed; declare it in numbers.yaml, or printed.yaml, and write #n(\"its name\")"
        for path in sorted(source.glob("*.typ"))
        if path.name != "template.typ"
        for line, number in typed_numbers(path.read_text(encoding="utf-8"))
    ]:
        raise PaperError("\n".join(found))


def _labels(datasets: Mapping[str, Dataset]) -> list[str]:
    coordinates = [one.tree.coords for one in datasets.values()]
    names = ("beam", "definition", "mesh_type", "material")
    return sorted({str(label) for one in coordinates for name in names if name in one for label in one[name].values})


# -- numbers typed into the text ---------------------------------------------------------------------------------------

FUNCTIONS = ("beam", "drawing", "has", "n", "named", "range", "tabular", "v")
"""Template functions whose arguments are names or layout."""

IGNORED_PATTERNS = (
    re.compile(r"/\*.*?\*/", re.DOTALL),
    re.compile(r"(?<!:)//[^\n]*"),
    re.compile(r"^#(?:import|include|set|show)\b[^\n]*", re.MULTILINE),
    re.compile(rf"#?\b(?:{'|'.join(FUNCTIONS)})\([^()\[\]]*\)"),
    re.compile(r"\b(?:columns|width|height|gap|above|below|size|breakable|placement):\s*[\w.%()+, ]+(?=[,)\n])"),
    re.compile(r"@[\w-]+(?:\[[^\]]*\])?"),
    re.compile(r"<[\w-]+>"),
    re.compile(r"https?://\S+"),
    re.compile(
        r"\b(?:[Tt]ables?|[Ff]igures?|[Ee]quations?|[Ss]ections?)[\s~]+\d+(?:\.\d+)*(?:(?:,|[\s~]+to|[\s~]+and|–|-)[\s~]*\d+(?:\.\d+)*)*"
    ),
    re.compile(r"\b[23]-?D\b|(?<=[A-Za-z_])\d+\w*"),
)
FORMULA_PATTERN = re.compile(r"\$[^$]*\$")
SINGLE_DIGIT_PATTERN = re.compile(r"(?<![\d.,])\d(?![\d.,]*\d)")
NUMBER_PATTERN = re.compile(r"\d[\d.,]*(?:\s*%|\s*[a-zA-Zµ°]+\b)?")


def _blank(found: re.Match[str]) -> str:
    """Replace a match by spaces and line breaks."""
    return re.sub(r"[^\n]", " ", found.group())


def typed_numbers(text: str) -> Iterator[tuple[int, str]]:
    r"""Yield numbers typed into Typst text in place of dataset values, with their lines.

    Digits are allowed in names (``2-D``, ``P1``, ``@tab-1``), after *Table*, *Figure*, *Equation* and *section*, and in
    arguments of `FUNCTIONS`. Formulas may hold one-digit integers, as :math:`2 k / \sqrt 3`.
    """
    for pattern in IGNORED_PATTERNS:
        text = pattern.sub(_blank, text)
    text = FORMULA_PATTERN.sub(lambda formula: SINGLE_DIGIT_PATTERN.sub(_blank, formula.group()), text)
    for found in NUMBER_PATTERN.finditer(text):
        yield text.count("\n", 0, found.start()) + 1, found.group().strip()


# -- figures -----------------------------------------------------------------------------------------------------------


class Drawing(Entry):
    """Declaration of a figure: a public plot function, a study and its selection, or a script of ``examples/``."""

    plot: str = ""
    study: str = ""
    at: dict[str, Any] = {}
    example: str = ""


def draw(
    declared: Mapping[str, Any], datasets: Mapping[str, Dataset], folder: Path, examples: Path = Path("examples")
) -> dict[str, Any]:
    """Draw the figures of a paper as PDF files."""
    drawings = {name: validate_entry(Drawing, entry, f"figure {name}") for name, entry in declared.items()}
    for name, drawing in drawings.items():
        write_bytes(folder / f"{name}.pdf", _pdf(drawing, datasets, f"figure {name}", examples))
    return {name: _origin(drawing, datasets, f"figure {name}") for name, drawing in drawings.items()}


def _pdf(drawing: Drawing, datasets: Mapping[str, Dataset], name: str, examples: Path) -> bytes:
    import matplotlib.pyplot as plt

    from ..output.style import SETTINGS

    if bool(drawing.example) == bool(drawing.plot):
        raise PaperError(f"{name}: give a plot, or the example that draws it, one of both")
    # Fonts as publishers take them.
    with plt.rc_context(SETTINGS | {"pdf.fonttype": 42}):
        if drawing.example:
            figure = _example_figure(examples / f"{drawing.example}.py", name)
        else:
            plot, tree = _plot_function(drawing.plot, name), dataset_of(datasets, drawing.study, name).tree
            try:
                figure = np.ravel(np.asarray(plot(tree, **drawing.at), dtype=object))[0].figure
            except (KeyError, TypeError, ValueError) as error:
                raise PaperError(f"{name}: {drawing.plot} of the study '{drawing.study}': {error}") from None
        content = io.BytesIO()
        figure.savefig(content, format="pdf", metadata={"CreationDate": None})
        plt.close(figure)
    return content.getvalue()


def _example_figure(script: Path, name: str) -> Any:
    import matplotlib.pyplot as plt

    if not script.is_file():
        raise PaperError(f"{name}: there is no {script}; give the stem of a script of this folder")
    plt.close("all")
    with redirect_stdout(io.StringIO()):
        runpy.run_path(str(script))["main"]()
    if len(plt.get_fignums()) != 1:
        raise PaperError(f"{name}: {script} leaves {len(plt.get_fignums())} figures open; it has to leave one")
    return plt.gcf()


def _plot_function(plot: str, name: str) -> Callable[..., object]:
    import springtune

    if not plot.startswith("plot_") or plot not in springtune.__all__:
        known = [one for one in springtune.__all__ if one.startswith("plot_")]
        raise PaperError(f"{name}: nothing plots '{plot}'; give one of {', '.join(known)}")
    return getattr(springtune, plot)


def _origin(drawing: Drawing, datasets: Mapping[str, Dataset], name: str) -> str:
    if drawing.example:
        return f"none, drawn by examples/{drawing.example}.py"
    place = ": ".join(filter(None, (drawing.study, cell_text(drawing.at, {"mesh_size": "m"}))))
    return f"{place}, sha256 {dataset_of(datasets, drawing.study, name).sha256[:HASH_DIGITS]}"


if __name__ == "__main__":
    os.environ["MPLBACKEND"] = "Agg"
    try:
        main(*sys.argv[1:])
    except PaperError as problem:
        sys.exit(str(problem))
