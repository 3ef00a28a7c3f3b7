"""The gallery: run the scripts and the notebook of `examples/`, and write a page of each with its text and figures.

Pages go to docs/gallery, which git ignores, before Sphinx reads the sources.
"""

import ast
import base64
import inspect
import io
import os
import re
import runpy
import tempfile
from contextlib import chdir, redirect_stdout
from pathlib import Path

import matplotlib
import nbformat
from nbclient import NotebookClient
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
    notebooks = sorted(EXAMPLES.glob("*.ipynb"))
    cards = [*map(_notebook, notebooks), *(_page(*one) for one in made)]
    grid = "\n".join(["::::{grid} 1 2 2 3", ":gutter: 3", *cards, "::::"])
    names = [example.stem for example in [*notebooks, *(example for example, _, _ in made)]]
    toctree = "\n".join(["```{toctree}", ":hidden:", *names, "```"])
    (PAGES / "cards.txt").write_text(f"{grid}\n\n{toctree}\n")


def _notebook(example: Path) -> str:
    """Run a notebook, write its page with what its cells show, and return its card."""
    notebook = nbformat.read(example, as_version=4)
    NotebookClient(notebook, kernel_name="python3", resources={"metadata": {"path": str(EXAMPLES)}}).execute()
    parts, figures = [], []
    for cell in notebook.cells:
        parts.append(cell.source if cell.cell_type == "markdown" else f"```python\n{cell.source}\n```")
        for output in cell.get("outputs", ()):
            shown = output.get("data", {"text/plain": output.get("text", "")})
            if "image/png" in shown:
                figures.append(f"{example.stem}_{len(figures) + 1}.png")
                (PAGES / figures[-1]).write_bytes(base64.b64decode(shown["image/png"]))
                parts.append(f"![Figure of the notebook]({figures[-1]})")
            elif "<iframe" in shown.get("text/html", ""):
                parts.append("Here the notebook shows [the page to browse](../browse.md).")
            else:
                parts.append(f"```text\n{shown['text/plain'].rstrip()}\n```")
    title, text = (re.sub(r"^#+ ", "", part) for part in notebook.cells[0].source.split("\n\n")[:2])
    parts.append(f"Download [{example.name}]({os.path.relpath(example, PAGES)}), or open it in a clone in Jupyter.")
    (PAGES / f"{example.stem}.md").write_text("\n\n".join(parts) + "\n")
    return _card(example, f"Notebook: {title}", text.partition(". ")[0], figures[1:])


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
    return _card(example, title, f"{first[0].upper()}{first[1:]}", figures)


def _card(example: Path, title: str, text: str, figures: list[str]) -> str:
    """Return a card that links to the page of an example, with its first figure."""
    image = [f":img-bottom: {figures[0]}"] if figures else []
    head = [f":::{{grid-item-card}} {title}", f":link: {example.stem}", ":link-type: doc", *image]
    return "\n".join([*head, "", f"{text}.", ":::"])


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for sources."""
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True}
