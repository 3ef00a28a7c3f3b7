"""Copy the pictures of the pages from studies, as docs/figures.yaml says; `make pictures`."""

import runpy
import subprocess
import tempfile
from pathlib import Path

import yaml
from PIL import Image

DOCS = Path(__file__).parents[1] / "docs"

SHARE = 0.6
"""Pixels of a side that are kept: a browser shows a column of 3.5 inches in 630 of them."""

COLOURS = 128
"""Of a picture in the repository, whose history keeps every version of it."""


def main() -> None:
    """Run the studies, which does nothing where all is made, and copy; draw what examples draw."""
    pictures = yaml.safe_load((DOCS / "figures.yaml").read_text())
    for study in dict.fromkeys(picture["study"] for picture in pictures.values() if "study" in picture):
        subprocess.run(["snakemake", "--configfile", f"config/{study}.yaml"], cwd=DOCS.parent, check=True)
    for name, source in pictures.items():
        if "example" in source:
            draw(source["example"], DOCS / name)
        else:
            copy(DOCS.parent / "results" / source["study"] / "figures" / f"{source['figure']}.png", DOCS / name)


def draw(example: str, target: Path) -> None:
    """Picture of the figure that an example leaves open."""
    from matplotlib import pyplot

    pyplot.switch_backend("agg")
    runpy.run_path(str(DOCS.parent / "examples" / f"{example}.py"))["main"]()
    with tempfile.TemporaryDirectory() as folder:
        pyplot.savefig(Path(folder) / "figure.png", dpi=300)
        copy(Path(folder) / "figure.png", target)
    pyplot.close("all")


def copy(made: Path, target: Path) -> None:
    """A picture as small as a page shows it."""
    with Image.open(made) as picture:
        size = [round(SHARE * side) for side in picture.size]
        few = picture.convert("RGB").resize(size, Image.Resampling.LANCZOS).quantize(COLOURS, dither=Image.Dither.NONE)
    few.save(target, optimize=True)


if __name__ == "__main__":
    main()
