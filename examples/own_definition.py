"""A definition of one's own: every spring gets E t, and the error of Young's modulus that follows.

An equilateral network of springs k has E t = 2 k / sqrt(3). Outline springs of full stiffness make a strip of height H
stiffer by 1 + sqrt(3)/2 a/H. So the error is 2/sqrt(3) (1 + sqrt(3)/2 a/H) - 1: a quarter here.
"""

import math

import numpy as np

import springtune as st


def guess(mesh, material, thickness):
    """Return E t for every spring."""
    return st.Springs(material.young_modulus * thickness, np.ones(len(mesh.edges)))


def main():
    """Return the error of Young's modulus."""
    # Ten rows of exactly equilateral triangles.
    beam, steel = st.Beam(0.2, 10 * 0.002 * math.sqrt(3) / 2), st.Material("210 GPa", 0.3)
    mesh = st.make_mesh(beam, "structured", "2 mm")
    moduli = st.moduli(mesh, steel, guess)
    result = st.Scene(beam, mesh, steel, "traction", "20 kN", definition=guess).solve()
    print(f"Young's modulus {100 * moduli.young_modulus_error:+.2f} %, displacement {100 * result.error:+.2f} %")
    return moduli.young_modulus_error


if __name__ == "__main__":
    main()
