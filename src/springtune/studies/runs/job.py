"""A job of a stage, ``python -m springtune.studies.runs.job TASKS RECORD DIGEST STUDY``."""

import os
import sys
import warnings
from pathlib import Path
from typing import Any

from springtune.problem.shapes import AssumptionWarning
from springtune.safe_io import write_json

from .attempts import do_in_worker
from .source import PACKAGE, RECORDS, STATE, TASKS, hash_of, read_note, source_state
from .store import DamagedError


def main(tasks: str, record: str, digest: str, study: str) -> None:
    """Do the job of a note, and write its record."""
    warnings.simplefilter("ignore", AssumptionWarning)  # reading the study has warned
    if not (note := _note(tasks, digest)):
        from ..config.expand import load
        from ..config.model import kinds  # here: a run has written the notes of all jobs
        from .plan import stage_jobs

        for job in stage_jobs(load(study, kinds()), Path(tasks).parents[1]).values():
            job.write()
        note = _note(tasks, digest)
    if not note:
        raise SystemExit(f"{study} was changed while it ran; call the same command again")
    if os.environ.get(STATE, source_state()) != source_state():
        raise SystemExit(f"{PACKAGE} was edited while the study ran; call the same command again")
    try:
        computed = do_in_worker(note["module"], note["content"])
    except DamagedError as error:
        forget_job_of(error.path, Path(tasks).parents[1])
        raise SystemExit(str(error)) from None
    write_json(record, {"digest": digest, "computed": computed})


def _note(tasks: str, digest: str) -> dict[str, Any]:
    """Note of a job, empty if it is of another one or damaged."""
    note = read_note(Path(tasks))
    whole = hash_of(note.get("module"), note.get("content")) == note.get("checksum")
    return note if whole and note["digest"] == digest else {}


def forget_job_of(product: Path, folder: Path) -> None:
    """Remove the record of the job that makes a file, so that the next run does this job again."""
    for path in (folder / TASKS).glob("*_*.json"):
        if str(product) in read_note(path).get("products", ()):
            (folder / RECORDS / path.name).unlink(missing_ok=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
