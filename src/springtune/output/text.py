"""Text for a terminal."""

from collections.abc import Collection, Iterable


def aligned(rows: Iterable[Iterable[object]], left: int, right: Collection[int] = ()) -> str:
    """Rows in columns, those in `right` flush right."""
    texts = [[str(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*texts)]
    lines = []
    for row in texts:
        cells = [
            cell.rjust(width) if n in right else cell.ljust(width) for n, (cell, width) in enumerate(zip(row, widths))
        ]
        lines.append((" " * left + "  ".join(cells)).rstrip())
    return "\n".join(lines)
