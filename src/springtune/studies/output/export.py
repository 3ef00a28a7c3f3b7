"""Files for other programs: a group of a dataset as one long table, and a VTU file of each scene with fields."""

import json
import math
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from springtune.handover.paraview import write_vtu
from springtune.problem.quantities import Status, nearest
from springtune.safe_io import check_folder, replacing, write_text

from ...registry import how_to_install
from . import reading
from .answers import plane_vectors
from .dataset import CELL_NODES, MESH_DIMENSIONS, SPRING_NODES, as_words, cells, is_flagged
from .text import cell_text

TABLE_ENDINGS = (".csv", ".parquet")

MOST_NUMBERS = 50_000_000  # most rows times columns: a table repeats the labels of all dimensions in each row


def table(tree: xr.DataTree, group: str = "/") -> pd.DataFrame:
    """Return a group as a table: a row for each requested cell, a column for each dimension and variable."""
    name = "/" + group.strip("/")
    known = [node.path for node in tree.subtree if node.data_vars]
    if name not in known:
        raise ValueError(f"--group {group}: the dataset has no such group; {nearest(name, known)}")
    data = tree[name].to_dataset().reset_coords()
    rows = math.prod(data.sizes.values())
    if rows * len(data.variables) > MOST_NUMBERS:
        why = f"{rows} rows of {len(data.variables)} columns, and at most {MOST_NUMBERS} values are written"
        remedy = "select in Python: springtune.open(path)['group'].sel(...).to_dataframe()"
        raise ValueError(f"group '{group}': {why}; {remedy}")
    asked = data.status != Status.NOT_REQUESTED if "status" in data else xr.DataArray(True)
    for variable in data.data_vars:
        if is_flagged(data[variable]):
            data[variable] = data[variable].dims, as_words(data[variable])
    units = {str(name): one.attrs.get("units", "1") for name, one in data.variables.items()}
    frame = data.to_dataframe().reset_index() if data.sizes else pd.DataFrame([{n: data[n].item() for n in data}])
    if asked.dims:
        frame = frame[asked.broadcast_like(xr.Dataset(coords=data.coords)).transpose(*data.sizes).values.ravel()]
    return frame.rename(columns={name: f"{name} [{unit}]" for name, unit in units.items() if unit not in ("", "1")})


def export(tree: xr.DataTree, path: Path, group: str = "/", force: bool = False) -> str:
    """Write a group as CSV or Parquet, by the ending of a path; return a line on the written file."""
    ending = path.suffix.lower()
    if ending not in TABLE_ENDINGS:
        remedy = f"give a file in {' or '.join(TABLE_ENDINGS)}"
        raise ValueError(f"--to {path}: '{path.suffix}' is no format to export to; {remedy}")
    check_folder(path)
    if path.exists() and not force:
        raise ValueError(f"{path}: is there already; give another name, or --force to replace it")
    if ending == ".parquet" and not find_spec("pyarrow"):
        raise ValueError(f"{path}: Parquet needs pyarrow, which is not installed; {how_to_install('export')}")
    frame = table(tree, group)
    with replacing(path) as unfinished:
        (frame.to_csv if ending == ".csv" else frame.to_parquet)(unfinished, index=False)
    return f"{path}: {len(frame)} rows, {len(frame.columns)} columns of group '{group}'"


# -- scenes in VTU files for ParaView ----------------------------------------------------------------------------------


def write_scenes(tree: xr.DataTree, folder: Path) -> None:
    """Write a VTU file for each scene with fields, and a table of the files with the labels of each."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.vtu"):
        old.unlink()
    fields, rows = tree["fields"].to_dataset(), []
    solved = fields.displacement_x.isel(particle=0, drop=True).notnull()
    order = *MESH_DIMENSIONS, *(str(name) for name in solved.dims if name not in MESH_DIMENSIONS)
    units = {name: str(fields[name].attrs.get("units", "1")) for name in order}
    for labels in cells(solved, order):
        name = cell_text(labels, units).replace(", ", "_").replace(" ", "") + ".vtu"
        _write_scene(folder / name, reading.field(tree, **labels), {"title": tree.attrs.get("title", ""), **labels})
        rows.append({"file": name, **labels})
    write_text(folder / "scenes.csv", pd.DataFrame(rows, columns=["file", *units]).to_csv(index=False))


def _write_scene(path: Path, network: xr.Dataset, labels: Mapping[str, object]) -> None:
    """Write a network: particles with displacements, springs as lines, cells; all in SI units."""
    network = network.squeeze([name for name in labels if name in network.dims])  # a mesh may be of one cell
    corners = network[CELL_NODES].transpose("cell", ...).values
    elements = {2: network[SPRING_NODES].transpose("spring", ...).values}
    elements |= {count: corners[(corners >= 0).sum(axis=1) == count][:, :count] for count in (3, 4)}
    points = {"displacement": plane_vectors(network, "displacement_{}")}
    known = "particle_reference_x" in network
    if known and np.isfinite(expected := plane_vectors(network, "particle_reference_{}")).all():
        points |= {"reference_displacement": expected, "error": points["displacement"] - expected}
    springs = {"stiffness": {2: network.stiffness.values}, "force": {2: network.spring_force.values}}
    write_vtu(path, plane_vectors(network, "{}"), elements, points, springs, {}, json.dumps(labels, indent=1))
