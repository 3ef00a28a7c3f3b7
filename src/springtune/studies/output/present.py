"""Make a study's outputs: figures in PNG and PDF files, and tables, each as CSV and all on one page."""

import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
import xarray as xr

from springtune.registry import import_name
from springtune.safe_io import write_bytes, write_json, write_text

from ..config.model import Output, modules, outputs
from . import reading
from .dataset import sign_of_errors
from .text import decimals, number


def main(dataset: str, folder: str, record: str, digest: str, *names: str) -> None:
    """Draw the figures of outputs into ``folder/figures``, write their other files, and the record of it."""
    with reading.open(dataset) as tree:
        width, font_size = (float(tree.attrs.get(f"figure_{name}") or 0) for name in ("width", "font_size"))
        if width or font_size:
            from . import style  # here: tables of beams and shapes need no matplotlib

            style.choose(width, font_size)
        for output in (outputs(*names)[name] for name in names):
            into = Path(folder) / output.into
            if output.module:
                _draw(output, tree, Path(folder) / "figures")
            if output.page:
                write_page(tree, into)
            if output.write:
                import_name(output.write)(tree, into)
    write_json(record, {"digest": digest})


def _draw(output: Output, tree: xr.DataTree, folder: Path) -> None:
    import matplotlib.pyplot as plt

    from . import style

    single = [(output.name, style.draw_alone, {"name": output.name, "draw": output.draw})]
    drawn: Any = single if output.draw else import_name(output.plot)(tree)
    for stem, plot, selection in drawn:
        figure = np.ravel(plot(tree, **selection))[0].figure
        for ending, content in style.png_and_pdf(figure).items():
            write_bytes(folder / f"{stem}.{ending}", content)
        plt.close(figure)


# -- the page of all tables --------------------------------------------------------------------------------------------

MOST_ROWS = 1000  # most rows on the page; CSV files have all

COLUMN_UNITS = {"mm2": "mm²", "mm": "mm", "percent": "%", "points": "points", "N": "N", "MPa": "MPa", "ms": "ms"}


def write_page(tree: xr.DataTree, folder: Path) -> None:
    """Write a CSV file for each table, and a page with all."""
    known = (name for name in modules("tables", "figures") if name.split(".")[2] in ("bodies", *tree.children))
    found = (getattr(import_name(name), "tables", None) for name in known)
    tables = [table for of_kind in found if of_kind for table in of_kind(tree)]
    for table in tables:  # missing numbers are empty
        text = pd.DataFrame(table["rows"]).to_csv(index=False, float_format="%.8g", lineterminator="\n")
        write_text(folder / f"{table['stem']}.csv", text)
    write_text(folder / "index.html", html(tables, tree))


def html(tables: Iterable[Mapping[str, Any]], tree: xr.DataTree) -> str:
    """Page of tables: each has a stem, a title, rows, and may have a note, remarks, marks and the cells `shown`."""
    import jinja2  # here: few jobs write the page

    loader = jinja2.PackageLoader("springtune.studies.output", "")
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    root, scenes = tree.to_dataset(), any("marks" in table for table in tables)
    shown = []
    for table in tables:
        cells, count = table["shown"] if "shown" in table else texts(table["rows"]), len(table["rows"])
        beyond = f"The first {MOST_ROWS} of {count} rows; the file has all of them: " if count > MOST_ROWS else ""
        text = cells.to_html(index=False, border=0) if len(cells) else ""
        shown.append(dict(table) | {"html": text, "beyond": beyond})
    return environment.get_template("page.html").render(
        tables=shown,
        scenes=scenes,
        sign=sign_of_errors(root) if scenes else "",
        beams=_beam_sizes(root),
        marks={mark for table in tables for mark in table.get("marks", "")},
        attributes=tree.attrs,
    )


def _beam_sizes(root: xr.Dataset) -> list[str]:
    """Extents of a study's beams; their thickness where it is not swept."""
    names = [name for name in ("beam_length", "beam_height", "beam_thickness") if name in root]
    names = [name for name in names if root[name].dims == ("beam",)]
    sizes = 1e3 * root[names].to_dataframe()[names].dropna() if names else pd.DataFrame()
    return [f"{beam}, {' x '.join(f'{size:.4g}' for size in row)} mm" for beam, row in zip(sizes.index, sizes.values)]


def texts(rows: list[Mapping[str, Any]]) -> pd.DataFrame:
    """Cells of a table as texts, a number with the digits that its column needs."""
    data = pd.DataFrame(rows)
    return pd.DataFrame({head(name): _column_texts(name, data[name].tolist()) for name in data}).head(MOST_ROWS)


def _column_texts(name: str, values: list[Any]) -> list[str]:
    if any(isinstance(value, str) for value in values):
        return [value if isinstance(value, str) else "–" for value in values]
    short = [f"{value:g}" for value in values]
    if max(map(len, short)) <= 4 and "nan" not in short:  # as a study says it: mesh sizes, friction
        return short
    places = error_decimals(values) if "error" in name else decimals(values)
    return [number(value, places, sign="error" in name) for value in values]


def error_decimals(values: Iterable[float]) -> int:
    """Decimals of errors [%] for three digits of their median."""
    sizes = [abs(value) for value in values if np.isfinite(value) and value]
    return int(np.clip(decimals([float(np.median(sizes))], 3) or 0, 1, 4)) if sizes else 2


def head(name: str) -> str:
    """Column name with its unit in brackets."""
    words = name.split("_")
    unit = COLUMN_UNITS.get(words[-1], "") if len(words) > 1 else ""
    return f"{' '.join(words[:-1])} [{unit}]" if unit else " ".join(words)


if __name__ == "__main__":
    import gc
    import os

    import fontTools.subset

    os.environ["MPLBACKEND"] = "Agg"
    sys.modules["pint"] = cast(Any, None)  # see `browse`
    gc.set_threshold(100_000, 20, 100)  # looking for garbage among figures takes a tenth of the drawing
    # A PDF has the place of each letter; reading how a font would place them takes a third of its time.
    # Not public: without these defaults PDFs are drawn more slowly.
    getattr(fontTools.subset.Options, "_drop_tables_default", []).extend(["GDEF", "GPOS", "GSUB"])
    main(*sys.argv[1:])
