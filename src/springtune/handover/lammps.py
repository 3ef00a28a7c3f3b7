"""LAMMPS: an input script, and beside it the data file of particles and bonds.

Springs are bonds of the style ``bpm/spring`` (package BPM), with one bond type for each stiffness: the force is
``k (r0 - r)``, k in N/m without a factor of a half, and r0 is the distance at the begin of the first run. Bonds do not
break (``break no``), and no factor smooths their end (``smooth no``). ``bond_style harmonic`` would have its energy
``K (r - r0)^2``, so K = k / 2 there. Energies of angles are ``angle_style harmonic``, ``K (theta - theta0)^2`` with K =
beta / 2 in J and theta0 in degrees. Tried with the release of 22 July 2025.

Masses, loads and supports are per particle (`fix property/atom`). A support is `fix setforce`, the load `fix addforce`.
The script minimises by FIRE, which needs forces alone, in steps no longer than the stable one: energies are too coarse,
`min_style cg` and `hftn` stop at the begin. Lines for a damped motion stand below as comments.
"""

import numpy as np

from ..mesh.cells import no_cells
from .simulation import about, filled, simulate
from .terms import Net, Terms

BALANCED = 1e-10
"""Force out of balance that ends the minimisation, over the load [1]."""

LONGEST_MINIMISATION = 1_000_000
"""Steps of the minimisation at most."""


def lammps(net: Net, data: str) -> tuple[str, str]:
    """Input script of a net, and the data file of the given name that it reads.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("40 mm", "20 mm"), st.Material("210 GPa", 0.3, density="7850 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "right", "20 mm"), steel, "traction", "1 kN", definition="lattice")
    >>> [script, data] = scene.springs.write("net.lmp")
    >>> next(line for line in script.read_text().splitlines() if line.startswith("bond_coeff"))
    'bond_coeff 1 90932667.39736606 1.0 0.0'
    """
    simulation = simulate(net, "LAMMPS", ("angle", "corner"))
    there = np.flatnonzero(net.stiffness)
    stiffness, kinds = np.unique(net.stiffness[there], return_inverse=True)
    found = [part for part in map(_angles, net.energies) if len(part[1])]
    moduli, angles = (np.concatenate(parts) for parts in zip(*found)) if found else (np.empty((0, 2)), no_cells(3))
    types, of_angles = np.unique(moduli, axis=0, return_inverse=True)
    moved = np.zeros(net.points.shape) if simulation.displacements is None else simulation.displacements
    margin = float(net.rest_lengths.mean())
    forces = np.where(net.held, 0.0, net.forces)
    columns = [simulation.masses, *forces.T, *(net.points + moved).T, *net.held.T.astype(int)]
    said = f"the one here is {simulation.step / simulation.largest_step:.2g} of it"
    script = filled(
        "lammps.lmp",
        about=about(net, simulation, said),
        simulation=simulation,
        data=data,
        longest=float(net.rest_lengths.max()),
        stiffness=stiffness.tolist(),
        types=types.tolist(),
        balanced=BALANCED * float(np.abs(net.forces).sum()),
        steps=LONGEST_MINIMISATION,
    )
    particles = filled(
        "lammps.data",
        net=net,
        bonds=(np.column_stack([kinds, net.springs[there]]) + 1).tolist(),
        kinds=len(stiffness),
        angles=(np.column_stack([of_angles, angles]) + 1).tolist(),
        types=len(types),
        margin=margin,
        low=(net.points.min(axis=0) - margin).tolist(),
        high=(net.points.max(axis=0) + margin).tolist(),
        particles=list(zip(*(column.tolist() for column in columns))),
    )
    return script, particles


def _angles(terms: Terms) -> tuple[np.ndarray, np.ndarray]:
    """K [J] and angle at rest [degrees] of the angles of triangles, shape (n, 2), and their particles, (n, 3)."""
    rest, particles = terms.values["rest_angle"], np.stack([np.roll(terms.cells, 1 - i, axis=1) for i in range(3)], 1)
    modulus = terms.values["modulus"][:, None] if terms.kind == "angle" else terms.values["rotational"]
    there = np.broadcast_to(modulus != 0, rest.shape)
    return np.stack([0.5 * np.broadcast_to(modulus, rest.shape)[there], np.degrees(rest[there])], 1), particles[there]
