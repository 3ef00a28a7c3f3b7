"""CSV files that a study names."""

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path

from springtune.safe_io.inputs import LARGEST_CSV, read

from .messages import Key, Problems, unseen


def read_lines(
    path: Path, where: Sequence[Key], problems: Problems, own: Problems, remedy: str
) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines of a CSV file without empty ones and comments (#)."""
    try:
        text = read(path, LARGEST_CSV).decode("utf-8-sig")
    except ValueError as error:
        why = "not UTF-8 text" if isinstance(error, UnicodeDecodeError) else error
        problems.add(where, f"'{path}' cannot be read: {why}; {remedy}")
        problems.stop()
    # Empty lines in place of comments, so that the reader's line numbers are the file's.
    reader = csv.reader("\n" if line.startswith("#") else line for line in text.splitlines(keepends=True))
    try:
        for row in reader:
            for why in filter(None, (unseen(cell.strip()) for cell in row)):
                own.add((), why, reader.line_num)
            if any(cell.strip() for cell in row):
                yield reader.line_num, row
    except csv.Error as error:
        own.add((), f"not CSV: {error}; correct or remove the line", reader.line_num)
