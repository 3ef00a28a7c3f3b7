"""Quantities with units: "200 mm" to 0.2, "210 GPa" to 210e9.

A table has the usual units; pint has all others, but its import would cost every start a third of a second.
"""

import math
import re
import unicodedata
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal
from difflib import get_close_matches
from functools import cache
from typing import Any


@dataclass(frozen=True, eq=False)
class Dimension:
    """Dimension of a quantity, with its usual units and their size in its SI unit."""

    name: str
    unit: str
    example: str
    units: dict[str, str]

    @property
    def words(self) -> str:
        """Example for messages: ``a length such as '200 mm'``."""
        return f"{_article(self.name)} such as '{self.example}'"


DEGREE = "0.01745329251994329576923690768488612713"  # A degree [rad]

QUANTITY_DIMENSIONS = {
    dimension.name: dimension
    for dimension in (
        Dimension("length", "m", "200 mm", {"m": "1", "cm": "1e-2", "mm": "1e-3", "um": "1e-6", "km": "1e3"}),
        Dimension("force", "N", "400 kN", {"N": "1", "mN": "1e-3", "kN": "1e3", "MN": "1e6"}),
        Dimension(
            "stiffness", "N/m", "170e6 N/m", {"N/m": "1", "kN/m": "1e3", "MN/m": "1e6", "N/mm": "1e3", "kN/mm": "1e6"}
        ),
        Dimension("stress", "Pa", "210 GPa", {"Pa": "1", "kPa": "1e3", "MPa": "1e6", "GPa": "1e9", "N/mm^2": "1e6"}),
        Dimension(
            "density", "kg/m^3", "7850 kg/m^3", {"kg/m^3": "1", "g/cm^3": "1e3", "t/m^3": "1e3", "kg/dm^3": "1e3"}
        ),
        Dimension("area", "m^2", "12 mm^2", {"m^2": "1", "cm^2": "1e-4", "mm^2": "1e-6"}),
        Dimension("energy", "J", "3.5 J", {"J": "1", "mJ": "1e-3", "kJ": "1e3", "N*m": "1", "N*mm": "1e-3"}),
        Dimension("acceleration", "m/s^2", "9.81 m/s^2", {"m/s^2": "1", "mm/s^2": "1e-3"}),
        Dimension("angle", "rad", "30 deg", {"rad": "1", "deg": DEGREE, "mrad": "1e-3"}),
        Dimension("time", "s", "5 ms", {"s": "1", "ms": "1e-3", "us": "1e-6", "min": "60"}),
        Dimension("frequency", "Hz", "10 Hz", {"Hz": "1", "mHz": "1e-3", "kHz": "1e3"}),
    )
}
"""Dimensions of quantities by name."""

_UNIT_SIZES = {
    unit: (dimension.name, Decimal(size))
    for dimension in QUANTITY_DIMENSIONS.values()
    for unit, size in dimension.units.items()
}

_QUANTITY = re.compile(r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)(?:/([0-9]+))?\s*(.*)", re.DOTALL)


_POWERS = str.maketrans({"²": "^2", "³": "^3"})
_OF_PRINT = re.compile("pixel|point|pica|didot|cicero|dot")

LONGEST_QUANTITY = 100  # most characters of a quantity

_POWER = re.compile(r"(?<![\d\s^*/(.+-])\s*\^\s*[+-]?[\d.]{1,3}(?![\d^.])")
_OTHER_NUMBER = re.compile(r"\^|(?<![\w.])(?!1(?![\w.]))[\d.]")
"""Power of a name or a bracket, and other powers and numbers but 1."""


class UnitError(ValueError):
    """A text is not a quantity of the expected dimension; the message says why and what to write instead.

    Public functions raise it as a plain ValueError that names the argument.

    Examples
    --------
    >>> import springtune as st
    >>> from springtune.units import parse
    >>> try:
    ...     parse("200 GPa", "length")
    ... except st.UnitError as error:
    ...     print(error)
    '200 GPa' is a stress; give a length such as '200 mm'
    """


def parse(text: str, dimension: str) -> float:
    """Return the number in SI units of a quantity; its number may be a fraction, such as 1/60."""
    expected = QUANTITY_DIMENSIONS[dimension]
    remedy = f"give {expected.words}"
    if len(text) > LONGEST_QUANTITY:
        raise UnitError(f"'{text[:57]}...' is too long; {remedy}")
    found = _QUANTITY.fullmatch(text.strip())
    if not found:
        raise UnitError(f"'{text}' does not begin with a finite number; {remedy}")
    number, below, unit = found.groups()
    if not unit:
        raise UnitError(f"'{text}' has no unit; {remedy}")
    # Micro and squares are written in several ways.
    spelling = unicodedata.normalize("NFKC", unit.translate(_POWERS)).replace("μ", "u").replace("**", "^")
    known = _UNIT_SIZES.get(spelling) or _ask_pint(spelling)
    if known is None and unit[0] == ",":
        raise UnitError(f"'{text}' has a comma: write a decimal point; {remedy}")
    if known is None:
        same = [one for one in expected.units if one.casefold() == unit.casefold()]
        near = same or get_close_matches(unit, expected.units, n=1, cutoff=0.5)
        meant = f", did you mean '{near[0]}'?" if near else ";"
        raise UnitError(f"'{text}': unknown unit '{unit}'{meant} {remedy}")
    found_dimension, size = known
    if found_dimension != dimension:
        raise UnitError(f"'{text}' is {_article(found_dimension)}; {remedy}")
    value = math.inf
    with suppress(ArithmeticError):
        value = float(Decimal(number) * size / int(below or 1))
    if not math.isfinite(value):
        raise UnitError(f"'{text}' is too large a number; {remedy}")
    return value


def _article(dimension: str) -> str:
    article = "an" if dimension[0] in "aeiou" else "a"
    return f"{article} {dimension}" if dimension in QUANTITY_DIMENSIONS else dimension


@cache
def _registry() -> Any:
    import pint  # here, since few studies need it

    return pint.UnitRegistry()


@cache
def _ask_pint(unit: str) -> tuple[str, Decimal] | None:
    if _OTHER_NUMBER.search(_POWER.sub("", unit)):  # pint would evaluate 9^9^9^9
        return None
    registry = _registry()

    try:
        given = registry.parse_units(unit)
        size = registry.Quantity(1.0, given).to_base_units().magnitude
    except Exception:  # pint raises many kinds, tokenizer's and its own
        return None
    if of_print := _OF_PRINT.search(str(given)):  # to pint lengths, or numbers of dots
        return f"a number of {of_print[0]}s, which have no size of their own", Decimal(1)
    for dimension in QUANTITY_DIMENSIONS.values():
        if dimension.name in ("angle", "frequency"):
            continue  # to pint an angle is a number, as a percentage is, and a speed of rotation a frequency
        if given.dimensionality == registry.parse_units(dimension.unit).dimensionality:
            return dimension.name, Decimal(f"{size:.15g}")
    return f"of dimension {given.dimensionality}", Decimal(1)
