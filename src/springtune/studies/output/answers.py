"""Answers of a study: errors of definitions, what to type, and how they are shown. Imports numpy alone."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from springtune.problem.quantities import Status

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


def plane_vectors(fields: "xr.Dataset", name: str) -> np.ndarray:
    """Vectors in the plane from their components, such as ``"displacement_{}"``, shape (n, 2)."""
    return np.stack([fields[name.format(axis)].values for axis in "xy"], axis=1)


class DefinitionErrors(NamedTuple):
    """Valid errors of a definition, by `springtune.studies.output.dataset.requested_cells`."""

    labels: tuple[str, ...]  # definition, and kinematics where a study has them
    cells: "pd.DataFrame"

    @property
    def median(self) -> float:
        """Median size."""
        return float(self.cells.valid_error.abs().median())

    @property
    def worst(self) -> "pd.Series":
        """Cell of the largest."""
        return self.cells.loc[self.cells.valid_error.abs().idxmax()]


def definition_errors(cells: "pd.DataFrame") -> list[DefinitionErrors]:
    """Valid errors of each definition and kinematics."""
    by = [name for name in ("definition", "kinematics") if name in cells]
    known = cells[np.isfinite(cells.valid_error)]
    return [DefinitionErrors(labels, own) for labels, own in known.groupby(by, sort=False)]


class Answer(NamedTuple):
    """Stiffnesses [N/m] to type for a definition on a mesh: the different ones of its springs, sorted."""

    labels: tuple[str, ...]  # of the mesh type and material
    mesh_size: float
    definition: str
    uniform: bool
    energies: bool  # besides springs
    inside: np.ndarray
    outline: np.ndarray
    ratio: float  # median inside over E t
    errors: np.ndarray  # of the scenes

    @property
    def median_error(self) -> float:
        """Median size of the errors."""
        return float(np.median(np.abs(self.errors)))


def what_to_type(cells: "pd.DataFrame", by: Sequence[str] = ("mesh_type", "material")) -> Iterator[tuple[Answer, ...]]:
    """Return the best springs alone, uniform stiffness and springs with energies, on each finest mesh."""
    if "stiffness_inside" not in cells:
        return
    membrane = cells.get("material_young_modulus", np.nan) * cells.get("beam_thickness", np.nan)
    # Energies alone have no stiffness to type.
    has_springs = cells[["stiffness_inside", "stiffness_outline"]].abs().max(axis=1) > 0
    cells = cells.assign(ratio=cells.stiffness_inside / membrane, known=np.isfinite(cells.valid_error) & has_springs)
    for labels, here in cells.groupby([*by], sort=False):
        size, answers = here.mesh_size[here.known].min(), []
        for name, own in here[here.mesh_size == size].groupby("definition"):
            inside, outline = (np.unique(own[f"stiffness_{place}"].dropna()) for place in ("inside", "outline"))
            energies = "further_energies" in own and bool(own.further_energies.max() > 0)
            uniform = not energies and "stiffness" in own and bool(own.stiffness.notna().any())
            kind, ratio = (uniform, energies), own.ratio.median()
            if len(errors := own.valid_error[own.known].to_numpy()):
                answers.append(Answer(labels, size, name, *kind, inside, outline, ratio, errors))
        order = (False, False), (True, False), (False, True)
        kinds = ([one for one in answers if (one.uniform, one.energies) == kind] for kind in order)
        if answers:
            yield tuple(min(kind, key=lambda one: one.median_error) for kind in kinds if kind)


def count_statuses(flags: np.ndarray) -> dict[str, int]:
    """Number of requested cells by status in words."""
    known = zip(*np.unique(flags[flags != 0], return_counts=True))
    return {str(Status(int(flag))).replace("_", " "): int(count) for flag, count in known}


def status_words(flags: int | np.ndarray) -> str:
    """Statuses of requested cells in words, each once."""
    return ", ".join(count_statuses(np.ravel(flags)))


# -- colours of the size of errors -------------------------------------------------------------------------------------

ERROR_COLOURS = (
    "#ffffe5", "#fff7bc", "#fee391", "#fec44f", "#fe9929", "#ec7014", "#cc4c02", "#993404", "#662506",
)  # fmt: skip
"""Colours of the size of an error, from small to large, on a logarithmic scale: ColorBrewer's YlOrBr."""

ERROR_RANGE = (0.1, 100.0)  # sizes of errors at the ends of the scale [%]
