"""Choice of scenes whose whole fields are stored."""

from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING

from springtune.problem.parameters import shown_order

from .model import swept_value

if TYPE_CHECKING:
    from .model import SceneSpec, Study

SHOWING = ("deformed", "paraview")


def keeps_fields(study: "Study") -> bool:
    """Return whether a study's dataset has whole fields, its group `/fields`."""
    return any(name in study.outputs for name in SHOWING)


def shown(scenes: "Collection[SceneSpec]", swept: Iterable[str]) -> "frozenset[SceneSpec]":
    """Scenes on the coarsest mesh, with one value of each swept parameter."""
    names, coarsest = tuple(swept), dict[tuple[str, ...], float]()
    for scene in scenes:
        body, size = _body(scene), scene.mesh.mesh_size
        if size >= coarsest.get(body, size):
            coarsest[body] = size
    # Few are on the coarsest mesh; only they are ranked.
    ranked = [
        (scene, body, [shown_order(name, swept_value(scene, scene.mesh.beam, name)) for name in names])
        for scene in scenes
        if scene.mesh.mesh_size == coarsest[body := _body(scene)]
    ]
    last: dict[tuple[str, ...], list[float]] = {}
    for _, body, rank in ranked:
        last[body] = max(last.get(body, rank), rank)
    return frozenset(scene for scene, body, rank in ranked if rank == last[body])


def _body(scene: "SceneSpec") -> tuple[str, ...]:
    return scene.mesh.beam.name, scene.mesh.mesh_type, scene.material.name, scene.load
