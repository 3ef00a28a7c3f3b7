"""Files in a study's folder that its current values no longer need."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from springtune.handover.paraview import pieces_of
from springtune.safe_io.atomic import UNFINISHED

from ..config.kind import FORMATS
from . import plan, rerun
from .checked_json import ASIDE

if TYPE_CHECKING:
    from ..config.model import Study

JOB_FILES = {"tasks": ".json", "done": ".json", "logs": ".log", "benchmarks": ".tsv"}

COLLECTED, PIECE = ".pvd", ".vtu"
"""Endings of ParaView collections, and of their files in a folder beside."""

OUTPUT_FILES = {
    "figures": tuple(f".{ending}" for ending in FORMATS),
    "tables": (".csv", ".html", ".md"),
    "paraview": (COLLECTED,),
}

STORED = ".h5"
"""Ending of what stages store, see `springtune.studies.runs.store`."""


def orphans(study: "Study", folder: Path) -> list[Path]:
    """Files of earlier runs that the next run neither makes nor reads."""
    planned = plan.plan(study, folder, 1)
    jobs = rerun.jobs(study, planned)
    products = [Path(path) for job in jobs.values() for path in job.products]
    kept = {folder / plan.BUNDLES_FILE, *products}
    kept |= {piece for path in products if path.suffix == COLLECTED for piece in pieces_of(path)}
    found = {path for path in _candidates(folder) if path not in kept}
    found -= {folder / name / f"{job}{ending}" for name, ending in JOB_FILES.items() for job in jobs}
    return sorted(found)


def _candidates(folder: Path) -> Iterator[Path]:
    """Files of the kinds that runs make, in a study's folder and those directly in it that are no links elsewhere."""
    names = tuple(f"{name}_" for name in (*(stage.name for stage in plan.stages()), rerun.PRESENT))
    stores = {stage.folder for stage in plan.stages()}
    for path in _files(folder):
        if _is_left(path):
            yield path
    for below in sorted(folder.iterdir()):
        if below.is_symlink() or not below.is_dir():
            continue
        if below.name in OUTPUT_FILES and COLLECTED in OUTPUT_FILES[below.name]:
            yield from (path for path in sorted(below.glob(f"*/*{PIECE}")) if path.is_file() and not path.is_symlink())
        for path in _files(below):
            made = path.suffix in OUTPUT_FILES.get(below.name, ())
            made |= below.name in JOB_FILES and path.name.startswith(names)
            made |= below.name in stores and path.suffix == STORED
            made |= below.name == "meshes" and path.suffix in (".vtu", ".json")
            if made or _is_left(path):
                yield path


def _is_left(path: Path) -> bool:
    """Whether a file was being written, or was set aside."""
    return UNFINISHED in path.name or path.name.endswith(ASIDE)


def _files(folder: Path) -> Iterator[Path]:
    return (path for path in folder.iterdir() if path.is_file() and not path.is_symlink())
