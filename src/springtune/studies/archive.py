"""Pack the results of a study into one zip file, an RO-Crate, to be cited and handed on."""

import json
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from springtune.safe_io import replacing, shown

from .config.model import Study
from .output import reading
from .runs import plan
from .runs.keys import input_files
from .runs.source import checksum

CHECKSUMS_FILE, VERSIONS_FILE, README = "SHA256SUMS", "versions.json", "README.md"

PRODUCTS = (plan.DATASET, plan.PAGE, plan.SUMMARY)
"""Files of `results/<study>` that are packed, beside figures and tables; what the stages stored is made again."""

README_TEXT = """# {title}

A study by springtune {version}. `dataset.nc` has all results, `index.html` shows them.

Compute it again with the packages of `versions.json`:

    pip install springtune=={version}
    springtune run {study}

`sha256sum --check SHA256SUMS` compares the files with what was packed.
"""


def pack(study: Study, folder: Path, target: Path) -> list[str]:
    """Write a zip archive of a finished study, and return its files' names; ValueError if the dataset is outdated."""
    from rocrate.rocrate import ROCrate  # here: an extra

    with reading.open(folder) as tree:
        about = {name: shown(str(tree.attrs.get(name, ""))) for name in ("title", "springtune_version", "created")}
        if tree.attrs.get("config") != study.text:
            raise ValueError(
                f"{folder}: the dataset is of another text of {study.path}; run the study, then archive it"
            )
        versions = json.dumps(json.loads(tree.attrs["software"]), indent=1)
    packed = (name for name in plan.presented_files(study) if name.startswith(("figures/", "tables/")))
    files = {name: path for name in (*PRODUCTS, *sorted(packed)) if (path := folder / name).is_file()}
    files |= _inputs(study)
    texts = {
        README: README_TEXT.format(title=about["title"], version=about["springtune_version"], study=study.path.name),
        VERSIONS_FILE: f"{versions}\n",
    }
    with tempfile.TemporaryDirectory() as made:
        for name, text in texts.items():
            files[name] = Path(made, name)
            files[name].write_text(text, encoding="utf-8")
        sums = Path(made, CHECKSUMS_FILE)
        sums.write_text("".join(f"{checksum(path)}  {name}\n" for name, path in files.items()), encoding="utf-8")
        crate = ROCrate()
        crate.name, crate.description = about["title"], f"Study by springtune {about['springtune_version']}"
        crate.datePublished = about["created"]
        for name, path in (*files.items(), (CHECKSUMS_FILE, sums)):
            crate.add_file(path, name)
        written = Path(made, "archive.zip")
        crate.write_zip(written)
        with replacing(target) as unfinished:
            shutil.copyfile(written, unfinished)
    return [*files, CHECKSUMS_FILE]


def _inputs(study: Study) -> Mapping[str, Path]:
    """The study and the files that it names, by their names from its folder."""
    beside = study.path.resolve().parent
    found = {}
    for path in (file.resolve() for file in input_files(study)):
        if not path.is_relative_to(beside):
            raise ValueError(f"{study.path}: names {path.name} outside of its folder; move it there, for an archive")
        found[path.relative_to(beside).as_posix()] = path
    return found
