"""Tables in Markdown."""


def table(heads, rows):
    """Lines of a table: texts in the first column, numbers flush right in the others."""
    lines = [heads, ["---", *["---:"] * (len(heads) - 1)], *rows]
    return [f"| {' | '.join(line)} |" for line in lines]
