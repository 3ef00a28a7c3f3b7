"""Kinds of study: one package each, registered once, here."""

from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..study import Study
    from .base import Kind, Output

KINDS = ("scenes", "moduli", "laying", "stability", "benchmark", "samples", "refinement", "shapes")
"""Packages of the study kinds, in the order of the dataset's groups."""


@cache
def kinds() -> "tuple[Kind, ...]":
    """All study kinds.

    Returns
    -------
    tuple of Kind
    """
    return tuple(import_module(f".{name}.kind", __name__).KIND for name in KINDS)


@cache
def outputs() -> "dict[str, Output]":
    """What is made from a dataset, of all study kinds.

    Returns
    -------
    dict of str to Output
        By name.
    """
    modules = [import_module(f".{name}.outputs", __name__) for name in KINDS]
    return {output.name: output for module in modules for output in module.OUTPUTS}


def load_study(path: str | Path, beside: Path | None = None) -> "Study":
    """Read, validate and expand a study.

    Parameters
    ----------
    path : str or Path
        YAML file.
    beside : Path, optional
        Folder that the names of its files are seen from; its own without.

    Returns
    -------
    springtune.study.Study
        Its scenes and curves and all that they need, in a canonical order.

    Raises
    ------
    StudyError
        If anything is wrong with the file; nothing else is raised.

    Examples
    --------
    >>> import springtune as st
    >>> study = st.load_study("config/paper.yaml")
    >>> len(study.scenes), len(study.curves)
    (270, 90)
    >>> study.axes["mesh_size"]
    (0.001, 0.002, 0.005)
    """
    from ..study import load

    study = load(path, kinds(), beside)
    if study.part is None:
        return study
    from .division import part_of  # here: few studies are parts

    return part_of(study)
