"""Kinds of study: one package each, registered once, here."""

from functools import cache
from importlib import import_module

KINDS = ("scenes", "moduli", "laying", "stability", "benchmark")
"""Packages of the study kinds, in the order of the dataset's groups."""


@cache
def kinds():
    """All study kinds.

    Returns
    -------
    tuple of Kind
    """
    return tuple(import_module(f".{name}.kind", __name__).KIND for name in KINDS)


@cache
def outputs():
    """What is made from a dataset, of all study kinds.

    Returns
    -------
    dict of str to Output
        By name.
    """
    modules = [import_module(f".{name}.outputs", __name__) for name in KINDS]
    return {output.name: output for module in modules for output in module.OUTPUTS}


def load_study(path):
    """Read, validate and expand a study.

    Parameters
    ----------
    path : str or Path
        YAML file.

    Returns
    -------
    Study

    Raises
    ------
    StudyError
        If anything is wrong with the file; nothing else is raised.
    """
    from ..study import load

    return load(path, kinds())
