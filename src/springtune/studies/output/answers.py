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
    """Stiffnesses [N/m] to type for a definition on a mesh: those of its scenes, sorted; none if springs differ."""

    labels: tuple[str, ...]  # of the mesh type and material
    mesh_size: float
    definition: str
    uniform: bool
    energies: bool  # besides springs
    inside: np.ndarray
    outline: np.ndarray
    ratio: float  # median inside over E t
    errors: "pd.Series"  # of the scenes, by load

    @property
    def worst_error(self) -> float:
        """Error of the largest size."""
        return float(self.errors.iloc[self.errors.abs().argmax()])


def what_to_type(cells: "pd.DataFrame", by: Sequence[str] = ("mesh_type", "material")) -> Iterator[tuple[Answer, ...]]:
    """Return the best springs alone, uniform stiffness and springs with energies, on each finest mesh.

    The best has errors under most loads, and the smallest worst error.
    """
    if "stiffness_inside" not in cells:
        return
    membrane = cells.get("material_young_modulus", np.nan) * cells.get("beam_thickness", np.nan)
    # Energies alone have no stiffness to type.
    has_springs = cells[["stiffness_inside", "stiffness_outline"]].abs().max(axis=1) > 0
    cells = cells.assign(ratio=cells.stiffness_inside / membrane, known=np.isfinite(cells.valid_error) & has_springs)
    for labels, here in cells.groupby([*by], sort=False):
        size, answers = here.mesh_size[here.known].min(), []
        for name, own in here[here.mesh_size == size].groupby("definition"):
            alike = own[own.stiffness_alike != 0] if "stiffness_alike" in own else own
            inside, outline = (np.unique(alike[f"stiffness_{place}"].dropna()) for place in ("inside", "outline"))
            energies = "further_energies" in own and bool(own.further_energies.max() > 0)
            uniform = not energies and "stiffness" in own and bool(own.stiffness.notna().any())
            if len(errors := own[own.known].set_index("load").valid_error):
                ratio = alike.ratio.median()
                answers.append(Answer(labels, size, name, uniform, energies, inside, outline, ratio, errors))
        answers.sort(key=lambda one: (-one.errors.index.nunique(), abs(one.worst_error)))
        # Springs alone, uniform ones, with energies.
        kinds = ([one for one in answers if 2 * one.energies + one.uniform == kind] for kind in range(3))
        if answers:
            yield tuple(kind[0] for kind in kinds if kind)


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
