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
    """Scenes that are shown where not all can be.

    Of each beam, mesh type, material and load those on the coarsest mesh; of what is swept one value of each.

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
    ranks: dict[SceneSpec, tuple[tuple[str, ...], list[float]]] = {}
    last: dict[tuple[str, ...], list[float]] = {}
    for scene in scenes:
        mesh = scene.mesh
        body = mesh.beam.name, mesh.mesh_type, scene.material.name, scene.load
        rank = [mesh.mesh_size, *(shown_order(name, swept_value(scene, mesh.beam, name)) for name in names)]
        ranks[scene] = body, rank
        last[body] = max(last.get(body, rank), rank)
    return frozenset(scene for scene, (body, rank) in ranks.items() if rank == last[body])
