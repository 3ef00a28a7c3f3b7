"""Moduli, gathered in the group ``/moduli``."""

from collections import defaultdict

from ...output.dataset import Filler
from ...runs import store
from . import plan
from .variables import MODULI


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    part = study.parts["moduli"]
    moduli = Filler(MODULI.empty(study.axes))
    box = {"patch_length": part.patch.length, "patch_height": part.patch.height}
    moduli.data.attrs = {"comment": "of the mesh that a beam of this length and height [m] gets"} | box
    patches = defaultdict(dict)
    for one in part.measurements:
        patches[plan.patch_name(one)][plan.moduli_key(study, one)] = one
    for patch, names in patches.items():
        for name, result in store.read(folder / "moduli" / f"{patch}.h5", names).items():
            one = names[name]
            labels = {"mesh_type": one.mesh_type, "mesh_size": one.mesh_size, "poisson_ratio": one.poisson_ratio}
            moduli.put(result, definition=one.definition, **labels)
    return {MODULI.name: moduli.data}
