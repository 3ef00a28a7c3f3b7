"""Texts and tables for terminals, notebooks, generated programs, XML, RST and matplotlib; foreign texts are escaped."""

import re
from collections.abc import Collection, Iterable, Sequence
from html import escape
from typing import TypeVar

UNSEEN = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufffe\uffff\ud800-\udfff]")
"""Control characters, line breaks, bidirectional marks, surrogates and what is no character in XML."""

PUNCTUATION = re.compile(r"([^\w\s]|_)")
"""Characters that a markup language may interpret."""


def shown(text: object) -> str:
    r"""Return a text as one line with its control characters escaped.

    >>> print(shown("12 faults\x1b[2K\r0 faults\n"))
    12 faults\x1b[2K\r0 faults\n
    """
    return UNSEEN.sub(lambda found: ascii(found[0])[1:-1], str(text))


def printable(text: object) -> str:
    r"""Return a text as one line of printable characters, for a generated program; others are escaped.

    >>> print(printable("steel\r\nimport os\u200b"))
    steel\r\nimport os\u200b
    """
    return "".join(one if one.isprintable() else ascii(one)[1:-1] for one in str(text))


def json_line(text: str) -> str:
    r"""Return a line of JSON with unseen characters as JSON escapes them.

    >>> print(json_line('"one\u2028two"'))
    "one\u2028two"
    """
    return UNSEEN.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def xml_comment(text: str) -> str:
    """Return a text as one line for a comment of XML, which must not have two hyphens in a row.

    >>> print(xml_comment("x---><include/>"))
    x- - -><include/>
    """
    return re.sub("-(?=-)", "- ", printable(text))


SHOWN_CHARACTERS = 60


def clipped(text: str, longest: int = SHOWN_CHARACTERS) -> str:
    """Return a text as `shown`, shortened for a message."""
    return shown(text if len(text) <= longest else f"{text[: longest - 3]}...")


def rst(text: str) -> str:
    r"""Return a text escaped for reStructuredText.

    >>> print(rst("`click <javascript:alert(1)>`__"))
    \ \`click \<javascript\:alert\(1\)\>\`\_\_
    """
    # The escaped space is nothing; without it, a line of backslashes would be a transition.
    return r"\ " + PUNCTUATION.sub(r"\\\1", text.strip())


def no_mathematics(text: str) -> str:
    r"""Return a figure's text with its dollar signs escaped.

    >>> print(no_mathematics("$x_{"))
    \$x_{
    """
    return text.replace("$", r"\$")


def aligned(rows: Iterable[Iterable[object]], left: int, right: Collection[int] = ()) -> str:
    """Align columns, those in `right` to the right."""
    texts = [[shown(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*texts)]
    lines = []
    for row in texts:
        cells = [
            cell.rjust(width) if n in right else cell.ljust(width) for n, (cell, width) in enumerate(zip(row, widths))
        ]
        lines.append((" " * left + "  ".join(cells)).rstrip())
    return "\n".join(lines)


def number_text(number: float, unit: str) -> str:
    """Number with unit, lengths in mm; empty for NaN.

    >>> number_text(0.005, "m"), number_text(0.3, "1"), number_text(4e5, "N")
    ('5 mm', '0.3', '400000 N')
    """
    if number != number:
        return ""
    if unit == "m":
        return f"{1e3 * number:.6g} mm"
    return f"{number:.6g}" if unit in ("", "1") else f"{number:.6g} {unit}"


def mesh_size_text(size: float) -> str:
    """Mesh size [m] as options take it: ``3.08 mm``."""
    return f"{1e3 * size:.12g} mm"


def html_table(name: str, rows: Iterable[Sequence[object]], heads: Iterable[object] = ()) -> str:
    """HTML table below a name; the first cell of each row is its head."""
    lines = ["".join(_cell("th", head) for head in heads)]
    lines += [_cell("th", first) + "".join(_cell("td", cell) for cell in others) for first, *others in rows]
    table = "".join(f"<tr>{line}</tr>" for line in lines if line)
    return f"<div><b>{escape(name)}</b><table>{table}</table></div>"


WRAPPED = 30
"""Characters from which a cell may have several lines."""


def _cell(tag: str, content: object) -> str:
    text = shown(content)
    space = "normal" if len(text) >= WRAPPED else "nowrap"  # notebooks have styles of their own
    return f'<{tag} style="text-align: left; vertical-align: top; white-space: {space}">{escape(text)}</{tag}>'


class Tabled:
    """Object with rows of labels and texts: one line in `repr`, a table in `print` and in notebooks."""

    def _rows(self) -> Iterable[tuple[str, str]]:
        """Return labels and texts with units; rows with an empty text are hidden."""
        raise NotImplementedError

    def _computed_rows(self) -> Iterable[tuple[str, str]]:
        """Return rows that take time to compute; only tables show them."""
        return ()

    def _table(self) -> list[tuple[str, str]]:
        return [row for row in (*self._rows(), *self._computed_rows()) if row[1]]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({'; '.join(f'{label}: {text}' for label, text in self._rows() if text)})"

    def __str__(self) -> str:
        return f"{type(self).__name__}\n{aligned(self._table(), left=2)}"

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self._table())


One = TypeVar("One", bound=Tabled)


class TabledList(list[One]):
    """List whose objects are the rows of one table."""

    def table(self) -> list[list[str]]:
        """Return the labels, then the texts of each object."""
        rows = [dict(one._rows()) for one in self]
        labels = list(dict.fromkeys(label for row in rows for label in row))
        return [labels, *([row.get(label, "") for label in labels] for row in rows)]

    def __repr__(self) -> str:
        return aligned(self.table(), left=1)

    def _repr_html_(self) -> str:
        heads, *rows = self.table()
        return html_table(", ".join({type(one).__name__: None for one in self}) or "none", rows, heads)


def clock(seconds: float) -> str:
    """Readable duration.

    >>> clock(3.4), clock(75), clock(7300)
    ('3 s', '1:15 min', '2:01 h')
    """
    seconds = round(seconds)
    if seconds < 60:
        return f"{seconds} s"
    minutes, rest = divmod(seconds, 60)
    return f"{minutes}:{rest:02d} min" if minutes < 60 else f"{minutes // 60}:{minutes % 60:02d} h"
