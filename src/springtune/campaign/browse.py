"""The page to browse a study's results with."""

import sys
from pathlib import Path

from ..browse.page import page
from ..jobs.atomic import write_text


def run(dataset: str | Path, output: str | Path, *files: str) -> None:
    """Write the page of a dataset.

    Parameters
    ----------
    dataset : str or Path
    output : str or Path
        HTML file to write.
    *files : str
        What else is made of the dataset, from its folder on.
    """
    write_text(output, page(dataset, files))


if __name__ == "__main__":
    run(*sys.argv[1:])
