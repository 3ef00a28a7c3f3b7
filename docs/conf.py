"""Sphinx configuration of the site: `make site` writes it to build/site, without anything from a network.

Sphinx runs in the repository's folder with `-c docs`, so that links hold in the repository and on the site.
"""

import re
import sys
from pathlib import Path

import numpydoc.xref
from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.util.logging import getLogger

import springtune

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS / "extensions"))

project = "springtune"
author = "the springtune authors"
copyright = author
version = release = springtune.__version__

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_design",
    "commands",
    "gallery",
    "mathtext",
    "named",
]

root_doc = "docs/index"
include_patterns = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "config/README.md"]
include_patterns += ["workflow/profiles/README.md", "docs/**.md", "docs/reference/generated/*"]
exclude_patterns = ["docs/README.md"]  # the sidebar replaces this list of pages
templates_path = [str(DOCS / "templates")]  # absolute, since some extensions resolve it from the sources

myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
default_role = "py:obj"

autodoc_typehints = "none"  # docstrings name the types
autodoc_member_order = "bysource"
autosummary_generate = True
autosummary_context = {"public": ", ".join(springtune.__all__)}  # they have pages of their own
numpydoc_show_class_members = False
numpydoc_xref_param_type = True
# Only types of springtune are linked.
numpydoc_xref_ignore = "all"
numpydoc_xref_aliases = {name: name for name in numpydoc.xref.DEFAULT_LINKS}
numpydoc_xref_aliases |= {name: f"springtune.{name}" for name in springtune.__all__}

html_math_renderer = "mathtext"
html_theme = "pydata_sphinx_theme"
html_title = f"springtune {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_extra_path = ["start"]
html_show_sourcelink = False
html_show_sphinx = False
html_copy_source = False
html_theme_options = {
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
}
html_sidebars = {"docs/index": [], "README": [], "CHANGELOG": [], "CONTRIBUTING": [], "SECURITY": []}
html_context = {"default_mode": "light"}
pygments_style = "default"

ELSEWHERE = {"examples": "docs/gallery/index", "docs/README": "docs/index"}
"""Targets on the site of links to a folder or to the list of pages."""


def _lead(app: Sphinx, doctree: nodes.document) -> None:
    for link in doctree.findall(addnodes.pending_xref):
        target = link["reftarget"].replace("../", "")
        if target in ELSEWHERE:
            link.attributes |= {"refdomain": "doc", "reftarget": ELSEWHERE[target], "reftargetid": None}


LOADED = {
    "*.html": r"""<(?:script|img|iframe|source|link)\b[^>]*\b(?:src|href)="((?:https?:)?//[^"]+)""",
    "*.css": r"""(?:@import|url\()\s*["']?((?:https?:)?//[^"')]+)""",
}
"""Patterns of remote addresses that a browser loads by itself, by kind of file."""


def _stay(app: Sphinx, error: Exception | None) -> None:
    for files, pattern in LOADED.items():
        for path in Path(app.outdir).rglob(files):
            for found in re.findall(pattern, path.read_text()):
                getLogger(__name__).warning("%s loads %s; include a local copy", path.name, found)


def setup(app: Sphinx) -> None:
    """Resolve links to folders, and warn of remote files."""
    app.connect("doctree-read", _lead)
    app.connect("build-finished", _stay)
