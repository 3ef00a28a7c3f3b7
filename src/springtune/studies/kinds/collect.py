"""Compare what was solved with its references and gather everything in one dataset."""

import gc
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from springtune.registry import import_name
from springtune.safe_io import atomic

from ..config.kind import kinds, outputs
from ..output import dataset, summing_up
from ..runs import job, provenance, rerun
from ..runs.plan import rows
from ..runs.store import DamagedError
from . import load_study

if TYPE_CHECKING:
    from ..config.kind import StudyKind
    from ..config.model import Study


def run(study: "Study", folder: Path, output: Path) -> None:
    """Build the dataset of a study from its stored results."""
    try:
        groups = gathered(study, folder)
        dataset.write(output, groups, provenance.attributes(study))
    except DamagedError as error:
        job.forget_job_of(error.path, folder)
        raise SystemExit(str(error)) from None
    except OSError as error:  # the message says it all
        raise SystemExit(str(error)) from None
    told = output.with_name(rerun.SUMMARY)
    atomic.write_text(told, summing_up.text(groups, study.title))


def main(config: str, folder: str, output: str, record: str, digest: str) -> None:
    """Build a dataset and write the record of it."""
    study = load_study(config)
    if rerun.jobs(study, Path(folder))[rerun.COLLECT].digest != digest:
        raise SystemExit(f"{config} was changed while the study ran; call the same command again")
    run(study, Path(folder), Path(output))
    atomic.write_json(record, {"digest": digest})


def group_of(kind: "StudyKind") -> dataset.Group:
    """Group that a kind without a module ``collect`` declares."""
    return dataset.Group(f"/{kind.name}", kind.variables, kind.dimensions, kind.flags)


def _of_tasks(kind: "StudyKind", study: "Study", folder: Path) -> dict[str, xr.Dataset]:
    """Group of such a kind, of the stored rows of its stages."""
    group, found = group_of(kind), [row for stage in kind.stages for row in rows(stage, study, folder)]
    names = {name for row in found for name in row} if kind.sparse else None
    return {group.name: group.of_rows(study.axes, found, names).assign_attrs(kind.attributes(study.parts[kind.name]))}


def gathered(study: "Study", folder: Path) -> dict[str, xr.Dataset]:
    """Groups of the dataset of a study, of what its stages stored."""
    groups: dict[str, xr.Dataset] = {}
    for kind in kinds():
        if study.parts[kind.name]:
            own = (
                partial(_of_tasks, kind) if kind.variables else import_name(f"studies.kinds.{kind.name}.collect:groups")
            )
            groups |= own(study, folder)
    for made in outputs().values():
        if made.collect and made.name in study.outputs:
            groups |= import_name(made.collect).groups(study, folder)
    return groups


if __name__ == "__main__":
    gc.set_threshold(100_000, 20, 100)  # looking for garbage among scenes takes a tenth of the time
    main(*sys.argv[1:])
