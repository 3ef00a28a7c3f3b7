"""The page: a dataset, the views of the study kinds, and BokehJS from its installed package, in one file."""

import base64
import hashlib
import json
import os
import sys
import zlib
from collections.abc import Iterable
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path

import h5netcdf
import h5py
import jinja2
from markupsafe import Markup

from springtune.registry import imported
from springtune.safe_io.atomic import write_text
from springtune.safe_io.inputs import bounded

from ...config.kind import modules
from ...runs import records
from ..reading import REMEDY, check_links, guarded, most_of
from . import View
from .payload import packed

SCRIPTS = ("payload", "words", "charts", "table", "cells", "shape", "explorer", "main")
"""Modules of the page's own script, in the order in which they are put together."""

LIBRARY = ("bokeh", "bokeh-api")
"""Scripts of BokehJS that the page needs."""


def views() -> dict[str, View]:
    """Views that the study kinds declare."""
    found: dict[str, View] = {}
    for name in modules("outputs"):
        found |= {view.group: view for view in getattr(imported(name), "VIEWS", ())}
    return found


def page(dataset: str | os.PathLike[str], files: Iterable[str] = ()) -> str:
    """Page of a dataset."""
    path = Path(dataset)
    if not path.is_file():
        raise FileNotFoundError(
            f"{path}: there is no such dataset; run the study, or give its results/<study>/dataset.nc"
        )
    try:
        check_links(path)
        with guarded(path), bounded(most_of(path)), h5py.File(path) as opened:
            # Read first: if h5netcdf itself fails here, the file that it leaves open raises a warning later.
            opened.attrs.get("_nc3_strict")
            with h5netcdf.File(opened, decode_vlen_strings=True) as file:
                groups, contents = packed(file)
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error}); {REMEDY}") from None
    attributes = groups[0]["attributes"]
    if "springtune_version" not in attributes:
        raise ValueError(f"{path}: is not a dataset of springtune; {REMEDY}")
    declared = {path: asdict(view) for path, view in views().items()}
    content = {"groups": groups, "declared": declared, "files": sorted(files)}
    library = _library()
    texts = {"content": json.dumps(content, separators=(",", ":"), allow_nan=False)} | library
    script = "(() => {\n" + "".join(_asset(f"{name}.js") for name in SCRIPTS) + "})();\n"
    blocks = {name: zlib.compress(text.encode(), 9) for name, text in texts.items()}
    blocks |= {f"group-{number}": content for number, content in enumerate(contents)}
    # Scripts run only with one of these hashes, and nothing may be loaded: a script in a title stays a text.
    hashes = " ".join(_hash(text) for text in (script, *library.values()))
    policy = f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'"
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("springtune.studies.output.browse", "assets"), autoescape=True, trim_blocks=True
    )
    return environment.get_template("page.html").render(
        title=attributes.get("title") or attributes.get("study") or "Study",
        policy=f"{policy}; form-action 'none'",
        style=Markup(_asset("style.css")),
        script=Markup(script),
        blocks={name: base64.b64encode(block).decode() for name, block in blocks.items()},
    )


def _asset(name: str) -> str:
    return (Path(__file__).parent / "assets" / name).read_text(encoding="utf-8")


def _library() -> dict[str, str]:
    """Scripts of BokehJS by name, without importing Bokeh, which takes longer than making the page."""
    found = find_spec("bokeh")
    if found is None or found.origin is None:
        raise FileNotFoundError("the package bokeh is not installed; `pip install bokeh` or `make study` installs it")
    folder = Path(found.origin).parent / "server/static/js"
    return {name: (folder / f"{name}.min.js").read_text(encoding="utf-8") for name in LIBRARY}


def _hash(script: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def main(dataset: str, output: str, record: str, digest: str, *files: str) -> None:
    """Write the page of a dataset, and the record of it."""
    read = records.checksum(dataset)
    write_text(output, page(dataset, files))
    records.write(record, digest, [output], read=read)


if __name__ == "__main__":
    main(*sys.argv[1:])
