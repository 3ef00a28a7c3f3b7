"""Buckling: the critical load of a slender clamped column, against Euler's pi^2 E I / (4 L^2).

Below the critical load the straight network is stable. Above it Newton's method still finds an equilibrium. The tangent
has a negative pivot there, so the result is called unstable.
"""

import math

import springtune as st


def main():
    """Return the critical load over Euler's."""
    beam, steel = st.Beam("100 mm", "4 mm"), st.Material("210 GPa", 0.3)
    mesh = st.make_mesh(beam, "structured", "0.25 mm")
    euler = math.pi**2 * steel.young_modulus * beam.thickness * beam.height**3 / 12 / (4 * beam.length**2)
    critical = st.Scene(beam, mesh, steel, "compression", euler, definition="delingette").buckling_load()
    print(f"critical load {critical:.1f} N, Euler's {euler:.1f} N")
    for share in (0.9, 1.1):
        result = st.Scene(beam, mesh, steel, "compression", share * critical, definition="delingette").solve()
        print(f"at {share} of it: {result.status}, {result.negative_pivots} negative pivots")
    return critical / euler


if __name__ == "__main__":
    main()
