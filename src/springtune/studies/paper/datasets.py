"""Datasets of a paper by study name."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..output import reading
from ..runs import provenance
from . import PaperError

if TYPE_CHECKING:
    import xarray as xr

HASH_SHOWN = 12


@dataclass(frozen=True)
class Dataset:
    """A dataset in memory with its origin; `sha256` includes stored run times."""

    path: Path
    tree: "xr.DataTree"
    sha256: str

    @property
    def study(self) -> str:
        """Name of its study."""
        return str(self.tree.attrs["study"])

    def origin(self) -> dict[str, object]:
        """Facts for a statement on reproducibility."""
        attributes = self.tree.attrs
        return {
            "study": self.study,
            "title": attributes["title"],
            "version": attributes["springtune_version"],
            "commit": attributes["git_commit"][:HASH_SHOWN] or "no commit",
            "changed": attributes["git_commit"].endswith(provenance.CHANGED),
            "created": attributes["created"][:10],
            "software": json.loads(attributes["software"]),
            "sha256": self.sha256[:HASH_SHOWN],
        }


def read(paths: Iterable[str | Path]) -> dict[str, Dataset]:
    """Read datasets."""
    found: dict[str, Dataset] = {}
    for path in map(Path, paths):
        try:
            with reading.open(path) as tree:
                one = Dataset(path, tree.load(), hashlib.sha256(path.read_bytes()).hexdigest())
        except (OSError, ValueError) as error:
            raise PaperError(str(error)) from None
        found[one.study] = one
    return found


def chosen(datasets: Mapping[str, Dataset], study: str, what: str) -> Dataset:
    """Dataset of a study."""
    if study not in datasets:
        raise PaperError(
            f"{what}: no dataset of the study '{study}' was given; there is {', '.join(datasets) or 'none'}: "
            f"run config/{study}.yaml and give its results/{study}/dataset.nc"
        )
    return datasets[study]
