"""Moduli, gathered in the group ``/moduli``."""

from ...output.dataset import Filler
from ...runs.stages import results
from .kind import STAGE
from .variables import MODULI


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    part = study.parts["moduli"]
    moduli = Filler(MODULI.empty(study.axes))
    box = {"patch_length": part.patch.length, "patch_height": part.patch.height}
    moduli.data.attrs = {"comment": "of the mesh that a beam of this length and height [m] gets"} | box
    for task, result in results(STAGE, study, folder):
        moduli.put(result, **task.labels)
    return {MODULI.name: moduli.data}
