"""Quantities with units."""

import math
from decimal import Decimal

import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from springtune.units import COMMON, QUANTITY_KINDS, UnitError, parse

REGISTRY = pint.UnitRegistry()

USUAL = [(kind, unit) for kind, units in COMMON.items() for unit in units]


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("200 mm", "length", 0.2),
        ("200mm", "length", 0.2),
        (" .5 um ", "length", 5e-7),
        ("5 µm", "length", 5e-6),
        ("5 μm", "length", 5e-6),
        ("1 inch", "length", 0.0254),
        ("210 GPa", "stress", 210e9),
        ("1 N/mm²", "stress", 1e6),
        ("1 N/mm**2", "stress", 1e6),
        ("1 bar", "stress", 1e5),
        ("400 kN", "force", 400e3),
        ("-3 N", "force", -3.0),
        ("170e6 N/m", "stiffness", 170e6),
        ("170e6 N/mm", "stiffness", 170e9),
        ("170 MN / m", "stiffness", 170e6),
        ("1/60 s", "time", 1 / 60),
    ],
)
def test_reads_quantities(text, kind, value):
    assert parse(text, kind) == value


@pytest.mark.parametrize(("kind", "unit"), USUAL)
def test_table_agrees_with_pint(kind, unit):
    theirs = REGISTRY.Quantity(1.0, unit).to(QUANTITY_KINDS[kind].unit).magnitude
    assert math.isclose(parse(f"1 {unit}", kind), theirs, rel_tol=1e-9)


@pytest.mark.parametrize("kind", QUANTITY_KINDS)
def test_examples_in_messages_are_right(kind):
    assert parse(QUANTITY_KINDS[kind].example, kind) > 0


@pytest.mark.parametrize(
    ("text", "kind", "says"),
    [
        ("200", "length", "'200' has no unit; give a length such as '200 mm'"),
        ("200 mN", "length", "'200 mN' is a force; give a length such as '200 mm'"),
        ("5 s", "force", "'5 s' is a time; give a force such as '400 kN'"),
        ("200 mmm", "length", "unknown unit 'mmm', did you mean 'mm'?"),
        ("0,5 mm", "length", "unknown unit ',5 mm'"),
        ("1 mm*", "length", "unknown unit 'mm*'"),
        ("1 (((", "length", "unknown unit '((('"),
        ("20 degC", "stress", "is of dimension [temperature]"),
        ("nan mm", "length", "does not begin with a finite number"),
        ("inf mm", "length", "does not begin with a finite number"),
        ("", "length", "does not begin with a finite number"),
        ("1e400 mm", "length", "too large"),
        ("1e99999999999999999999 mm", "length", "too large"),
        ("1/0 s", "time", "too large"),
        ("1/60", "time", "'1/60' has no unit"),
    ],
)
def test_refuses(text, kind, says):
    with pytest.raises(UnitError) as caught:
        parse(text, kind)
    assert says in str(caught.value)
    assert QUANTITY_KINDS[kind].example in str(caught.value)


@given(
    st.sampled_from(USUAL),
    st.decimals(min_value="-1e12", max_value="1e12", places=6, allow_nan=False, allow_infinity=False),
)
def test_value_is_the_nearest_float(kind_and_unit, number):
    kind, unit = kind_and_unit
    assert parse(f"{number} {unit}", kind) == float(number * Decimal(COMMON[kind][unit]))


@given(st.text(max_size=20), st.sampled_from(sorted(QUANTITY_KINDS)))
def test_any_text_is_read_or_refused(text, kind):
    try:
        assert math.isfinite(parse(text, kind))
    except UnitError:
        pass
