"""Scenes for SOFA in Python, for SofaPython3.

Written after the sources of SOFA v24.06 to v26.06, not run there: SOFA has no wheel. `MeshSpringForceField` will not
do: it has one stiffness for all edges, divides it by their lengths, and since v24.12 passes over springs that it is
given (sofa issue 5135).
"""

import numpy as np

from .simulation import STEPS_PER_PERIOD, Net, comment_lines, fill_template, numbers, simulate

Component = tuple[str, dict[str, str]]  # name of a component, and its data


def sofa_python(net: Net) -> str:
    """Return the scene of a net for SOFA v24.06 and later."""
    simulation = simulate(net, "SOFA")
    there = net.stiffness != 0
    edges, lengths = net.springs[there], net.rest_lengths[there].tolist()
    springs = " ".join(
        f"{first} {second} {stiffness!r} 0 {length!r}"
        for (first, second), stiffness, length in zip(edges.tolist(), net.stiffness[there].tolist(), lengths)
    )
    sheet = [
        ("SparseLDLSolver", {}),
        _vec3("MechanicalObject", name="particles", position=_positions(net.points)),
        ("EdgeSetTopologyContainer", {"name": "edges", "position": "@particles.position", "edges": numbers(edges)}),
        _vec3("DiagonalMass", vertexMass=numbers(simulation.masses), topology="@edges", geometryState="@particles"),
        _vec3("SpringForceField", name="springs", spring=springs),
    ]
    for x, y in ((True, True), (True, False), (False, True), (False, False)):
        which = np.flatnonzero((net.held == (x, y)).all(axis=1))
        if len(which) and x and y:
            sheet.append(_vec3("FixedProjectiveConstraint", indices=numbers(which)))
        elif len(which):  # across the plane all are held
            directions = f"{int(x)} {int(y)} 1"
            sheet.append(_vec3("PartialFixedProjectiveConstraint", indices=numbers(which), fixedDirections=directions))
    loaded = np.flatnonzero((np.where(net.held, 0, net.forces) != 0).any(axis=1))
    if len(loaded):
        arrows = float(f"{float(net.rest_lengths.mean()):.6g}") / float(np.abs(net.forces).max())
        data = {"forces": _positions(net.forces[loaded]), "showArrowSize": f"{arrows:.6g}"}
        sheet.append(_vec3("ConstantForceField", name="load", indices=numbers(loaded), **data))
    step_note = "the one here is below it"
    if simulation.loaded_frequency:
        share = f"a {STEPS_PER_PERIOD}th of the slowest period that the load excites"
        step_note = f"the one here is that of backward Euler, {share}"
    predicted = []
    if simulation.displacements is not None:
        shown = {"showObject": "1", "showObjectScale": "4", "showColor": "0.1 0.6 0.2 1"}
        moved = _positions(net.points + simulation.displacements)
        predicted = [_vec3("MechanicalObject", name="particles", position=moved, **shown)]
    return fill_template(
        "sofa.py",
        about=comment_lines(net, simulation, step_note),
        step=simulation.implicit_step,
        integrator={"rayleighStiffness": "0", "rayleighMass": repr(simulation.mass_damping)},
        sheet=sheet,
        predicted=predicted,
    )


def _vec3(kind: str, **data: str) -> Component:
    return kind, {"template": "Vec3", **data}


def _positions(points: np.ndarray) -> str:
    return numbers(np.column_stack([points, np.zeros(len(points))]))
