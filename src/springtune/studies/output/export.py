"""Export a dataset: long tables, Zarr, netCDF meshes and ParaView files."""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from springtune.problem.quantities import nearest
from springtune.safe_io.atomic import UNFINISHED, check_folder, replacing, write_bytes, write_text, writer
from springtune.units import QUANTITY_KINDS, UnitError, parse

from ...registry import how_to_install
from . import reading
from .dataset import flag_words, is_flagged
from .selection import at, shown_swept
from .text import cell_text


class RequestError(ValueError):
    """The request does not fit the dataset, or names an unknown format."""

    wrong_call = True


@dataclass(frozen=True)
class Column:
    """A column of a long table; `values` has shape (n_rows,)."""

    name: str
    units: str
    long_name: str
    values: np.ndarray

    @property
    def title(self) -> str:
        """Name with unit."""
        return self.name if self.units in ("", "1") else f"{self.name} [{self.units}]"


def table(
    tree: xr.DataTree,
    group: str = "/",
    variables: Sequence[str] = (),
    selection: Mapping[str, Sequence[str]] | None = None,
) -> list[Column]:
    """Long table of a group: one row for each requested cell, one column for each dimension or variable.

    Examples
    --------
    >>> columns = table(tree, "/", ["deformation_error"], {"beam": ["200x40"], "mesh_size": ["0.005"]})
    >>> [column.title for column in columns][:4]
    ['beam', 'mesh_type', 'mesh_size', 'material']
    >>> len(columns[0].values)
    48
    >>> table(tree, "unknown")
    Traceback (most recent call last):
    springtune.studies.output.export.RequestError: group 'unknown': there is none; known: /, benchmark, block, ...
    """
    data = _group(tree, group)
    if not data.data_vars:
        raise RequestError(f"group '{group}': it has no variables; give one of {', '.join(tree.children)}")
    data = _selected(data, selection or {})
    for name in variables:
        if name not in data.variables or name in data.dims:
            known = nearest(name, sorted(str(known) for known in data.variables if known not in data.dims))
            raise RequestError(f"variable '{name}': group '{group}' has none of that name; {known}")
    status = data.get("status")
    if variables:
        chosen = [data[name] for name in variables]
        dimensions = _ordered(data, {str(name) for array in chosen for name in array.dims})
    else:
        widest = status if status is not None else max(data.data_vars.values(), key=lambda array: array.ndim)
        dimensions = _ordered(data, set(map(str, widest.dims)))
        chosen = [array for array in data.data_vars.values() if set(array.dims) <= set(dimensions)]
    named = {array.name for array in chosen} | set(data.dims)
    besides = [array for name, array in data.coords.items() if name not in named and set(array.dims) <= set(dimensions)]
    labels = [
        data[name] if name in data.coords else xr.DataArray(np.arange(data.sizes[name]), dims=name, name=name)
        for name in dimensions
    ]
    sizes = {name: data.sizes[name] for name in dimensions}
    asked = _asked(status, chosen, sizes)
    return [_column(array, _spread(array, sizes)[asked]) for array in (*labels, *besides, *chosen)]


def _spread(array: xr.DataArray, sizes: Mapping[str, int]) -> np.ndarray:
    """Values over all dimensions of a table."""
    spread = array.variable.compute().set_dims(sizes)  # type: ignore[no-untyped-call]
    return np.asarray(spread.transpose(*sizes).values)


def _group(tree: xr.DataTree, name: str) -> xr.Dataset:
    names = {"/": tree} | {node.path[1:]: node for node in tree.subtree if node.path != "/"}
    wanted = name.strip("/") or "/"
    if wanted not in names:
        raise RequestError(f"group '{name}': there is none; {nearest(wanted, ['/', *sorted(set(names) - {'/'})])}")
    return names[wanted].to_dataset()


def _selected(data: xr.Dataset, selection: Mapping[str, Sequence[str]]) -> xr.Dataset:
    for name, labels in selection.items():
        if name not in data.dims:
            raise RequestError(f"--select {name}: no dimension of that name; {nearest(name, map(str, data.dims))}")
        coordinate = data[name]
        data = data.isel({name: [_place(name, coordinate, label) for label in labels]})
    return data


def _place(name: str, coordinate: xr.DataArray, label: str) -> int:
    """Index of a label."""
    known = coordinate.values
    if known.dtype.kind in "OU":
        found = np.flatnonzero(known.astype(str) == label)
        listed = nearest(label, map(str, known))
    else:
        found = np.flatnonzero(np.isclose(known, _number(name, coordinate, label), rtol=1e-9, atol=0.0))
        unit = coordinate.attrs.get("units", "1")
        listed = f"known: {', '.join(f'{value:g}' for value in known)}" + ("" if unit == "1" else f" {unit}")
    if not len(found):
        raise RequestError(f"--select {name}={label}: no such label; {listed}")
    return int(found[0])


def _number(name: str, coordinate: xr.DataArray, label: str) -> float:
    """Parse a numeric label that may have a unit."""
    try:
        return float(label)
    except ValueError:
        pass
    kinds = [kind.name for kind in QUANTITY_KINDS.values() if kind.unit == coordinate.attrs.get("units")]
    try:
        return parse(label, kinds[0]) if kinds else float("nan")
    except UnitError as error:
        raise RequestError(f"--select {name}: {error}") from None


def _ordered(data: xr.Dataset, names: set[str]) -> list[str]:
    """Dimensions in the order of the array with most of them."""
    arrays = sorted(data.data_vars.values(), key=lambda array: -len(names & set(array.dims)))
    found = dict.fromkeys(str(name) for array in arrays for name in array.dims if name in names)
    return list(found)


def _asked(status: xr.DataArray | None, chosen: Sequence[xr.DataArray], sizes: Mapping[str, int]) -> np.ndarray:
    """Requested cells over all dimensions of a table."""
    if not sizes:
        return np.ones((), dtype=bool)
    if status is not None and set(status.dims) == set(sizes):
        return _spread(status, sizes) != 0
    # A number of all cells of a mesh, say, is no reason for a row: those with most dimensions are.
    most = max((array.ndim for array in chosen), default=0)
    asked = np.zeros(list(sizes.values()), dtype=bool)
    for array in (one for one in chosen if one.ndim == most):
        values = _spread(array, sizes)
        asked |= values.astype(str) != "" if values.dtype.kind in "OU" else ~np.isnan(values)
    if status is not None and set(status.dims) <= set(sizes):
        asked &= _spread(status, sizes) != 0
    return asked


def _column(array: xr.DataArray, values: np.ndarray) -> Column:
    if is_flagged(array):
        words = flag_words(array)
        values = np.array([words.get(value, "") for value in values.tolist()], dtype=object)
    attributes = array.attrs
    return Column(str(array.name), str(attributes.get("units", "1")), str(attributes.get("long_name", "")), values)


# -- files -------------------------------------------------------------------------------------------------------------


def write_csv(path: str | os.PathLike[str], columns: Sequence[Column]) -> None:
    """Write a long table as CSV, with units in the head and all digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([column.title for column in columns])
    # NaN is the one number that is not itself.
    lists = [["" if value != value else value for value in column.values.tolist()] for column in columns]
    writer.writerows(zip(*lists))
    write_text(Path(path), text.getvalue())


def write_parquet(path: str | os.PathLike[str], columns: Sequence[Column], attributes: Mapping[Any, object]) -> None:
    """Write a long table as Parquet with units, long names and attributes."""
    try:
        import pyarrow as pa
        import pyarrow.parquet
    except ImportError:
        raise ValueError(f"{path}: Parquet needs pyarrow; {how_to_install('export')}") from None
    arrays = [pa.array(column.values.tolist(), from_pandas=True) for column in columns]
    fields = [
        pa.field(column.name, array.type, metadata={"units": column.units, "long_name": column.long_name})
        for column, array in zip(columns, arrays)
    ]
    schema = pa.schema(fields, metadata={str(name): str(value) for name, value in attributes.items()})
    sink = pa.BufferOutputStream()
    pyarrow.parquet.write_table(pa.Table.from_arrays(arrays, schema=schema), sink)
    write_bytes(Path(path), sink.getvalue().to_pybytes())


def write_zarr(path: str | os.PathLike[str], tree: xr.DataTree) -> None:
    """Write a Zarr store atomically."""
    if find_spec("zarr") is None:
        raise ValueError(f"{path}: Zarr needs zarr; {how_to_install('export')}")
    path = Path(path)
    unfinished, before = (path.with_name(f"{path.name}.{mark}{UNFINISHED}") for mark in (writer(), "before"))
    tree = tree.load()
    for node in tree.subtree:
        for variable in node.variables.values():
            variable.encoding = {}  # HDF5's
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what of Zarr may still change
            tree.to_zarr(unfinished, zarr_format=2, consolidated=True, mode="w")
        if path.exists():  # no folder takes the place of another one at once
            os.replace(path, before)
        os.replace(unfinished, path)
    except BaseException:
        if before.exists() and not path.exists():
            os.replace(before, path)
        raise
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
        shutil.rmtree(before, ignore_errors=True)


EXPORTS = (".csv", ".parquet", ".zarr", ".nc", ".vtu", ".pvd")


def export(
    tree: xr.DataTree,
    path: str | os.PathLike[str],
    group: str = "/",
    variables: Sequence[str] = (),
    selection: Mapping[str, Sequence[str]] | None = None,
    force: bool = False,
) -> str:
    """Write a dataset in the format of the file's ending, one of `EXPORTS`.

    ``.nc`` holds one network of the group `fields`, ``.vtu`` one scene for ParaView and ``.pvd`` all selected scenes;
    networks of shapes are in the group `shape_fields`.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in EXPORTS:
        raise RequestError(f"{path}: '{ending}' is no format to export to; give a file ending in {', '.join(EXPORTS)}")
    check_folder(path)
    if path.exists() and not force:
        raise ValueError(f"{path}: is there already; give another name, or --force to replace it")
    if ending == ".nc":
        return _mesh(tree, path, group, variables, selection or {})
    if ending in (".vtu", ".pvd"):
        if group.strip("/") not in ("", "fields", NETWORKS_OF_SHAPES) or variables:
            raise RequestError(
                f"{path}: ParaView gets the group 'fields', or --group {NETWORKS_OF_SHAPES}; leave --group and "
                "--variables out"
            )
        of_shapes = "fields" not in tree.children and NETWORKS_OF_SHAPES in tree.children
        if group.strip("/") == NETWORKS_OF_SHAPES or (of_shapes and not group.strip("/")):
            return _paraview(_Shapes(tree, selection or {}), path)
        return _paraview(_Scenes(tree, selection or {}), path)
    if ending == ".zarr":
        if group.strip("/") or variables or selection:
            raise RequestError(
                f"{path}: Zarr takes the whole dataset; leave --group, --variables and --select out, or export a table"
            )
        if path.exists() and not any((path / name).exists() for name in (".zgroup", "zarr.json")):
            raise ValueError(f"{path}: is there and no Zarr store; give another name")
        write_zarr(path, tree)
        return f"{path}: the whole dataset, {len(list(tree.subtree))} groups"
    columns = table(tree, group, variables, selection)
    if ending == ".csv":
        write_csv(path, columns)
    else:
        write_parquet(path, columns, tree.attrs | {"springtune_group": "/" + group.strip("/")})
    return f"{path}: {len(columns[0].values) if columns else 0} rows, {len(columns)} columns of group '{group}'"


def _mesh(
    tree: xr.DataTree, path: Path, group: str, variables: Sequence[str], selection: Mapping[str, Sequence[str]]
) -> str:
    """Write one network of the group of fields."""
    if group.strip("/") != "fields" or variables:
        raise ValueError(
            f"{path}: NetCDF takes one network with its fields; give --group fields and such as "
            "--select beam=200x40,mesh_type=free, or export a table"
        )
    fields, labels = _group(tree, group), {}
    for name, given in selection.items():
        chosen = _selected(fields, {name: given})[name].values.tolist()
        if len(chosen) > 1:
            raise RequestError(f"--select {name}: {len(chosen)} labels; give one, or export a table")
        labels[name] = chosen[0]
    found = reading.field(tree, **labels)
    with replacing(path) as unfinished:
        found.to_netcdf(unfinished, engine="h5netcdf")  # see _make_texts of dataset.py
    sizes = found.sizes
    return f"{path}: {sizes['particle']} particles, {sizes['spring']} springs, {sizes['cell']} cells, as UGRID has them"


def write_scenes(tree: xr.DataTree, path: Path) -> list[Path]:
    """Write scenes of the group of fields as a ParaView collection."""
    from springtune.handover.paraview import pieces_of

    _write_series(_Scenes(tree, {}), path)
    return pieces_of(path)


def _paraview(networks: _Scenes | _Shapes, path: Path) -> str:
    """Write one network, or a collection of all."""
    from springtune.handover.paraview import MOST_PIECES

    found, one = networks.labels, networks.one
    if not found:
        raise ValueError(f"the group '{networks.group}' has no solved {one} of such labels; give others to --select")
    if path.suffix.lower() == ".vtu":
        if len(found) > 1:
            several = ", ".join(name for name in found[0] if len({labels[name] for labels in found}) > 1)
            raise ValueError(
                f"{path}: {len(found)} {one}s, and a .vtu file has one; --select one {several}, or give a name ending "
                "in .pvd for all of them"
            )
        networks.write(path, found[0])
        return f"{path}: {networks.named(found[0])}"
    if len(found) > MOST_PIECES:
        raise ValueError(f"{path}: {len(found)} {one}s, and at most {MOST_PIECES} are written; --select some")
    _write_series(networks, path)
    return f"{path}: {len(found)} {one}s, in the folder {path.with_suffix('')}"


def _write_series(networks: _Scenes | _Shapes, path: Path) -> None:
    from springtune.handover.paraview import series

    with series(path) as add:
        for number, labels in enumerate(networks.labels):
            name = networks.named(labels).replace(", ", "_").replace(" ", "")
            add(float(number), partial(networks.write, labels=labels), name)


NETWORKS_OF_SHAPES = "shape_fields"

MESH = ("beam", "mesh_type", "mesh_size")
"""Dimensions that identify a mesh."""

NUMBERS = {
    "displacement": "displacement_of_the_load",
    "reference_displacement": "reference_displacement_of_the_load",
    "deformation_error": "deformation_error",
    "force": "force_of_the_load",
}
"""Scene variables written beside fields, and their names there."""


class _Scenes:
    """Networks of the group of fields."""

    group, one = "/fields", "scene"

    def __init__(self, tree: xr.DataTree, selection: Mapping[str, Sequence[str]]) -> None:
        if "fields" not in tree.children:
            raise ValueError(reading.without_fields(tree))
        self.tree, root = tree, tree.to_dataset()
        self.labels = _solved(_selected(_group(tree, "fields"), selection), (*MESH, "material", "load", "definition"))
        # Of what a study sweeps, the values whose fields it keeps.
        swept = shown_swept(tree["fields"].to_dataset(), root)
        names = [name for name in NUMBERS if name in root and name != "force"]
        self.numbers = at(root[names], swept)[names].assign(swept).load()
        self.mesh: dict[str, str | float] = {}  # the one of before: scenes of one follow each other

    def named(self, labels: Mapping[str, str | float]) -> str:
        """Labels of a scene in words."""
        return cell_text(labels, {name: str(self.tree["/fields"][name].attrs.get("units", "1")) for name in labels})

    def write(self, path: Path, labels: Mapping[str, str | float]) -> None:
        """Write a scene."""
        mesh = {name: label for name, label in labels.items() if name in MESH}
        if mesh != self.mesh:
            self.mesh, self.network = mesh, reading.field(self.tree, **mesh)
        found = self.network
        found = found.sel({name: label for name, label in labels.items() if name not in MESH and name in found.dims})
        numbers = {}
        for name, array in self.numbers.items():
            here = array.sel({dim: label for dim, label in labels.items() if dim in array.dims})
            if here.ndim == 0 and np.isfinite(here):
                numbers[NUMBERS.get(str(name), str(name))] = float(here)
        units = {"error": "m", "stiffness": "N/m", "force": "N", "mesh_size": "m"}
        _write_network(self.tree, path, found, numbers, labels, units)


def _solved(fields: xr.Dataset, order: Sequence[str]) -> list[dict[str, str | float]]:
    """Labels of networks with displacements, in dataset order."""
    solved = fields.displacement_x.isel(particle=0, drop=True).notnull()
    solved = solved.transpose(*(name for name in order if name in solved.dims), ...)
    return [
        {str(name): solved[name].values[number].item() for name, number in zip(solved.dims, place)}
        for place in np.argwhere(solved.values)
    ]


def _write_network(
    tree: xr.DataTree,
    path: Path,
    found: xr.Dataset,
    numbers: Mapping[str, float],
    labels: Mapping[str, str | float],
    units: Mapping[str, str],
) -> None:
    """Write a network: particles with displacements, springs as lines, cells."""
    from springtune.handover.paraview import write_vtu

    def vectors(names: str) -> np.ndarray:
        return np.stack([found[names.format(axis)].values for axis in "xy"], axis=1)

    corners = found[reading.CELL_NODES].transpose("cell", ...).values
    cells = {2: found[reading.SPRING_NODES].transpose("spring", ...).values}
    for count in (3, 4):
        cells[count] = corners[(corners >= 0).sum(axis=1) == count][:, :count]
    of_particles = {"displacement": vectors("displacement_{}")}
    if "particle_reference_x" in found:
        expected = vectors("particle_reference_{}")
        if np.isfinite(expected).all():
            of_particles |= {"reference_displacement": expected, "error": of_particles["displacement"] - expected}
    named = {"stiffness": "stiffness", "force": "spring_force"}
    of_springs = {name: {2: found[stored].values} for name, stored in named.items() if stored in found}
    said = {name: tree.attrs.get(name, "") for name in ("title", "study")} | dict(labels)
    comment = json.dumps(said | {"units": {"points": "m", "displacement": "m"} | dict(units)}, indent=1)
    write_vtu(path, vectors("{}"), cells, of_particles, of_springs, numbers, comment)


class _Shapes:
    """Networks of shapes, selected by shape, load and definition."""

    group, one = "/shape_fields", "network"

    def __init__(self, tree: xr.DataTree, selection: Mapping[str, Sequence[str]]) -> None:
        self.tree, self.fields = tree, _group(tree, self.group).load()
        stored = {"shape": "shape_name", "load": "load_name", "definition": "definition"}
        known = {name: self.fields[variable].values.astype(str).tolist() for name, variable in stored.items()}
        for name, wanted in selection.items():
            if name not in known:
                raise RequestError(f"--select {name}: networks of shapes are told apart by {', '.join(known)}")
            for label in wanted:
                if label not in known[name]:
                    there = nearest(label, dict.fromkeys(known[name]))
                    raise RequestError(f"--select {name}={label}: no such label; {there}")
        self.cases = list(zip(known["shape"], known["load"]))
        found = [
            dict(zip(known, (*self.cases[self.fields.case.values.tolist().index(one["case"])], one["definition"])))
            for one in _solved(self.fields, ("case", "definition"))
        ]
        self.labels = [one for one in found if all(one[name] in wanted for name, wanted in selection.items())]

    def named(self, labels: Mapping[str, str | float]) -> str:
        """Labels of a network in words."""
        return ", ".join(map(str, labels.values()))

    def write(self, path: Path, labels: Mapping[str, str | float]) -> None:
        """Write a network."""
        one = self.fields.isel(case=self.cases.index((str(labels["shape"]), str(labels["load"]))))
        one = one.sel(definition=labels["definition"])
        about = {name: str(one[f"{name}_name"].values) for name in ("material", "kinematics", "mesh_type")}
        size = float(one.case_mesh_size)
        numbers = {"mesh_size": size}
        here = self.tree["shapes"].to_dataset().sel({**labels, **about}).sel(mesh_size=size, method="nearest")
        for quantity in here["quantity"].values.tolist():
            for name in ("value", "reference_value", "error"):
                number = float(here[name].sel(quantity=quantity)) if name in here else np.nan
                if np.isfinite(number):
                    numbers[f"{name}_of_{quantity}"] = number
        units = {"force": "N", "mesh_size": "m", "value": "SI", "error": "1"}
        _write_network(self.tree, path, reading.network(one), numbers, {**labels, **about}, units)


def selected(text: Sequence[str]) -> dict[str, list[str]]:
    """Parse labels such as ``beam=200x40,load=traction`` by dimension.

    Examples
    --------
    >>> selected(["beam=200x40,mesh_size=5 mm", "beam=100x20"])
    {'beam': ['200x40', '100x20'], 'mesh_size': ['5 mm']}
    """
    found: dict[str, list[str]] = {}
    for pair in (pair.strip() for one in text for pair in one.split(",")):
        name, equals, label = pair.partition("=")
        if not (name and equals and label):
            raise RequestError(f"--select: '{pair}' is no dimension=label; give such as beam=200x40,mesh_size=5 mm")
        found.setdefault(name.strip(), []).append(label.strip())
    return found
