"""Answers of a study: errors of definitions, what to type, and how errors are shown. By numpy alone."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from springtune.problem.compare import sign_sentence
from springtune.problem.quantities import Status

from ..config.model import FINITE_STRAIN_REFERENCE, STRAINED_REFERENCE, TESTED_REFERENCE

if TYPE_CHECKING:
    import xarray as xr

Variables = Mapping[str, tuple[Sequence[str], np.ndarray]]  # dimensions and values of a group's variables and labels

Columns = dict[str, np.ndarray]  # labels and values of cells, arrays of one dimension


def variables(data: "xr.Dataset") -> Variables:
    """Dimensions and values of a group's variables and labels."""
    return {str(name): ([*map(str, array.dims)], array.values) for name, array in data.variables.items()}


def plane_vectors(fields: "xr.Dataset", name: str) -> np.ndarray:
    """Vectors in the plane from their components, such as ``"displacement_{}"``, shape (n, 2)."""
    return np.stack([fields[name.format(axis)].values for axis in "xy"], axis=1)


def broadcast(dims: Sequence[str], own: Sequence[str], values: np.ndarray) -> np.ndarray:
    """Values over their `own` dimensions with an axis for each of `dims`, of length 1 where they have none."""
    values = values.transpose([own.index(name) for name in dims if name in own])
    return values[tuple(slice(None) if name in own else None for name in dims)]


def requested_cells(group: Variables, finite: Variables | None = None, error: str = "deformation_error") -> Columns:
    """Requested cells of a group; `valid_error`, at `finite` strain if nonlinear, is NaN where it does not apply."""
    dims, values = group[error]
    there = broadcast(dims, *group["status"]) != Status.NOT_REQUESTED
    places = dict(zip(dims, np.nonzero(np.broadcast_to(there, values.shape))))
    held = ((name, *row) for name, row in group.items() if row[0] and {*row[0]} <= {*dims})
    cells = {name: values[tuple(places[one] for one in own)] for name, own, values in held}
    valid = cells[error]
    if "reference_applies" in cells:
        valid = np.where(cells["reference_applies"] == 1, valid, np.nan)
    if finite and own_laws(finite):
        along, law, known = own_law(finite)
        places["reference"] = law[at := tuple(places[one] for one in along)]
        own, values = finite["deformation_error"]
        errors = np.where(known[at], values[tuple(places[one] for one in own)], np.nan)
        valid = np.where(cells["kinematics"] == "linear", valid, errors)
    cells["valid_error"] = np.where(cells["status"] == Status.SOLVED, valid, np.nan)
    return cells


def own_laws(finite: Variables) -> list[str]:
    """References of materials' own laws in a group of references, by priority; in plane strain only with planes."""
    own = (TESTED_REFERENCE, FINITE_STRAIN_REFERENCE, *((STRAINED_REFERENCE,) if "material_plane" in finite else ()))
    return [law for law in own if law in finite["reference"][1]] if "reference" in finite else []


def own_law(finite: Variables) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Dimensions; along them the place of a material's own law among the references, and whether it has a number."""
    dims, values = finite["reference_displacement"]
    own, laws = [one for one in dims if one != "reference"], own_laws(finite)
    numbers = [finite["reference"][1].tolist().index(law) for law in laws]
    known = np.isfinite(np.moveaxis(values, [*dims].index("reference"), 0))[numbers]
    if laws[-1] == STRAINED_REFERENCE:
        known[-1] &= broadcast(own, *finite["material_plane"]) == "strain"
    return own, np.select([*known], numbers, numbers[-1]), np.logical_or.reduce(known)


class DefinitionErrors(NamedTuple):
    """Valid errors of a definition: places among the cells, and sizes."""

    labels: tuple[str, ...]  # definition, and kinematics where a study has them
    places: np.ndarray
    errors: np.ndarray

    @property
    def median(self) -> float:
        """Median size."""
        return float(np.median(self.errors))

    @property
    def worst(self) -> int:
        """Place of the largest among the cells."""
        return int(self.places[np.argmax(self.errors)])


def definition_errors(cells: Columns) -> list[DefinitionErrors]:
    """Valid errors of each definition and kinematics, in the order of the cells."""
    by = [cells[name] for name in ("definition", "kinematics") if name in cells]
    known, found = np.isfinite(cells["valid_error"]), []
    for labels in dict.fromkeys(zip(*(column.tolist() for column in by))):
        places = np.flatnonzero(known & np.all([column == label for column, label in zip(by, labels)], axis=0))
        if places.size:
            found.append(DefinitionErrors(labels, places, np.abs(cells["valid_error"][places])))
    return found


class Answer(NamedTuple):
    """Stiffnesses [N/m] to type for a definition on a mesh: the different ones of its springs, sorted."""

    labels: tuple[str, ...]  # of the mesh type and material
    mesh_size: float
    definition: str
    uniform: bool
    inside: np.ndarray
    outline: np.ndarray
    ratio: float  # median inside over E t
    errors: np.ndarray  # of the scenes

    @property
    def median_error(self) -> float:
        """Median size of the errors."""
        return float(np.median(np.abs(self.errors)))


def what_to_type(cells: Columns, by: Sequence[str] = ("mesh_type", "material")) -> Iterator[tuple[Answer, ...]]:
    """The best definition and the best uniform stiffness, where known, on the finest mesh of each type and material."""
    if "stiffness_inside" not in cells:
        return
    missing = np.full(cells["status"].shape, np.nan)
    known, uniform = np.isfinite(cells["valid_error"]), np.isfinite(cells.get("stiffness", missing))
    inside, outline = cells["stiffness_inside"], cells["stiffness_outline"]
    ratio = inside / cells.get("material_young_modulus", missing) / cells.get("beam_thickness", missing)
    known &= (np.abs(inside) > 0) | (np.abs(outline) > 0)  # energies alone have no stiffness to type
    for labels in dict.fromkeys(zip(*(cells[name].tolist() for name in by))):
        here = np.all([cells[name] == label for name, label in zip(by, labels)], axis=0)
        if not (here & known).any():
            continue
        size = float(cells["mesh_size"][here & known].min())
        here &= cells["mesh_size"] == size
        answers = []
        for name in sorted({*cells["definition"][here & known].tolist()}):
            own = here & (cells["definition"] == name)
            springs, edges = (np.unique(values[own & np.isfinite(values)]) for values in (inside, outline))
            share, errors = ratio[own & np.isfinite(ratio)], cells["valid_error"][own & known]
            median = float(np.median(share)) if share.size else np.nan
            answers.append(Answer(labels, size, name, bool(uniform[own].any()), springs, edges, median, errors))
        kinds = ([one for one in answers if one.uniform == alike] for alike in (False, True))
        yield tuple(min(kind, key=lambda one: one.median_error) for kind in kinds if kind)


# -- colours of the size of errors, and the meaning of their sign ------------------------------------------------------

ERROR_COLOURS = (
    "#ffffe5", "#fff7bc", "#fee391", "#fec44f", "#fe9929", "#ec7014", "#cc4c02", "#993404", "#662506",
)  # fmt: skip
"""Colours of the size of an error, from small to large, on a logarithmic scale: ColorBrewer's YlOrBr."""

ERROR_RANGE = (0.1, 100.0)  # sizes of errors at the ends of the scale [%]


def sign_of_displacements(references: np.ndarray, axes: Mapping[str, Sequence[object]]) -> str:
    """Sentence on which sign of errors means too soft, by loads or else quantities; empty without any reference."""
    signs = np.sign(references)
    known = signs[np.isfinite(signs) & (signs != 0)]
    if not known.size or (known == known[0]).all():
        return sign_sentence({"": known[0]}) if known.size else ""
    for name, where in (("load", "under"), ("quantity", "of")):
        if name in axes:
            others = tuple(axis for axis, other in enumerate(axes) if other != name)
            low, high = np.fmin.reduce(signs, axis=others), np.fmax.reduce(signs, axis=others)
            if not ((low < 0) & (high > 0)).any():
                return sign_sentence({str(label): sign for label, sign in zip(axes[name], low + high)}, where)
    return "too soft: errors with the sign of their reference"
