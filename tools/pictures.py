"""Copy the pictures of the pages from the studies that make them, as docs/figures.yaml has it; `make pictures`."""

import shutil
import subprocess
from pathlib import Path

import yaml

DOCS = Path(__file__).parents[1] / "docs"


def main() -> None:
    """Run the studies, which does nothing where all is made, and copy."""
    pictures = yaml.safe_load((DOCS / "figures.yaml").read_text())
    for study in dict.fromkeys(picture["study"] for picture in pictures.values()):
        subprocess.run(["snakemake", "--configfile", f"config/{study}.yaml"], cwd=DOCS.parent, check=True)
    for name, picture in pictures.items():
        made = DOCS.parent / "results" / picture["study"] / "figures" / f"{picture['figure']}.png"
        shutil.copyfile(made, DOCS / name)


if __name__ == "__main__":
    main()
