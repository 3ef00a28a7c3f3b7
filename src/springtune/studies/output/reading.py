"""Open the dataset of a study safely."""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from springtune.registry import NAME, NAME_RULE
from springtune.safe_io import BeyondBound, DataElsewhere, bounded, check_alone, clipped

if TYPE_CHECKING:
    import xarray

    from .dataset import Label

REMEDY = "give the dataset.nc of a study; delete a damaged one, and the same run makes it again"

OPENING_BYTES = 1e9  # limit of bytes that opening takes

REASON_CHARACTERS = 200


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
    FileNotFoundError, ValueError
        If there is no such file, or it is not the dataset of a study.

    Examples
    --------
    >>> import springtune as st
    >>> with st.open("results/mine") as tree:
    ...     sorted(tree.children), dict(tree.sizes)
    (['benchmark', 'block', 'engine_curves', 'engines', 'fields', 'laying', 'moduli',
    'samples', 'sensitivity', 'shape_fields', 'shapes', 'sobol', 'stability'], {'beam': 2, 'mesh_type': 2,
    'mesh_size': 3, 'material': 2, 'load': 3, 'definition': 2, 'kinematics': 2})
    >>> st.open("results/nothing")
    Traceback (most recent call last):
    FileNotFoundError: results/nothing: there is no such dataset; run the study, or give its results/<study>/dataset.nc
    """
    import h5netcdf

    from .dataset import tree

    path = dataset_file(path)
    with ExitStack() as stack:
        try:
            with bounded(OPENING_BYTES):
                check_alone(path)
                file = stack.enter_context(h5netcdf.File(path, decode_vlen_strings=True))
                attributes = dict(file.attrs)
                name = attributes.get("study", "unknown")
                named = isinstance(name, str) and NAME.fullmatch(name) is not None  # it becomes part of paths
                ours = "springtune_version" in attributes
                found = tree(file) if ours and named else None
        except DataElsewhere:
            raise
        except Exception as error:  # of any library, on a damaged file
            raise ValueError(f"{path}: cannot be read ({reason(error)}); {REMEDY}") from None
        if not ours:
            raise ValueError(f"{path}: is not a dataset of springtune; {REMEDY}")
        if found is None:
            raise ValueError(f"{path}: attribute 'study' is {clipped(repr(name))}; {NAME_RULE}; {REMEDY}")
        found.set_close(stack.pop_all().close)
    return found


def dataset_file(path: str | os.PathLike[str]) -> Path:
    """Path of the file of a dataset, given by itself or by its folder."""
    path = Path(path)
    file = path / "dataset.nc" if path.is_dir() else path
    if not file.is_file():
        remedy = "run the study, or give its results/<study>/dataset.nc"
        raise FileNotFoundError(f"{path}: there is no such dataset; {remedy}")
    return file


@contextmanager
def guard(path: str | os.PathLike[str]) -> Iterator[None]:
    """Context that turns any error on a damaged dataset into a refusal."""
    try:
        yield
    except (AttributeError, ArithmeticError, LookupError, MemoryError, RuntimeError, TypeError) as error:
        why = f"is damaged, or not as springtune writes it ({reason(error)})"
        raise ValueError(f"{path}: {why}; delete it, and the same run makes it again") from error


def reason(error: Exception) -> str:
    """Return an error as a short line."""
    for_people = isinstance(error, OSError | ValueError | BeyondBound)
    text = str(error) if for_people else f"{type(error).__name__}: {error}"
    return clipped(" ".join(text.split()), REASON_CHARACTERS)


def field(data: "xarray.DataTree", **labels: "Label") -> "xarray.Dataset":
    """Network of one beam and mesh type with its fields, as an unstructured mesh by UGRID-1.0.

    Parameters
    ----------
    data : xarray.DataTree
        A study's dataset with the group ``/fields``.
    **labels : str or float
        Label by dimension: ``beam``, ``mesh_type`` and ``mesh_size`` [m] where there are several; and of ``material``,
        ``load``, ``definition`` and ``kinematics`` those that shall not stay dimensions. Of what a study sweeps, such
        as ``force`` [N], fields are of one value for each beam, mesh type, material and load: a coordinate of what is
        returned; another one is refused.

    Returns
    -------
    xarray.Dataset
        In memory, dimensions ``particle``, ``spring`` and ``cell`` as long as the mesh has of each: positions ``x``,
        ``y`` [m], ``spring_nodes`` and ``cell_nodes`` (particles from 0, -1 where a cell has fewer corners than
        others), the network's displacements [m], each spring's ``stiffness`` [N/m] and axial
        ``spring_force`` [N], and the reference's outline.

    Raises
    ------
    ValueError
        If there are no fields, the labels leave a choice of meshes, or a label is not there.

    Examples
    --------
    >>> import springtune as st
    >>> network = st.field(tree, beam="200x40", mesh_type="free", mesh_size=5e-3, load="traction")
    >>> network.spring_nodes.values.tolist(), network.mesh.attrs["edge_node_connectivity"]
    ([[0, 1], [1, 2], [2, 3]], 'spring_nodes')
    >>> network.displacement_x.dims
    ('definition', 'material', 'particle')

    It may be written, and opened by what knows such meshes:

    >>> network.to_netcdf("network.nc")
    """
    if not hasattr(data, "children"):
        raise ValueError(f"data: {type(data).__name__} is no dataset; give what springtune.open returns")
    if "fields" not in data.children:
        why = "the dataset has no group '/fields'"
        if data.variables:
            raise ValueError(f"{why}; add 'deformed' or 'paraview' to the outputs of the study, and run it")
        shown = " 'shape_fields' has those of shapes:" if "shape_fields" in data.children else ""
        others = f"take a group as it is, one of {', '.join(data.children)}"
        raise ValueError(f"{why}, nor has its study beams;{shown} {others}")
    from .dataset import network

    with guard("the group '/fields'"):
        return network(data, labels)
