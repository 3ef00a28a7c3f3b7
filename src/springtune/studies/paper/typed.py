r"""Find numbers typed into a paper's Typst text in place of dataset values.

Digits are allowed in names (``2-D``, ``P1``, ``@tab-1``), after *Table*, *Figure*, *Equation* and *section*, and in
arguments of `FUNCTIONS`. Formulas may hold one-digit integers, as :math:`2 k / \sqrt 3`.
"""

import re
from collections.abc import Iterator

FUNCTIONS = ("beam", "drawing", "has", "n", "named", "range", "tabular", "v")
"""Template functions whose arguments are names or layout."""

_BLANKED = (
    re.compile(r"/\*.*?\*/", re.DOTALL),
    re.compile(r"(?<!:)//[^\n]*"),
    re.compile(r"^#(?:import|include|set|show)\b[^\n]*", re.MULTILINE),
    re.compile(rf"#?\b(?:{'|'.join(FUNCTIONS)})\([^()\[\]]*\)"),
    re.compile(r"\b(?:columns|width|height|gap|above|below|size|breakable|placement):\s*[\w.%()+, ]+(?=[,)\n])"),
    re.compile(r"@[\w-]+(?:\[[^\]]*\])?"),
    re.compile(r"<[\w-]+>"),
    re.compile(r"https?://\S+"),
)
_REFERENCE = re.compile(
    r"\b(?:[Tt]ables?|[Ff]igures?|[Ee]quations?|[Ss]ections?)[\s~]+\d+(?:\.\d+)*(?:(?:,|[\s~]+to|[\s~]+and|–|-)[\s~]*\d+(?:\.\d+)*)*"
)
_NAME = re.compile(r"\b[23]-?D\b|(?<=[A-Za-z_])\d+\w*")
_FORMULA = re.compile(r"\$[^$]*\$")
_STRUCTURE = re.compile(r"(?<![\d.,])\d(?![\d.,]*\d)")
_NUMBER = re.compile(r"\d[\d.,]*(?:\s*%|\s*[a-zA-Zµ°]+\b)?")


def _blank(found: re.Match[str]) -> str:
    """Replace a match by empty lines."""
    return re.sub(r"[^\n]", " ", found.group())


def typed_numbers(text: str) -> Iterator[tuple[int, str]]:
    """Yield typed numbers with their lines.

    Examples
    --------
    >>> list(typed_numbers("The error is 3.4 %, see Table 1."))
    [(1, '3.4 %')]
    >>> list(typed_numbers('The error is #n("worst"), see @tab-1; $k = sqrt(3)/2 E t$ in 2-D.'))
    []
    >>> list(typed_numbers("As a formula: $k = 0.866 E t$."))
    [(1, '0.866 E')]
    """
    for pattern in _BLANKED:
        text = pattern.sub(_blank, text)
    text = _FORMULA.sub(lambda formula: _STRUCTURE.sub(_blank, formula.group()), text)
    for pattern in (_REFERENCE, _NAME):
        text = pattern.sub(_blank, text)
    for found in _NUMBER.finditer(text):
        yield text.count("\n", 0, found.start()) + 1, found.group().strip()
