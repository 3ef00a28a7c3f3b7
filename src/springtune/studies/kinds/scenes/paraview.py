"""Scenes of a study for ParaView: a file for each scene with fields, and a collection."""

from pathlib import Path
from typing import TYPE_CHECKING

from ...output.export import write_scenes
from .outputs import COLLECTION

if TYPE_CHECKING:
    import xarray as xr


def write(tree: "xr.DataTree", folder: Path) -> list[Path]:
    """Write the collection and its files."""
    folder.mkdir(parents=True, exist_ok=True)
    return [path.relative_to(folder) for path in write_scenes(tree, folder / COLLECTION)]
