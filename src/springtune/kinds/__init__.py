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


def page_files(study):
    """Files of the page of all tables: each table as CSV, and the page.

    Parameters
    ----------
    study : Study

    Returns
    -------
    list of str
    """
    return [*(f"{stem}.csv" for kind in kinds() if kind.tables for stem in kind.tables(study)), "index.html"]


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
