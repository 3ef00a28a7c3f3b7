"""Attributes of a dataset's root that state its origin."""

import hashlib
import json
import platform
import subprocess
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from springtune import __version__
from springtune.mesh.types import MESH_TYPES
from springtune.problem.loads import LOADS
from springtune.registry import Extended
from springtune.springs.base import DEFINITIONS

from ..config.kind import kinds
from ..config.model import Study
from .keys import installed
from .source import COMMIT_FILE, PACKAGE, checksum, clone

SOFTWARE = (
    "cvxopt",
    "h5netcdf",
    "h5py",
    "meshio",
    "netgen-mesher",
    "numba",
    "numpy",
    "pyamg",
    "scikit-fem",
    "scipy",
    "snakemake",
    "xarray",
)

LOCK = Path("requirements/run.txt")
"""Lock file, beside the study or above it."""

CHANGED = "+changes"
"""Ending of `git_commit` if files differ from the commit."""

PRINTED = {"paper_tables.csv": "the paper Mass-Spring Parameters Definition in 2D for Simulation"}
"""Sources of printed values by file name."""


def attributes(study: Study, config: str | Path, package: Path = PACKAGE) -> dict[str, str]:
    """Attributes of the root of a study's dataset."""
    created = datetime.now(UTC).isoformat(timespec="seconds")
    software = {name: installed(name) for name in (*SOFTWARE, *_plugins(study))}
    software["python"] = platform.python_version()
    folder = Path(config).resolve().parent
    library, own = library_commit(package), study_commit(folder, package)
    found = {
        "title": study.title,
        "Conventions": "CF-1.11",
        "history": f"{created} springtune {__version__}: collected from the results of the study {study.name}",
        "source": f"springtune {__version__}: mass-spring networks, and finite elements as their references",
        "study": study.name,
        "config": study.text,
        "config_sha256": hashlib.sha256(study.text.encode()).hexdigest(),
        "inputs": json.dumps(inputs(study, folder), sort_keys=True),
        "springtune_version": __version__,
        "git_commit": library,
        "created": created,
        "software": json.dumps(software, sort_keys=True),
    }
    if study.printed_path:
        name = study.printed_path.name
        found["references"] = f"paper_*: as printed in {PRINTED.get(name, name)}"
    found |= {"plane_strain": ", ".join(study.plane_strain)} if study.plane_strain else {}
    return found | ({"study_commit": own} if own else {})


def _plugins(study: Study) -> set[str]:
    """Distributions of the definitions, mesh types and loads of other packages that a study uses."""
    used = {label for labels in study.axes.values() for label in labels}
    tables: tuple[Extended[Any], ...] = (DEFINITIONS, MESH_TYPES, LOADS)
    return {package for table in tables for name, package in table.packages.items() if name in used}


def inputs(study: Study, folder: Path) -> dict[str, str]:
    """SHA-256 of each input file, lock file included."""
    root = _checkout(folder)
    files = input_files(study) | ({root / LOCK} if root else set())
    return {_name(file.resolve(), root or folder): checksum(file) for file in sorted(files)}


def _checkout(folder: Path) -> Path | None:
    """Checkout that contains a folder."""
    return next((above for above in (folder, *folder.parents) if (above / LOCK).is_file()), None)


def input_files(study: Study) -> set[Path]:
    """The study's file and all files that it names."""
    return {study.path, *study.files, *(file for kind in kinds() for file in kind.files(study.parts[kind.name]))}


def _name(file: Path, root: Path) -> str:
    """File name without parts that depend on the machine."""
    return file.relative_to(root).as_posix() if file.is_relative_to(root) else f"{file.parent.name}/{file.name}"


def git_commit(folder: Path) -> str:
    """Commit of the checkout, with `CHANGED` if files differ; empty outside of git."""
    return git(folder, "describe", "--always", "--abbrev=40", f"--dirty={CHANGED}", "--exclude=*").strip()


def library_commit(package: Path = PACKAGE) -> str:
    """Commit of the library: the noted one of a built package, or that of its clone; empty if unknown."""
    noted, root = package / COMMIT_FILE, clone(package)
    if noted.is_file():
        return noted.read_text().strip()
    return git_commit(root) if root else ""


def study_commit(folder: Path, package: Path) -> str:
    """Commit of the checkout of a study; empty outside of git and for studies of the library."""
    top, root = git(folder, "rev-parse", "--show-toplevel").removesuffix("\n"), clone(package)
    of_library = folder.is_relative_to(package.resolve()) or (root and root.resolve() == Path(top))
    return git_commit(folder) if top and not of_library else ""


def git(folder: Path, *arguments: str) -> str:
    """Output of a git command, empty if it fails; bytes other than UTF-8 are escaped."""
    try:
        answer = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return answer.stdout.decode(errors="surrogateescape")
