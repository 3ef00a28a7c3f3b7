"""Which definition to use on one mesh: all that suit it are solved under three loads; the best one comes first.

A patch test of the mesh measures E and Poisson's ratio of each. Inner springs of `lattice` have sqrt(3)/2 E t.
"""

import springtune as st


def main():
    """Return the stiffness of inner springs of `lattice` [N/m]."""
    beam, steel = st.Beam("100 mm", "20 mm"), st.Material("210 GPa", 0.3)
    choices = st.predict(beam, st.make_mesh(beam, "structured", "2 mm"), steel, also=["lattice"])
    for choice in choices:
        ratio = f"Poisson's ratio {choice.poisson_ratio:.3f}"
        print(f"{choice.definition:12} at worst {100 * choice.worst:5.2f} %, {ratio}")
    return next(choice.inside for choice in choices if choice.definition == "lattice")


if __name__ == "__main__":
    main()
