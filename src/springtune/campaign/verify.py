"""Whether what lies in a study's folder is what was made, and whether a sample of it can be made again."""

import json
import random
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..jobs import atomic, records, sealed
from ..jobs.damage import ASIDE, rename
from ..jobs.guard import LIMITS_TOLD
from ..jobs.keys import installed
from ..jobs.spent import Spent
from ..kinds import kinds, load_study
from ..output import reading
from ..problem.status import Status
from . import due
from .plan import plan

if TYPE_CHECKING:
    import xarray as xr

    from ..output.dataset import Label
    from ..study.model import CurveSpec, SceneSpec, Study

COMPARED = ("displacement", "stiffness", "deformation_error", "field_error", "reference_displacement")
"""Numbers of a scene that are made again."""

SAME_SOFTWARE, OTHER_SOFTWARE = 1e-12, 1e-6
"""Relative differences that are none: with the versions of the software that the dataset was made with, and with
others, whose factors round differently; equilibria are solved to 1e-10 of the load."""


@dataclass(frozen=True)
class Again:
    """A scene that was made again.

    Attributes
    ----------
    labels : str
        Of the scene.
    before, after : str
        Its status in the dataset, and now.
    difference : float
        Largest relative difference of its numbers [1].
    limit : float
        Largest one that is none [1].
    """

    labels: str
    before: str
    after: str
    difference: float
    limit: float

    @property
    def agrees(self) -> bool:
        """Whether it is what the dataset says."""
        return self.before == self.after and self.difference <= self.limit


@dataclass(frozen=True)
class Files:
    """What the files of a study are.

    Attributes
    ----------
    compared : int
        Files that were compared with their checksums.
    faults : dict of str to str
        By the name of a job, what is not as it made it, or that it has not been done.
    stale : tuple of str
        Names of jobs that were done, and of which something else is asked for now: the study or the program changed.
    """

    compared: int
    faults: dict[str, str]
    stale: tuple[str, ...]


def files(study: "Study", folder: Path) -> Files:
    """Compare all files of a study with their checksums.

    Parameters
    ----------
    study : Study
    folder : Path
        Where its results are.

    Returns
    -------
    Files
    """
    found = due.jobs(study, plan(study, folder, 1))
    compared, stale = 0, []
    faults: dict[str, str] = {}
    for name, job in found.items():
        record = sealed.read(job.record, digest=str, products=dict)
        made = record or {"digest": job.digest, "products": job.products}
        why = records.fault(job.record, made["digest"], made["products"], wholly=True)
        compared += len(made["products"]) + 1
        if why:
            faults[name] = why
        elif due.fault(job, found):
            stale.append(name)
    return Files(compared, faults, tuple(stale))


def set_aside(found: Files) -> list[Path]:
    """Give damaged files another name, so that the next run makes them again.

    Parameters
    ----------
    found : Files

    Returns
    -------
    list of Path
        Their names before.
    """
    paths = [Path(why.removesuffix(records.DAMAGED)) for why in found.faults.values() if why.endswith(records.DAMAGED)]
    for path in paths:
        rename(path)
    return paths


def left(folder: Path) -> list[Path]:
    """Files that were set aside, and those that a process which was killed was writing."""
    return sorted(path for path in folder.rglob("*") if path.name.endswith((ASIDE, atomic.UNFINISHED)))


def again(folder: Path, beside: Path, number: int, seed: int) -> Iterator[Again]:
    """Make scenes again that are drawn from a dataset, by its own config.

    Parameters
    ----------
    folder : Path
        With ``dataset.nc``.
    beside : Path
        Folder that files named in the config are seen from.
    number : int
        Of scenes; all of them where there are fewer.
    seed : int
        Of the drawing.

    Yields
    ------
    Again

    Raises
    ------
    ValueError, OSError
        If there is no dataset.
    StudyError
        If its config cannot be read any more, such as where a file that it names is gone.
    """
    with reading.open(folder) as tree, tempfile.TemporaryDirectory() as temporary:
        root = tree.to_dataset().load()
        config = Path(temporary) / f"{root.attrs['study']}.yaml"
        atomic.write_text(config, root.attrs["config"])
        study = load_study(config, beside)
        # What was lost to limits would take as much again.
        held = [scene for scene in study.scenes if LIMITS_TOLD not in str(root.message.sel(study.labels(scene)).item())]
        drawn = random.Random(seed).sample(held, min(number, len(held)))
        part = _part(study, drawn)
        made = _made(part, Path(temporary) / "results" / study.name)
    software = json.loads(root.attrs["software"])
    same = all(installed(name) == version for name, version in software.items() if name != "python")
    for scene in part.scenes:
        yield _compared(
            study.name_of(scene), study.labels(scene), root, made, SAME_SOFTWARE if same else OTHER_SOFTWARE
        )


def _part(study: "Study", scenes: "list[SceneSpec]") -> "Study":
    """A study of a few scenes of another one, and of what these need."""
    chosen = set(scenes)
    groups = {
        (scene.mesh.mesh_type, scene.material, scene.kinematics) for scene in chosen if scene.definition == "calibrated"
    }
    curves = tuple(
        curve
        for curve in study.curves
        if (curve.mesh.beam.name, curve.load) == study.calibration
        and (curve.mesh.mesh_type, curve.material, curve.kinematics) in groups
    )
    asked: list[SceneSpec | CurveSpec] = [*chosen, *curves]
    bodies = {(one.mesh.beam, one.material, one.load, one.force) for one in asked}
    meshes = {one.mesh for one in asked}
    return replace(
        study,
        scenes=tuple(scene for scene in study.scenes if scene in chosen),
        curves=curves,
        meshes=tuple(mesh for mesh in study.meshes if mesh in meshes),
        references=tuple(one for one in study.references if (one.beam, one.material, one.load, one.force) in bodies),
        further_references=(),
        printed=(),
        parts={name: part if name == "scenes" else () for name, part in study.parts.items()},
    )


def _made(study: "Study", folder: Path) -> "xr.Dataset":
    """Root of the dataset of a study, made in this process."""
    for job in plan(study, folder, 1).jobs.values():
        spent = Spent()
        import_module(f"springtune.{job.stage.module}").run(job.content, spent)
        if spent.broken:
            raise spent.broken[0]
    (scenes,) = (kind for kind in kinds() if kind.name == "scenes")
    found: xr.Dataset = scenes.module("collect").groups(study, folder)["/"]
    return found


def _compared(name: str, labels: "dict[str, Label]", before: "xr.Dataset", after: "xr.Dataset", limit: float) -> Again:
    cells = [data.sel({name: label for name, label in labels.items() if name in data.dims}) for data in (before, after)]
    differences = [0.0]
    for name in COMPARED:
        old, new = (float(cell[name]) for cell in cells)
        if np.isnan(old) != np.isnan(new):
            differences.append(np.inf)
        elif old != new and not np.isnan(old):
            # An error that is small is a difference of large numbers.
            size = 1.0 if name.endswith("error") else max(abs(old), abs(new))
            differences.append(abs(new - old) / size)
    old_status, new_status = (str(Status(int(cell.status))) for cell in cells)
    return Again(name, old_status, new_status, max(differences), limit)
