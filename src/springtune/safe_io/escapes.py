"""Escape foreign texts for terminals, generated programs, JSON lines, XML, RST and matplotlib."""

import re

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
