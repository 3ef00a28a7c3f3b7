"""Examples below the help of a command."""


def examples(*lines: str) -> str:
    r"""Epilog of a command that shows how it is called.

    Examples
    --------
    >>> examples("springtune definitions")
    '\x08\nExamples:\n  springtune definitions'
    """
    return "\n".join(["\b", "Examples:", *(f"  {line}" for line in lines)])
