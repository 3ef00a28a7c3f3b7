"""Compare what was solved with its references and gather everything in one dataset."""

import json
import platform
import subprocess
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path

import xarray as xr

from .. import __version__
from ..jobs import bundles
from ..jobs.keys import installed
from ..kinds import kinds, load_study, outputs
from ..output import dataset
from ..study.model import Study
from .plan import COSTS_FILE, usual_costs

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


def run(config: str | Path, folder: str | Path, output: str | Path) -> None:
    """Build the dataset of a study from its stored results.

    Parameters
    ----------
    config : str or Path
        YAML file of the study.
    folder : str or Path
        Where the study's results are.
    output : str or Path
        NetCDF file to write.
    """
    study, folder = load_study(config), Path(folder)
    groups: dict[str, xr.Dataset] = {}
    for kind in kinds():
        if study.parts[kind.name]:
            groups |= kind.module("collect").groups(study, folder)
    for made in outputs().values():
        if made.collect and made.name in study.outputs:
            groups |= import_module(f"springtune.{made.collect}").groups(study, folder)
    dataset.write(output, groups, _attributes(study, config))
    print(*_objected(groups["/"]), sep="", end="")
    bundles.remember(folder.parent / COSTS_FILE, sorted(folder.glob("done/*_*.json")), usual_costs())


def _objected(root: xr.Dataset) -> Iterator[str]:
    """Lines on scenes whose errors are missing or not the networks' own."""
    requested, there = root.status != 0, root.reference_displacement.notnull()
    for scenes, what in (
        (requested & ~there, "have no reference and no error"),
        (requested & there & (root.reference_applies == 0), "are beyond the reference of small strain"),
    ):
        if scenes.any():
            yield f"{int(scenes.sum())} of {int(requested.sum())} scenes {what}: `message` says why\n"


def _attributes(study: Study, config: str | Path) -> dict[str, str]:
    software = {name: installed(name) for name in SOFTWARE} | {"python": platform.python_version()}
    return {
        "title": study.title,
        "Conventions": "CF-1.11",
        "study": study.name,
        "config": study.text,
        "springtune_version": __version__,
        "git_commit": _git_commit(Path(config).parent),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "software": json.dumps(software, sort_keys=True),
        "host": platform.node(),
    }


def _git_commit(folder: Path) -> str:
    """Commit of the checkout that holds the study, with "+changes" where files differ from it; empty outside of git."""
    try:
        answer = subprocess.run(
            ["git", "describe", "--always", "--abbrev=40", "--dirty=+changes", "--exclude=*"],
            cwd=folder, capture_output=True, text=True, check=True,
        )  # fmt: skip
    except (OSError, subprocess.CalledProcessError):
        return ""
    return answer.stdout.strip()


if __name__ == "__main__":
    run(*sys.argv[1:])
