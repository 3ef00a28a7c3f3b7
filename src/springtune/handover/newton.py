"""Sheets for Newton (newton-physics), read and run with Newton 1.8: a script of its `ModelBuilder`.

A triangle of Newton's solver VBD has Lame's constants of plane stress times the thickness t [N/m]

    tri_ke = mu t = E t / (2 (1 + nu)),    tri_ka = lambda t = E t nu / (1 - nu^2)

and the law of `springtune.mechanics.energies.StableNeoHookeEnergy`, at small strain that of `delingette`.
"""

import numpy as np

from ..mechanics.energies import Energy, StableNeoHookeEnergy
from .simulation import Net, comment_lines, fill_template, lame, simulate

LAWS = ("biquadratic",)  # energies that triangles of Newton stand for

LAW_COMMENTS = (
    "Triangles have Newton's law: mu/2 (tr C - 2 J) + (lambda + mu)/2 (J - 1)^2, mu = tri_ke, lambda = tri_ka.",
    "At small strain it is that of the definition; the displacement expected here is by Newton's law.",
)
"""Comments on that law."""

EXPLICIT_STEP_ITERATIONS = 10  # iterations in which VBD converges in a step that is stable in explicit schemes

SLOW_PERIOD_STEPS, LONG_STEP_AND_ITERATIONS = 300, (3.0, 60)
"""Loaded period over the largest explicit step above which a step is three times that one, with more iterations.

In single precision, what is left of h^2 f / m below the last place of a position is lost in each step.
"""

DECAY_TIMES = 12  # times in which the slowest mode comes down to 1/e that a script runs for


def membrane(net: Net) -> tuple[float, float]:
    """Return ``tri_ke`` and ``tri_ka`` [N/m] of all triangles; 0 where a net has springs alone."""
    first, shear = lame(net, net.energies[0], "Newton") if net.energies else (0.0, 0.0)
    return shear, first


def membrane_energies(net: Net, reference: float) -> list[Energy]:
    """Energies of the triangles by Newton's law, over the reference stiffness."""
    shear, first = membrane(net)
    ones = np.ones(len(net.triangles)) / reference
    return [StableNeoHookeEnergy(net.points, net.triangles, shear * ones, first * ones)] if net.energies else []


def colours(net: Net) -> list[np.ndarray]:
    """Return groups of particles that neither a spring nor a triangle joins: VBD moves a group at once."""
    joined: list[set[int]] = [set() for _ in net.points]
    for cell in [*net.springs.tolist(), *net.triangles.tolist()]:
        for corner in cell:
            joined[corner].update(cell)
    chosen = np.full(len(net.points), -1)
    for corner, others in enumerate(joined):
        taken = {chosen[other] for other in others}
        chosen[corner] = next(colour for colour in range(len(joined)) if colour not in taken)
    return [np.flatnonzero(chosen == colour) for colour in range(chosen.max() + 1)]


def newton_script(net: Net) -> str:
    """Return a script of a net for Newton's `ModelBuilder` and its solver VBD."""
    simulation = simulate(net, "Newton", LAWS, membrane_energies)
    shear, first = membrane(net)
    largest, loaded, damping = simulation.largest_step, simulation.loaded_frequency, simulation.mass_damping
    step, iterations = simulation.step, EXPLICIT_STEP_ITERATIONS
    if loaded and 2 * np.pi / loaded > SLOW_PERIOD_STEPS * largest:
        step, iterations = LONG_STEP_AND_ITERATIONS[0] * largest, LONG_STEP_AND_ITERATIONS[1]
    # Of the slowest mode that the load excites.
    rate = damping / 2 - max(damping**2 / 4 - simulation.frequency**2, 0.0) ** 0.5
    step_note = f"the one here is {step / largest:.2g} times that, in which {iterations} iterations converge"
    seconds = DECAY_TIMES / rate if rate else 100 * simulation.step
    if calibrated := net.header.get("calibrated"):
        step, damping, seconds = (float(calibrated[one]) for one in ("step", "damping", "seconds"))
        iterations = int(calibrated["iterations"])
        step_note = f"the one here is that of {calibrated['setting']}, for which the stiffness is made"
    return fill_template(
        "newton.py",
        net=net,
        simulation=simulation,
        promised=float(calibrated["displacement"]) if calibrated else None,
        damping=damping,
        about=[*comment_lines(net, simulation, step_note), *(LAW_COMMENTS if net.energies else ())],
        tri_ke=shear,
        tri_ka=first,
        step=step,
        iterations=iterations,
        seconds=seconds,
        there=net.stiffness != 0,
        colours=[group.tolist() for group in colours(net)],
    )
