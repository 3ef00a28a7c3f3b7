"""Let go: a bent beam swings, and its frequency is that of beam theory.

A cantilever is bent by a force at its end, in equilibrium. Then the force is gone, and the beam swings with
`1.875^2 / (2 pi L^2) sqrt(E I / (rho A))`. The implicit midpoint takes long steps and keeps the energy.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import springtune as st


def main():
    """Return the frequency of the swing [Hz]."""
    beam, steel = st.Beam("100 mm", "5 mm"), st.Material("210 GPa", 0.3, density="7850 kg/m^3")
    mesh = st.make_mesh(beam, "structured", "0.5 mm")
    scene = st.Scene(beam, mesh, steel, "bending", "1 N", definition="patch", kinematics="linear")
    bent = scene.solve().displacements

    period = 2 * math.pi / scene.motion().loaded_frequency  # of the motion that the force excites
    motion, tip = scene.motion(released=True), []
    run = motion.run(
        "implicit-midpoint",
        period / 100,
        250,
        start=bent,
        sample=1,
        watch=lambda time, u, v: tip.append([time, scene.displacement_of(u)]),
    )
    time, moved = np.array(tip).T
    zero = np.flatnonzero(moved[:-1] * moved[1:] < 0)
    crossings = time[zero] - moved[zero] * np.diff(time)[zero] / np.diff(moved)[zero]
    frequency = 0.5 * (len(crossings) - 1) / (crossings[-1] - crossings[0])
    energy = run.samples[:, 1]
    print(f"{frequency:.0f} Hz; energy {1e6 * energy[0]:.2f} uJ, kept to {np.ptp(energy) / energy[0]:.0e}")

    _, ax = plt.subplots(figsize=(5, 3), layout="constrained")
    ax.plot(1e3 * time, 1e6 * moved)
    ax.set(xlabel="time [ms]", ylabel="deflection of the end [um]")
    return frequency


if __name__ == "__main__":
    main()
    plt.show()
