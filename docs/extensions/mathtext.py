"""Formulas as SVG in the page, drawn by matplotlib's mathtext: no remote script, no LaTeX."""

import base64
import io
import re
from typing import Any

from docutils import nodes
from matplotlib import rc_context
from matplotlib.font_manager import FontProperties
from matplotlib.mathtext import MathTextParser, math_to_image
from sphinx.application import Sphinx

POINTS = 10.5
"""Size of the font; the page's text has 12 points (16 px)."""


SPELLINGS = {
    r"\\tfrac": r"\\frac",
    r"\\ge\b": r"\\geq",
    r"\\le\b": r"\\leq",
    r"\\Big": "",
    r"\\sqrt *(\\[a-z]+|\w)": r"\\sqrt{\1}",
}
"""LaTeX commands and their spelling in mathtext."""


def _image(formula: str, size: float = POINTS) -> str:
    """Return the image element of a formula, aligned with the baseline of the text."""
    shown = formula = " ".join(formula.split())
    for pattern, spelling in SPELLINGS.items():
        formula = re.sub(pattern, spelling, formula)
    font = FontProperties(size=size)
    depth = MathTextParser("path").parse(f"${formula}$", dpi=72, prop=font)[2]
    drawn = io.BytesIO()
    with rc_context({"mathtext.fontset": "cm", "svg.hashsalt": "springtune"}):
        math_to_image(f"${formula}$", drawn, prop=font, dpi=72, format="svg")
    source = base64.b64encode(drawn.getvalue()).decode()
    shown = shown.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
    return (
        f'<img class="math" src="data:image/svg+xml;base64,{source}" alt="{shown}" style="vertical-align:-{depth}pt">'
    )


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(_image(node.astext()))
    raise nodes.SkipNode


def _display(writer: Any, node: nodes.math_block) -> None:
    formula = re.sub(r"\\t?frac", r"\\dfrac", node.astext())
    writer.body.append(f"<p>{_image(formula, 1.1 * POINTS)}</p>")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer("mathtext", (_inline, None), (_display, None))
    return {"parallel_read_safe": True}
