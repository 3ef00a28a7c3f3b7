"""The page to browse a study's results with."""

import sys

from springtune.safe_io.atomic import write_text

from ...runs import records
from .page import page


def main(dataset: str, output: str, record: str, digest: str, *files: str) -> None:
    """Write the page of a dataset, and the record of it."""
    read = records.checksum(dataset)
    write_text(output, page(dataset, files))
    records.write(record, digest, [output], read=read)


if __name__ == "__main__":
    main(*sys.argv[1:])
