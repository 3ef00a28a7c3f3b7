"""Directive ``named``: a public mapping of springtune as tables."""

from collections.abc import Callable

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import springtune as st
from springtune.handover.simulation import WORDS


def _loads() -> list[tuple[str, ...]]:
    rows = []
    for name, load in st.LOADS.items():
        kind = load.kind
        turns = "follows the side" if load.follower else "keeps its direction"
        rows.append((name, kind.name, turns))
    return rows


def _engines() -> list[tuple[str, ...]]:
    rows = []
    for one in st.ENGINES.values():
        words = dict.fromkeys([*["springs"] * one.springs, *(WORDS[kind] for kind in one.laws)])
        rows.append((one.name, ", ".join(words), one.measured or "not yet"))
    return rows


def _numbers() -> list[tuple[str, ...]]:
    return [
        (one.name, f"``{name}``", typed.unit, typed.formula)
        for one in st.ENGINES.values()
        for name, typed in one.parameters.items()
    ]


Table = tuple[tuple[str, ...], Callable[[], list[tuple[str, ...]]]]

TABLES: dict[str, tuple[Table, ...]] = {
    "DEFINITIONS": ((("definition", "springs"), lambda: [(one.name, one.summary) for one in st.DEFINITIONS.values()]),),
    "MESH_TYPES": ((("mesh type", "mesh"), lambda: [(one.name, one.summary) for one in st.MESH_TYPES.values()]),),
    "LOADS": ((("load", "kind", "force"), _loads),),
    "ENGINES": ((("engine", "takes", "measured"), _engines), (("engine", "you type", "unit", "formula"), _numbers)),
}
"""Headings and rows of the tables of a mapping."""


class Named(SphinxDirective):
    """A mapping as tables, and the target of links to it."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Make the entry and its tables."""
        name = self.arguments[0]
        lines = [f".. py:data:: springtune.{name}", ""]
        for headings, rows in TABLES[name]:
            lines += ["   .. list-table::", "      :header-rows: 1", ""]
            for row in [headings, *rows()]:
                first, *others = row
                lines.append(f"      * - {first if row is headings else f'``{first}``'}")
                lines += [f"        - {cell}" for cell in others]
            lines.append("")
        content = nodes.container()
        self.state.nested_parse(StringList(lines, source=f"springtune.{name}"), self.content_offset, content)
        return content.children


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("named", Named)
    return {"parallel_read_safe": True}
