"""Studies whose results a command is about."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from ..studies.config.model import Study

RESULTS_FOLDER, CONFIG_FOLDER = Path("results"), Path("config")

DATASET = "dataset.nc"


def studies(given: Path | None) -> "Iterator[tuple[Study, Path]]":
    """Studies with the folders of their results."""
    from ..studies.kinds import load_study
    from ..studies.runs.locks import LockedError, check_claim, claimed

    if given is not None and not given.is_dir():
        study = load_study(given)
        folder = RESULTS_FOLDER / study.name
        if not folder.is_dir():
            raise click.ClickException(f"{folder}: there is no such folder; run the study, or go to where it was run")
        try:
            check_claim(folder, given)
        except LockedError as error:
            raise click.ClickException(str(error)) from None
        yield study, folder
        return
    if given is None and not RESULTS_FOLDER.is_dir():
        raise click.ClickException(f"{RESULTS_FOLDER}: there is no such folder; go to where studies were run")
    folders = [given] if given else sorted(path for path in RESULTS_FOLDER.iterdir() if path.is_dir())
    for folder in folders:
        config = claimed(folder) or folder.parent.parent / CONFIG_FOLDER / f"{folder.name}.yaml"
        if config.is_file():
            yield load_study(config), folder
        elif given:
            raise click.ClickException(f"{folder}: there is no {config}; give the study's YAML file instead")
        else:
            click.echo(f"{folder}: left alone, there is no {config}; give the study's YAML file, or remove it by hand")


def idle(folder: Path) -> None:
    """Refuse to remove anything under a run."""
    from ..studies.runs.locks import LockedError, check_idle

    try:
        check_idle(folder)
    except LockedError as error:
        raise click.ClickException(f"{error}; nothing is removed") from None


def dataset_path(given: str) -> Path:
    """Dataset of what a command is given."""
    from ..studies.runs.locks import check_claim

    path = Path(given)
    if path.suffix in (".yaml", ".yml"):
        from ..studies.output.expected import is_expected

        if is_expected(path):
            return path
        config, path = path, RESULTS_FOLDER / path.stem
        check_claim(path, config)
    for file in (path, path / DATASET, RESULTS_FOLDER / path / DATASET):
        if file.is_file():
            return file
    known = sorted(file.parent.name for file in RESULTS_FOLDER.glob(f"*/{DATASET}"))
    there = f"here are {', '.join(known)}" if known else "none is in results/ here"
    raise ValueError(
        f"{given}: there is no such dataset; run the study, or give a dataset.nc, results/<study> or a study's name; "
        f"{there}"
    )
