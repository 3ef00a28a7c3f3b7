"""Constraints for extended position-based dynamics (XPBD), as JSON.

A spring is the distance constraint ``C = l - L`` with the compliance 1/k [m/N] (Macklin, Mueller, Chentanez, XPBD,
Motion in Games 2016): where a solver has converged, the constraint pulls with C over its compliance, for any step.
"""

import json
from typing import Any

import numpy as np

from .simulation import simulate
from .terms import Net

CONTENT = {
    "points": "particles at rest [m]",
    "inverse_masses": "of the particles [1/kg]; 0 where a particle is held",
    "held_directions": "particle and axis of directions that are held, of particles that are not held as a whole",
    "forces": "of the load on each particle [N]",
    "constraints": "C = distance of the particles - rest_lengths [m], with compliance [m/N]; one list each",
    "time_step": "a fiftieth of the slowest period that the load excites [s]; XPBD is stable in any, and converges the "
    "sooner the shorter it is",
    "mass_damping": "damping over mass that is critical for the lowest frequency, or under large tension up to the "
    "loaded one [1/s]; velocities go down to their share 1 / (1 + mass_damping * time_step) in each step",
    "displacements": "where the load brings the particles in the end [m]; null where there is no stable equilibrium",
}
"""What each entry of a file is."""


def xpbd(net: Net) -> str:
    """Particles and distance constraints of a net for XPBD.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("40 mm", "20 mm"), st.Material("210 GPa", 0.3, density="7850 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "right", "20 mm"), steel, "traction", "1 kN", definition="lattice")
    >>> [path] = scene.springs.write("net.xpbd.json")
    >>> found = json.loads(path.read_text())
    >>> found["inverse_masses"][0], f"{found['constraints']['compliance'][0]:.3g} m/N"
    (0.0, '1.1e-08 m/N')
    """
    simulation = simulate(net, "XPBD")
    negative = int((net.stiffness < 0).sum())
    if negative:
        raise ValueError(
            f"definition '{net.header['definition']}': {negative} of {len(net.springs)} springs have a negative "
            f"stiffness, and no compliance of XPBD is negative; take a mesh with less slender or obtuse cells, or "
            "'patch' or 'lattice', whose springs all pull"
        )
    there = net.stiffness > 0
    whole = np.asarray(net.held.all(axis=1))
    displacements = simulation.displacements
    content: dict[str, Any] = {
        "header": dict(net.header) | {"springs_without_stiffness_left_out": int((~there).sum())},
        "content": CONTENT,
        "points": net.points.tolist(),
        "inverse_masses": np.where(whole, 0.0, 1 / simulation.masses).tolist(),
        "held_directions": np.argwhere(net.held & ~np.repeat(whole[:, None], 2, axis=1)).tolist(),
        "forces": net.forces.tolist(),
        "constraints": {
            "particles": net.springs[there].tolist(),
            "rest_lengths": net.rest_lengths[there].tolist(),
            "compliance": (1 / net.stiffness[there]).tolist(),
        },
        "time_step": simulation.implicit_step,
        "mass_damping": simulation.mass_damping,
        "displacements": None if displacements is None else displacements.tolist(),
    }
    # An entry a line: rows of their own would make most of the file blanks.
    lines = [f" {json.dumps(key)}: {json.dumps(value)}" for key, value in content.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"
