"""Hashes of the inputs of results."""

import hashlib
import json
from typing import Any

_ENCODER = json.JSONEncoder(sort_keys=True, separators=(",", ":"))


def hash_of(*parts: Any) -> str:
    """Hash values, independent of the order of keys.

    Examples
    --------
    >>> hash_of({"a": 1.0, "b": [2]}) == hash_of({"b": [2], "a": 1.0})
    True
    """
    return hashlib.sha256(_ENCODER.encode(parts).encode()).hexdigest()[:24]
