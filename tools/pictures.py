"""Copy the pictures of the pages from the studies that make them, as docs/figures.yaml has it; `make pictures`."""

import subprocess
from pathlib import Path

import yaml
from PIL import Image

DOCS = Path(__file__).parents[1] / "docs"

SHARE = 0.6
"""Pixels of a side that are kept: a browser shows a column of 3.5 inches in 630 of them."""

COLOURS = 128
"""Of a picture in the repository, whose history keeps every version of it."""


def main() -> None:
    """Run the studies, which does nothing where all is made, and copy."""
    pictures = yaml.safe_load((DOCS / "figures.yaml").read_text())
    for study in dict.fromkeys(picture["study"] for picture in pictures.values()):
        subprocess.run(["snakemake", "--configfile", f"config/{study}.yaml"], cwd=DOCS.parent, check=True)
    for name, source in pictures.items():
        made = DOCS.parent / "results" / source["study"] / "figures" / f"{source['figure']}.png"
        with Image.open(made) as picture:
            size = [round(SHARE * side) for side in picture.size]
            few = (
                picture.convert("RGB")
                .resize(size, Image.Resampling.LANCZOS)
                .quantize(COLOURS, dither=Image.Dither.NONE)
            )
        few.save(DOCS / name, optimize=True)


if __name__ == "__main__":
    main()
