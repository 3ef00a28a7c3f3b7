"""Attributes of a dataset's root that state its origin."""

import hashlib
import json
import platform
import subprocess
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from springtune import __version__
from springtune.mesh.cells import MESH_TYPES
from springtune.problem.loads import LOADS
from springtune.registry import ExtensibleMapping
from springtune.springs.base import DEFINITIONS

from ..config.kind import kinds
from ..config.model import Study
from .keys import version_of
from .source import COMMIT_FILE, PACKAGE, checksum, clone

SOFTWARE = ("cvxopt h5netcdf h5py meshio netgen-mesher numba numpy scikit-fem scipy snakemake xarray").split()
"""Distributions whose versions a dataset holds."""

CHANGED = "+changes"
"""Ending of `git_commit` if files differ from the commit."""

PRINTED = {"paper_tables.csv": "the paper Mass-Spring Parameters Definition in 2D for Simulation"}
"""Sources of printed values by file name."""


def attributes(study: Study, package: Path = PACKAGE) -> dict[str, str]:
    """Attributes of the root of a study's dataset."""
    created = datetime.now(UTC).isoformat(timespec="seconds")
    software = {name: version_of(name) for name in (*SOFTWARE, *_plugins(study))}
    software["python"] = platform.python_version()
    found = {
        "title": study.title,
        "Conventions": "CF-1.11",
        "history": f"{created} springtune {__version__}: collected from the results of the study {study.name}",
        "source": f"springtune {__version__}: mass-spring networks, and finite elements as their references",
        "study": study.name,
        "config": study.text,
        "config_sha256": hashlib.sha256(study.text.encode()).hexdigest(),
        "inputs": json.dumps(inputs(study), sort_keys=True),
        "springtune_version": __version__,
        "git_commit": library_commit(package),
        "created": created,
        "software": json.dumps(software, sort_keys=True),
    }
    if study.printed_path:
        name = study.printed_path.name
        found["references"] = f"paper_*: as printed in {PRINTED.get(name, name)}"
    found |= {f"figure_{name}": str(value) for name, value in study.style.items()}
    return found | ({"plane_strain": ", ".join(study.plane_strain)} if study.plane_strain else {})


def _plugins(study: Study) -> set[str]:
    """Distributions of the definitions, mesh types and loads of other packages that a study uses."""
    used = {label for labels in study.axes.values() for label in labels}
    tables: tuple[ExtensibleMapping[Any], ...] = (DEFINITIONS, MESH_TYPES, LOADS)
    return {package for table in tables for name, package in table.packages.items() if name in used}


def inputs(study: Study) -> dict[str, str]:
    """SHA-256 of each input file, by its path in the study's folder; of others only the last folder is named."""
    folder, found = study.path.parent.resolve(), {}
    for file in map(Path.resolve, input_files(study)):
        inside = file.is_relative_to(folder)
        found[file.relative_to(folder).as_posix() if inside else f"{file.parent.name}/{file.name}"] = checksum(file)
    return found


def input_files(study: Study) -> list[Path]:
    """The study's file and all files that it names."""
    further = (file for kind in kinds() for file in kind.files(study.parts[kind.name]))
    return sorted({study.path, *study.files, *further})


def library_commit(package: Path = PACKAGE) -> str:
    """Commit of the library, empty if unknown; it ends with `CHANGED` if files of the clone differ."""
    noted, root = package / COMMIT_FILE, clone(package)
    if noted.is_file() or root is None:
        return noted.read_text().strip() if noted.is_file() else ""
    command = ["git", "describe", "--always", "--abbrev=40", f"--dirty={CHANGED}", "--exclude=*"]
    try:
        return subprocess.run(command, cwd=root, capture_output=True, check=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
