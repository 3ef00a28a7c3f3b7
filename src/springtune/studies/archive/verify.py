"""Verify a study's files by checksum, and recompute a sample."""

import json
import random
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from springtune.problem.status import Status
from springtune.safe_io import atomic

from ..config.kind import kinds
from ..config.model import SceneSpec
from ..kinds import load_study
from ..kinds.scenes.plan import of_scenes
from ..kinds.shapes.kind import of_shape_scenes
from ..output import reading
from ..output.summary import SCENES
from ..runs import checked_json, driver, records, rerun, store
from ..runs.checked_json import ASIDE, DamagedError, rename
from ..runs.keys import installed
from ..runs.plan import BUNDLES_FILE, plan
from ..runs.run_tasks import RECORDS, TASKS
from ..runs.task_costs import LIMITS_TOLD, TaskCosts

if TYPE_CHECKING:
    import xarray as xr

    from ..config.model import Study
    from ..kinds.shapes.expand import ShapeScene
    from ..output.dataset import Label

OF_SHAPES = "/shapes"

COMPARED = {
    SCENES: ("displacement", "stiffness", "deformation_error", "field_error", "reference_displacement"),
    OF_SHAPES: ("value", "error", "reference_value"),
}
"""Recomputed numbers by group, one for each quantity."""

SAME_SOFTWARE, OTHER_SOFTWARE = 1e-12, 1e-6
"""Tolerances for the same software and for other versions; equilibria converge to 1e-10 of the load."""

SMALLEST_SEEN = 1e-18
"""Tolerance with which scenes are compared, so that every difference is seen."""


def _is_whole(path: Path) -> bool:
    """Return whether a file of results is undamaged."""
    try:
        store.contents(path)
    except DamagedError:
        return False
    return True


SEALS: dict[str, Callable[[Path], bool]] = {
    ".h5": _is_whole,
    ".json": lambda path: checked_json.read(path) is not None,
}
"""Checks by file ending."""


@dataclass(frozen=True)
class Again:
    """A recomputed scene with its largest relative `difference` and the `limit` for it [1]."""

    labels: str
    before: str
    after: str
    difference: float
    limit: float

    @property
    def agrees(self) -> bool:
        """Whether it agrees with the dataset."""
        return self.before == self.after and self.difference <= self.limit


@dataclass(frozen=True)
class Files:
    """State of a study's files: `faults` pair job and file, `stale` jobs match no current request."""

    compared: int
    faults: tuple[tuple[str, str], ...]
    stale: tuple[str, ...]


def files(study: "Study", folder: Path) -> Files:
    """Compare all files of a study with their checksums."""
    jobs, stale = rerun.jobs(study, plan(study, folder, 1)), []
    notes = [*sorted((folder / TASKS).glob("*_*.json")), *folder.glob(BUNDLES_FILE)]
    faults = [(path.stem, f"{path}{records.DAMAGED}") for path in notes if not SEALS[".json"](path)]
    compared = {*map(str, notes)}
    recorded = {name: job.record for name, job in jobs.items()}
    if any(name == Path(BUNDLES_FILE).stem for name, _ in faults):  # jobs are planned that are not those of before
        recorded |= {path.stem: path for path in sorted((folder / RECORDS).glob("*.json"))}
    for name, path in recorded.items():
        job, record = jobs.get(name), checked_json.read(path, digest=str, products=dict)
        compared |= {str(path)} if path.exists() else set()
        if record:
            own = list(records.faults(path, record["digest"], record["products"], wholly=True))
            compared |= {made for made, known in record["products"].items() if known and Path(made).exists()}
        else:  # files that have a checksum of their own are compared with that
            own = [records.fault(path, "", ())]
            sealing = [one for one in map(Path, job.products if job else ()) if one.suffix in SEALS and one.exists()]
            own += [f"{one}{records.DAMAGED}" for one in sealing if not SEALS[one.suffix](one)]
            compared |= {*map(str, sealing)}
        faults += [(name, why) for why in own]
        if job and not own and rerun.fault(job, jobs):
            stale.append(name)
    return Files(len(compared), tuple(faults), tuple(stale))


def set_aside(found: Files) -> list[Path]:
    """Rename damaged files, so that the next run makes them again."""
    whys = dict.fromkeys(why for _, why in found.faults if why.endswith(records.DAMAGED))
    paths = [Path(why.removesuffix(records.DAMAGED)) for why in whys]
    for path in paths:
        rename(path)
    return paths


def left(folder: Path) -> list[Path]:
    """Renamed files and unfinished temporary ones."""
    return sorted(path for path in folder.rglob("*") if path.name.endswith((ASIDE, atomic.UNFINISHED)))


def again(folder: Path, beside: Path, number: int, seed: int) -> Iterator[Again]:
    """Recompute random scenes of a dataset by its own config."""
    import xarray as xr

    from ..output.comparison import Tolerance, compare

    with reading.open(folder) as tree, tempfile.TemporaryDirectory() as temporary:
        before = {name: tree[name].to_dataset().load() for name in COMPARED if name == SCENES or name in tree.groups}
        root = before[SCENES]
        config = Path(temporary) / f"{root.attrs['study']}.yaml"
        atomic.write_text(config, root.attrs["config"])
        study = load_study(config, beside)
        # What was lost to limits would take as much again.
        held = [
            (name, scene)
            for name, scenes in _scenes(study).items()
            for scene, labels in scenes.items()
            if LIMITS_TOLD not in str(before[name].message.sel(labels).item())
        ]
        drawn = set(random.Random(seed).sample(held, min(number, len(held))))
        part = _part(study, {scene for _, scene in drawn})
        made = _made(part, Path(temporary) / "results" / study.name)
    software = json.loads(root.attrs["software"])
    same = all(installed(name) == version for name, version in software.items() if name != "python")
    for name, scenes in _scenes(part).items():
        kept = [data[name][[*COMPARED[name], "status"]].drop_attrs(deep=False) for data in (before, made)]
        for scene, labels in scenes.items():
            own = [data.sel({dim: at for dim, at in labels.items() if dim in data.dims}, drop=True) for data in kept]
            found = compare(xr.DataTree(own[0]), xr.DataTree(own[1]), Tolerance(SMALLEST_SEEN))
            yield Again(
                study.name_of(scene) if isinstance(scene, SceneSpec) else scene.name,
                str(Status(int(own[0].status))),
                str(Status(int(own[1].status))),
                SMALLEST_SEEN * max((row.excess for row in found.changes), default=0.0),
                SAME_SOFTWARE if same else OTHER_SOFTWARE,
            )


def _scenes(study: "Study") -> "dict[str, dict[SceneSpec | ShapeScene, dict[str, Label]]]":
    """Scenes of a study with their cells, by group."""
    shapes = study.parts["shapes"]
    found: dict[str, dict[SceneSpec | ShapeScene, dict[str, Label]]] = {
        SCENES: {scene: study.labels(scene) for scene in study.scenes},
        OF_SHAPES: {scene: asdict(scene) for scene in (shapes.scenes if shapes else ())},
    }
    return {name: scenes for name, scenes in found.items() if scenes}


def _part(study: "Study", chosen: "set[SceneSpec | ShapeScene]") -> "Study":
    """Study of a few scenes and all that they need."""
    found = of_shape_scenes(of_scenes(replace(study, further_references=(), printed=()), chosen), chosen)
    kept = {name: found.parts[name] for name in ("scenes", "shapes")}
    return replace(found, parts=dict.fromkeys(study.parts, ()) | kept)


def _made(study: "Study", folder: Path) -> "dict[str, xr.Dataset]":
    """Groups of a dataset, computed in this process."""
    for job in plan(study, folder, 1).jobs.values():
        costs = TaskCosts()
        driver.run(job.stage.module, job.content, costs)
        if costs.broken:
            raise costs.broken[0]
    found: dict[str, xr.Dataset] = {}
    for kind in kinds():
        if kind.name in ("scenes", "shapes") and study.parts[kind.name]:
            found |= kind.module("collect").groups(study, folder)
    return found
