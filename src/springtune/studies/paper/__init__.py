"""Build a paper with Typst: numbers, tables and figures from datasets."""

from importlib.util import find_spec

from ...registry import how_to_install


class PaperError(Exception):
    """An error in the source or the datasets of a paper."""


def check_typst() -> None:
    """Raise if Typst is not installed."""
    if find_spec("typst") is None:
        raise PaperError(f"the paper is set with Typst, which is not installed; {how_to_install('paper')}")
