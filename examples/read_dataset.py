"""A study's dataset: errors of one beam as a table, and its sensitivity curves as a figure.

    make study STUDY=config/quick.yaml
    python examples/read_dataset.py [results/quick/dataset.nc [figure.png]]

The paper's finite elements give this beam 0.475 mm.
"""

import sys

import springtune as st


def main(path="results/quick/dataset.nc", figure=None):
    """Return the displacement of the reference [m]."""
    labels = {"beam": "100x20", "mesh_type": "structured", "material": "steel", "load": "traction"}
    with st.open(path) as tree:
        scenes = tree.to_dataset().sel(kinematics="nonlinear", **labels)
        print((100 * scenes.deformation_error.sel(definition=["paper", "lattice"])).round(2).to_pandas())
        axes = st.plot_sensitivity(tree, **labels)
        if figure:
            axes.figure.savefig(figure)
        return float(scenes.reference_displacement)


if __name__ == "__main__":
    main(*sys.argv[1:])
