"""Groups of a dataset of beams, in the root, and of shapes."""

from . import beam_collect, shape_collect


def groups(study, folder):
    """Groups of a dataset by name: ``folder`` has the stored results of a study."""
    beams = beam_collect.groups(study, folder) if study.scenes else {}
    return beams | (shape_collect.groups(study, folder) if study.shapes else {})
