"""Files of parts: the whole study's text, then a section that names the part."""

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .messages import Problems
from .model import Part
from .sections import StudyConfig
from .yaml_lines import read_yaml

PART_BELOW = (
    "\n# What stands above is the whole study; this file asks for a part of it. Written by `springtune split`.\n"
)

LONGEST_NAME = 255


def is_part(text: str) -> bool:
    """Return whether a text requests a part of a study."""
    return PART_BELOW in text


def whole_text(text: str) -> str:
    """Text of the whole study without the section ``part``."""
    return text.rpartition(PART_BELOW)[0] if is_part(text) else text


def digest_of(text: str) -> str:
    """SHA-256 of the text of a study."""
    return hashlib.sha256(text.encode()).hexdigest()


def part_text(text: str, part: Part) -> str:
    """Text of a file that requests a part of a study."""
    return f"{text}{PART_BELOW}part: {{number: {part.number}, of: {part.of}, by: {part.by}, study: {part.study}}}\n"


def declared_part(config: StudyConfig, text: str, problems: Problems) -> Part | None:
    """Part that a file requests; None for the whole study."""
    if config.part is None:
        return None
    part = Part(config.part.number, config.part.of, config.part.by, config.part.study)
    if digest_of(whole_text(text)) != part.study:
        problems.add(
            ("part", "study"),
            "the study above it was changed since it was split, so that its parts no longer fit together; change the "
            "whole study and split it again, or remove this section",
        )
        problems.stop()
    return part


def named_files(text: str, path: Path) -> list[Path]:
    """Files that a study names under any key."""
    content, _ = read_yaml(text, str(path))
    found = {value for value in _texts(content) if value.strip() and len(value) < LONGEST_NAME}
    files = (path.parent / value for value in sorted(found))
    return [file.resolve() for file in files if file.is_file()]


def _texts(content: Any) -> Iterator[str]:
    if isinstance(content, str):
        yield content
    elif isinstance(content, dict | list):
        for value in content.values() if isinstance(content, dict) else content:
            yield from _texts(value)
