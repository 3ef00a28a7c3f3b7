"""Opening the dataset of a study."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray


def open(path: str | os.PathLike[str]) -> "xarray.DataTree":
    """Open the dataset of a study.

    Parameters
    ----------
    path : str or Path
        ``results/<study>/dataset.nc``, or its folder.

    Returns
    -------
    xarray.DataTree
        Read from the file when needed; close it, or open it in a ``with`` statement.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If it is not the dataset of a study.

    Examples
    --------
    >>> import springtune as st
    >>> with st.open("results/mine") as tree:
    ...     sorted(tree.children), dict(tree.sizes)
    (['benchmark', 'block', 'fields', 'laying', 'moduli', 'sensitivity', 'stability'], {'beam': 2, 'mesh_type': 2,
    'mesh_size': 3, 'material': 2, 'load': 3, 'definition': 2, 'kinematics': 2})
    >>> st.open("results/nothing")
    Traceback (most recent call last):
    FileNotFoundError: results/nothing: there is no such dataset; run the study, or give its results/<study>/dataset.nc
    """
    import xarray

    path = Path(path)
    file = path / "dataset.nc" if path.is_dir() else path
    if not file.is_file():
        raise FileNotFoundError(
            f"{path}: there is no such dataset; run the study, or give its results/<study>/dataset.nc"
        )
    remedy = "give the dataset.nc of a study, or run the study again"
    try:
        tree = xarray.open_datatree(file, engine="h5netcdf")
    except (OSError, ValueError, KeyError) as error:
        raise ValueError(f"{file}: cannot be read ({error}); {remedy}") from None
    if "springtune_version" not in tree.attrs:
        tree.close()
        raise ValueError(f"{file}: is not a dataset of springtune; {remedy}")
    return tree
