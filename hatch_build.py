"""What a built package has besides its modules: a description, the workflow, and the commit that it was built from.

The README is the description: links that lead nowhere outside of the repository become their text. With an address of
the repository, `Source` among `project.urls` in pyproject.toml, they lead there instead.
"""

import re
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

RELATIVE = r"\[((?:[^\[\]]|\[[^\]]*\])*)\]\((?!https?:|#)([^)\s]+)\)"
"""A link to a file of the repository: its text, and the file."""


def description(text: str, source: str, version: str) -> str:
    """The README where its neighbours are not.

    Parameters
    ----------
    text : str
        The README.
    source : str
        Address of the repository; empty where there is none.
    version : str
        Version, whose tag the links lead to.

    Returns
    -------
    str
    """
    if source:
        text = re.sub(f"!{RELATIVE}", rf"![\1]({source}/raw/v{version}/\2)", text)
        return re.sub(RELATIVE, rf"[\1]({source}/blob/v{version}/\2)", text)
    text = re.sub(rf"^!{RELATIVE}\n\n", "", text, flags=re.MULTILINE)
    return re.sub(RELATIVE, r"\1", text)


class Description(MetadataHookInterface):
    """Gives the package its README."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the description."""
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        source = metadata.get("urls", {}).get("Source", "").rstrip("/")
        metadata["readme"] = {
            "content-type": "text/markdown",
            "text": description(text, source, metadata["version"]),
        }


CARRIED = {
    "Snakefile": "Snakefile",
    "README.md": "README.md",
    "config": "config",
    "docs": "docs",
    "examples": "examples",
    "workflow": "workflow",
    "workflow/profiles": "profiles",  # where Snakemake looks for them: beside the Snakefile
}
"""What a wheel has in `springtune/workflow`, where `springtune.studies.runs.source` finds it."""

COMMIT = "springtune/commit.txt"


class Carried(BuildHookInterface):
    """Adds the workflow to a wheel, and the commit to wheel and source distribution. A clone needs neither."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the files."""
        root, forced = Path(self.root), build_data["force_include"]
        self.scratch = tempfile.TemporaryDirectory()
        if version == "editable":
            return
        if self.target_name == "wheel":
            forced |= {str(root / name): f"springtune/workflow/{place}" for name, place in CARRIED.items()}
        commit = built_from(root)
        if commit:
            file = Path(self.scratch.name) / "commit.txt"
            file.write_text(f"{commit}\n", encoding="utf-8")
            forced[str(file)] = COMMIT if self.target_name == "wheel" else f"src/{COMMIT}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what was written for it."""
        self.scratch.cleanup()


def built_from(root: Path) -> str:
    """Commit of a clone, with `+changes` if files differ; empty without git and in a source distribution."""
    if not (root / ".git").exists():  # a folder above may be of another project
        return ""
    asked = ["git", "describe", "--always", "--abbrev=40", "--dirty=+changes", "--exclude=*"]
    try:
        return subprocess.run(asked, cwd=root, capture_output=True, check=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
