"""Select the group and labels that a figure shows."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from springtune.problem.quantities import OF_BODIES, SWEPT, shown_order
from springtune.problem.shapes import beam_label

from ..config.model import STRAINED_REFERENCE
from .answers import OWN_LAW_REFERENCES
from .error_scale import sign_of_displacements

if TYPE_CHECKING:
    from .dataset import Label


def group(data: xr.DataTree | xr.Dataset, name: str, alone: bool = True) -> xr.Dataset:
    """Dataset of a group; `data` itself if it is no tree."""
    if not isinstance(data, xr.DataTree):
        if not alone:
            raise ValueError(f"not only the group '/{name}' is plotted: give the whole dataset, an xarray.DataTree")
        return data
    if name == "/":
        if not data.variables:
            raise ValueError(
                f"the dataset has no scenes of beams; it has {_quoted(f'/{one}' for one in data.children)}"
            )
        return data.to_dataset()
    if name not in data.children:
        raise ValueError(f"the dataset has no group '/{name}'; it has {_quoted(f'/{one}' for one in data.children)}")
    return data[name].to_dataset()


def choose(present: xr.DataArray, **selection: Label | None) -> dict[str, Label | None]:
    """Labels of a figure: the given ones, and the only label of each other dimension."""
    chosen = {name: label for name, label in selection.items() if name in present.dims}
    given = [name for name, label in chosen.items() if label is not None]
    for name in sorted(chosen, key=lambda name: name not in given):
        found = labels_of(present, name)
        if name in given and chosen[name] not in found:
            raise ValueError(f"nothing has {name} {chosen[name]!r}; there is {_quoted(found)}")
        if not found:
            raise ValueError("nothing to plot: the dataset has no cell of the selection")
        if name not in given and len(found) > 1:
            raise ValueError(f"choose one {name}: {_quoted(found)}")
        chosen[name] = chosen[name] if name in given else found[0]
        present = present.sel({name: [chosen[name]]})  # later dimensions are seen under this label
    return chosen


def last_swept(present: xr.DataArray, along: str = "") -> dict[str, xr.DataArray]:
    """Last swept values of each beam, material and load: what figures without a sweep show."""
    names = [str(name) for name in present.dims if name in SWEPT and name != along]
    if not names:
        return {}
    kept: list[str] = [name for name in ("beam", "material", "load") if name in present.dims]
    there = present.any([name for name in present.dims if name not in (*kept, *names, along)])
    if along in there.dims:
        counts = there.sum(along)
        together = int(counts.max()) == 1 and int((there.any(names).sum(along)).max()) > 1
        kept += [along] if together else []
        there = there if together else (counts > 0) & (counts == counts.max(names))
    there = there.transpose(*kept, *names)
    # What is shown rather than others comes last.
    ranks = {name: [shown_order(name, value) for value in there[name].values.tolist()] for name in names}
    there = there.isel({name: np.argsort(rank, kind="stable") for name, rank in ranks.items()})
    shape = there.shape[len(kept) :]
    flat = there.values.reshape(*there.shape[: len(kept)], -1)
    places = np.unravel_index(flat.shape[-1] - 1 - flat[..., ::-1].argmax(axis=-1), shape)
    coordinates = {name: there[name].values for name in kept}
    return {name: xr.DataArray(there[name].values[place], coordinates, kept) for name, place in zip(names, places)}


SHOWN_PREFIX = "shown_"
"""Prefix of variables that hold the swept values of stored fields."""


def unswept(root: xr.Dataset) -> xr.Dataset:
    """Root at the last swept values of each beam, material and load."""
    return at(root, last_swept(root.status != 0))


def shown_swept(fields: xr.Dataset, root: xr.Dataset) -> dict[str, xr.DataArray]:
    """Swept values whose fields the dataset holds."""
    names = [name for name in SWEPT if name in root.dims and f"{SHOWN_PREFIX}{name}" in fields]
    coordinates = [name for name in root.dims if name in SWEPT]
    # Nothing is kept of what has no value: any will do.
    values = {name: fields[f"{SHOWN_PREFIX}{name}"].fillna(root[name].values[0]) for name in names}
    return {name: value.drop_vars(coordinates, errors="ignore") for name, value in values.items()}


def at(data: xr.Dataset, values: Mapping[str, xr.DataArray]) -> xr.Dataset:
    """Select one swept value for each beam, material and load."""
    chosen = {name: value for name, value in values.items() if name in data.dims}
    if not chosen:
        return data
    found = data.sel(chosen)
    own = {
        name: (("material",) if name.startswith("material") else ("beam",))
        for name in OF_BODIES.values()
        if name in found
    }
    for name, dimensions in own.items():  # what belongs to a body is the same under all loads, but for what is swept
        others = [one for one in found[name].dims if one not in dimensions]
        found[name] = found[name].isel(dict.fromkeys(others, -1), drop=True) if others else found[name]
    return found.reset_coords([name for name in chosen if name in found.coords])


def sign_of_errors(data: xr.Dataset) -> str:
    """Sentence on which sign of a group's errors means too soft; empty without references."""
    if "reference_displacement" not in data:
        return ""
    references = data.reference_displacement
    axes = {str(name): references[name].values.tolist() for name in references.dims}
    return sign_of_displacements(references.values, axes)


def labels_of(present: xr.DataArray, name: str) -> list[Label]:
    """Labels of a dimension that have a present cell, in dataset order."""
    there = present.any([dimension for dimension in present.dims if dimension != name])
    return there[name].values[there.values].tolist()


def cells(present: xr.DataArray, names: Collection[str]) -> list[dict[str, Label]]:
    """Labels of present cells over some dimensions, the last name fastest."""
    there = present.any([dimension for dimension in present.dims if dimension not in names]).transpose(*names)
    labels = [there[name].values.tolist() for name in names]
    return [{name: labels[axis][place[axis]] for axis, name in enumerate(names)} for place in np.argwhere(there.values)]


def records(data: xr.Dataset, present: xr.DataArray, names: Iterable[str]) -> list[dict[str, Any]]:
    """Labels and variables of present cells, last dimension fastest; selecting each takes a thousand times as long."""
    places = dict(zip(map(str, present.dims), np.nonzero(present.values)))
    columns = {name: present[name].values[numbers].tolist() for name, numbers in places.items()}
    for name in names:
        dimensions = [str(one) for one in data[name].dims]
        columns[name] = data[name].values[tuple(places[one] for one in dimensions)].tolist()
    return [dict(zip(columns, row)) for row in zip(*columns.values())]


def table_rows(
    data: xr.Dataset,
    present: xr.DataArray,
    names: Collection[str],
    scaled: Mapping[str, tuple[str, float]] = MappingProxyType({}),
) -> list[dict[str, Any]]:
    """Rows of the present cells: labels and variables by name, and variables by column times a factor."""
    variables = [name for name in (*names, *(name for name, _ in scaled.values())) if name in data.variables]
    return [
        {name: one[name] for name in names} | {head: factor * one[name] for head, (name, factor) in scaled.items()}
        for one in records(data, present, variables)
    ]


def _quoted(labels: Iterable[object]) -> str:
    return ", ".join(repr(label) for label in labels) or "nothing"


def labelled_beam(data: xr.Dataset, name: str) -> str:
    """Beam name with its dimensions, see `springtune.problem.shapes.beam_label`."""
    if "beam_length" not in data:
        return str(name)
    found = data[["beam_length", "beam_height"]]
    found = found.sel(beam=name) if "beam" in found.dims else found
    return beam_label(str(name), float(found.beam_length), float(found.beam_height))


# -- references at finite strain: Yeoh's law of a material with a uniaxial test, else neo-Hooke's in its plane ---------


def own_law_references(data: xr.Dataset) -> tuple[list[str], xr.Dataset]:
    """References of a material's own law, and the group without plane-strain numbers of plane-stress materials."""
    laws = [kind for kind in OWN_LAW_REFERENCES if kind in data.reference.values]
    if "material_plane" not in data:
        return [kind for kind in laws if kind != STRAINED_REFERENCE], data
    own = (data.reference != STRAINED_REFERENCE) | (data.material_plane == "strain")
    numbers = {name: one for name, one in data.items() if one.dtype.kind == "f" and "reference" in one.dims}
    return laws, data.assign({name: one.where(own) for name, one in numbers.items()}).drop_vars("material_plane")


def select_own_law(finite: xr.Dataset) -> xr.Dataset | None:
    """Select the reference of each material's own law and plane."""
    laws, finite = own_law_references(finite)
    if not laws:
        return None
    found = finite.sel(reference=laws[-1], drop=True)
    # A material has one of them; where none is there, each says why.
    for law in laws[-2::-1]:
        other = finite.sel(reference=law, drop=True)
        there = other.reference_displacement.notnull()
        found = found.copy()
        for name, array in other.items() if there.any() else ():
            own = there.broadcast_like(array).transpose(*array.dims) if set(there.dims) <= set(array.dims) else there
            found[name] = array.where(own, found[name])
    return found


def own_law_reference(cell: xr.Dataset, name: str) -> str | None:
    """Label of a material's own reference: a solved one if there is any; None without a reference."""
    kinds, cell = own_law_references(cell)
    there = [kind for kind in kinds if np.isfinite(cell[name].sel(reference=kind).values).any()]
    return next(iter(there or kinds[::-1]), None)
