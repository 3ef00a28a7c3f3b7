"""Find the workflow: in the source tree around the package, else in the package itself, as a wheel has it."""

from pathlib import Path

PACKAGE = Path(__file__).parents[2]

CONFIG_FOLDER = Path("config")

USUAL_STUDY = "paper.yaml"

COPY = PACKAGE / "workflow"
"""The workflow in the package of a wheel, see ``hatch_build.py``."""

COMMIT_FILE = PACKAGE / "commit.txt"
"""The commit that the package was built from; a clone has no such file."""

EXPECTED = ("Snakefile", "workflow/rules/common.smk")
"""Files that every source tree has."""


def is_source_tree(folder: Path) -> bool:
    """Return whether a folder has the workflow."""
    return all((folder / file).is_file() for file in EXPECTED)


def workflow_folder() -> Path:
    """Folder with the Snakefile of this library, and with workflow, config and examples beside it."""
    around = PACKAGE.parents[1]
    return around if is_source_tree(around) else COPY


def clone() -> Path | None:
    """Clone that the library is used from; None of a built package, whatever git knows of the folders above it."""
    root = workflow_folder()
    return root if (root / ".git").exists() else None


def config_file(name: str, beside: Path = CONFIG_FOLDER) -> Path:
    """A study or another file: beside a study, in config/ of the current folder, or in that of the workflow."""
    here = (folder / name for folder in (beside, CONFIG_FOLDER))
    return next(filter(Path.is_file, here), workflow_folder() / CONFIG_FOLDER / name)
