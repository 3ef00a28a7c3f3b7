"""User input: quantities as texts with units or numbers in SI units, known names, swept parameters; the status."""

import math
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from enum import IntEnum
from numbers import Integral
from typing import Any, TypeVar

Entry = TypeVar("Entry")

Number = float | Any  # A number in SI units, for which a text with its unit may be given as well


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
    if out_of_range(number, kind):
        raise ValueError(f"{name}: {value!r} is far out of range; {_remedy(kind)}")
    return number


def whole_number(value: Any, name: str, most: float = math.inf) -> int:
    """Return a whole number above zero, up to the most that is run."""
    if isinstance(value, bool) or not isinstance(value, Integral) or int(value) < 1:
        raise ValueError(f"{name}: {value!r} is not a whole number above zero; give one")
    if int(value) > most:
        raise ValueError(f"{name}: {value!r} is more than {most}; give fewer")
    return int(value)


def put(frozen: object, **values: object) -> None:
    """Set fields of a frozen dataclass as it is made."""
    for name, value in values.items():
        object.__setattr__(frozen, name, value)


LEAST_QUANTITY, MOST_QUANTITY = 1e-40, 1e40
"""Quantities between which products of several stay numbers [SI units]; forces are what they are."""


def out_of_range(number: Number, kind: str) -> bool:
    """Whether a quantity is so small or large that nothing can be computed with it."""
    return bool(kind != "force" and not LEAST_QUANTITY <= number <= MOST_QUANTITY)


def _remedy(kind: str) -> str:
    from ..units import QUANTITY_DIMENSIONS

    return f"give {QUANTITY_DIMENSIONS[kind].words}, or a number in {QUANTITY_DIMENSIONS[kind].unit}"


LONGEST_WORD = 100  # characters of a word beyond which none is near it

MOST_WORDS = 50  # most words that are listed


def nearest(word: str, words: Iterable[str]) -> str:
    """Return ``did you mean ...?`` if one of the words is near, and all of them."""
    words = list(words)
    near = get_close_matches(word, words, n=1, cutoff=0.6) if len(word) <= LONGEST_WORD else []
    hint = f"did you mean '{near[0]}'? " if near else ""
    more = f" and {len(words) - MOST_WORDS} more" if len(words) > MOST_WORDS else ""
    return f"{hint}known: {', '.join(words[:MOST_WORDS])}{more}"


def choose(known: Mapping[str, Entry], name: object, what: str) -> Entry:
    """Return the entry of a mapping; for another name raise ValueError with the known ones."""
    if isinstance(name, str) and name in known:
        return known[name]
    raise ValueError(f"{what}: {name!r} is unknown; {nearest(str(name), known)}")


SWEPT = {
    "force": ("size of the force on the loaded side; the load says its direction", "N"),
    "thickness": ("thickness of the sheet", "m"),
    "young_modulus": ("Young's modulus", "Pa"),
    "poisson_ratio": ("Poisson's ratio", "1"),
    "stiffness_scale": ("factor on the stiffness that the definition gives", "1"),
}
"""Description and unit of each by its name in studies and datasets."""

PLANES = "stress", "strain"  # plane stress and plane strain: the quantity that is zero across a sheet

MOST_SCENES = 1_000_000
"""Most scenes of a study, those that grids share counted in each, unless `MOST_SCENES_VARIABLE` says more."""

MOST_SCENES_VARIABLE = "SPRINGTUNE_MAX_SCENES"  # variable of the environment with another number


def with_unit(name: str, value: float, digits: int = 4) -> str:
    r"""Return a swept parameter's value with its unit, without line breaks.

    >>> with_unit("force", 4e5), with_unit("thickness", 2e-3), with_unit("poisson_ratio", 0.3)
    ('400\xa0kN', 'thickness 2\xa0mm', 'nu\xa0=\xa00.3')
    """
    if name == "force":
        text = f"{value / 1e3:.{digits}g} kN" if abs(value) >= 1e3 else f"{value:.{digits}g} N"
    elif name == "thickness":
        return f"thickness {1e3 * value:.{digits}g}\u00a0mm"
    elif name == "young_modulus":
        text = f"E = {value / 1e9:.{digits}g} GPa" if value >= 1e9 else f"E = {value / 1e6:.{digits}g} MPa"
    elif name == "poisson_ratio":
        text = f"nu = {value:.{digits}g}"
    else:
        return f"stiffness times\u00a0{value:.{digits}g}"
    return text.replace(" ", "\u00a0")


class Status(IntEnum):
    """Status of a solve, such as a scene or a point of a curve; flags of a dataset's variables ``status``.

    Stored as a number; its text is the flag's meaning.

    Attributes
    ----------
    NOT_REQUESTED
        Was not requested.
    SOLVED
        A stable equilibrium.
    LINEAR_ONLY
        Only the linear equilibrium.
    NOT_CONVERGED
        No equilibrium was found.
    UNSTABLE
        An unstable equilibrium, or an unstable path to it.
    FAILED
        Nothing to solve: a definition refuses the mesh, a reference is missing, or the program failed.

    Examples
    --------
    >>> import springtune as st
    >>> str(st.Status.NOT_CONVERGED), int(st.Status.NOT_CONVERGED)
    ('not_converged', 3)
    >>> st.Status(4)
    <Status.UNSTABLE: 4>
    """

    NOT_REQUESTED = 0
    SOLVED = 1
    LINEAR_ONLY = 2
    NOT_CONVERGED = 3
    UNSTABLE = 4
    FAILED = 5

    def __str__(self) -> str:
        return self.name.lower()
