"""The gallery: run every script of `examples/`, and write a page with its text and figures.

Pages go to docs/gallery, which git ignores, before Sphinx reads the sources.
"""

import ast
import inspect
import io
import os
import re
import runpy
import tempfile
from contextlib import chdir, redirect_stdout
from pathlib import Path

import matplotlib
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

REPOSITORY = Path(__file__).parents[2]
EXAMPLES, PAGES = REPOSITORY / "examples", REPOSITORY / "docs/gallery"

DATASET = REPOSITORY / "results/quick/dataset.nc"
"""Dataset for examples that read one."""


def _as_markdown(text: str) -> str:
    """Return a docstring as Markdown; its indented lines are commands."""
    return re.sub(r"(?:^    .+\n?)+", lambda found: f"\n```sh\n{_dedent(found[0])}\n```\n", text, flags=re.MULTILINE)


def _dedent(text: str) -> str:
    return "\n".join(line.strip() for line in text.strip().splitlines())


def _run(example: Path) -> tuple[str, list[str]]:
    """Run an example: return what it prints, and the files of its figures."""
    from matplotlib import pyplot

    pyplot.switch_backend("agg")
    pyplot.close("all")
    main = runpy.run_path(str(example))["main"]
    given = [DATASET] if "path" in inspect.signature(main).parameters else []
    if given and not DATASET.is_file():
        raise ExtensionError(f"{example.name} reads {DATASET}; make it first: make study STUDY=config/quick.yaml")
    with redirect_stdout(io.StringIO()) as printed, tempfile.TemporaryDirectory() as folder, chdir(folder):
        main(*given)
    files = []
    for number in pyplot.get_fignums():
        files.append(f"{example.stem}_{number}.png")
        pyplot.figure(number).savefig(PAGES / files[-1], dpi=150, bbox_inches="tight", metadata={"Software": None})
    pyplot.close("all")
    return printed.getvalue(), files


def write(app: Sphinx) -> None:
    """Write a page for each example, and the cards that link to them."""
    matplotlib.use("agg")
    for page in [*PAGES.glob("*.png"), *PAGES.glob("*.md")]:
        if page.name != "index.md":
            page.unlink()
    made = [(example, *_run(example)) for example in EXAMPLES.glob("*.py")]
    # Examples with a picture first, sorted by size.
    made.sort(key=lambda one: (not one[2], one[0].stat().st_size))
    cards = [_page(*one) for one in made]
    grid = "\n".join(["::::{grid} 1 2 2 3", ":gutter: 3", *cards, "::::"])
    toctree = "\n".join(["```{toctree}", ":hidden:", *(example.stem for example, _, _ in made), "```"])
    (PAGES / "cards.txt").write_text(f"{grid}\n\n{toctree}\n")


def _page(example: Path, printed: str, figures: list[str]) -> str:
    """Write the page of an example, and return its card."""
    source = example.read_text()
    text = ast.get_docstring(ast.parse(source)) or ""
    title, _, meaning = text.partition(":")
    code = source[source.index('"""', 3) + 3 :].strip()
    parts = [f"# {title}", _as_markdown(text), f"```python\n{code}\n```", f"It prints\n\n```text\n{printed}```"]
    parts += [f"![Figure of the example: {title}]({file})" for file in figures]
    link = os.path.relpath(example, PAGES)
    parts.append(f"Download [{example.name}]({link}), or run it in a clone: `python examples/{example.name}`.")
    (PAGES / f"{example.stem}.md").write_text("\n\n".join(parts) + "\n")
    first = " ".join(meaning.split()).partition(". ")[0].partition(": ")[0].rstrip(".")
    image = [f":img-bottom: {figures[0]}"] if figures else []
    head = [f":::{{grid-item-card}} {title}", f":link: {example.stem}", ":link-type: doc", *image]
    return "\n".join([*head, "", f"{first[0].upper()}{first[1:]}.", ":::"])


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for sources."""
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True}
