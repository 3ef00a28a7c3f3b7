"""Poisson's ratio: a network of springs alone has 1/3; springs with coupling have the material's.

Central springs obey Cauchy's relation C1122 = C1212, so an isotropic plane network has 1/3. (The last printed digits
come from the zigzag ends of the rows.) `delingette` couples the sides of each triangle.
"""

import math

import springtune as st


def main():
    """Return Poisson's ratio of springs alone."""
    # Ten rows of exactly equilateral triangles: only these are exactly isotropic.
    beam = st.Beam(0.2, 10 * 0.002 * math.sqrt(3) / 2)
    mesh = st.make_mesh(beam, "structured", "2 mm")
    for ratio in (0.0, 0.3, 0.49):
        material = st.Material("1 MPa", ratio)
        springs, coupled = (st.moduli(mesh, material, name).poisson_ratio for name in ("uniform", "delingette"))
        print(f"material {ratio:.2f}: springs alone {springs:.4f}, with coupling {coupled:.4f}")
    return springs


if __name__ == "__main__":
    main()
