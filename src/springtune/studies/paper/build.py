"""Build a paper: numbers, tables, figures, then the PDF."""

import os
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from springtune.safe_io import atomic

from ..runs import records
from . import PaperError

if TYPE_CHECKING:
    from .datasets import Dataset

MAIN = "main.typ"


def run(source: str | Path, folder: str | Path, output: str | Path, *paths: str | Path) -> None:
    """Build a paper; the same inputs give the same bytes: Typst's own fonts, no date."""
    source, folder = Path(source), Path(folder)
    check_typst()
    _check_texts(source)
    # Here, so that what is wrong with the source is told at once.
    from . import figures, numbers
    from .datasets import read

    declared, printed = numbers.load(source / "numbers.yaml"), numbers.load(source / "printed.yaml")
    datasets = read(paths)
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
    from .typed import typed_numbers

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


if __name__ == "__main__":
    os.environ["MPLBACKEND"] = "Agg"
    try:
        main(*sys.argv[1:])
    except PaperError as problem:
        sys.exit(str(problem))
