"""Rubber at any stretch: Treloar's three tests beside the laws that are fitted to the first of them.

Yeoh's law, and neo-Hooke's as its first term, are areas and springs of zero rest length on every triangle. Springs
alone reach a stretch of 2, where an equilateral lattice lies flat. They are fitted up to 1.9.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import springtune as st
from springtune.problem.materials import RUBBER_TESTS, TensileTest
from springtune.springs.rubber import SpringLaw

TRELOAR = Path(__file__).parents[1] / "config/treloar"

TITLES = {
    "uniaxial": "uniaxial, fitted to",
    "equibiaxial": "equibiaxial, predicted",
    "pure shear": "pure shear, predicted",
}


def main():
    """Return the equibiaxial over the uniaxial stress of springs alone, at the same stretch."""
    data = {test: TensileTest.read(TRELOAR / f"{test.replace(' ', '-')}.csv") for test in RUBBER_TESTS}
    laws = {
        "Yeoh's law": st.fit_rubber(data["uniaxial"]),
        "neo-Hooke": st.fit_rubber(data["uniaxial"], terms=1),
        "springs alone": SpringLaw.fitted(data["uniaxial"], 2),
    }
    figure, panels = plt.subplots(1, 3, figsize=(7.16, 2.6), layout="constrained")
    looks = {"color": "black"}, {"color": "#d95f02", "linestyle": "--"}, {"color": "#0072b2", "linestyle": "-."}
    for panel, (test, points) in zip(panels, data.items()):
        for (name, law), look in zip(laws.items(), looks):
            most = law.largest if isinstance(law, SpringLaw) else points.stretch.max()
            stretch = np.linspace(1, most, 200)
            panel.plot(stretch, law.stress(test, stretch) / 1e6, label=name, **look)
        measured = {"color": "0.35", "markersize": 3, "fillstyle": "none", "label": "Treloar"}
        panel.plot(points.stretch, points.stress / 1e6, "o", **measured)
        panel.set(xlabel="stretch", ylim=(0, 1.15 * points.stress.max() / 1e6))
        panel.set_title(TITLES[test], fontsize=8, loc="left")
    panels[0].set_ylabel("nominal stress [MPa]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    for test, points in data.items():
        error = laws["Yeoh's law"].stress(test, points.stretch) / points.stress - 1
        print(f"{test}: Yeoh's law errs by {100 * np.sqrt(np.mean(error**2)):.0f} % (root mean square)")
    even, along = (
        float(laws["springs alone"].stress(test, np.array([1.5]))[0]) for test in ("equibiaxial", "uniaxial")
    )
    return even / along


if __name__ == "__main__":
    main()
    plt.show()
