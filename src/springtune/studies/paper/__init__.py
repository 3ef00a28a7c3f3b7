"""Build a paper with Typst: numbers, tables and figures from datasets."""


class PaperError(Exception):
    """A fault of a paper's source or datasets."""
