"""PyBullet: a sheet as a deformable body of mass and springs (`loadSoftBody` in a deformable world).

Tried in 3.2.7, whose wheel computes in double precision; an OBJ file has positions in single precision.

- `springElasticStiffness` is the stiffness of each spring [N/m], and all springs of a body have the same. Springs are
  the edges of the triangles, with their lengths in the file as rest lengths.
- Bending springs join nodes that are two edges apart, even with ``useBendingSprings=0``: their stiffness
  `springBendingStiffness` is 0.1 N/m where none is given, and must be 0.
- Springs are explicit, so steps must be below the stable one; dampers `springDampingStiffness` are implicit. Solver
  iterations change nothing at rest.
- All nodes have the same mass. An anchor to the world (-1) holds a node in all directions, one to a prismatic joint in
  one.
- `applyExternalForce` does not act on a deformable body. So a loaded node is anchored to a rigid body of a node's mass,
  which is pushed and damped over mass; dampers do not act on anchored nodes. Dampers between the others have the
  stiffness over the damping over mass. Their solver leaves up to a thousandth of the load, the more the stronger they
  are, and does nothing about swings of micrometres.
- The laws of triangles (`useNeoHookean`) act on tetrahedra alone.
- Bodies that are slow fall asleep, and their forces vanish, unless `changeDynamics` forbids it.
"""

import tempfile
import weakref
from pathlib import Path
from typing import Any

import numpy as np

from ..handover.net import SpringNet
from .base import EngineError, Parameter, Setting, engine

LARGEST_SPREAD = 1e-9
"""Of the stiffnesses of a body that counts as uniform, over their mean [1]."""

FURTHEST = 1e-6
"""Distance of a node from where the file has it, over the extent of the body [1]."""

NO_CONTACT = {"useSelfCollision": 0, "useFaceContact": 0, "useNeoHookean": 0, "collisionMargin": 1e-6}


def typed(net: SpringNet) -> dict[str, Any]:
    """The one stiffness of all springs."""
    stiffness = net.stiffness
    if np.ptp(stiffness) > LARGEST_SPREAD * abs(stiffness.mean()):
        raise EngineError(
            f"definition '{net.header['definition']}': has springs of {stiffness.min():.4g} to {stiffness.max():.4g} "
            "N/m, and PyBullet has one stiffness for all springs of a body; take 'uniform', or 'paper' with a stiffness"
        )
    return {"springElasticStiffness": float(stiffness.mean()), "springBendingStiffness": 0.0}


def _obj(net: SpringNet) -> str:
    """Triangles whose edges are the springs; three for each quadrilateral, which has both diagonals."""
    quads = [net.quads[:, corners] for corners in ([0, 1, 2], [0, 2, 3], [1, 2, 3])]
    lines = [f"v {x!r} {y!r} 0" for x, y in net.points.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (np.concatenate([net.triangles, *quads]) + 1).tolist()]
    return "\n".join(lines) + "\n"


@engine(
    "pybullet",
    order=120,
    program="PyBullet",
    needs=("pybullet",),
    extra="pybullet",
    precisions=("float64",),
    parameters={
        "springElasticStiffness": Parameter("N/m", "k of the definition, one for all springs"),
        "springBendingStiffness": Parameter("N/m", "0; it is 0.1 where it is not given"),
    },
    iterates=False,
    dampers={"springDampingStiffness": Parameter("N s/m", "beta k, one for all springs")},
    typed=typed,
    measured="1e-3, ten scenes; 1e-5 on sheets",
    source="Bullet's source, btDeformableMassSpringForce.h",
)
class Deformable:
    """PyBullet's deformable world: springs of one stiffness, explicit, dampers implicit."""

    def __init__(self, net: SpringNet, setting: Setting, damping: float) -> None:
        import pybullet

        assert net.masses is not None  # of a scene that moves
        numbers = typed(net) | {"springDampingStiffness": 0.0, "springDampingAllDirections": 0}
        if damping:
            numbers["springDampingStiffness"] = numbers["springElasticStiffness"] / damping
        self.program, self.net, self.substeps = pybullet, net, setting.substeps
        self.here = {"physicsClientId": pybullet.connect(pybullet.DIRECT)}
        weakref.finalize(self, pybullet.disconnect, **self.here)
        pybullet.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD, **self.here)
        pybullet.setTimeStep(setting.step, **self.here)
        pybullet.setPhysicsEngineParameter(numSubSteps=1, **self.here)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "sheet.obj")
            path.write_text(_obj(net), encoding="utf-8")
            self.body = pybullet.loadSoftBody(
                str(path), mass=float(net.masses.sum()), useMassSpring=1, **numbers, **NO_CONTACT, **self.here
            )
        self.awake = {"activationState": pybullet.ACTIVATION_STATE_DISABLE_SLEEPING, **self.here}
        pybullet.changeDynamics(self.body, -1, **self.awake)
        self.rest = self._places()
        if len(self.rest) != len(net.points) or np.abs(self.rest - net.points).max() > FURTHEST * np.ptp(net.points):
            raise EngineError("mesh: PyBullet reads other nodes; take a mesh whose particles all belong to cells")
        forces = np.where(net.held, 0.0, net.forces)
        self.pushed: list[tuple[int, int, list[float]]] = []
        for node in np.flatnonzero(forces.any(axis=1) | net.held.any(axis=1)).tolist():
            body, link = self._carrier(node, damping)
            pybullet.createSoftBodyAnchor(self.body, node, body, link, *([[0, 0, 0]] if body >= 0 else []), **self.here)
            if forces[node].any():
                self.pushed.append((body, link, [*forces[node].tolist(), 0.0]))

    def _carrier(self, node: int, damping: float) -> tuple[int, int]:
        """Body and link that a node is anchored to; -1 is the world."""
        held, program = self.net.held[node], self.program
        if held.all():
            return -1, -1
        assert self.net.masses is not None
        mass, place = float(self.net.masses.mean()), [*self.rest[node].tolist(), 0.0]
        rail: dict[str, Any] = {}
        if held.any():
            one: dict[str, Any] = {"Masses": mass, "ParentIndices": 0, "JointTypes": program.JOINT_PRISMATIC}
            one |= {"JointAxis": [*np.where(held, 0, 1).tolist(), 0], "Positions": [0, 0, 0]}
            one |= {"CollisionShapeIndices": -1, "VisualShapeIndices": -1, "Orientations": [0, 0, 0, 1]}
            one |= {"InertialFramePositions": [0, 0, 0], "InertialFrameOrientations": [0, 0, 0, 1]}
            rail = {f"link{name}": [value] for name, value in one.items()}
        body = program.createMultiBody(0 if rail else mass, -1, -1, place, **rail, **self.here)
        link = 0 if rail else -1
        if rail:
            program.setJointMotorControl2(body, link, program.VELOCITY_CONTROL, force=0, **self.here)
        # It is damped for its node, too.
        program.changeDynamics(body, link, linearDamping=2 * damping, angularDamping=0, jointDamping=0, **self.awake)
        return body, link

    def _places(self) -> np.ndarray:
        """Positions of the nodes."""
        flags = self.program.MESH_DATA_SIMULATION_MESH
        return np.array(self.program.getMeshData(self.body, -1, flags=flags, **self.here)[1])[:, :2]

    def advance(self, frames: int) -> None:
        """Take a number of frames."""
        push, frame = self.program.applyExternalForce, self.program.LINK_FRAME
        for _ in range(frames * self.substeps):
            for body, link, force in self.pushed:
                push(body, link, force, [0, 0, 0], frame, **self.here)
            self.program.stepSimulation(**self.here)

    def displacements(self) -> np.ndarray:
        """Displacement of each particle [m]."""
        return np.asarray(self._places() - self.rest)
