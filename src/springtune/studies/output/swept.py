"""Turn parameters that only some studies sweep into dimensions of all."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from springtune.problem.parameters import STATED, SWEPT, UNCHANGED

from .alignment import SAME_NUMBER
from .flags import nothing


def with_swept(trees: Sequence[xr.DataTree]) -> list[xr.DataTree]:
    """Add a dimension for each parameter that any dataset sweeps."""
    made = [*trees]
    for name in SWEPT:
        sweeping = [tree for tree in trees if name in tree.dims]
        if not sweeping:
            continue
        # No study need have all groups: what a parameter matters to is asked of all.
        over = {
            (node.path, str(variable))
            for tree in sweeping
            for node in tree.subtree
            for variable, array in node.data_vars.items()
            if name in array.dims
        }
        for number, tree in enumerate(made):
            stated = _stated(tree, name)
            if name not in tree.dims and stated is not None:
                made[number] = _swept(tree, name, stated, sweeping[0][name].attrs, over)
    return made


def _stated(tree: xr.DataTree, name: str) -> xr.DataArray | None:
    """A study's value of a parameter over its dimensions; None if unstated."""
    if name in UNCHANGED:
        return xr.DataArray(UNCHANGED[name])
    found = tree.to_dataset().get(STATED[name])
    return None if found is None else abs(found)


def _swept(
    tree: xr.DataTree,
    name: str,
    stated: xr.DataArray,
    attributes: Mapping[Any, Any],
    over: Collection[tuple[str, str]],
) -> xr.DataTree:
    """Add a dimension to the variables `over`, pairs of path and name."""
    known = np.unique(stated.values[np.isfinite(stated.values)])
    if not len(known):
        return tree
    labels = known[np.concatenate([[True], np.diff(known) > SAME_NUMBER * known[1:]])]
    axis = xr.DataArray(labels, dims=name, name=name, attrs=dict(attributes))
    here = xr.concat([abs(stated - label) <= SAME_NUMBER * label for label in labels], name).assign_coords({name: axis})
    groups = {}
    for node in tree.subtree:
        data = node.to_dataset()
        found = data.drop_vars(name, errors="ignore")
        for variable in found.data_vars:
            if (node.path, str(variable)) not in over:
                continue
            array = found[variable]
            empty, dtype = nothing([array])
            mask = here.any([one for one in here.dims if one not in (*array.dims, name)])
            spread = array.astype(dtype).where(mask, np.array(empty, dtype)).transpose(*array.dims, name)
            found[variable] = spread.assign_attrs(array.attrs)
        groups[node.path] = found
    made = xr.DataTree.from_dict(groups)
    made.attrs = tree.attrs
    return made
