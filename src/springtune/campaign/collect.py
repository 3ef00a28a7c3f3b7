"""Compare what was solved with its references and gather everything in one dataset."""

import sys
from importlib import import_module
from pathlib import Path

import xarray as xr

from ..jobs import atomic, bundles
from ..kinds import kinds, load_study, outputs
from ..output import dataset
from . import provenance, summary
from .plan import COSTS_FILE, usual_costs


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
    try:
        dataset.write(output, groups, provenance.attributes(study, config))
    except OSError as error:  # the message says it all
        raise SystemExit(str(error)) from None
    atomic.write_text(Path(output).with_name(summary.FILE), summary.text(groups, study.title))
    bundles.remember(folder.parent / COSTS_FILE, sorted(folder.glob("done/*_*.json")), usual_costs())


if __name__ == "__main__":
    run(*sys.argv[1:])
