"""Kinds of study: one package each."""

from pathlib import Path

from ..config.model import Study, kinds


def load_study(path: str | Path) -> Study:
    """Read, validate and expand a study.

    Parameters
    ----------
    path : str or Path
        YAML file; files that it names are seen from its folder.

    Returns
    -------
    Study
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
    (360, 90)
    >>> study.axes["mesh_size"]
    (0.001, 0.002, 0.005)
    """
    from ..config.expand import load  # here, since pydantic takes a fifth of a second to import

    return load(path, kinds())
