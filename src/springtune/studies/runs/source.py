"""Paths of the workflow, in the source tree or in a wheel's package; hashes and notes."""

import hashlib
import json
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).parents[2]

TASKS, RECORDS = "tasks", "done"  # folders of a study: notes of jobs to do, and records of done jobs

CONFIG_FOLDER = Path("config")

USUAL_STUDY = "paper.yaml"

COPY, COMMIT_FILE = "workflow", "commit.txt"
"""In the package of a wheel: the workflow, and the commit that it was built from; see ``hatch_build.py``."""


def is_source_tree(folder: Path) -> bool:
    """Return whether a folder has the workflow."""
    return (folder / "Snakefile").is_file() and (folder / "workflow/rules/common.smk").is_file()


def workflow_folder(package: Path = PACKAGE) -> Path:
    """Folder with the Snakefile of the library, and with workflow, config and examples beside it."""
    around = package.parents[1]
    return around if is_source_tree(around) else package / COPY


def clone(package: Path = PACKAGE) -> Path | None:
    """Clone that the library is used from; None for a built package."""
    root = workflow_folder(package)
    return root if (root / ".git").exists() else None


def config_file(name: str, beside: Path = CONFIG_FOLDER) -> Path:
    """Path of a file beside a study, in config/ of the current folder, or in that of the workflow."""
    here = (folder / name for folder in (beside, CONFIG_FOLDER))
    return next(filter(Path.is_file, here), workflow_folder() / CONFIG_FOLDER / name)


STATE = "SPRINGTUNE_SOURCE_STATE"  # environment variable with the `source_state` at the begin of a run, for its jobs

DIGESTS = "SPRINGTUNE_CODE_DIGESTS"  # environment variable with digests of the package's modules at that state


def source_state() -> str:
    """Hash of sizes and times of the package's files."""
    states = [(str(path), path.stat()) for path in sorted(PACKAGE.rglob("*.py"))]
    return hash_of([[name, state.st_size, state.st_mtime_ns] for name, state in states])


_ENCODER = json.JSONEncoder(sort_keys=True, separators=(",", ":"))


def hash_of(*parts: Any) -> str:
    """Hash values, independent of the order of keys."""
    return hash_of_text(_ENCODER.encode(parts))


def hash_of_text(text: str) -> str:
    """Hash a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def read_note(path: Path) -> dict[str, Any]:
    """Content of a note or a record; empty if it cannot be read."""
    try:
        found = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def checksum(path: str | Path) -> str:
    """SHA-256 of a file."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
