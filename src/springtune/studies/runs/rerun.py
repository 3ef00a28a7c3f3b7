"""Find the jobs that a run has to do: those never done, with another request, or with missing products.

Jobs of stages come from `springtune.studies.runs.plan`; the jobs after them are defined here.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..config.kind import FORMATS, modules, outputs
from .job import RECORDS, TASKS
from .keys import stage_key
from .plan import Plan, plan, table_files
from .provenance import inputs
from .source import PACKAGE, checksum, hash_of, read_note
from .workload import results_of

if TYPE_CHECKING:
    from ..config.kind import Output
    from ..config.model import Study

DATASET, SUMMARY, PAGE = "dataset.nc", "summary.txt", "index.html"
"""Files that every study has."""

COLLECT, BROWSE, PRESENT = "collect", "browse", "present"
"""Names of jobs after the stages; jobs of outputs begin with the last one."""

PAPER, PAPER_FILE = "paper", "paper.pdf"
"""The job that typesets the paper, and its product."""

PAPER_STUDIES = ("paper", "definitions", "block", "laying", "stability", "benchmark", "shapes")


@dataclass(frozen=True)
class Job:
    """A job of a run.

    `digest` is a hash of all that it depends on, without products of other jobs. It reads the first product of the job
    `reads`, if any, and `inputs`, which several jobs make.
    """

    name: str
    digest: str
    products: tuple[str, ...]
    record: Path
    reads: str = ""
    inputs: tuple[str, ...] = ()


def output_jobs(study: "Study") -> "dict[str, list[Output]]":
    """Requested outputs of a study that have files, by the job that makes them."""
    found: dict[str, list[Output]] = {}
    for one in outputs().values():
        if one.name in study.outputs and output_files(one, study):
            found.setdefault(f"{PRESENT}_{one.job or one.name}", []).append(one)
    return found


def output_files(output: "Output", study: "Study") -> list[str]:
    """Files of an output."""
    figures = [f"figures/{stem}.{ending}" for stem in output.figures(study) for ending in FORMATS]
    return figures + [f"{output.into}/{name}" for name in table_files(output, study)]


def linked(study: "Study") -> list[str]:
    """Files that the page to browse links to, relative to the study's folder."""
    made = (path for members in output_jobs(study).values() for one in members for path in output_files(one, study))
    return [path for path in made if Path(path).suffix in (f".{FORMATS[0]}", ".html")]


def jobs(study: "Study", plan: Plan) -> dict[str, Job]:
    """All jobs of a study."""
    folder = plan.folder
    found = [Job(one.name, one.digest, one.products, plan.record(one.name)) for one in plan.jobs.values()]
    made = [(COLLECT, _collect_digest(study, plan), [DATASET, SUMMARY], "")]
    for name, members in output_jobs(study).items():
        files = [file for one in members for file in output_files(one, study)]
        made.append((name, _present_digest(members, files), files, COLLECT))
    made.append((BROWSE, _browse_digest(study), [PAGE], COLLECT))
    for name, digest, files, reads in made:
        paths = tuple(str(folder / file) for file in files)
        found.append(Job(name, digest, paths, plan.record(name), reads))
    return {job.name: job for job in found}


def _collect_digest(study: "Study", plan: Plan) -> str:
    """Digest of a study's dataset: of the study's files, the jobs of its stages and the code."""
    code = [stage_key(name) for name in ("studies.kinds.collect", *modules("kind", "collect"))]
    code += [stage_key(made.collect) for made in outputs().values() if made.collect and made.name in study.outputs]
    # Whatever bundles they are in.
    results = sorted(set(results_of([job.content for job in plan.jobs.values()])))
    return hash_of(study.name, inputs(study, study.path.resolve().parent), results, code)


def _present_digest(members: "Iterable[Output]", files: list[str]) -> str:
    used = ["studies.output.present", *modules("outputs")]
    templates = []
    for one in members:
        used += filter(None, (name.partition(":")[0] for name in (one.module, one.write, *one.texts.values())))
        if one.page:
            used += ["studies.output.page", *modules("tables")]
            templates.append(checksum(PACKAGE / "studies/output/page.html"))
    return hash_of(files, [stage_key(name) for name in dict.fromkeys(used)], templates)


def _browse_digest(study: "Study") -> str:
    assets = {path.name: checksum(path) for path in sorted((PACKAGE / "studies/output/browse/assets").iterdir())}
    return hash_of(
        linked(study), [stage_key(name) for name in ("studies.output.browse.page", *modules("outputs"))], assets
    )


def paper_job(source: Path, datasets: "Iterable[Path]", folder: Path) -> Job:
    """The job that typesets the paper."""
    texts = {path.name: checksum(path) for path in sorted(source.iterdir()) if path.is_file()}
    examples = sorted((source.resolve().parents[1] / "examples").glob("*.py"))
    texts |= {f"examples/{path.name}": checksum(path) for path in examples}
    used = ["studies.paper.build", *(one.module for one in outputs().values() if one.module)]
    digest = hash_of(texts, [stage_key(name) for name in dict.fromkeys(used)])
    record = folder / RECORDS / f"{PAPER}.json"
    return Job(PAPER, digest, (str(folder / PAPER_FILE),), record, inputs=tuple(map(str, datasets)))


def fault(job: Job, found: dict[str, Job]) -> str:
    """Return why a job must run, or an empty string; jobs before it count only by their products."""
    if not job.record.exists():
        return "not done yet"
    if read_note(job.record).get("digest") != job.digest:
        return "something else is asked for"
    for product in job.products:
        if not Path(product).exists():
            return f"{product}{MISSING}"
    read = [*(found[job.reads].products[:1] if job.reads else ()), *job.inputs]
    made = job.record.stat().st_mtime_ns
    newer = (path for path in map(Path, read) if path.exists() and path.stat().st_mtime_ns > made)
    return next((f"{path} is newer" for path in newer), "")


MISSING = " is missing"


def is_missing(why: str) -> bool:
    """Return whether a reason is a missing file, which a user should know."""
    return why.endswith(MISSING)


def outdated(study: "Study", folder: Path, cluster: bool = False) -> dict[Path, str] | None:
    """Return the records of done jobs that must run again, with the reasons; None if a job was never done.

    Snakemake does not find all of these: it compares parameters with its own notes, and knows no stored results.
    """
    if not (folder / TASKS).exists():  # never run: planning 10,000 scenes takes a second
        return None
    found = jobs(study, plan(study, folder, cluster=cluster))
    faults = {job.record: why for job in found.values() if (why := fault(job, found))}
    known = {record: why for record, why in faults.items() if record.exists()}
    return known if len(known) == len(faults) else known or None
