"""Scenes for SOFA, as XML (.scn) and in Python (.py, for SofaPython3).

Written after the sources of SOFA v24.06 to v26.06, not run there: SOFA has no wheel. `SpringForceField` reads
``spring="first second stiffness damping rest_length ..."``, so each spring has its own stiffness [N/m] and rest
length, and its law is ``stiffness (length - rest_length)``, that of springtune. `MeshSpringForceField` will not do: it
has one stiffness for all edges, divides it by their lengths, and since v24.12 passes over springs that it is given
(sofa issue 5135). Particles have three dimensions, that across the plane held: for those every component is there.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from .simulation import PERIOD, about, filled, numbers, simulate
from .terms import Net

BACKWARD_EULER = (
    ("Sofa.Component.ODESolver.Backward", "EulerImplicitSolver"),
    ("Sofa.Component.IntegrationScheme.Backward", "EulerImplicitIntegrationScheme"),
)
"""Plugin and component of backward Euler, until v25.12 and since v26.06."""

PLUGINS = (
    "Sofa.Component.Constraint.Projective",
    "Sofa.Component.LinearSolver.Direct",
    "Sofa.Component.Mass",
    "Sofa.Component.MechanicalLoad",
    "Sofa.Component.SolidMechanics.Spring",
    "Sofa.Component.StateContainer",
    "Sofa.Component.Topology.Container.Dynamic",
    "Sofa.Component.Visual",
)


class Component(NamedTuple):
    """A component of a scene."""

    name: str
    data: Mapping[str, str]


SCENE_ROOT = [
    Component("DefaultAnimationLoop", {}),
    Component("VisualStyle", {"displayFlags": "showBehaviorModels showForceFields"}),
]


class SofaScene(NamedTuple):
    """Nodes of a scene in SOFA's order; the first two components of `sheet` are integrator and solver; step in s."""

    step: float
    about: list[str]
    sheet: list[Component]
    predicted: list[Component]


def sofa_xml(net: Net) -> str:
    """Scene of a net for SOFA v24.06 to v25.12, as XML.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("40 mm", "20 mm"), st.Material("210 GPa", 0.3, density="7850 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "right", "20 mm"), steel, "traction", "1 kN", definition="lattice")
    >>> [path] = scene.springs.write("net.scn")
    >>> next(line for line in path.read_text().splitlines() if "<Fixed" in line).strip()
    '<FixedProjectiveConstraint template="Vec3" indices="0 1"/>'
    """
    scene = _scene(net)
    plugin, integrator = BACKWARD_EULER[0]
    sheet = [scene.sheet[0]._replace(name=integrator), *scene.sheet[1:]]
    return filled("sofa.scn", scene=scene._replace(sheet=sheet), plugins=(*PLUGINS, plugin), root=SCENE_ROOT)


def sofa_python(net: Net) -> str:
    """Scene of a net for SOFA v24.06 and later with SofaPython3, in Python; errors as of `sofa_xml`."""
    return filled("sofa.py", scene=_scene(net), plugins=PLUGINS, backward_euler=BACKWARD_EULER, root=SCENE_ROOT)


def _vec3(kind: str, **data: str) -> Component:
    return Component(kind, {"template": "Vec3", **data})


def _positions(points: np.ndarray) -> str:
    return numbers(np.column_stack([points, np.zeros(len(points))]))


def _scene(net: Net) -> SofaScene:
    simulation = simulate(net, "SOFA")
    there = net.stiffness != 0
    edges, lengths = net.springs[there], net.rest_lengths[there].tolist()
    springs = " ".join(
        f"{first} {second} {stiffness!r} 0 {length!r}"
        for (first, second), stiffness, length in zip(edges.tolist(), net.stiffness[there].tolist(), lengths)
    )
    sheet = [
        Component("EulerImplicit", {"rayleighStiffness": "0", "rayleighMass": repr(simulation.mass_damping)}),
        Component("SparseLDLSolver", {}),
        _vec3("MechanicalObject", name="particles", position=_positions(net.points)),
        Component(
            "EdgeSetTopologyContainer", {"name": "edges", "position": "@particles.position", "edges": numbers(edges)}
        ),
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
    said = "the one here is below it"
    if simulation.loaded_frequency:
        said = f"the one here is that of backward Euler, a {PERIOD}th of the slowest period that the load excites"
    predicted = []
    if simulation.displacements is not None:
        shown = {"showObject": "1", "showObjectScale": "4", "showColor": "0.1 0.6 0.2 1"}
        moved = _positions(net.points + simulation.displacements)
        predicted = [_vec3("MechanicalObject", name="particles", position=moved, **shown)]
    return SofaScene(simulation.implicit_step, about(net, simulation, said), sheet, predicted)
