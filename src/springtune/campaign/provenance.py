"""Where a dataset comes from: attributes of its root."""

import hashlib
import json
import platform
import subprocess
from datetime import UTC, datetime
from pathlib import Path

from .. import __version__
from ..jobs.keys import installed
from ..jobs.records import checksum
from ..kinds import kinds
from ..output.reading import CHANGED
from ..study.model import Study

SOFTWARE = (
    "cvxopt",
    "h5netcdf",
    "h5py",
    "meshio",
    "netcdf4",
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
"""Versions that a checkout installs, beside the study or above it."""

LONGEST = 40_000
"""Characters of a difference from the commit that are kept."""

PRINTED = {"paper_tables.csv": "the paper Mass-Spring Parameters Definition in 2D for Simulation"}
"""Where printed values are from, by the name of their file."""


def attributes(study: Study, config: str | Path) -> dict[str, str]:
    """Attributes of the root of a study's dataset.

    Parameters
    ----------
    study : Study
    config : str or Path
        YAML file of the study.

    Returns
    -------
    dict of str to str
    """
    created = datetime.now(UTC).isoformat(timespec="seconds")
    software = {name: installed(name) for name in SOFTWARE} | {"python": platform.python_version()}
    folder = Path(config).resolve().parent
    commit = git_commit(folder)
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
        "git_commit": commit,
        "git_diff": git_diff(folder) if commit.endswith(CHANGED) else "",
        "created": created,
        "software": json.dumps(software, sort_keys=True),
        "host": platform.node(),
    }
    return found | _references(study)


def _references(study: Study) -> dict[str, str]:
    """Where the printed values are from; nothing where the dataset has none."""
    cells = {(one.mesh.beam.name, one.mesh.mesh_type, one.material.name, one.load) for one in study.scenes}
    if not study.printed_path or not any(
        (one.beam, one.mesh_type, one.material, one.load) in cells for one in study.printed
    ):
        return {}
    name = study.printed_path.name
    return {"references": f"paper_*: as printed in {PRINTED.get(name, name)}"}


def inputs(study: Study, folder: Path) -> dict[str, str]:
    """SHA-256 of each file that a study is made from, the versions of its software included.

    Parameters
    ----------
    study : Study
    folder : Path
        Where the study's file is, absolute.

    Returns
    -------
    dict of str to str
        By the file's name: seen from the checkout, or from the study where there is none.
    """
    root = next((above for above in (folder, *folder.parents) if (above / LOCK).is_file()), None)
    files = input_files(study) | ({root / LOCK} if root else set())
    return {_name(file.resolve(), root or folder): checksum(file) for file in sorted(files)}


def input_files(study: Study) -> set[Path]:
    """The study's file, and all that it names: meshes, rows of parameters, tests, printed values.

    Parameters
    ----------
    study : Study

    Returns
    -------
    set of Path
    """
    files = {study.path, *study.test_files, *study.row_files}
    files |= {mesh.file for mesh in study.mesh_files.values() if mesh.file}
    files |= {study.printed_path} if study.printed_path else set()
    return files | {file for kind in kinds() for file in kind.files(study.parts[kind.name])}


def _name(file: Path, root: Path) -> str:
    """Name of a file without what is the machine's own."""
    return file.relative_to(root).as_posix() if file.is_relative_to(root) else f"{file.parent.name}/{file.name}"


def git_commit(folder: Path) -> str:
    """Commit of the checkout that holds a folder, with `CHANGED` where files differ from it; empty outside of git."""
    return _git(folder, "describe", "--always", "--abbrev=40", f"--dirty={CHANGED}", "--exclude=*").strip()


def git_diff(folder: Path) -> str:
    """What differs from the commit in the checkout that holds a folder; of a long one the beginning, and its SHA-256.

    Files that git does not know are not part of it.
    """
    text = _git(folder, "diff", "--no-color", "--no-ext-diff", "HEAD")
    if len(text) <= LONGEST:
        return text
    digest = hashlib.sha256(text.encode()).hexdigest()
    kept = text[: text.rfind("\n", 0, LONGEST) + 1]
    return f"{kept}... cut here; the whole difference has {len(text)} characters and SHA-256 {digest}\n"


def _git(folder: Path, *arguments: str) -> str:
    try:
        answer = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    # Whatever files are written in.
    return answer.stdout.decode(errors="replace").replace("\0", "")
