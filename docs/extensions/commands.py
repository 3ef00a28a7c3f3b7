"""Directive ``commands``: the help of every command of `springtune`."""

import click
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from springtune.cli import main


class Commands(SphinxDirective):
    """A section for each command, from click's help."""

    def run(self) -> list[nodes.Node]:
        """Make the sections."""
        found: list[nodes.Node] = []
        with click.Context(main, info_name="springtune", max_content_width=88) as above:
            found.append(nodes.literal_block(text=main.get_help(above), language="text"))
            for name in main.list_commands(above):
                command = main.get_command(above, name)
                assert command is not None
                with click.Context(command, info_name=name, parent=above, max_content_width=88) as context:
                    shown = command.get_help(context)
                section = nodes.section(ids=[f"springtune-{name}"], names=[name])
                section += nodes.title(text=f"springtune {name}")
                section += nodes.literal_block(text=shown, language="text")
                self.state.document.note_explicit_target(section)
                found.append(section)
        return found


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True}
