"""Find the workflow: in the source tree around the package, else in the package itself, as a wheel has it."""

from pathlib import Path

PACKAGE = Path(__file__).parents[2]

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
    """Clone that the library is used from; None of a built package, whatever git knows of the folders above it."""
    root = workflow_folder(package)
    return root if (root / ".git").exists() else None


def config_file(name: str, beside: Path = CONFIG_FOLDER) -> Path:
    """A study or another file: beside a study, in config/ of the current folder, or in that of the workflow."""
    here = (folder / name for folder in (beside, CONFIG_FOLDER))
    return next(filter(Path.is_file, here), workflow_folder() / CONFIG_FOLDER / name)
