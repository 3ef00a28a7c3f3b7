"""Draw docs/how-to/rubber_tests.png: Treloar's three tests beside the laws that are fitted to the first of them.

python tools/rubber_tests.py
"""

from pathlib import Path

import numpy as np

from springtune.output import style
from springtune.problem.materials import RUBBER_TESTS
from springtune.problem.rubber import TensileTest, fit_rubber
from springtune.springs.rubber import SpringLaw

REPOSITORY = Path(__file__).parents[1]


@style.styled
def draw(path: Path) -> None:
    """Write the figure."""
    data = {
        test: TensileTest.read(REPOSITORY / f"config/treloar/{test.replace(' ', '-')}.csv") for test in RUBBER_TESTS
    }
    fitted = data["uniaxial"]
    laws = {
        "Yeoh's law": fit_rubber(fitted),
        "neo-Hooke": fit_rubber(fitted, terms=1),
        "springs alone, up to 1.9": SpringLaw.fitted(fitted, 2),
    }
    figure, axes = style.panels(None, ncols=3, figsize=(style.PAGE, 2.6))
    style.arrange(figure, axes, left=0.5, right=0.08, bottom=0.75, top=0.3, across=0.5)
    for panel, (test, points) in zip(axes[0], data.items()):
        for number, (name, law) in enumerate(laws.items()):
            most = law.largest if isinstance(law, SpringLaw) else points.stretch.max()
            q = np.linspace(1, most, 200)
            panel.plot(q, law.stress(test, q) / 1e6, label=name, **style.line(number) | {"marker": ""})
        panel.plot(
            points.stretch, points.stress / 1e6, "o", color="0.35", markersize=3, fillstyle="none", label="Treloar 1944"
        )
        said = {
            "uniaxial": "Uniaxial, fitted to",
            "equibiaxial": "Equibiaxial, predicted",
            "pure shear": "Pure shear, predicted",
        }
        panel.set(xlabel="Stretch", title=said[test], ylim=(0, 1.15 * points.stress.max() / 1e6))
    axes[0, 0].set_ylabel("Nominal stress [MPa]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="lower center", ncols=4)
    figure.savefig(path, dpi=180)


if __name__ == "__main__":
    draw(REPOSITORY / "docs/how-to/rubber_tests.png")
