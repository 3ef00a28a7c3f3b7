"""Dataset of a study: labelled arrays with units and the reasons of missing values; parts of it that a figure shows."""

import math
import os
import shutil
from collections.abc import Collection, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import numpy as np
import pandas as pd
import xarray as xr
from xarray.backends import H5NetCDFStore
from xarray.conventions import cf_encoder, encode_dataset_coordinates

from springtune.problem.compare import sign_sentence
from springtune.problem.quantities import SWEPT, Status
from springtune.safe_io import replacing

from ..config.model import EMPTY_VALUES, FINITE_STRAIN_REFERENCE, STRAINED_REFERENCE, TESTED_REFERENCE

STATUS = tuple(map(str, Status))  # meanings of `status` flags in order of value

Label = str | float  # label along a dimension: a text or a number in SI units

Axes = Mapping[str, Sequence[Label]]  # labels by dimension

DIMENSIONS: dict[str, str | tuple[str, str]] = {
    "beam": "beam, length x height in mm",
    "mesh_type": "mesh type",
    "mesh_size": ("asked length of an edge", "m"),
    "material": "material",
    "load": "load",
    "definition": "definition of the spring stiffness",
    "kinematics": "kinematics of the network",
    **SWEPT,
}
"""Shared dimensions: long name, and unit if any."""


@dataclass(frozen=True)
class Group:
    """A group of a dataset.

    - `variables`: (dimensions, units, long name, fill value) by name;
    - `dimensions`: long name and unit of dimensions of this group alone;
    - `flags`: meanings by a variable's name, or its last word, as ``status``;
    - `further`: more attributes by variable.
    """

    name: str
    variables: dict[str, tuple[tuple[str, ...], str, str, float | str | np.number[Any]]]
    dimensions: dict[str, str | tuple[str, str]] = field(default_factory=dict)
    flags: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    further: dict[str, dict[str, object]] = field(default_factory=dict)

    def empty(self, axes: Axes, names: Collection[str] | None = None) -> xr.Dataset:
        """Create the dataset with empty cells."""
        chosen = {name: row for name, row in self.variables.items() if names is None or name in names}
        data, coordinates = {}, {}
        for name, (dimensions, units, long_name, nothing) in chosen.items():
            shape = [len(axes[dimension]) for dimension in dimensions]
            meanings = self.flags.get(name) or {"status": STATUS, **self.flags}.get(name.rpartition("_")[2])
            dtype = "int8" if meanings else object if isinstance(nothing, str) else None
            values = np.full(shape, nothing, dtype=dtype)
            attributes: dict[str, object] = {"long_name": long_name, "units": units}
            if meanings:
                attributes["flag_values"] = np.arange(len(meanings), dtype="int8")
                attributes["flag_meanings"] = " ".join(meanings)
            # As it is: looking for dates among millions of texts costs more than the texts.
            data[name] = xr.Variable(dimensions, values, attributes | self.further.get(name, {}), fastpath=True)
        for dimension, words in (DIMENSIONS | self.dimensions).items():
            if any(dimension in dimensions for dimensions, *_ in chosen.values()):
                long_name, units = words if isinstance(words, tuple) else (words, "1")
                values = np.array(axes[dimension])
                values = values.astype(object) if values.dtype.kind == "U" else values
                coordinates[dimension] = (dimension, values, {"long_name": long_name, "units": units})
        return xr.Dataset(data, coordinates)

    def of_rows(
        self, axes: Axes, rows: Iterable[Mapping[str, object]] | pd.DataFrame, names: Collection[str] | None = None
    ) -> xr.Dataset:
        """Create the dataset of rows of labels and values; each value goes to the labels that its variable has."""
        frame = rows if isinstance(rows, pd.DataFrame) else pd.DataFrame([*rows])
        needed = {one for dimensions, *_ in self.variables.values() for one in dimensions} - axes.keys()
        own = {one: frame[one].dropna().unique().tolist() if one in frame else [] for one in needed}
        data = self.empty({**axes, **own}, names)
        labels = frame.columns.intersection([*data.dims])
        found = {name: data.get_index(name).get_indexer(frame[name]) for name in labels}
        for name in frame.columns.intersection([*data.data_vars]):
            array, dimensions = data[name].values, [one for one in data[name].dims if one in found]
            there = frame[[name, *dimensions]].notna().all(axis=1).to_numpy()
            places, values = [found[one][there] for one in dimensions], frame[name].to_numpy()[there]
            if any((place < 0).any() for place in places):
                raise KeyError(f"{name}: rows have labels that the axes have not")
            if dimensions and len(dimensions) == array.ndim:
                array[tuple(places)] = values
                continue
            for *place, value in zip(*places, values):
                array[(*place, *map(slice, np.shape(value)))] = value
        return data


MESH_DIMENSIONS = ("beam", "mesh_type", "mesh_size")

SPRING_NODES, CELL_NODES = "spring_nodes", "cell_nodes"

NO_NODE = EMPTY_VALUES["no node"]  # fill value of UGRID connectivities

CHUNK_BYTES = 2**18  # most bytes of a compressed chunk, which is read for each of its cells

UNCOMPRESSED_BYTES = 2**13  # most bytes of an uncompressed array; compressing less costs more than it saves


MOSTLY_EMPTY_SHARE = 0.75  # share of empty cells above which a large array of texts stores none of them

TEXTS_IN_CHUNK = 128  # cells in a chunk of such an array


def write(path: str | os.PathLike[str], groups: Mapping[str, xr.Dataset], attributes: Mapping[str, str]) -> None:
    """Write a dataset atomically."""
    tree, content = xr.DataTree.from_dict(groups), BytesIO()  # whole, so that HDF5 meets no full disk
    tree.attrs = dict(attributes)
    with h5netcdf.File(content, "w") as file:
        for node in tree.subtree:
            above = node.parent.sizes if node.parent else {}  # what groups share with the root is written there
            _write_group(file.create_group(node.path) if node.parent else file, node.to_dataset(False), above)
    path = Path(path)
    try:
        with replacing(path, synced=True) as unfinished:
            unfinished.write_bytes(content.getbuffer())
    except OSError as error:
        free = shutil.disk_usage(path.parent).free / 1e6 if path.parent.is_dir() else 0.0
        why = f"cannot be written ({error.strerror}; {free:.0f} MB are free there)"
        remedy = "make room, or see to permissions and limits, and run the study again: what is solved is stored"
        raise OSError(f"{path}: {why}; {remedy}, and only this file is made anew") from None


def _write_group(group: h5netcdf.Group, data: xr.Dataset, above: Mapping[Hashable, int]) -> None:
    """Write the variables of a group, encoded by the conventions; of large sparse texts only the chunks with a text."""
    variables, attributes = encode_dataset_coordinates(data)
    for name, array in variables.items():
        if str(array.attrs.get("cf_role", "")).endswith("connectivity"):
            array.encoding = {"_FillValue": NO_NODE}
        elif name in data.coords:
            array.encoding = {"_FillValue": None}  # CF: coordinates have no holes
    variables, attributes = cf_encoder(variables, attributes)
    group.attrs.update(attributes)
    group.dimensions = {dim: size for dim, size in data.sizes.items() if above.get(dim) != size}
    # Labels first: one that comes after variables of its dimension is attached anew to each of them.
    for name, array in sorted(variables.items(), key=lambda pair: pair[0] not in data.dims):
        fill, values = array.attrs.pop("_FillValue", None), array.values
        texts = values.dtype.kind in "OU"
        sparse = texts and values.nbytes > CHUNK_BYTES and np.mean(values == "") > MOSTLY_EMPTY_SHARE
        options: dict[str, Any] = {}
        if sparse:
            options = {"chunks": _chunk_shape(array.shape, TEXTS_IN_CHUNK)}
        elif not texts and values.nbytes > UNCOMPRESSED_BYTES:
            chunks = _chunk_shape(array.shape, CHUNK_BYTES // values.itemsize)
            options = {"chunks": chunks, "compression": "gzip", "shuffle": True}
        dtype = h5py.string_dtype() if texts else values.dtype
        stored = group.create_variable(name, array.dims, dtype, fillvalue=fill, **options)
        stored.attrs.update(array.attrs)
        if not sparse:
            stored[...] = values
            continue
        for start in np.unique(np.argwhere(values != "") // options["chunks"], axis=0).tolist():
            cells = tuple(slice(n * size, (n + 1) * size) for n, size in zip(start, options["chunks"]))
            stored[cells] = values[cells]


def _chunk_shape(shape: Sequence[int], cells: int) -> tuple[int, ...]:
    """Return the shape of chunks: whole last dimensions, then as many of the others as fit."""
    cells_of_one = np.cumprod((1, *shape[:0:-1]))[::-1]  # along each dimension
    return tuple(np.clip(cells // cells_of_one, 1, shape).tolist())


LARGE_ARRAY_BYTES = 2**20  # larger arrays, in bytes, are read on demand


def tree(file: h5netcdf.File) -> xr.DataTree:
    """Dataset of an open file: small arrays in memory, large ones read on demand."""
    groups, sizes = {}, dict[str, int]()
    for group in (file, *file.groups.values()):
        store: Any = H5NetCDFStore(group)
        sizes |= {name: dimension.size for name, dimension in group.dimensions.items()}
        variables = {}
        for name, stored in group.variables.items():
            texts = stored.dtype == object
            if stored.dtype.itemsize * math.prod(sizes[dim] for dim in stored.dimensions) > LARGE_ARRAY_BYTES:
                variables[name] = store.open_store_variable(name, stored)
                if texts:
                    del variables[name].encoding["dtype"]  # by which xarray would read texts as wide as the longest
            else:  # h5netcdf looks up all dimensions for each slice of numbers; a whole array takes no look
                values = stored[...] if texts else np.asarray(stored)
                variables[name] = xr.Variable(stored.dimensions, values, _attributes(stored))
        groups[group.name] = xr.decode_cf(xr.Dataset(variables, attrs=_attributes(group)))
        for one in (one for one in groups[group.name].variables.values() if one.nbytes <= LARGE_ARRAY_BYTES):
            one.load()
    return xr.DataTree.from_dict(groups)


def _attributes(stored: h5netcdf.Group | h5netcdf.Variable) -> dict[str, Any]:
    """Attributes, with texts of fixed length as texts."""
    return {name: value.decode() if isinstance(value, bytes) else value for name, value in stored.attrs.items()}


# -- flags -------------------------------------------------------------------------------------------------------------


def is_flagged(array: xr.DataArray) -> bool:
    """Return whether a variable holds flags."""
    return "flag_meanings" in array.attrs and array.dtype.kind in "iuf"


def flag_words(array: xr.DataArray) -> dict[int, str]:
    """Meanings of flags by value."""
    meanings = str(array.attrs["flag_meanings"]).split()
    return dict(zip(map(int, np.ravel(array.attrs.get("flag_values", range(len(meanings))))), meanings))


def as_words(array: xr.DataArray) -> np.ndarray:
    """Convert flags to words; empty for unknown ones."""
    words = pd.Series(array.values.ravel()).map(flag_words(array)).astype(object).fillna("")
    return words.to_numpy().reshape(array.shape)


# -- the group and the labels that a figure shows ----------------------------------------------------------------------


def group(data: xr.DataTree | xr.Dataset, name: str, needs_tree: bool = False) -> xr.Dataset:
    """Return the dataset of a group; `data` itself if it is no tree, which `needs_tree` refuses."""
    if isinstance(data, xr.DataTree):
        if not data.variables if name == "/" else name not in data.children:
            lack = "scenes of beams" if name == "/" else f"group '/{name}'"
            raise ValueError(f"the dataset has no {lack}; it has {_quoted(f'/{one}' for one in data.children)}")
        return data[name].to_dataset()
    if needs_tree:
        raise ValueError(f"not only the group '/{name}' is plotted: give the whole dataset, an xarray.DataTree")
    return data


def choose(present: xr.DataArray, **selection: Label | None) -> dict[str, Label | None]:
    """Labels of a figure: the given ones, and the only label of each other dimension."""
    chosen = {name: label for name, label in selection.items() if name in present.dims}
    for name, label in sorted(chosen.items(), key=lambda pair: pair[1] is None):
        found = labels_of(present, name)
        if label is not None and label not in found:
            raise ValueError(f"nothing has {name} {label!r}; there is {_quoted(found)}")
        if not found:
            raise ValueError("nothing to plot: the dataset has no cell of the selection")
        if label is None and len(found) > 1:
            raise ValueError(f"choose one {name}: {_quoted(found)}")
        chosen[name] = found[0] if label is None else label
        present = present.sel({name: [chosen[name]]})  # later dimensions are seen under this label
    return chosen


SHOWN_PREFIX = "shown_"  # prefix of variables that hold the swept values of stored fields


def sign_of_errors(data: xr.Dataset, reference: str = "reference_displacement") -> str:
    """Sentence on which sign of errors means too soft, by loads or else quantities; empty without any reference."""
    signs: xr.DataArray = xr.apply_ufunc(np.sign, data.get(reference, xr.DataArray()))
    if "quantity_kind" in data:
        signs = signs.where(data.quantity_kind == "displacement")
    known = signs.values[np.isfinite(signs.values) & (signs.values != 0)]
    if not known.size or (known == known[0]).all():
        return sign_sentence({"": known[0]}) if known.size else ""
    for name, where in (("load", "under"), ("quantity", "of")):
        if name in signs.dims:
            others = [one for one in signs.dims if one != name]
            low, high = signs.min(others), signs.max(others)
            if not ((low < 0) & (high > 0)).any():
                return sign_sentence(dict(zip(map(str, signs[name].values), (low + high).values)), where)
    return "too soft: errors with the sign of their reference"


def labels_of(present: xr.DataArray, name: str) -> list[Label]:
    """Labels of a dimension that have a present cell, in dataset order."""
    there = present.any([dimension for dimension in present.dims if dimension != name])
    return there[name].values[there.values].tolist()


def cells(present: xr.DataArray, names: Collection[str]) -> list[dict[str, Label]]:
    """Labels of present cells over some dimensions, the last name fastest."""
    there = present.any([dimension for dimension in present.dims if dimension not in names])
    return records(xr.Dataset(), there.transpose(*names), ())


def columns(data: xr.Dataset, present: xr.DataArray, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Labels and variables of present cells, last dimension fastest; selecting each takes a thousand times as long."""
    places = dict(zip(map(str, present.dims), np.nonzero(present.values)))
    labels = {name: present[name].values[numbers] for name, numbers in places.items()}
    return labels | {name: data[name].values[tuple(places[str(one)] for one in data[name].dims)] for name in names}


def records(data: xr.Dataset, present: xr.DataArray, names: Iterable[str]) -> list[dict[str, Any]]:
    """Rows of `columns`."""
    found = {name: values.tolist() for name, values in columns(data, present, names).items()}
    return [dict(zip(found, row)) for row in zip(*found.values())]


def requested_cells(data: xr.Dataset, error: str = "deformation_error") -> pd.DataFrame:
    """Labels and variables of requested cells; `valid_error` is NaN where the reference does not apply."""
    dims = data[error].dims
    present = (data.status != Status.NOT_REQUESTED).broadcast_like(data[error]).transpose(*dims)
    own = [str(name) for name, one in data.variables.items() if one.dims and {*one.dims} <= {*dims}]
    cells = pd.DataFrame(columns(data, present, own))
    valid = (cells.status == Status.SOLVED) & (cells.get("reference_applies", 1) == 1)
    return cells.assign(valid_error=cells[error].where(valid))


Scaled = Mapping[str, tuple[str, float]]  # variable and factor by the column of a table


def table_rows(data: xr.Dataset, present: xr.DataArray, names: Collection[str], scaled: Scaled) -> list[dict[str, Any]]:
    """Rows of the present cells: labels and variables by name, and variables by column times a factor."""
    variables = [name for name in (*names, *(name for name, _ in scaled.values())) if name in data.variables]
    return [
        {name: one[name] for name in names} | {head: factor * one[name] for head, (name, factor) in scaled.items()}
        for one in records(data, present, variables)
    ]


def _quoted(labels: Iterable[object]) -> str:
    return ", ".join(repr(label) for label in labels) or "nothing"


def network(data: xr.DataTree, labels: dict[str, Label]) -> xr.Dataset:
    """Network of one mesh with its fields, see `springtune.field`."""
    fields = group(data, "fields")
    # Of what is swept, fields are of one value each; the values of the scenes are no coordinates of theirs.
    swept = [name for name in SWEPT if f"{SHOWN_PREFIX}{name}" in fields]
    asked = {name: labels.pop(name) for name in swept if name in labels}
    fields = fields.drop_vars(swept, errors="ignore")
    for name in (name for name in labels if name not in fields.indexes):
        known = ", ".join(map(str, fields.indexes))
        raise ValueError(f"there is no dimension '{name}' to choose of; known: {known}")
    others = {name: fields[name].values for name in labels if name not in MESH_DIMENSIONS}
    present = fields.x.notnull().any("particle").expand_dims(others)
    found = fields.sel(choose(present, **dict.fromkeys(MESH_DIMENSIONS) | labels)).load()
    for name in swept:
        kept = found[f"{SHOWN_PREFIX}{name}"]
        known = np.unique(kept.values[np.isfinite(kept.values)]).tolist()
        if name in asked and known != [asked[name]]:
            listed = ", ".join(map(repr, known)) or "none"
            raise ValueError(f"fields are not kept of {name} {asked[name]!r}; they are of {listed}")
        found = found.assign_coords({name: kept}).drop_vars(f"{SHOWN_PREFIX}{name}")
    # One network of a group may lack particles, springs, cells and corners of cells that another has.
    needed = {"particle": "x", "spring": SPRING_NODES, "cell": CELL_NODES, "cell_corner": CELL_NODES}
    for dimension, name in needed.items():
        found = found.dropna(dimension, how="all", subset=[name])
    for name in (SPRING_NODES, CELL_NODES):
        connectivity = found[name].fillna(NO_NODE).astype("int32")
        connectivity.encoding = {"_FillValue": NO_NODE, "dtype": "int32"}
        found[name] = connectivity.assign_attrs(found[name].attrs)
    return found.assign_attrs(Conventions="CF-1.11 UGRID-1.0")


# -- references at finite strain: Yeoh's law of a material with a uniaxial test, else neo-Hooke's in its plane ---------


def in_own_plane(data: xr.Dataset) -> xr.Dataset:
    """Group without plane-strain numbers of materials in plane stress."""
    if "material_plane" not in data:
        return data
    own = (data.reference != STRAINED_REFERENCE) | (data.material_plane == "strain")
    numbers = {name: one for name, one in data.items() if one.dtype.kind == "f" and "reference" in one.dims}
    return data.assign({name: one.where(own) for name, one in numbers.items()}).drop_vars("material_plane")


def own_laws(data: xr.Dataset) -> list[str]:
    """References of materials' own laws in a group of references, by priority; in plane strain only with planes."""
    own = (TESTED_REFERENCE, FINITE_STRAIN_REFERENCE, *((STRAINED_REFERENCE,) if "material_plane" in data else ()))
    return [law for law in own if law in data.reference.values]


def against_own_laws(root: xr.Dataset, finite: xr.Dataset | None) -> xr.Dataset:
    """Return the root with errors of nonlinear networks against finite strain, by each material's law, if computed."""
    laws = [] if finite is None else own_laws(finite)
    if finite is None or not laws:
        return root
    own = in_own_plane(finite).sel(reference=laws)
    known = own.reference_displacement.notnull() | (own.reference == laws[-1])  # the last says why there is none
    own = own.isel(reference=known.argmax("reference")).drop_vars("reference")
    linear, names = root.kinematics == "linear", ("deformation_error", "reference_displacement", "reference_message")
    chosen = {name: root[name].where(linear, own[name]) for name in names if name in own and name in root}
    chosen["deformation_error"] = chosen["deformation_error"].transpose(*root.deformation_error.dims)
    if "reference_displacement" in chosen and "reference_applies" in root:
        chosen["reference_applies"] = root.reference_applies.where(linear, own.reference_displacement.notnull())
    return root.assign(chosen).assign_attrs(finite_strain=True)
