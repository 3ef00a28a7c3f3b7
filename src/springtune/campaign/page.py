"""The page of all tables, each also as CSV."""

from pathlib import Path

import jinja2
import numpy as np
import xarray as xr

from ..jobs.atomic import write_text
from ..kinds import kinds
from ..output.tables import csv_text


def write(tree: xr.DataTree, folder: str | Path) -> list[str]:
    """Write one CSV file a table and a page with all of them.

    Parameters
    ----------
    tree : xarray.DataTree
    folder : str or Path

    Returns
    -------
    list of str
        Names of the files written.
    """
    tables = [table for kind in kinds() if kind.tables for table in kind.module("tables").tables(tree)]
    written = {f"{table['stem']}.csv": csv_text(table["rows"]) for table in tables}
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("springtune.output", ""), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    written["index.html"] = environment.get_template("page.html").render(
        tables=[table for table in tables if "title" not in table],
        further=[table for table in tables if "title" in table],
        kinematics=[str(name) for name in tree.kinematics.values],
        attributes=tree.attrs,
        missing=np.nan,
    )
    for name, text in written.items():
        write_text(Path(folder) / name, text)
    return list(written)
