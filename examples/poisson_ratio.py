"""Poisson's ratio: a network of springs alone has 1/3, whatever the material's; springs with coupling have any.

Central springs obey Cauchy's relation C1122 = C1212, so that an isotropic network in the plane has 1/3. (The last
digits printed are of the rows' zigzag ends.) `delingette` couples the sides of each triangle.
"""

import math

import springtune as st


def main():
    """Poisson's ratio of springs alone."""
    # Ten rows of exactly equilateral triangles: others are isotropic only nearly.
    beam = st.Beam(0.2, 10 * 0.002 * math.sqrt(3) / 2)
    mesh = st.make_mesh(beam, "structured", "2 mm")
    for ratio in (0.0, 0.3, 0.49):
        material = st.Material("1 MPa", ratio)
        springs, coupled = (st.moduli(mesh, material, name).poisson_ratio for name in ("uniform", "delingette"))
        print(f"material {ratio:.2f}: springs alone {springs:.4f}, with coupling {coupled:.4f}")
    return springs


if __name__ == "__main__":
    main()
