"""Checks of load cases on meshes with groups: names, and supports of each part."""

from typing import TYPE_CHECKING

import numpy as np

from .shapes import LoadCase

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..mesh.groups import GroupedMesh


def check_case(grouped: "GroupedMesh", case: LoadCase) -> None:
    """Refuse a load case whose groups a mesh lacks, or that leaves cells free to move.

    Examples
    --------
    >>> import springtune as st
    >>> grouped = st.mesh_shape(st.Shape.rectangle("100 mm", "40 mm", points={"corner": (0, 0)}), "10 mm")
    >>> pull = st.LoadCase("pull", (st.Support("left", x=0),), (st.Traction("right", ("1 kN", 0)),))
    >>> try:
    ...     check_case(grouped, pull)
    ... except ValueError as error:
    ...     print(error)
    load 'pull': its supports leave the body free to move along y; hold it
    >>> check_case(grouped, st.LoadCase("pull", (*pull.supports, st.Support("corner", y=0)), pull.tractions))
    """
    from ..mesh.parts import check_held  # here, since they stand on meshes
    from .boundary import supported

    case.check_names(grouped.sides, grouped.points, grouped.unusable)
    where = f"load {case.name!r}"
    pressed = {one.group for one in case.pressures}
    used = [one.group for one in case.supports] + [one.group for one in case.tractions]
    for name in dict.fromkeys([*pressed, *used, *(one.of for one in case.quantities)]):
        fault = grouped.side_fault(name, directed=name in pressed) if name in grouped.sides else ""
        if fault:
            raise ValueError(f"{where}: {name!r} {fault}")
    for what, name in [("support", one.group) for one in case.supports] + [
        ("traction", one.group) for one in case.tractions
    ]:
        if name in grouped.points and grouped.particle(name) is None:
            raise ValueError(f"{where}, {what}: point {name!r} is no particle of the mesh; move it to one")
    for quantity in case.quantities:
        if quantity.of in grouped.points and not _in_body(grouped.mesh, grouped.points[quantity.of]):
            raise ValueError(f"{where}, quantity {quantity.name!r}: point {quantity.of!r} is not in the body; move it")
    held = supported(grouped, case)[0]
    check_held(grouped.mesh.points, grouped.mesh.edges, held, where)


def _in_body(mesh: "Mesh", point: np.ndarray) -> bool:
    """Whether a point is in a cell, or within rounding of one."""
    small = 1e-9 * np.ptp(mesh.points, axis=0).max()
    for corners in mesh.cells.values():
        here = mesh.points[corners] - point
        after = np.roll(here, -1, axis=1)
        lengths = np.linalg.norm(after - here, axis=2)
        if ((here[..., 0] * after[..., 1] - here[..., 1] * after[..., 0]) >= -small * lengths).all(axis=1).any():
            return True
    return False
