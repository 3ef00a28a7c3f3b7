"""Finite-strain references by each material's own law: Yeoh with a uniaxial test, else neo-Hooke."""

from typing import TYPE_CHECKING

import numpy as np

from ..config.model import FINITE_STRAIN_REFERENCE, TESTED_REFERENCE

if TYPE_CHECKING:
    import xarray as xr


OWN_LAWS = (TESTED_REFERENCE, FINITE_STRAIN_REFERENCE)
"""Plane-stress references of own laws, by priority."""


def of_own_law(finite: "xr.Dataset") -> "xr.Dataset | None":
    """Select plane-stress references of each material's own law."""
    neo_hooke, tested = (
        finite.sel(reference=kind, drop=True) if kind in finite.reference.values else None
        for kind in (FINITE_STRAIN_REFERENCE, TESTED_REFERENCE)
    )
    if neo_hooke is None or tested is None:
        return tested if neo_hooke is None else neo_hooke
    # A material has one of the two; where neither is there, each says why.
    there = tested.reference_displacement.notnull()
    if not there.any():
        return neo_hooke
    found = neo_hooke.copy()
    for name, array in tested.items():
        own = there.broadcast_like(array).transpose(*array.dims) if set(there.dims) <= set(array.dims) else there
        found[name] = array.where(own, neo_hooke[name])
    return found


def own_law(cell: "xr.Dataset", name: str) -> str | None:
    """Label of one material's plane-stress reference; an unsolved requested one counts last, None without any."""
    kinds = [kind for kind in OWN_LAWS if kind in cell.reference.values]
    there = [kind for kind in kinds if np.isfinite(cell[name].sel(reference=kind).values).any()]
    return next(iter(there or kinds[::-1]), None)
