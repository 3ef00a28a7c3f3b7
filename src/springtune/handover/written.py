"""Scenes and results as files: springs for other programs, deformed networks and series of them for ParaView."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..mechanics.dynamics import Motion, Run
from ..mechanics.integrators import BackwardEuler
from ..reference.small_strain import ReferenceNotConvergedError
from ..safe_io.atomic import check_folder
from ..scene.single import Result, Scene
from ..springs.base import Springs
from .formats import check_target, write_vtu_with
from .net import NOT_COMPUTED, SpringNet
from .paraview import MOST_PIECES, pieces_of, series

FRAMES = 50
"""Files of a series, where no number is given."""


def write_springs(path: str | Path, scene: Scene, springs: Springs, **options: Any) -> list[Path]:
    """Write springs of a scene, see `springtune.handover.net.SpringNet.write`."""
    check_target(path)
    return SpringNet.from_scene(scene, springs=springs, **options).write(path)


def write_result(path: str | Path, result: Result, steps: int = 10) -> list[Path]:
    """Write a deformed network, or the path to it, for ParaView; see `springtune.Result.write`."""
    path, scene = Path(path), result.scene
    if path.suffix.lower() not in (".vtu", ".pvd"):
        raise ValueError(f"{path}: '{path.suffix}' is no format of a result; give a name ending in .vtu or .pvd")
    check_folder(path)
    if not np.isfinite(result.displacement):
        raise ValueError(f"there is no equilibrium to write: {result.message}")
    if path.suffix.lower() == ".vtu":
        _Frames(scene).write(path, result.displacements)
        return [path]
    if not 1 <= steps <= MOST_PIECES:
        raise ValueError(f"steps: {steps!r} is not from 1 to {MOST_PIECES}; give the number of load steps")
    frames, about = _Frames(scene), scene.statement
    with series(path) as add:
        add(0.0, partial(frames.write, displacements=np.zeros(scene.mesh.points.shape), share=0.0))
        for share in np.arange(1, steps + 1) / steps:
            load = share * about.factor(scene.springs)
            linear = scene.kinematics == "linear"
            found = scene.problem.linear(load) if linear else scene.problem.nonlinear(load)
            if not found.converged:
                raise ValueError(f"no equilibrium at {100 * share:g} % of the force; give another number of steps")
            add(float(share * about.size), partial(frames.write, displacements=found.displacements, share=share))
    return pieces_of(path)


def write_motion(
    path: str | Path,
    scene: Scene,
    motion: Motion,
    integrator: str | BackwardEuler,
    step: float,
    steps: int,
    frames: int = FRAMES,
    **options: Any,
) -> Run:
    """Move a scene and write it as it moves, for ParaView; see `springtune.Scene.write_motion`."""
    path = Path(path)
    if path.suffix.lower() != ".pvd":
        raise ValueError(f"{path}: '{path.suffix}' is no format of a motion; give a name ending in .pvd")
    check_folder(path)
    if not 1 <= frames <= MOST_PIECES:
        raise ValueError(f"frames: {frames!r} is not from 1 to {MOST_PIECES}; give the number of files")
    if not (isinstance(steps, int) and steps >= 1):
        raise ValueError(f"steps: {steps!r} is not a whole number above zero; give the number of time steps")
    pieces = _Frames(scene, compared=False)
    with series(path) as add:

        def watch(time: float, u: np.ndarray, v: np.ndarray) -> None:
            add(time, partial(pieces.write, displacements=u, velocities=v, linear=motion.linear))

        run = motion.run(integrator, step, steps, sample=-(-steps // frames), watch=watch, **options)
        if run.status == "diverged":
            raise ValueError(run.message)
    return run


class _Frames:
    """Deformed networks of a scene as files, with what they have in common computed once."""

    def __init__(self, scene: Scene, compared: bool = True) -> None:
        self.scene = scene
        self.net = SpringNet.from_scene(scene, errors=False)
        self.reference: np.ndarray | None = None
        if not compared:
            return
        try:
            reference = scene.reference()
        except ReferenceNotConvergedError as error:
            self.net.header["reference"] = f"{NOT_COMPUTED}: {error}"
        else:
            self.reference = reference.at(scene.mesh.points)
            strain = "finite" if scene.finite_strain and not scene.objection else "small"
            self.net.header["reference"] = scene.objection or f"finite elements, {strain} strain, converged"

    def write(
        self,
        path: Path,
        displacements: np.ndarray,
        share: float = 1.0,
        velocities: np.ndarray | None = None,
        linear: bool | None = None,
    ) -> None:
        """Write displacements [m] under a share of the force [1]; the reference's, too, where that is known."""
        scene = self.scene
        linear = scene.kinematics == "linear" if linear is None else linear
        of_particles = {"displacement": displacements}
        if velocities is not None:
            of_particles["velocity"] = velocities
        # At finite strain a share of the force is not a share of the displacements.
        if self.reference is not None and (share == 1 or not scene.finite_strain):
            expected = share * self.reference
            of_particles |= {"reference_displacement": expected, "error": displacements - expected}
        forces = scene.springs.reference * scene.network.spring_forces(displacements, linear)
        numbers = {"displacement_of_the_load": scene.displacement_of(displacements)}
        write_vtu_with(path, self.net, of_particles, {"force": forces}, numbers)
