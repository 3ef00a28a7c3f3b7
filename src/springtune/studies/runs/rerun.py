"""Find the jobs that a run has to do: those never done, with another request, or with damaged or missing products.

Jobs of stages come from `springtune.studies.runs.plan`; the jobs after them are defined here.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from springtune.safe_io.atomic import UNFINISHED

from ..config.kind import FORMATS, further_modules, kinds, modules, outputs
from . import checked_json, records
from .checked_json import ASIDE, hash_of
from .keys import CODE_FILE, OURS, stage_key
from .plan import BUNDLES_FILE, Plan, plan, stages, table_files
from .provenance import inputs
from .run_tasks import RECORDS
from .source import PACKAGE

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
    code = [stage_key(name) for name in ("studies.kinds.collect", *modules("kind", "collect"), *further_modules(study))]
    code += [stage_key(made.collect) for made in outputs().values() if made.collect and made.name in study.outputs]
    stages = [job.digest for job in plan.jobs.values()]
    return hash_of(study.name, inputs(study, study.path.resolve().parent), stages, code)


def _present_digest(members: "Iterable[Output]", files: list[str]) -> str:
    used = ["studies.output.present", *modules("outputs")]
    templates = []
    for one in members:
        used += filter(None, (name.partition(":")[0] for name in (one.plot, one.write)))
        if one.page:
            used += ["studies.output.page", *modules("kind")]
            used += [kind.place(kind.tables_by) for kind in kinds() if kind.tables]
            templates.append(records.checksum(PACKAGE / "studies/output/page.html"))
    return hash_of(files, [stage_key(name) for name in dict.fromkeys(used)], templates)


def _browse_digest(study: "Study") -> str:
    assets = {
        path.name: records.checksum(path) for path in sorted((PACKAGE / "studies/output/browse/assets").iterdir())
    }
    return hash_of(
        linked(study), [stage_key(name) for name in ("studies.output.browse.page", *modules("outputs"))], assets
    )


def paper_job(source: Path, datasets: "Iterable[Path]", folder: Path) -> Job:
    """The job that typesets the paper."""
    texts = {path.name: records.checksum(path) for path in sorted(source.iterdir()) if path.is_file()}
    examples = sorted((source.resolve().parents[1] / "examples").glob("*.py"))
    texts |= {f"examples/{path.name}": records.checksum(path) for path in examples}
    used = ["studies.paper.build", *(one.module for one in outputs().values() if one.module)]
    digest = hash_of(texts, [stage_key(name) for name in dict.fromkeys(used)])
    record = folder / RECORDS / f"{PAPER}.json"
    return Job(PAPER, digest, (str(folder / PAPER_FILE),), record, inputs=tuple(map(str, datasets)))


def fault(job: Job, found: dict[str, Job]) -> str:
    """Return why a job must run, or an empty string; jobs before it count only by their products."""
    why = records.fault(job.record, job.digest, job.products)
    if not why and job.reads and not _is_up_to_date(job, found[job.reads]):
        return f"{found[job.reads].products[0]} is another one"
    if not why and job.inputs:
        read = [records.checksum(path) if Path(path).exists() else "" for path in job.inputs]
        if checked_json.read(job.record)["read"] != read:
            return "a dataset that it reads is another one"
    return why


def outdated(study: "Study", folder: Path) -> dict[Path, str] | None:
    """Return the records of done jobs that must run again, with the reasons; None if a job was never done.

    Snakemake does not find these: it compares parameters with its own notes, and no content of products.
    """
    if not (folder / BUNDLES_FILE).exists():  # never run: planning 10,000 scenes takes a second
        return None
    OURS.recall(folder.parent / CODE_FILE)
    found = jobs(study, plan(study, folder))
    faults = {job.record: why for job in found.values() if (why := fault(job, found))}
    known = {record: why for record, why in faults.items() if record.exists()}
    return known if len(known) == len(faults) else known or None


def _is_up_to_date(job: Job, before: Job) -> bool:
    """Return whether the recorded input checksum matches the predecessor's product, or that job must run itself."""
    read, made = checked_json.read(job.record), checked_json.read(before.record, products=dict)
    product = made and made["products"].get(before.products[0])
    return not product or read["read"] == product[2]


def is_damage(why: str) -> bool:
    """Return whether a reason is a damaged or missing file, which a user should know."""
    return why.endswith((records.DAMAGED, records.MISSING))


# -- files that no job of a study makes any more -----------------------------------------------------------------------

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
    from springtune.handover.paraview import pieces_of  # here: few commands need it

    planned = plan(study, folder, 1)
    found = jobs(study, planned)
    products = [Path(path) for job in found.values() for path in job.products]
    kept = {folder / BUNDLES_FILE, *products}
    kept |= {piece for path in products if path.suffix == COLLECTED for piece in pieces_of(path)}
    kept |= {folder / name / f"{job}{ending}" for name, ending in JOB_FILES.items() for job in found}
    return sorted({*_candidates(folder)} - kept)


def _candidates(folder: Path) -> Iterator[Path]:
    """Files of the kinds that runs make, in a study's folder and those directly in it that are no links elsewhere."""
    names = tuple(f"{name}_" for name in (*(stage.name for stage in stages()), PRESENT))
    stores = {stage.folder for stage in stages()}
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
