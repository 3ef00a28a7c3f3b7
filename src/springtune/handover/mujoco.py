"""MuJoCo's models (MJCF): particles on slides, springs as tendons.

Each particle that can move is a body on a slide joint for each direction that is not held, each spring a spatial tendon
with its stiffness and its rest length: MuJoCo's law is ``stiffness (springlength - length)`` along the tendon, which is
that of springtune, in tension and in compression. A fixed tendon spreads the load, and one actuator is the load, its
control added to it: in the viewer the net moves, and a slider changes the load. Damping is that of the
joints, which MuJoCo's integrator Euler takes implicitly; else it is `symplectic-euler`, and so is its largest step.

Coupled springs of squared lengths (definition `delingette`) are the St. Venant-Kirchhoff energy of linear triangles,
and so is MuJoCo's flex of two dimensions (3.3.7 and later); young and poisson mean other constants in version 3. Its
shear modulus and Lame's first constant, times the thickness t, are

    MuJoCo 3: mu t = t young / (8 (1 + poisson)), lambda t = t young poisson / (2 (1 + poisson) (1 - 2 poisson));
    MuJoCo 4: mu t = t young / (2 (1 + poisson)), lambda t = t young poisson / (1 - poisson^2), those of plane stress,

as single triangles in MuJoCo 3.3.7, 3.5.0, 3.17.0 and 4.0.0 have it, to rounding. No pair of values serves both, so a
file with a flex is for one version, and the other refuses it. Bodies of a flex may have no damping in their joints, so
a fixed tendon for each joint has it. Before 3.15.0 forces were wrong on bodies of a flex that move along y alone: a
file for version 3 that has such bodies is refused there.
"""

from collections.abc import Sequence
from xml.sax.saxutils import quoteattr

import numpy as np

from .simulation import Simulation, about, commented, lame, load_in_words, numbers, simulate
from .terms import Net, Terms

VERSIONS = (3, 4)
"""Versions of MuJoCo that files are written for; the last one where none is asked for."""

LEAST_MASS = 1e-15
"""Mass below which MuJoCo takes no body that moves [kg]."""

REFUSED_BY_4 = "for MuJoCo 3 alone, write the file with --mujoco 4"
"""Name of a tendon that MuJoCo 4 refuses, which its message has."""

LARGEST_ACCELERATION = 1e9
"""Acceleration beyond which MuJoCo may take a run for a diverged one, a tenth of its limit [m/s2]."""


def mjcf(net: Net, version: int = VERSIONS[-1]) -> str:
    """Model of a net for MuJoCo.

    Examples
    --------
    >>> import springtune as st
    >>> beam, steel = st.Beam("40 mm", "20 mm"), st.Material("210 GPa", 0.3, density="7850 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "right", "20 mm"), steel, "traction", "1 kN", definition="lattice")
    >>> [path] = scene.springs.write("net.xml")
    >>> next(line for line in path.read_text().splitlines() if "<spatial" in line).strip()
    '<spatial stiffness="90932667.39736606" springlength="0.02"><site site="p0"/><site site="p1"/></spatial>'
    """
    if version not in VERSIONS:
        known = " or ".join(map(str, VERSIONS))
        raise ValueError(f"mujoco: {version!r} is no version of MuJoCo that files are written for; give {known}")
    return model(net, simulate(net, "MuJoCo", ("biquadratic",)), version)


def model(net: Net, simulation: Simulation, version: int, integrator: str = "Euler") -> str:
    """Model of a net that moves as a simulation says, by one of MuJoCo's integrators."""
    moving = ~net.held.all(axis=1)
    least = float(simulation.masses[moving].min())
    if least < LEAST_MASS:
        raise ValueError(
            f"masses: the least one is {least:.3g} kg, and MuJoCo takes {LEAST_MASS:g} kg and more; take larger "
            "cells or a thicker sheet"
        )
    size = float(net.rest_lengths.mean())
    moved = 0.0 if simulation.displacements is None else simulation.displacements
    seen = np.concatenate([net.points, net.points + moved])
    low, high = seen.min(axis=0), seen.max(axis=0)
    centre = " ".join(f"{value:.6g}" for value in (low + high) / 2)
    accelerations = np.abs(np.where(net.held, 0, net.forces)).max(axis=1) / simulation.masses
    keep = ' autoreset="disable"' if accelerations.max() > LARGEST_ACCELERATION else ""
    said = f"the one here is {simulation.step / simulation.largest_step:.2g} of it"
    load = net.header.get("load")
    title = net.header["definition"] + (f", {load_in_words(load)}" if load else "")
    flex = [_flex(net, terms, size, version) for terms in net.energies]
    # MuJoCo 3 has no other solver for a flex under it.
    solver = ' solver="CG"' if flex and version == 3 and integrator == "discrete" else ""
    lines = [
        f"<mujoco model={quoteattr(title)}>",
        *commented([*about(net, simulation, said), f"Written {for_versions(net.energies, version)}."], "  "),
        f'  <option timestep="{simulation.step!r}" integrator="{integrator}"{solver} gravity="0 0 0">',
        f'    <flag contact="disable"{keep}/>',
        "  </option>",
        f'  <statistic center="{centre} 0" extent="{0.6 * float(np.hypot(*(high - low))):.6g}" meansize="{size:.6g}"/>',
        "  <visual>",
        '    <global azimuth="90" elevation="-90"/>',
        '    <headlight ambient="0.6 0.6 0.6" diffuse="0.4 0.4 0.4"/>',
        "  </visual>",
        "  <asset>",
        '    <texture type="skybox" builtin="flat" rgb1="1 1 1" rgb2="1 1 1" width="8" height="8"/>',
        "  </asset>",
        "  <default>",
        f'    <site size="{size / 8:.6g}" rgba="0.2 0.2 0.25 1"/>',
        f'    <tendon width="{size / 16:.6g}" rgba="0.2 0.45 0.7 1"/>',
        '    <default class="x"><joint type="slide" axis="1 0 0"/></default>',
        '    <default class="y"><joint type="slide" axis="0 1 0"/></default>',
        "  </default>",
        "  <worldbody>",
        *_particles(net, simulation, bool(flex)),
        "  </worldbody>",
        *flex,
        *_tendons(net, simulation, bool(flex), version),
        *_load(net, simulation),
        *(_refused_before_3_15(net) if flex and version == 3 else []),
        "</mujoco>",
    ]
    return "\n".join(lines) + "\n"


def for_versions(energies: Sequence[Terms], version: int | None = None) -> str:
    """Which versions of MuJoCo a file is for."""
    if not energies:
        return f"for MuJoCo {' and '.join(map(str, VERSIONS))}: springs are the same in both"
    version = version or VERSIONS[-1]
    [other] = set(VERSIONS) - {version}
    refused = f"MuJoCo {other}, whose flex has other constants, refuses it"
    return f"for MuJoCo {version}; {refused}: write one with mujoco {other} for that"


def _particles(net: Net, simulation: Simulation, bodies: bool) -> list[str]:
    """Bodies of particles that can move; others are places in the world, or bodies without joints for a flex."""
    lines = []
    masses = simulation.masses.tolist()
    for number, ((x, y), held) in enumerate(zip(net.points.tolist(), net.held.tolist())):
        place = f'pos="{x!r} {y!r} 0"'
        if all(held):
            body = f'<body name="b{number}" {place}><site name="p{number}"/></body>'
            lines.append(f"    {body}" if bodies else f'    <site name="p{number}" {place}/>')
            continue
        mass = masses[number]
        joints = "".join(
            f'<joint class="{axis}" name="{axis}{number}"{_damping(simulation, number, not bodies)}/>'
            for axis, fixed in zip("xy", held)
            if not fixed
        )
        inertia = f'<inertial pos="0 0 0" mass="{mass!r}" diaginertia="{mass!r} {mass!r} {mass!r}"/>'
        lines.append(f'    <body name="b{number}" {place}>{joints}{inertia}<site name="p{number}"/></body>')
    return lines


def _damping(simulation: Simulation, number: int, here: bool) -> str:
    """Damping of a particle, in proportion to its mass."""
    return f' damping="{float(simulation.mass_damping * simulation.masses[number])!r}"' if here else ""


def _tendons(net: Net, simulation: Simulation, dampers: bool, version: int) -> list[str]:
    """Tendons: springs, what spreads the load, and dampers of joints that may have none: of the bodies of a flex."""
    rows = zip(net.springs.tolist(), net.stiffness.tolist(), net.rest_lengths.tolist())
    lines = [
        f'    <spatial stiffness="{stiffness!r}" springlength="{length!r}">'
        f'<site site="p{first}"/><site site="p{second}"/></spatial>'
        for (first, second), stiffness, length in rows
        if stiffness
    ]
    if simulation.force:
        shares = np.where(net.held, 0.0, net.forces / simulation.force)
        joints = "".join(
            f'<joint joint="{"xy"[axis]}{number}" coef="{float(shares[number, axis])!r}"/>'
            for number, axis in np.argwhere(shares).tolist()
        )
        lines.append(f'    <fixed name="load">{joints}</fixed>')
    if dampers and simulation.mass_damping:
        lines += [
            f'    <fixed{_damping(simulation, number, True)}><joint joint="{"xy"[axis]}{number}" coef="1"/></fixed>'
            for number, axis in np.argwhere(~net.held).tolist()
        ]
    if dampers and version == 3:
        # MuJoCo 3 takes it, and it does nothing there; MuJoCo 4 refuses a joint that is repeated, and says the name.
        number, axis = np.argwhere(~net.held)[0].tolist()
        twice = "".join(f'<joint joint="{"xy"[axis]}{number}" coef="{sign}"/>' for sign in (1, -1))
        lines.append(f'    <fixed name="{REFUSED_BY_4}">{twice}</fixed>')
    return ["  <tendon>", *lines, "  </tendon>"] if lines else []


def _refused_before_3_15(net: Net) -> list[str]:
    """Sensor that MuJoCo takes since 3.15, where older ones get forces wrong: on bodies of a flex that move along y."""
    number = next(iter(np.flatnonzero(net.held[:, 0] & ~net.held[:, 1]).tolist()), None)
    if number is None:
        return []
    return [
        "  <!-- MuJoCo 3.15 and later: before, forces on a flex were wrong at particles held in x alone. -->",
        f'  <sensor><insidesite site="p{number}" objtype="site" objname="p{number}" enclosed="false"/></sensor>',
    ]


def elasticity(first: float, second: float, version: int) -> tuple[float, float]:
    """Young [N/m] and poisson [1] of a flex of thickness 1 that has two Lame constants, times the thickness [N/m]."""
    ratio = first / second
    if version != 3 and ratio > 2 * (1 + 1e-9):
        raise ValueError(
            f"the sheet is in plane strain and has a Poisson's ratio of {ratio / (2 + ratio):.3g} in its plane, and a "
            f"flex of MuJoCo {version} takes less than 0.5; take MuJoCo 3, or springs alone such as 'patch'"
        )
    # MuJoCo refuses a half, which plane stress allows in MuJoCo 4.
    poisson = ratio / (4 + 2 * ratio) if version == 3 else min(ratio / (2 + ratio), float(np.nextafter(0.5, 0)))
    return (8 if version == 3 else 2) * (1 + poisson) * second, poisson


def _flex(net: Net, terms: Terms, size: float, version: int) -> str:
    """Triangles whose sides are coupled, as a flex: where all have one pair of Lame constants."""
    first, second = lame(net, terms, "MuJoCo's flex")
    young, poisson = elasticity(first, second, version)
    # An attribute that MuJoCo 3 does not know, and refuses; 0 turns it off.
    only = "" if version == 3 else ' yield="0"'
    bodies = " ".join(f"b{number}" for number in range(len(net.points)))
    return "\n".join(
        [
            "  <deformable>",
            *commented(
                [
                    f"Delingette's springs: young and poisson are those with which a flex of MuJoCo {version} has the",
                    f"Lame constants of plane stress, times the thickness: lambda t = {first:.6g} N/m, mu t = "
                    f"{second:.6g} N/m.",
                ],
                "    ",
            ),
            f'    <flex name="sheet" dim="2" radius="{size / 20:.6g}" rgba="0.2 0.45 0.7 1" body="{bodies}" '
            f'element="{" ".join(map(str, terms.cells.ravel().tolist()))}">',
            f'      <elasticity young="{young!r}" poisson="{poisson!r}" thickness="1" elastic2d="stretch"{only}/>',
            "    </flex>",
            "  </deformable>",
        ]
    )


def _load(net: Net, simulation: Simulation) -> list[str]:
    """Actuator that holds the load, and the equilibrium as a keyframe."""
    lines = []
    if simulation.force:
        most = abs(simulation.force)
        what = "load [N]" if "force" in net.header["load"] else "factor on the load"
        lines += [
            "  <actuator>",
            f"    <!-- The {what}; the control is added to it. -->",
            f'    <general name="load" tendon="load" gaintype="fixed" gainprm="1" biastype="affine" '
            f'biasprm="{simulation.force!r} 0 0" ctrllimited="true" ctrlrange="{-most!r} {most!r}"/>',
            "  </actuator>",
        ]
    if simulation.displacements is not None:
        lines += [
            "  <keyframe>",
            f'    <key name="predicted" qpos="{numbers(simulation.displacements[~net.held])}"/>',
            "  </keyframe>",
        ]
    return lines
