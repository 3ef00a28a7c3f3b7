"""MuJoCo's models (MJCF): particles on slides, springs as tendons.

Each particle is a body on a slide joint for each free direction, each spring a spatial tendon with our law. A fixed
tendon spreads the load, and one actuator is the load: a slider of the viewer changes it. Damping is that of the joints,
which MuJoCo's integrator Euler takes implicitly; else it is `symplectic-euler`.

Coupled springs of squared lengths (definition `delingette`) are the flex of two dimensions of MuJoCo 4, with

    mu t = t young / (2 (1 + poisson)), lambda t = t young poisson / (1 - poisson^2) of plane stress

for the thickness t. MuJoCo 3 refuses a file with a flex. Its joints have no damping; fixed tendons have it.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..safe_io import printable
from .simulation import Net, Simulation, Terms, comment_lines, fill_template, lame, load_in_words, numbers, simulate

LEAST_MASS = 1e-15  # mass below which MuJoCo takes no body that moves [kg]

LARGEST_ACCELERATION = 1e9
"""Acceleration beyond which MuJoCo may take a run for a diverged one, a tenth of its limit [m/s2]."""


def mjcf(net: Net) -> str:
    """Return the model of a net for MuJoCo."""
    return model(net, simulate(net, "MuJoCo", ("biquadratic",)))


def model(net: Net, simulation: Simulation, integrator: str = "Euler") -> str:
    """Model of a net with the damping and step of a simulation, by one of MuJoCo's integrators."""
    least = float(simulation.masses[~net.held.all(axis=1)].min())
    if least < LEAST_MASS:
        why = f"the least one is {least:.3g} kg, and MuJoCo takes {LEAST_MASS:g} kg and more"
        raise ValueError(f"masses: {why}; take larger cells")
    moved = 0.0 if simulation.displacements is None else simulation.displacements
    seen = np.concatenate([net.points, net.points + moved])
    low, high = seen.min(axis=0), seen.max(axis=0)
    accelerations = np.abs(np.where(net.held, 0, net.forces)).max(axis=1) / simulation.masses
    load = net.header.get("load")
    title = net.header["definition"] + (f", {load_in_words(load)}" if load else "")
    step_note = f"the one here is {simulation.step / simulation.largest_step:.2g} of it"
    free = ["".join(axis for axis, fixed in zip("xy", held) if not fixed) for held in net.held.tolist()]
    joints = [f"{axis}{number}" for number, axes in enumerate(free) for axis in axes]
    shares = net.forces[~net.held] / (simulation.force or 1.0)
    masses, dampers = simulation.masses, simulation.mass_damping * simulation.masses
    return fill_template(
        "mujoco.xml",
        title=printable(title),
        about=[*comment_lines(net, simulation, step_note), f"Written {for_versions(net.energies)}."],
        simulation=simulation,
        integrator=integrator,
        fast=accelerations.max() > LARGEST_ACCELERATION,
        centre=tuple((low + high) / 2),
        extent=0.6 * float(np.hypot(*(high - low))),
        size=float(net.rest_lengths.mean()),
        particles=list(zip(range(len(free)), net.points.tolist(), free, masses.tolist(), dampers.tolist())),
        flex=flex(net),
        springs=list(zip(net.springs.tolist(), net.stiffness.tolist(), net.rest_lengths.tolist())),
        shares=[(joint, share) for joint, share in zip(joints, shares.tolist()) if share],
        of_beam=load and "force" in load,
        predicted=None if simulation.displacements is None else numbers(simulation.displacements[~net.held]),
    )


def for_versions(energies: Sequence[Terms]) -> str:
    """Versions of MuJoCo that a file is for."""
    if not energies:
        return "for MuJoCo 3 and 4"
    return "for MuJoCo 4; MuJoCo 3, whose flex has other constants, refuses it"


def elasticity(first: float, second: float) -> tuple[float, float]:
    """Young [N/m] and poisson [1] of a flex of thickness 1 that has two Lame constants, times the thickness [N/m]."""
    ratio = first / second
    if ratio > 2 * (1 + 1e-9):
        why = f"has a ratio of {ratio / (2 + ratio):.3g} in its plane, and a flex of MuJoCo takes less than 0.5"
        raise ValueError(f"sheet: {why}; take springs alone, such as 'patch'")
    poisson = min(ratio / (2 + ratio), float(np.nextafter(0.5, 0)))  # MuJoCo refuses a half
    return 2 * (1 + poisson) * second, poisson


def flex(net: Net) -> dict[str, Any] | None:
    """Values of a flex in place of coupled triangles, which must share one pair of Lame constants; None without any."""
    if not net.energies:
        return None
    first, second = lame(net, net.energies[0], "MuJoCo's flex")
    young, poisson = elasticity(first, second)
    cells = net.energies[0].cells.ravel().tolist()
    return {"first": first, "second": second, "young": young, "poisson": poisson, "cells": cells}
