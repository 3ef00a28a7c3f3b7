"""Dataset of a study: labelled arrays with units and the reasons of missing values."""

import os
import shutil
from collections.abc import Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Any

import h5netcdf
import h5py
import numpy as np
import pandas as pd
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from springtune.problem.parameters import SWEPT
from springtune.problem.status import Status
from springtune.safe_io.atomic import replacing
from springtune.safe_io.inputs import BeyondBound, bounded

STATUS = tuple(map(str, Status))
"""Meanings of `status` flags in order of value."""

Label = str | float
"""Label along a dimension: a text or a number in SI units."""

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

    `variables` maps names to (dimensions, units, long name, fill value), `dimensions` those of this group alone to long
    name and unit. `flags` holds meanings by a variable's name or its last word, `further` more attributes by variable.
    """

    name: str
    variables: dict[str, tuple[tuple[str, ...], str, str, float | str | np.number[Any]]]
    dimensions: dict[str, str | tuple[str, str]] = field(default_factory=dict)
    flags: dict[str, tuple[str, ...]] = field(default_factory=dict)
    further: dict[str, dict[str, object]] = field(default_factory=dict)

    def empty(self, axes: Mapping[str, Sequence[Label]], names: Collection[str] | None = None) -> xr.Dataset:
        """Create the dataset with empty cells."""
        chosen = {name: row for name, row in self.variables.items() if names is None or name in names}
        data, used = {}, set()
        for name, (dimensions, units, long_name, nothing) in chosen.items():
            shape = [len(axes[dimension]) for dimension in dimensions]
            meanings = self.flags.get(name) or ({"status": STATUS} | self.flags).get(name.rpartition("_")[2])
            dtype = "int8" if meanings else object if isinstance(nothing, str) else None
            values = np.full(shape, nothing, dtype=dtype)
            attributes: dict[str, object] = {"long_name": long_name, "units": units}
            if meanings:
                flags = np.arange(len(meanings), dtype="int8")
                attributes |= {"flag_values": flags, "flag_meanings": " ".join(meanings)}
            # As it is: looking for dates among millions of texts costs more than the texts.
            data[name] = xr.Variable(dimensions, values, attributes | self.further.get(name, {}), fastpath=True)
            used |= set(dimensions)
        described = DIMENSIONS | self.dimensions
        coordinates = {}
        for dimension in (name for name in described if name in used):
            words = described[dimension]
            long_name, units = words if isinstance(words, tuple) else (words, "1")
            values = np.array(axes[dimension])
            if values.dtype.kind == "U":
                values = values.astype(object)
            coordinates[dimension] = (dimension, values, {"long_name": long_name, "units": units})
        return xr.Dataset(data, coordinates)

    def of_rows(
        self,
        axes: Mapping[str, Sequence[Label]],
        rows: Iterable[Mapping[str, object]] | pd.DataFrame,
        names: Collection[str] | None = None,
    ) -> xr.Dataset:
        """Create the dataset of rows of labels and values; each value goes to the labels that its variable has."""
        frame = rows if isinstance(rows, pd.DataFrame) else pd.DataFrame([*rows])
        data = self.empty(axes, names)
        for name in frame.columns.intersection([*data]):
            dimensions = [str(one) for one in data[name].dims]
            cells = frame[[*dimensions, name]].dropna()
            places = {one: xr.DataArray(cells[one].astype(data[one].dtype).array, dims="row") for one in dimensions}
            data[name].loc[places] = cells[name].array if dimensions else cells[name].iloc[-1]
        return data

    def over(self, further: Mapping[str, Sequence[str]], without: Collection[str] = ()) -> "Group":
        """Copy with further dimensions."""
        variables = {}
        for name, (dimensions, units, long_name, nothing) in self.variables.items():
            shared = [one for one in dimensions if one in DIMENSIONS]
            own = [one for one in dimensions if one not in DIMENSIONS]
            if name not in without:
                variables[name] = (*shared, *further.get(name, ()), *own), units, long_name, nothing
        return replace(self, variables=variables)


class Filler:
    """Writer of single cells by label."""

    def __init__(self, data: xr.Dataset) -> None:
        self.data = data
        # Looking an array up costs more than writing a cell of it.
        self._arrays = {name: ([str(one) for one in array.dims], array.values) for name, array in data.items()}
        self._places = {
            str(name): {label: i for i, label in enumerate(data[name].values.tolist())} for name in data.coords
        }
        self._texts: dict[object, object] = {}

    def put(self, values: Mapping[str, Any], **labels: Label) -> None:
        """Write variables by name into one cell; rows and tables may be shorter than their dimensions."""
        for name, value in values.items():
            dimensions, array = self._arrays[name]
            place = tuple(self._places[dimension][labels[dimension]] for dimension in dimensions if dimension in labels)
            array[place + tuple(slice(size) for size in np.shape(value))] = value

    def put_each(self, values: Sequence[Mapping[str, object]], labels: Sequence[Mapping[str, Label]]) -> None:
        """Write many cells, one variable at a time."""
        places = {
            dimension: np.array([known[one[dimension]] for one in labels])
            for dimension, known in self._places.items()
            if labels and dimension in labels[0]
        }
        for name in dict.fromkeys(name for one in values for name in one):
            dimensions, array = self._arrays[name]
            cells = [number for number, one in enumerate(values) if name in one]
            found: list[Any] = [values[number][name] for number in cells]
            if array.dtype == object:  # texts that are alike are one text
                found = [self._texts.setdefault(one, one) for one in found]
            place = tuple(places[dimension][cells] for dimension in dimensions if dimension in places)
            array[place] = np.array(found, dtype=array.dtype)

    def put_arrays(self, values: Mapping[str, object], labels: Mapping[str, Label | Sequence[Label]]) -> None:
        """Write arrays into the cells of some labels, one or several of a dimension."""
        for name, value in values.items():
            array = self.data[name]
            array.loc[{dimension: labels[str(dimension)] for dimension in array.dims if dimension in labels}] = value


def most_requested(root: xr.Dataset, dimension: str) -> str:
    """Label of a dimension with the most requested scenes."""
    requested = root.status != 0
    counts = requested.sum([name for name in requested.dims if name != dimension])
    return str(counts[dimension].values[int(counts.values.argmax())])


NO_NODE = np.int32(-1)
"""Fill value of UGRID connectivities."""

UGRID: dict[str, dict[str, object]] = {
    "mesh": {
        "cf_role": "mesh_topology",
        "topology_dimension": np.int32(2),
        "node_coordinates": "x y",
        "edge_node_connectivity": "spring_nodes",
        "face_node_connectivity": "cell_nodes",
        "node_dimension": "particle",
        "edge_dimension": "spring",
        "face_dimension": "cell",
    },
    "spring_nodes": {"cf_role": "edge_node_connectivity", "start_index": np.int32(0)},
    "cell_nodes": {"cf_role": "face_node_connectivity", "start_index": np.int32(0)},
}
"""Attributes of unstructured meshes by UGRID-1.0, see `Group.further`."""

OF_PARTICLES: dict[str, object] = {"mesh": "mesh", "location": "node"}
OF_SPRINGS: dict[str, object] = {"mesh": "mesh", "location": "edge"}
"""Attributes of variables of particles or springs."""

CHUNK = 2**18
"""Most bytes of a compressed chunk, which is read for each of its cells."""

UNCOMPRESSED = 2**13
"""Most bytes of an uncompressed array; compressing less costs more than it saves."""


MOSTLY = 0.75
"""Share of empty cells above which a large array of texts stores none of them."""

TEXTS = 128
"""Cells in a chunk of such an array."""


def write(path: str | os.PathLike[str], groups: Mapping[str, xr.Dataset], attributes: Mapping[str, str]) -> None:
    """Write a dataset atomically."""
    tree = xr.DataTree.from_dict(groups)
    tree.attrs = dict(attributes)
    # What groups share with the root is written there alone.
    own = {node.path: node.to_dataset(inherit=False) for node in tree.subtree}
    sparse = {group: [name for name in data.data_vars if _mostly_holes(data[name])] for group, data in own.items()}
    others = xr.DataTree.from_dict({group: data.drop_vars(sparse[group]) for group, data in own.items()})
    encoding = {
        group: {name: _encoding(data, name) for name in data.variables if name not in sparse[group]}
        for group, data in own.items()
    }
    path = Path(path)
    try:
        with replacing(path, synced=True) as unfinished, _small_cache():
            _make_texts(unfinished, own, sparse)
            others.to_netcdf(unfinished, mode="a", engine="netcdf4", encoding=encoding)
            _order(unfinished, own)
    except (OSError, RuntimeError) as error:  # HDF5 says of a full disk that there is an error, at times of its own
        free = shutil.disk_usage(path.parent).free / 1e6 if path.parent.is_dir() else 0.0
        reason = getattr(error, "strerror", None) or error
        raise OSError(
            f"{path}: cannot be written ({reason}; {free:.0f} MB are free there); make room, or see to permissions and "
            "limits, and run the study again: what is solved is stored, and only this file is made anew"
        ) from None


@contextmanager
def _small_cache() -> Iterator[None]:
    """Limit netCDF's cache to four chunks a variable instead of 64 MB: each is written once."""
    import netCDF4

    before = netCDF4.get_chunk_cache()
    netCDF4.set_chunk_cache(4 * CHUNK)
    try:
        yield
    finally:
        netCDF4.set_chunk_cache(*before)


def _mostly_holes(array: xr.DataArray) -> bool:
    """Return whether an array holds few texts in many cells."""
    if array.dtype != object or array.nbytes <= CHUNK or set(array.coords) - set(array.dims):
        return False
    return float(np.mean(array.values == "")) > MOSTLY


def _make_texts(
    path: str | os.PathLike[str], groups: Mapping[str, xr.Dataset], sparse: Mapping[str, Collection[Hashable]]
) -> None:
    """Create a file with the variables of texts of all groups, of which it writes those that are sparse.

    netCDF's own library gives each a fill value, by which it crashes when a file is opened while it is open elsewhere
    (netcdf4-python, issue 1444), and it writes into a file to read texts that were never stored.
    """
    with h5netcdf.File(path, "w") as file:
        for group, data in groups.items():
            place = file if group == "/" else file.create_group(group)
            above = {dim for parent in PurePosixPath(group).parents for dim in groups[str(parent)].sizes}
            place.dimensions = {dim: size for dim, size in data.sizes.items() if dim not in above}
            for name, array in data.variables.items():
                if array.dtype.kind not in "OU":
                    continue
                chunks = _block(array.shape) if name in sparse[group] else None
                variable = place.create_variable(name, array.dims, h5py.string_dtype(), chunks=chunks)
                if chunks is None:
                    continue
                variable.attrs.update(array.attrs)
                # HDF5 stores a chunk when something is written into it, and says of others that there is no text.
                for start in np.unique(np.argwhere(array.values != "") // chunks, axis=0).tolist():
                    cells = tuple(slice(number * size, (number + 1) * size) for number, size in zip(start, chunks))
                    variable[cells] = array.values[cells]


def _order(path: str | os.PathLike[str], groups: Mapping[str, xr.Dataset]) -> None:
    """Put the variables of a file in order by renaming them: HDF5 lists last what was named last."""
    with h5py.File(path, "a") as file:
        for group, data in groups.items():
            for name in map(str, data.variables):
                file[group].move(name, f"{name} ")
                file[group].move(f"{name} ", name)


def _block(shape: Sequence[int]) -> tuple[int, ...]:
    """Chunk shape of texts, about equal in all dimensions."""
    block = [1] * len(shape)
    while np.prod(block) < TEXTS and block != list(shape):
        _, number = min((block[n], -n) for n, length in enumerate(shape) if block[n] < length)
        block[-number] = min(2 * block[-number], shape[-number])
    return tuple(block)


def _encoding(data: xr.Dataset, name: Hashable) -> dict[str, object]:
    """Encoding of a variable."""
    array = data[name]
    # CF: coordinates have no holes, and so no value that stands for one.
    found: dict[str, object] = {"_FillValue": None} if name in data.coords else {}
    if str(array.attrs.get("cf_role", "")).endswith("connectivity"):
        found = {"_FillValue": NO_NODE}
    if array.dtype == object or array.nbytes <= UNCOMPRESSED:
        return found
    return found | {"zlib": True, "complevel": 4, "chunksizes": _chunk(array.shape, array.dtype.itemsize)}


def _chunk(shape: Sequence[int], itemsize: int) -> tuple[int, ...]:
    """Chunk shape: whole last dimensions, then as many of the others as fit."""
    chunk, room = [], CHUNK // itemsize
    for length in reversed(shape):
        chunk.append(max(1, min(length, room)))
        room //= chunk[-1]
    return tuple(reversed(chunk))


# -- open --------------------------------------------------------------------------------------------------------------


class _Texts(BackendArray):
    """Texts of a file, read within bounded memory, since their length is unknown before."""

    dtype = np.dtype(object)

    def __init__(self, path: Path, name: str, shape: tuple[int, ...], most: float) -> None:
        self.path, self.name, self.shape, self.most = path, name, shape, most

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.BASIC, self._read)

    def _read(self, key: tuple[Any, ...]) -> Any:
        try:
            with bounded(self.most), h5py.File(self.path) as file:
                return file[self.name].asstr()[key]
        except (BeyondBound, OSError, RuntimeError, UnicodeError):  # HDF5 says of missing memory only that it failed
            raise ValueError(
                f"{self.path}: its texts '{self.name.rpartition('/')[2]}' are damaged, or take more than "
                f"{self.most / 1e9:.3g} GB; select what is needed first, or run the study again"
            ) from None


def opened(path: Path, most: float, texts: Collection[str] = ()) -> xr.DataTree:
    """Open a file, and leave the arrays `texts` in it: xarray reads all texts, at the width of the longest."""
    with _small_cache():
        source = xr.open_datatree(path, engine="netcdf4", drop_variables=[*texts])
    if not texts:
        return source
    groups = {}
    with h5netcdf.File(path) as file:
        for node in source.subtree:
            variables = (file if node is source else file[node.path]).variables
            data = node.to_dataset(inherit=False)
            for name in set(texts) & set(variables):
                array = _Texts(path, f"{node.path}/{name}", variables[name].shape, most)
                lazy = indexing.LazilyIndexedArray(array)
                data[name] = xr.Variable(variables[name].dimensions, lazy, dict(variables[name].attrs))
            groups[node.path] = data[[name for name in variables if name in data.data_vars]]
    tree = xr.DataTree.from_dict(groups)
    tree.set_close(source.close)
    return tree


# -- flags -------------------------------------------------------------------------------------------------------------

NOT_REQUESTED = "not_requested"


def is_flagged(array: xr.DataArray) -> bool:
    """Return whether a variable holds flags."""
    return "flag_meanings" in array.attrs and array.dtype.kind in "iuf"


def flag_words(array: xr.DataArray) -> dict[int, str]:
    """Meanings of flags by value."""
    values = np.atleast_1d(array.attrs.get("flag_values", [])).tolist()
    return dict(zip(map(int, values), str(array.attrs["flag_meanings"]).split()))


def nothing(arrays: Sequence[xr.DataArray]) -> tuple[object, np.dtype[Any]]:
    """Fill value for some arrays, and a type that holds it and all their values."""
    if arrays[0].dtype.kind in "OUS":
        return "", np.dtype(object)
    together = np.result_type(*(array.dtype for array in arrays))
    if is_flagged(arrays[0]):
        silent = [value for value, word in flag_words(arrays[0]).items() if word == NOT_REQUESTED]
        return (silent or [-1])[0], np.dtype("int8") if together.kind == "f" else together
    return np.nan, together if together.kind == "f" else np.dtype(float)
