"""Locked and installed software, and the machine."""

import os
import platform
from pathlib import Path

LOCK_FILES = ("requirements/run.txt", "requirements/cholesky.txt")
"""Lock files of studies; the second is an optional extra."""


def minor(version: str) -> str:
    """Python version without its last number, as wheels use it.

    Examples
    --------
    >>> minor("3.11.7")
    '3.11'
    """
    return ".".join(version.split(".")[:2])


def locked(path: Path) -> dict[str, str]:
    """Versions that a lock file requests on this machine."""
    from packaging.requirements import InvalidRequirement, Requirement
    from packaging.utils import canonicalize_name

    found = {}
    for line in path.read_text().splitlines():
        text = line.removesuffix("\\").strip()
        if not text or text.startswith(("#", "-")):
            continue
        try:
            one = Requirement(text)
        except InvalidRequirement:
            continue
        if one.marker is None or one.marker.evaluate():
            found[str(canonicalize_name(one.name))] = str(one.specifier).removeprefix("==")
    return found


def departures(lock: Path) -> dict[str, tuple[str, str]]:
    """Installed versions that differ from a lock file."""
    from ..runs.keys import installed

    here = {name: (version, installed(name)) for name, version in locked(lock).items()}
    return {name: pair for name, pair in here.items() if pair[0] != pair[1]}


def machine() -> dict[str, str]:
    """Properties of the machine that numbers and times depend on, without names."""
    found = {"architecture": platform.machine(), "system": platform.system(), "cores": str(os.cpu_count())}
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return found | ({"processor": models[0]} if models else {})
