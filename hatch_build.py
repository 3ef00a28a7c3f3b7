"""The README as a package's description: links that lead nowhere outside of the repository become their text.

With an address of the repository, `Source` among `project.urls` in pyproject.toml, they lead there instead.
"""

import re
from pathlib import Path
from typing import Any

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
