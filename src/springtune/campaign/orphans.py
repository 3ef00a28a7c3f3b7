"""What lies in a study's folder and nothing asks for any more: outputs and results of values that it no longer has."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ..jobs.atomic import UNFINISHED
from ..kinds import outputs
from ..kinds.base import FORMATS
from . import plan

if TYPE_CHECKING:
    from ..study.model import Study

JOB_FILES = {"tasks": ".json", "done": ".json", "logs": ".log", "benchmarks": ".tsv"}
"""Folders of files that each job has one of, and how these end."""

OUTPUT_FILES = {"figures": tuple(f".{ending}" for ending in FORMATS), "tables": (".csv", ".html", ".md")}
"""Folders of outputs, and how their files end."""

STORED, STORES = ".h5", {"references", "curves", "solutions", "moduli", "laying", "stability", "benchmark"}
"""Ending of what stages store, see `springtune.jobs.store`, and the folders where they do."""


def orphans(study: "Study", folder: Path) -> list[Path]:
    """Files of the kinds that runs make which the study's next run neither makes nor reads.

    Parameters
    ----------
    study : Study
    folder : Path
        Where the study's results are.

    Returns
    -------
    list of Path
        Sorted; none of them outside of the folder. Whatever else lies there is not looked at.
    """
    contents = plan.task_contents(study, folder)
    kept = {folder / name for name in _outputs(study)} | {folder / plan.BUNDLES_FILE}
    jobs: set[str] = set()
    for stage in plan.stages():
        for label, content in contents[stage.name].items():
            jobs.add(f"{stage.name}_{label}")
            kept |= {Path(path) for path in stage.products(content)}
    found = {path for path in _candidates(folder) if path not in kept}
    found -= {folder / name / f"{job}{ending}" for name, ending in JOB_FILES.items() for job in jobs | _present(study)}
    return sorted(found)


def _outputs(study: "Study") -> Iterator[str]:
    """Figures and tables of a study, from its folder on."""
    for output in outputs().values():
        if output.name in study.outputs:
            yield from (f"figures/{stem}.{ending}" for stem in output.figures(study) for ending in FORMATS)
            yield from (f"tables/{name}" for name in plan.table_files(output, study))


def _present(study: "Study") -> set[str]:
    """Names of the jobs of a study's outputs."""
    return {f"present_{output.made_by}" for output in outputs().values() if output.name in study.outputs}


def _candidates(folder: Path) -> Iterator[Path]:
    """Files of the kinds that runs make, in a study's folder and those directly in it that are no links elsewhere."""
    names = {stage.name for stage in plan.stages()} | {"present"}
    for path in _files(folder):
        if UNFINISHED in path.name:
            yield path
    for below in sorted(folder.iterdir()):
        if below.is_symlink() or not below.is_dir():
            continue
        for path in _files(below):
            stage, mark, _ = path.name.partition("_")
            made = path.suffix in OUTPUT_FILES.get(below.name, ())
            made |= below.name in JOB_FILES and bool(mark) and stage in names
            made |= below.name in STORES and path.suffix == STORED
            made |= below.name == "meshes" and path.suffix in (".vtu", ".json")
            if made or UNFINISHED in path.name:
                yield path


def _files(folder: Path) -> Iterator[Path]:
    return (path for path in folder.iterdir() if path.is_file() and not path.is_symlink())
