"""Write an archive of a finished study: all that another machine needs to check it and to compute it again.

It is a zip file:


    ro-crate-metadata.json, README.md, SHA256SUMS
    code/               package, rules, lock files and what builds them, as in the checkout; the study
    code.diff           what of package, rules and study differs from the commit
    inputs/             the study and its files, where they are outside of the checkout
    results/<study>/    dataset, page, figures, tables, summary; what each job made, and how long it took

and an RO-Crate 1.1, profile Provenance Run Crate.

The main entity is the Snakefile; each rule is a step, each job an action. Unknown values are left out, and only people
in CITATION.cff are named.
"""

import json
import os
import shutil
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Mapping
from datetime import UTC, datetime
from io import BytesIO
from mimetypes import MimeTypes
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from springtune.safe_io import atomic

from ..runs import checked_json, records, rerun
from .contents import (
    CITATION,
    CODE,
    DIFF,
    INPUTS,
    LOCK_FILES,
    METADATA,
    MOST_FILES,
    MOST_TEXT,
    README,
    SUMS,
    ArchiveError,
    gather,
    of_text,
    several,
)

if TYPE_CHECKING:
    from rocrate.model import Entity
    from rocrate.rocrate import ROCrate

    from ..config.model import Study
    from .contents import Contents, Packed

TERMS = "https://w3id.org/ro/terms/workflow-run#"
"""Namespace of terms that RO-Crate 1.1 lacks."""

PROFILES = {
    "https://w3id.org/ro/wfrun/process/0.5": ("Process Run Crate", "0.5"),
    "https://w3id.org/ro/wfrun/workflow/0.5": ("Workflow Run Crate", "0.5"),
    "https://w3id.org/ro/wfrun/provenance/0.5": ("Provenance Run Crate", "0.5"),
    "https://w3id.org/workflowhub/workflow-ro-crate/1.0": ("Workflow RO-Crate", "1.0"),
}

WORKFLOW_PROFILE = "https://bioschemas.org/profiles/ComputationalWorkflow/1.0-RELEASE"
PARAMETER_PROFILE = "https://bioschemas.org/profiles/FormalParameter/1.0-RELEASE"
"""Profiles of the workflow's parameters."""

DONE = "http://schema.org/CompletedActionStatus"

MEDIA = {
    ".cff": "application/yaml",
    ".js": "text/javascript",
    ".md": "text/markdown",
    ".toml": "application/toml",
    ".vtu": "application/xml",
    ".pvd": "application/xml",
    ".yaml": "application/yaml",
}
"""Media types by file ending that some versions of Python lack."""

OF_PYTHON = MimeTypes()
"""Python's own media types, without those of this machine."""

TEXT, BYTES = "text/plain", "application/octet-stream"
"""Media types of other files."""

USED = {"s": ("wall time", "SEC"), "cpu_time": ("time of processors", "SEC"), "max_rss": ("most memory", "E63")}
"""Reported columns of Snakemake's benchmarks: name and UN/CEFACT unit code."""


class CitationError(ValueError):
    """CITATION.cff lacks what an archive states."""


def citation(path: Path) -> dict[str, Any]:
    """Read authors, licence and keywords of a citation file."""
    import yaml

    try:
        found = yaml.safe_load(path.read_text())
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise CitationError(f"{path}: cannot be read: {' '.join(str(error).split())}") from None
    for key, example in (("authors", "[{family-names: ..., given-names: ...}]"), ("license", "MIT")):
        if not isinstance(found, dict) or not found.get(key):
            raise CitationError(f"{path}: has no '{key}', which an archive states; add it: {key}: {example}")
    nameless = [one for one in found["authors"] if not (isinstance(one, dict) and _name(one))]
    if nameless:
        raise CitationError(f"{path}: authors: {nameless[0]} has no name; give family-names and given-names, or name")
    return dict(found)


def _name(one: dict[str, Any]) -> str:
    """Name of a person or an organization."""
    parts = [one.get(key) for key in ("given-names", "name-particle", "family-names", "name-suffix")]
    return str(one.get("name") or " ".join(str(part) for part in parts if part))


def metadata(found: "Contents", cited: dict[str, Any]) -> str:
    """Text of ``ro-crate-metadata.json``."""
    made = _Crate(found, cited).crate.metadata.generate()
    first = {METADATA: 0, "./": 1}
    made["@graph"].sort(key=lambda one: (first.get(one["@id"], 2), one["@id"]))
    made["@graph"] = [{key: _single(value) for key, value in one.items()} for one in made["@graph"]]
    return json.dumps(made, indent=1, sort_keys=True, ensure_ascii=False) + "\n"


def _single(value: Any) -> Any:
    """Return the element of a list of one, as in compact JSON-LD."""
    return value[0] if isinstance(value, list) and len(value) == 1 else value


class _Crate:
    crate: "ROCrate"

    def __init__(self, found: "Contents", cited: dict[str, Any]) -> None:
        from rocrate.rocrate import ROCrate

        self.found, self.cited, self.version = found, cited, found.attributes["springtune_version"]
        self.crate = ROCrate(version="1.1")
        self.crate.metadata.extra_terms = {name: TERMS + name for name in ("sha256", "resourceUsage", "environment")}
        self.rules = self._rules()
        self.modules = {
            module: f"{CODE}/src/springtune/{module.replace('.', '/')}.py" for _, module, _ in self.rules.values()
        }
        self.files = {name: self._file(name) for name in found.files}
        self._about()
        self._workflow()
        self._run()

    def _add(self, name: str, kind: str, /, **properties: Any) -> "Entity":
        """Add an entity other than a file; properties of None are left out."""
        from rocrate.model import ContextEntity

        given = {key: value for key, value in properties.items() if value is not None}
        return self.crate.add(ContextEntity(self.crate, name, properties={"@type": kind} | given))

    # -- files ---------------------------------------------------------------------------------------------------------

    def _file(self, name: str) -> "Entity":
        one, path = self.found.files[name], PurePosixPath(name)
        other = BYTES if name in self.found.inputs else TEXT
        properties: dict[str, Any] = {"name": path.name, "sha256": one.sha256, "contentSize": str(one.size)}
        known, _ = OF_PYTHON.guess_type(name)
        properties["encodingFormat"] = MEDIA.get(path.suffix, known or other)
        if name == f"{CODE}/Snakefile":
            properties |= {"@type": ["File", "SoftwareSourceCode", "ComputationalWorkflow", "HowTo"]}
            properties |= {"name": "springtune: parameter studies of mass-spring models", "version": self.version}
            properties |= self._page()
            version = self.found.software.get("snakemake")
            return self.crate.add_workflow(
                dest_path=name, main=True, lang="snakemake", lang_version=version, properties=properties
            )
        modules = [module for module, file in self.modules.items() if file == name]
        if modules:
            properties |= {"@type": ["File", "SoftwareSourceCode"], "version": self.version} | self._page()
            properties |= {"name": f"springtune.{modules[0]}", "description": "what jobs of a rule run"}
        return self.crate.add_file(dest_path=name, properties=properties)

    def _page(self) -> dict[str, Any]:
        """The program's web page, if CITATION.cff has one."""
        place = self.cited.get("repository-code") or self.cited.get("url")
        return {"url": str(place)} if place else {}

    def _described(self) -> dict[str, str]:
        """Descriptions of files."""
        found = self.found
        told = {
            README: "what is in this archive, how to check it and to compute it again",
            **dict.fromkeys(found.inputs, "a file that the study names"),
            found.config: "the study",
            found.dataset: "the dataset: NetCDF-4, every parameter a dimension",
            f"{found.folder}/{rerun.PAGE}": "a page to browse the dataset, which needs no network",
            f"{found.folder}/{rerun.SUMMARY}": "what is solved, what is not and why",
            f"{CODE}/{LOCK_FILES[0]}": "versions and hashes of all packages",
            f"{CODE}/{LOCK_FILES[1]}": "version and hashes of the package that factorizes by CHOLMOD",
        }
        original = found.files[found.dataset].original
        if original != found.files[found.dataset].sha256:
            blank = " and ".join(repr(name) for name in sorted({"host", *found.untold}))
            told[found.dataset] += f"; {blank} of its attributes are blanked, before which its SHA-256 was {original}"
        if DIFF in found.files:
            told[DIFF] = f"what of package, rules and study differs in {CODE}/ from commit {found.code.commit}"
        return told

    def _about(self) -> None:
        """Add the root entity."""
        root, found = self.crate.root_dataset, self.found
        commit = f"commit {found.code.commit}" if found.code.commit else "from no git checkout"
        commit += ", changed" if found.code.changed else ""
        root["name"], root["version"] = found.study.title, self.version
        root["description"] = (
            f"The study '{found.study.name}' as computed by springtune {self.version} ({commit}): its file, the "
            "program with the versions of all packages, the dataset with figures and tables, and what each job took. "
            f"The dataset can be computed again from it: {README} says how."
        )
        if found.code.new:
            root["description"] += f" Files that git does not know: {', '.join(found.code.new)}."
        root["datePublished"] = found.attributes["created"]
        if self.cited.get("keywords"):
            root["keywords"] = [str(word) for word in self.cited["keywords"]]
        root["author"] = [self._author(number, one) for number, one in enumerate(self.cited["authors"], 1)]
        root["license"] = [self._licence(str(name)) for name in several(self.cited["license"])]
        root["conformsTo"] = [
            self._add(name, "CreativeWork", name=title, version=number) for name, (title, number) in PROFILES.items()
        ]
        for name, text in self._described().items():
            self.files[name]["description"] = text
        self.files[README]["about"] = root
        self._sort_into_folders()

    def _sort_into_folders(self) -> None:
        results = f"{self.found.folder}/"
        told = {
            f"{CODE}/": "the program: package, rules and lock files of springtune, and the study",
            f"{INPUTS}/": "the study and the files that it names",
            results: "dataset, page, figures, tables; done/ has what each job made, benchmarks/ what it took",
        }
        held: dict[str, list[Entity]] = {}
        for name, file in self.files.items():
            top = results if name.startswith(results) else name[: name.find("/") + 1]
            held.setdefault(top, []).append(file)
        parts = held.pop("", [])
        for top, files in sorted(held.items()):
            about = {"name": top, "description": told.get(top, "files that the study names")}
            folder = self.crate.add_dataset(dest_path=top, properties=about)
            folder["hasPart"] = files
            parts.append(folder)
        self.crate.root_dataset["hasPart"] = [*parts, self.files[f"{CODE}/Snakefile"]]

    def _author(self, number: int, one: dict[str, Any]) -> "Entity":
        place = one.get("orcid") or one.get("website") or f"#author-{number}"
        if "name" in one:
            return self._add(place, "Organization", name=_name(one), url=one.get("website"))
        home = one.get("affiliation")
        return self._add(
            place,
            "Person",
            name=_name(one),
            givenName=one.get("given-names"),
            familyName=one.get("family-names"),
            affiliation=self._add(f"#affiliation-{number}", "Organization", name=home) if home else None,
        )

    def _licence(self, name: str) -> "Entity":
        told = f"licence of the program and of what it made, see {CODE}/LICENSE"
        place = f"https://spdx.org/licenses/{name}"
        return self._add(place, "CreativeWork", name=name, identifier=place, description=told)

    # -- the workflow and its run --------------------------------------------------------------------------------------

    def _rules(self) -> dict[str, tuple[str, str, list[str]]]:
        """Description, module and jobs of each rule, in the order of a run."""
        found = self.found
        made: dict[str, tuple[str, str, list[str]]] = {}
        for name, job in found.plan.jobs.items():
            made.setdefault(job.stage.name, (job.stage.message, job.stage.module, []))[2].append(name)
        drawn = ("Drawing figures and writing tables", "studies.output.present")
        after = {
            rerun.COLLECT: ("Comparing with the references, and collecting the dataset", "studies.kinds.collect"),
            rerun.BROWSE: ("Writing the page to browse", "studies.output.browse.page"),
        }
        for name in found.jobs:
            if name not in found.plan.jobs:
                made[name] = (*after.get(name, drawn), [name])
        return made

    def _workflow(self) -> None:
        """Add the Snakefile with its inputs and outputs."""
        workflow, found = self.files[f"{CODE}/Snakefile"], self.found
        root = self.crate.root_dataset
        workflow["conformsTo"] = {"@id": WORKFLOW_PROFILE}
        workflow["license"], workflow["creator"] = root["license"], root["author"]
        for key, name, file, told in (
            ("input", "study", found.config, "the study's file, --configfile of Snakemake"),
            ("output", "dataset", found.dataset, "the dataset of the study"),
        ):
            parameter = self._add(
                f"#{name}",
                "FormalParameter",
                name=name,
                additionalType="File",
                encodingFormat=self.files[file]["encodingFormat"],
                description=told,
                workExample=self.files[file],
                conformsTo={"@id": PARAMETER_PROFILE},
            )
            workflow[key] = self.files[file]["exampleOfWork"] = parameter

    def _run(self) -> None:
        """Add the run: software, machine and one action for each job."""
        found, files, workflow = self.found, self.files, self.files[f"{CODE}/Snakefile"]
        software = {
            name: self._software(name, version) for name, version in sorted(found.software.items()) if version != "none"
        }
        workflow["softwareRequirements"] = list(software.values())
        workflow["hasPart"] = [files[name] for name in self.modules.values()]
        steps, controls, jobs = [], [], []
        for position, (rule, (message, module, names)) in enumerate(self.rules.items(), 1):
            tool = files[self.modules[module]]
            tool["programmingLanguage"] = software["python"]
            about = {"name": rule, "description": message}
            steps.append(self._add(f"#step-{rule}", "HowToStep", **about, position=str(position), workExample=tool))
            actions = [self._job(name, tool, message) for name in names]
            jobs += actions
            about = {"name": f"Jobs of the rule {rule}", "description": message}
            control = self._add(f"#control-{rule}", "ControlAction", **about, instrument=steps[-1], object=actions)
            controls.append(control)
        workflow["step"] = steps
        notes = tuple(f"{found.folder}/{name}/" for name in ("done", "benchmarks", "tasks"))
        machine = [
            self._add(f"#machine-{name}", "PropertyValue", name=name, value=value)
            for name, value in found.machine.items()
        ]
        run = self._add(
            "#run",
            "CreateAction",
            name=f"Run of the study '{found.study.name}'",
            description="all jobs that were to do, whose results were stored and reused where nothing had changed",
            instrument=workflow,
            object=[files[name] for name in (found.config, *found.inputs)],
            result=[files[name] for name in files if name.startswith(found.folder) and not name.startswith(notes)],
            endTime=max((job["endTime"] for job in jobs if "endTime" in job), default=found.attributes["created"]),
            actionStatus=DONE,
            environment=machine or None,
        )
        engine = self._add(
            "#engine",
            "OrganizeAction",
            name="Snakemake's run of its rules",
            description="which jobs ran, by which rule",
            instrument=software.get("snakemake", workflow),
            object=controls,
            result=run,
            endTime=run["endTime"],
            actionStatus=DONE,
        )
        self.crate.root_dataset["mentions"] = [run, engine, *controls, *jobs]

    def _software(self, name: str, version: str) -> "Entity":
        kind, page = ("pypi", f"https://pypi.org/project/{name}/")
        if name == "python":
            kind, page = ("generic", "https://www.python.org")
        about = {"name": name, "softwareVersion": version, "url": {"@id": page}}
        return self._add(f"pkg:{kind}/{name}@{version}", "SoftwareApplication", **about)

    def _job(self, name: str, tool: "Entity", message: str) -> "Entity":
        """Add the action of a job."""
        found, folder = self.found, self.found.plan.folder
        products = checked_json.demand(found.jobs[name].record)["products"]
        made = [f"{found.folder}/done/{name}.json"]
        made += [f"{found.folder}/{Path(path).relative_to(folder).as_posix()}" for path in products]
        written = max((state[1] for state in products.values() if state), default=0)
        used = [
            self._add(
                f"#{name}-{column}",
                "PropertyValue",
                name=USED[column][0],
                value=value,
                unitCode=USED[column][1],
                propertyID=f"https://snakemake.github.io/benchmarks#{column}",
            )
            for column, value in _benchmark(folder / f"benchmarks/{name}.tsv").items()
        ]
        return self._add(
            f"#job-{name}",
            "CreateAction",
            name=f"Job {name}",
            description=message,
            instrument=tool,
            object=self.files[found.config],
            result=[self.files[one] for one in made if one in self.files],
            endTime=datetime.fromtimestamp(written // 10**9, UTC).isoformat() if written else None,
            actionStatus=DONE,
            resourceUsage=used or None,
        )


def _benchmark(path: Path) -> dict[str, str]:
    """Snakemake's benchmark of a job, empty if missing."""
    try:
        head, row = (line.split("\t") for line in path.read_text().splitlines()[:2])
    except (OSError, ValueError):
        return {}
    cells = dict(zip(head, row))
    return {name: cells[name] for name in USED if cells.get(name, "").replace(".", "", 1).isdigit()}


# -- the zip file ------------------------------------------------------------------------------------------------------

PACKED_AT = (1980, 1, 1, 0, 0, 0)
"""Time of every archived file, zip's earliest, so that the same study gives the same bytes."""


def write(
    study: "Study",
    folder: Path,
    target: Path,
    store: bool = False,
    untracked: bool = False,
    chosen: Mapping[str, bool] | None = None,
    tell: "Callable[[Contents], None] | None" = None,
) -> str:
    """Write the archive of a study atomically."""
    try:
        atomic.check_folder(target)
    except ValueError as error:
        raise ArchiveError(str(error)) from None
    with tempfile.TemporaryDirectory() as scratch:
        found = gather(study, folder, Path(scratch), store, untracked, chosen)
        cited = citation(Path(CITATION))
        if tell:
            tell(found)
        packed = found.files | {METADATA: of_text(METADATA, metadata(found, cited))}
        sums = "".join(f"{one.sha256}  {name}\n" for name, one in sorted(packed.items()))
        packed |= {SUMS: of_text(SUMS, sums)}
        check_limits(packed)
        _zip(target, packed.values())
    return records.checksum(target)


def check_limits(packed: "Mapping[str, Packed]") -> None:
    """Refuse archives that `springtune verify` would refuse."""
    texts = max(packed[name].size for name in (METADATA, SUMS))
    if len(packed) > MOST_FILES or texts > MOST_TEXT:
        raise ArchiveError(
            f"{len(packed)} files, and an archive holds at most {MOST_FILES}, with {MOST_TEXT} bytes of metadata; "
            "leave out --with-store, or archive parts of the study"
        )


def _zip(target: Path, packed: "Iterable[Packed]") -> None:
    """Write a zip file without time and place of writing."""
    with (
        atomic.replacing(target, synced=True) as unfinished,
        zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive,
    ):
        for one in sorted(packed, key=lambda one: (one.name != METADATA, one.name)):
            info = zipfile.ZipInfo(one.name, PACKED_AT)
            info.compress_type, info.create_system = zipfile.ZIP_DEFLATED, 3  # Unix, whatever this system is
            runs = isinstance(one.source, Path) and os.access(one.source, os.X_OK)
            info.external_attr = (0o100755 if runs else 0o100644) << 16
            info.file_size = one.size
            source = BytesIO(one.source) if isinstance(one.source, bytes) else open(one.source, "rb")  # noqa: SIM115
            with source, archive.open(info, "w", force_zip64=one.size > zipfile.ZIP64_LIMIT) as written:
                shutil.copyfileobj(source, written)
