"""Dynamics: the largest stable time step, known before a run, and the lowest frequency of a pulled bar.

A run diverges with a step just above 2/omega_max, and not just below. A bar clamped at one end vibrates along its axis
with sqrt(E/rho) / (4 L).
"""

import math

import springtune as st


def main():
    """Return the lowest frequency that the load excites [Hz]."""
    beam, steel = st.Beam("100 mm", "5 mm"), st.Material("210 GPa", 0.3, density="7850 kg/m^3")
    mesh = st.make_mesh(beam, "structured", "1 mm")
    motion = st.Scene(beam, mesh, steel, "traction", "1 kN", definition="delingette").motion()
    limit = motion.step_limit("central-difference")
    for share in (0.98, 1.02):
        run = motion.run("central-difference", share * limit, 5000)
        print(f"{share} of the largest step, {1e9 * limit:.1f} ns: {run.status} after {run.steps} steps")
    frequency = motion.loaded_frequency / (2 * math.pi)
    print(f"lowest frequency {frequency:.0f} Hz")
    return frequency


if __name__ == "__main__":
    main()
