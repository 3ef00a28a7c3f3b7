"""One VTU file for each scene whose fields a study keeps, for ParaView and other programs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from springtune.handover.paraview import write_vtu
from springtune.safe_io.atomic import write_text

from . import reading
from .text import cell_text

MESH = ("beam", "mesh_type", "mesh_size")

LIST = "scenes.csv"
"""Table of the files, with the labels of each."""


def write(tree: xr.DataTree, folder: Path) -> list[Path]:
    """Write a file for each scene that has fields, and their table."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.vtu"):
        old.unlink()
    fields, rows = tree["fields"].to_dataset(), []
    solved = fields.displacement_x.isel(particle=0, drop=True).notnull()
    solved = solved.transpose(*MESH, *(name for name in solved.dims if name not in MESH))
    units = {name: str(fields[name].attrs.get("units", "1")) for name in solved.dims}
    for place in np.argwhere(solved.values):
        labels = {str(name): solved[name][at].item() for name, at in zip(solved.dims, place)}
        name = cell_text(labels, units).replace(", ", "_").replace(" ", "") + ".vtu"
        _write(folder / name, reading.field(tree, **labels), {"title": tree.attrs.get("title", "")} | labels)
        rows.append({"file": name} | labels)
    write_text(folder / LIST, pd.DataFrame(rows, columns=["file", *units]).to_csv(index=False))
    return [Path(LIST)]


def _write(path: Path, network: xr.Dataset, labels: Mapping[str, object]) -> None:
    """Write a network: particles with displacements, springs as lines, cells; all in SI units."""

    def vectors(names: str) -> np.ndarray:
        return np.stack([network[names.format(axis)].values for axis in "xy"], axis=1)

    network = network.squeeze([name for name in labels if name in network.dims])  # a mesh may be of one cell
    corners = network[reading.CELL_NODES].transpose("cell", ...).values
    cells = {2: network[reading.SPRING_NODES].transpose("spring", ...).values}
    cells |= {count: corners[(corners >= 0).sum(axis=1) == count][:, :count] for count in (3, 4)}
    points = {"displacement": vectors("displacement_{}")}
    expected = vectors("particle_reference_{}") if "particle_reference_x" in network else np.array(np.nan)
    if np.isfinite(expected).all():
        points |= {"reference_displacement": expected, "error": points["displacement"] - expected}
    springs = {"stiffness": {2: network.stiffness.values}, "force": {2: network.spring_force.values}}
    write_vtu(path, vectors("{}"), cells, points, springs, {}, json.dumps(labels, indent=1))
