"""MuJoCo: springs as tendons, triangles of a material as a flex; one engine for each integrator.

`Euler`, `implicitfast` and `RK4` need steps below the stable one. `discrete`, since MuJoCo 3.13, is implicit in
springs, too: `iterations` are those of its conjugate gradients, by default 100. MuJoCo computes in double precision.
Its reset of states that diverge is turned off.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..handover.mujoco import flex, model
from ..handover.net import SpringNet
from ..handover.simulation import Simulation
from .base import SPRING_STIFFNESS, EngineError, Parameter, Session, Setting, engine, version_numbers

FLEX_SINCE = 4  # version of MuJoCo from which on a flex has the law of plane stress

PARAMETERS = {
    "stiffness": SPRING_STIFFNESS,
    "young": Parameter("Pa", "E"),
    "poisson": Parameter("1", "nu"),
    "thickness": Parameter("m", "t"),
}
"""Stiffness of a tendon; or what an ``elastic2d="stretch"`` flex has."""


def typed(net: SpringNet) -> dict[str, Any]:
    """Stiffness of each tendon, or the constants of the flex."""
    if not (sheet := flex(net)):
        return {"stiffness": net.stiffness}
    return {"young": sheet["young"] / net.thickness, "poisson": sheet["poisson"], "thickness": net.thickness}


@contextmanager
def _no_log() -> Iterator[None]:
    """Keep MuJoCo from writing warnings into a file of the current folder."""
    import mujoco

    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


class _Session:
    """A model of MuJoCo, damped over mass."""

    def __init__(self, net: SpringNet, setting: Setting, damping: float, integrator: str) -> None:
        import mujoco

        if net.energies and version_numbers(mujoco.__version__)[0] < FLEX_SINCE:
            raise EngineError(f"MuJoCo {mujoco.__version__}: a flex needs MuJoCo {FLEX_SINCE}; install it")
        loaded = float(np.any(net.forces))
        moves = Simulation(net.masses, loaded, setting.step, setting.step, 0.0, 0.0, 0.0, None, "")
        with _no_log():
            try:
                self.model = mujoco.MjModel.from_xml_string(model(net, moves, integrator))
            except ValueError as error:
                raise EngineError(f"MuJoCo {mujoco.__version__} refuses the net: {error}") from None
        self.model.opt.iterations = setting.iterations
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        self.data, self.step, self.moving = mujoco.MjData(self.model), mujoco.mj_step, ~net.held
        self.substeps, self.velocity_share = setting.substeps, 1 / (1 + damping * setting.step)

    def advance(self, frames: int) -> None:
        """Take a number of frames."""
        with _no_log():
            for _ in range(frames * self.substeps):
                self.step(self.model, self.data)
                self.data.qvel *= self.velocity_share

    def displacements(self) -> np.ndarray:
        """Displacement of each particle [m]."""
        moved = np.zeros(self.moving.shape)
        moved[self.moving] = self.data.qpos
        return moved


def _declare(order: float, integrator: str, summary: str, **declared: Any) -> None:
    def session(net: SpringNet, setting: Setting, damping: float) -> Session:
        return _Session(net, setting, damping, integrator)

    session.__doc__ = f"MuJoCo with the integrator {integrator}: {summary}."
    common: dict[str, Any] = {"laws": ("biquadratic",), "needs": ("mujoco",), "iterates": False}
    engine(
        f"mujoco-{integrator.lower()}",
        order=order,
        program="MuJoCo",
        extra="mujoco",
        precisions=("float64",),
        parameters=PARAMETERS,
        typed=typed,
        source="MuJoCo's documentation, Computation",
        besides="flag autoreset=disable: by default what explodes is put back, and the sheet stands at 0; gravity 0",
        **common | {"measured": "1e-7, ten scenes"} | declared,
    )(session)


_declare(110, "Euler", "springs explicit")
_declare(111, "implicitfast", "springs explicit, dampers implicit", laws=())
_declare(113, "RK4", "springs explicit, of fourth order")
_declare(
    114, "discrete", "springs and dampers implicit", needs=("mujoco>=3.13",), measured="1e-3, ten scenes", iterates=True
)
