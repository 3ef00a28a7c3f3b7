"""A paper from datasets: its numbers, tables and figures by name, set with Typst."""


class PaperError(Exception):
    """What is wrong with a paper's source or with the datasets that it reads."""
