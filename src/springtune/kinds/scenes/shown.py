"""Scenes that are shown where not all can be: those whose whole fields are kept."""

from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING

from ...problem.parameters import shown_order
from ...study.model import swept_value

if TYPE_CHECKING:
    from ...study.model import SceneSpec, Study

SHOWING = ("deformed", "paraview")
"""Outputs that are made of whole fields."""


def keeps_fields(study: "Study") -> bool:
    """Whether a study's dataset has whole fields, its group `/fields`.

    Parameters
    ----------
    study : Study

    Returns
    -------
    bool
    """
    return any(name in study.outputs for name in SHOWING)


def shown(scenes: "Collection[SceneSpec]", swept: Iterable[str]) -> "frozenset[SceneSpec]":
    """Scenes on the coarsest mesh of each beam and mesh type; of what is swept each beam, material and load shows one.

    Parameters
    ----------
    scenes : collection of SceneSpec
    swept : iterable of str
        Keys of `springtune.problem.parameters.SWEPT`: the largest force, under it the largest thickness, and so on, see
        `springtune.problem.parameters.shown_order`.

    Returns
    -------
    frozenset of SceneSpec
    """
    names = tuple(swept)
    coarsest: dict[tuple[str, str], float] = {}
    for scene in scenes:
        place = scene.mesh.beam.name, scene.mesh.mesh_type
        coarsest[place] = max(coarsest.get(place, 0.0), scene.mesh.mesh_size)
    last: dict[tuple[str, str, str], list[float]] = {}
    ranked = []
    for scene in scenes:
        mesh = scene.mesh
        if mesh.mesh_size == coarsest[mesh.beam.name, mesh.mesh_type]:
            body = mesh.beam.name, scene.material.name, scene.load
            rank = [shown_order(name, swept_value(scene, mesh.beam, name)) for name in names]
            last[body] = max(last.get(body, rank), rank)
            ranked.append((scene, body, rank))
    return frozenset(scene for scene, body, rank in ranked if rank == last[body])
