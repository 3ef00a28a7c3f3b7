"""Directive ``named``: a public mapping of springtune as a table, a row a name."""

from collections.abc import Callable

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import springtune as st


def _loads() -> list[tuple[str, ...]]:
    rows = []
    for name, load in st.LOADS.items():
        kind = load.kind
        turns = "follows the side" if load.follower else "keeps its direction"
        rows.append((name, kind.name, turns))
    return rows


def _engines() -> list[tuple[str, ...]]:
    rows = []
    for name, one in st.ENGINES.items():
        for place, (number, typed) in enumerate(one.parameters.items()):
            measured = one.measured or "not yet" if place == 0 else ""
            rows.append((name, f"``{number}``", typed.unit, f"``{typed.formula}``", measured))
    return rows


TABLES: dict[str, tuple[tuple[str, ...], Callable[[], list[tuple[str, ...]]]]] = {
    "DEFINITIONS": (("definition", "springs"), lambda: [(one.name, one.summary) for one in st.DEFINITIONS.values()]),
    "MESH_TYPES": (("mesh type", "mesh"), lambda: [(one.name, one.summary) for one in st.MESH_TYPES.values()]),
    "LOADS": (("load", "kind", "force"), _loads),
    "ENGINES": (("engine", "you type", "unit", "formula", "measured"), _engines),
}
"""Headings and rows by mapping."""


class Named(SphinxDirective):
    """A mapping as a table, and the target of links to it."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Make the entry and its table."""
        name = self.arguments[0]
        headings, rows = TABLES[name]
        lines = [f".. py:data:: springtune.{name}", "", "   .. list-table::", "      :header-rows: 1", ""]
        for row in [headings, *rows()]:
            first, *others = row
            lines.append(f"      * - {first if row is headings else f'``{first}``'}")
            lines += [f"        - {cell}" for cell in others]
        content = nodes.container()
        self.state.nested_parse(StringList(lines, source=f"springtune.{name}"), self.content_offset, content)
        return content.children


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("named", Named)
    return {"parallel_read_safe": True}
