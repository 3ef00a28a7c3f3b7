"""Write the dataset of a study from its stored results, compared with their references."""

import gc
import sys
from pathlib import Path

import xarray as xr

from springtune.registry import import_name
from springtune.safe_io import write_json, write_text

from ..config.model import Study, StudyKind, kinds, outputs
from ..output import dataset, summary
from ..runs import job, keys, plan
from ..runs.store import DamagedError
from . import load_study


def run(study: Study, folder: Path, output: Path) -> None:
    """Write the dataset and the summary of a study from its stored results."""
    try:
        groups = groups_of_study(study, folder)
        dataset.write(output, groups, keys.origin(study))
    except (DamagedError, OSError) as error:
        if isinstance(error, DamagedError):
            job.forget_job_of(error.path, folder)
        raise SystemExit(str(error)) from None
    write_text(output.with_name(plan.SUMMARY), summary.text(groups, study.title))


def main(config: str, folder: str, output: str, record: str, digest: str) -> None:
    """Write the dataset of a study, and the record of the job."""
    study = load_study(config)
    if plan.collect_digest(study, plan.stage_jobs(study, Path(folder))) != digest:
        raise SystemExit(f"{config} was changed while the study ran; call the same command again")
    run(study, Path(folder), Path(output))
    write_json(record, {"digest": digest})


def group_of(kind: StudyKind) -> dataset.Group:
    """Group that a kind without a module ``collect`` declares."""
    return dataset.Group(f"/{kind.name}", kind.variables, kind.dimensions, kind.flags)


def groups_of_study(study: Study, folder: Path) -> dict[str, xr.Dataset]:
    """Groups of the dataset of a study by name."""
    groups: dict[str, xr.Dataset] = {}
    for kind in filter(lambda kind: study.parts[kind.name], kinds()):
        if not kind.variables:
            groups |= import_name(f"studies.kinds.{kind.name}.collect").groups(study, folder)
            continue
        rows = [row for stage in kind.stages for row in plan.rows(stage, study, folder)]
        names = {name for row in rows for name in row} if kind.sparse else None
        data = group_of(kind).of_rows(study.axes, rows, names)
        groups[f"/{kind.name}"] = data.assign_attrs(kind.attributes(study.parts[kind.name]))
    for made in outputs().values():
        if made.collect and made.name in study.outputs:
            groups |= import_name(made.collect).groups(study, folder)
    return groups


if __name__ == "__main__":
    gc.set_threshold(100_000, 20, 100)  # looking for garbage costs a tenth of the time
    main(*sys.argv[1:])
