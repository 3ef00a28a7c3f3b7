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

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from ..mesh.cells import no_cells
from .simulation import Simulation, about, simulate
from .terms import Net, Terms

BOND_STYLE = "bpm/spring break no smooth no"
"""Style of all bonds; its coefficients are stiffness [N/m], strain at break, which means nothing here, and damping."""

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
    bonds = np.column_stack([kinds, net.springs[there]]) + 1
    found = [part for part in map(_angles, net.energies) if len(part[1])]
    moduli, angles = (np.concatenate(parts) for parts in zip(*found)) if found else (np.empty((0, 2)), no_cells(3))
    types, kinds = np.unique(moduli, axis=0, return_inverse=True)
    angles = np.column_stack([kinds, angles]) + 1
    return _script(net, simulation, data, stiffness.tolist(), types.tolist()), _data(net, simulation, bonds, angles)


def _angles(terms: Terms) -> tuple[np.ndarray, np.ndarray]:
    """K [J] and angle at rest [degrees] of the angles of triangles, shape (n, 2), and their particles, (n, 3)."""
    rest, particles = terms.values["rest_angle"], np.stack([np.roll(terms.cells, 1 - i, axis=1) for i in range(3)], 1)
    modulus = terms.values["modulus"][:, None] if terms.kind == "angle" else terms.values["rotational"]
    there = np.broadcast_to(modulus != 0, rest.shape)
    return np.stack([0.5 * np.broadcast_to(modulus, rest.shape)[there], np.degrees(rest[there])], 1), particles[there]


def _script(
    net: Net, simulation: Simulation, data: str, stiffness: list[float], angles: list[tuple[float, float]]
) -> str:
    """Commands of a net."""
    longest, load = float(net.rest_lengths.max()), float(np.abs(net.forces).sum())
    damping = f" - {simulation.mass_damping!r}*mass*v"
    said = f"the one here is {simulation.step / simulation.largest_step:.2g} of it"
    lines = [
        *(f"# {line}" for line in about(net, simulation, said)),
        "units si",
        "dimension 2",
        "boundary s s p",
        "newton on off",
        f"atom_style {'angle' if angles else 'bond'}",
        "atom_modify map yes",
        f"comm_modify vel yes cutoff {4 * longest:.6g}",
        "special_bonds lj 0.0 1.0 1.0 coul 0.0 1.0 1.0",
        f"pair_style zero {longest:.6g}",
        "fix particles all property/atom rmass d_fx d_fy d_ux d_uy i_heldx i_heldy ghost yes",
        f'read_data "{data}" fix particles NULL Particles',
        "pair_coeff * *",
        f"bond_style {BOND_STYLE}",
        *(f"bond_coeff {number} {one!r} 1.0 0.0" for number, one in enumerate(stiffness, start=1)),
        *(["angle_style harmonic"] if angles else []),
        *(f"angle_coeff {number} {k!r} {rest!r}" for number, (k, rest) in enumerate(angles, start=1)),
        f"neighbor {0.3 * longest:.6g} bin",
        f"timestep {simulation.step!r}",
    ]
    for axis in "xy":
        lines += [f"variable held{axis} atom i_held{axis}", f"group held{axis} variable held{axis}"]
    lines += [
        "# The load, whose energy the minimisation has no use for.",
        "variable fx atom d_fx",
        "variable fy atom d_fy",
        "variable none atom 0.0",
        "fix load all addforce v_fx v_fy 0.0 energy v_none",
        "fix_modify load energy yes",
        "fix holdx heldx setforce 0.0 NULL NULL",
        "fix holdy heldy setforce NULL 0.0 NULL",
        "fix plane all enforce2d",
        "thermo 1000",
        "min_style fire",
        "min_modify tmax 1.0",
        *([f"minimize 0.0 {BALANCED * load!r} {LONGEST_MINIMISATION} {LONGEST_MINIMISATION}"] if load else []),
        "# A motion in the place of the minimisation, critically damped:",
        f'# variable fx atom "d_fx{damping}x"',
        f'# variable fy atom "d_fy{damping}y"',
        "# fix motion all nve",
        "# run 100000",
    ]
    if simulation.displacements is not None:
        lines += [
            "# Distance from the equilibrium that springtune found.",
            'variable away atom "sqrt((x-d_ux)^2+(y-d_uy)^2)"',
            "compute away all reduce max v_away",
            "variable furthest equal c_away",
            "run 0",
            'print "largest distance from the predicted equilibrium: ${furthest} m"',
        ]
    return "\n".join(lines) + "\n"


def _data(net: Net, simulation: Simulation, bonds: np.ndarray, angles: np.ndarray) -> str:
    """Particles, bonds as rows of type and ends, and angles as rows of type and particles."""
    moved = np.zeros(net.points.shape) if simulation.displacements is None else simulation.displacements
    margin = float(net.rest_lengths.mean())
    low, high = net.points.min(axis=0) - margin, net.points.max(axis=0) + margin
    forces = np.where(net.held, 0.0, net.forces)
    numbers = [simulation.masses, *forces.T, *(net.points + moved).T, *net.held.T.astype(int)]
    lines = [
        f"LAMMPS data file of {net.header['made_by']}",
        "",
        f"{len(net.points)} atoms",
        f"{len(bonds)} bonds",
        *([f"{len(angles)} angles"] if len(angles) else []),
        "1 atom types",
        f"{bonds[:, 0].max()} bond types",
        *([f"{angles[:, 0].max()} angle types"] if len(angles) else []),
        f"{float(low[0])!r} {float(high[0])!r} xlo xhi",
        f"{float(low[1])!r} {float(high[1])!r} ylo yhi",
        f"{-margin!r} {margin!r} zlo zhi",
        *_section(f"Atoms # {'angle' if len(angles) else 'bond'}", ((1, 1, x, y, 0.0) for x, y in net.points.tolist())),
        *_section("Bonds", bonds.tolist()),
        *(_section("Angles", angles.tolist()) if len(angles) else []),
        *_section("Particles", zip(*(column.tolist() for column in numbers))),
    ]
    return "\n".join(lines) + "\n"


def _section(title: str, rows: Iterable[Sequence[float]]) -> Iterator[str]:
    """Numbered rows under a title."""
    yield from ("", title, "")
    for number, row in enumerate(rows, start=1):
        yield f"{number} {' '.join(map(repr, row))}"
