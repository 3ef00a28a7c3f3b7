"""User input: quantities as texts with units or numbers in SI units, and known names."""

import math
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

Number = float | Any
"""A number in SI units, for which a text with its unit may be given as well."""


def quantity(value: float | str, kind: str, name: str) -> float:
    """Return the number in SI units of a text with its unit, or of a number in SI units."""
    if isinstance(value, str):
        from ..units import UnitError, parse  # here, since a study's numbers are in SI units

        try:
            return parse(value, kind)
        except UnitError as error:
            raise ValueError(f"{name}: {error}") from None
    try:
        number = math.nan if isinstance(value, bool | bytes | bytearray) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"{name}: {value!r} is not a finite number; {_remedy(kind)}")
    return number


def positive(value: float | str, kind: str, name: str) -> float:
    """Return the number in SI units of a quantity above zero."""
    number = quantity(value, kind, name)
    if not number > 0:
        raise ValueError(f"{name}: {value!r} is not above zero; {_remedy(kind)}")
    if beyond(number, kind):
        raise ValueError(f"{name}: {value!r} is beyond all measure; {_remedy(kind)}")
    return number


def put(frozen: object, **values: object) -> None:
    """Set fields of a frozen dataclass as it is made."""
    for name, value in values.items():
        object.__setattr__(frozen, name, value)


LEAST_QUANTITY, MOST_QUANTITY = 1e-40, 1e40
"""Quantities between which products of several stay numbers [SI units]; forces are what they are."""


def beyond(number: Number, kind: str) -> bool:
    """Whether a quantity is so small or large that nothing can be computed with it."""
    return bool(kind != "force" and not LEAST_QUANTITY <= number <= MOST_QUANTITY)


def _remedy(kind: str) -> str:
    from ..units import QUANTITY_DIMENSIONS

    return f"give {QUANTITY_DIMENSIONS[kind].words}, or a number in {QUANTITY_DIMENSIONS[kind].unit}"


LONGEST_WORD = 100
"""Characters of a word beyond which none is near it."""

MOST_WORDS = 50
"""Most words that are listed."""


def nearest(word: str, words: Iterable[str]) -> str:
    """Return ``did you mean ...?`` if one of the words is near, and all of them."""
    words = list(words)
    near = get_close_matches(word, words, n=1, cutoff=0.6) if len(word) <= LONGEST_WORD else []
    hint = f"did you mean '{near[0]}'? " if near else ""
    more = f" and {len(words) - MOST_WORDS} more" if len(words) > MOST_WORDS else ""
    return f"{hint}known: {', '.join(words[:MOST_WORDS])}{more}"
