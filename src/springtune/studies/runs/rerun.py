"""All jobs of a study: its stages, dataset, figures, tables, pages and the paper; and why a job runs again."""

from collections.abc import Iterable
from pathlib import Path

from ..config.kind import FORMATS, VIEWS, Output, kind_files, kinds, modules, outputs
from ..config.model import Study
from .keys import stage_key
from .plan import Job, plan
from .provenance import inputs
from .source import PACKAGE, TASKS, checksum, hash_of, read_note

DATASET, SUMMARY, PAGE = "dataset.nc", "summary.txt", "index.html"
"""Files that every study has."""

COLLECT, BROWSE, PRESENT = "collect", "browse", "present"
"""Names of jobs after the stages; jobs of outputs begin with the last one."""

PAPER, PAPER_FILE = "paper", "paper.pdf"
"""The job that typesets the paper, and its product."""

PAPER_STUDIES = ("paper", "definitions", "block", "laying", "stability", "benchmark", "shapes")


STUDIES_READ: list[tuple[Study, dict[str, Job]]] = []
"""Studies that this process runs, with all their jobs: the requested one, and those that the paper reads."""


def output_jobs(study: Study) -> dict[str, list[Output]]:
    """Requested outputs of a study that have files, by the job that makes them."""
    found: dict[str, list[Output]] = {}
    for one in outputs().values():
        if one.name in study.outputs and output_files(one, study):
            found.setdefault(f"{PRESENT}_{one.job}", []).append(one)
    return found


def output_files(output: Output, study: Study) -> list[str]:
    """Files of an output; for the page, all tables as CSV and the page itself."""
    figures = [f"figures/{stem}.{ending}" for stem in output.figures(study) for ending in FORMATS]
    names = [*output.tables(study)]
    if output.page:
        names = [*(f"{stem}.csv" for kind in kinds() if kind.tables for stem in kind.tables(study)), "index.html"]
    return figures + [f"{output.into}/{name}" for name in names]


def linked_files(study: Study) -> list[str]:
    """Files that the page to browse links to, relative to the study's folder."""
    made = (path for members in output_jobs(study).values() for one in members for path in output_files(one, study))
    return [path for path in made if Path(path).suffix in (f".{FORMATS[0]}", ".html")]


def jobs(study: Study, folder: Path) -> dict[str, Job]:
    """All jobs of a study by name."""
    found, read = plan(study, folder), (str(folder / DATASET),)
    made = [(COLLECT, collect_digest(study, found), [DATASET, SUMMARY])]
    for name, members in output_jobs(study).items():
        files = [file for one in members for file in output_files(one, study)]
        made.append((name, _present_digest(members, files), files))
    made.append((BROWSE, _browse_digest(study), [PAGE]))
    for name, digest, files in made:
        products = tuple(str(folder / file) for file in files)
        found[name] = Job(folder, name, digest, products, () if name == COLLECT else read)
    return found


def collect_digest(study: Study, jobs: dict[str, Job]) -> str:
    """Digest of a study's dataset: of the study's files, the results of its stages and the code."""
    code = [stage_key(name) for name in ("studies.kinds.collect", *modules("kind", "collect"))]
    code += [stage_key(made.collect) for made in outputs().values() if made.collect and made.name in study.outputs]
    results = sorted({result for job in jobs.values() for result in job.results})  # in any bundles
    return hash_of(study.name, inputs(study), results, code)


def _present_digest(members: Iterable[Output], files: list[str]) -> str:
    used = ["studies.output.present", *modules("outputs")]
    templates = []
    for one in members:
        used += filter(None, (name.partition(":")[0] for name in (one.module, one.write)))
        if one.page:
            used += modules("tables")
            templates.append(checksum(PACKAGE / "studies/output/page.html"))
    return hash_of(files, [stage_key(name) for name in dict.fromkeys(used)], templates)


def _browse_digest(study: Study) -> str:
    files = [*sorted((PACKAGE / "studies/output/assets").iterdir()), *kind_files(VIEWS)]
    assets = [(path.name, checksum(path)) for path in files]
    return hash_of(linked_files(study), stage_key("studies.output.browse"), assets)


def paper_job(source: Path, datasets: Iterable[Path], folder: Path) -> Job:
    """The job that typesets the paper."""
    texts = {path.name: checksum(path) for path in sorted(source.iterdir()) if path.is_file()}
    examples = sorted((source.resolve().parents[1] / "examples").glob("*.py"))
    texts |= {f"examples/{path.name}": checksum(path) for path in examples}
    used = ["studies.paper.build", *(one.module for one in outputs().values() if one.module)]
    digest = hash_of(texts, [stage_key(name) for name in dict.fromkeys(used)])
    return Job(folder, PAPER, digest, (str(folder / PAPER_FILE),), tuple(map(str, datasets)))


MISSING = " is missing"


def rerun_reason(job: Job) -> str:
    """Return why a job must run, or an empty string; jobs before it count only by their products."""
    if not job.record.exists():
        return "not done yet"
    if read_note(job.record).get("digest") != job.digest:
        return "its parameters, code or packages changed"
    for product in job.products:
        if not Path(product).exists():
            return f"{product}{MISSING}"
    made = job.record.stat().st_mtime_ns
    newer = (path for path in map(Path, job.reads) if path.exists() and path.stat().st_mtime_ns > made)
    return next((f"{path} is newer" for path in newer), "")


def is_missing(why: str) -> bool:
    """Return whether a reason is a missing file."""
    return why.endswith(MISSING)


def outdated(study: Study, folder: Path) -> dict[Path, str] | None:
    """Return the records of done jobs that must run again, with the reasons; None if a job was never done."""
    if not (folder / TASKS).exists():  # never run: planning 10,000 scenes takes a second
        return None
    faults = {job.record: why for job in jobs(study, folder).values() if (why := rerun_reason(job))}
    known = {record: why for record, why in faults.items() if record.exists()}
    return known if len(known) == len(faults) else known or None
