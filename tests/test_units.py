"""Quantities with units."""

import math
from decimal import Decimal
from pathlib import Path

import pint
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as some

import springtune as st
from springtune.units import QUANTITY_DIMENSIONS, parse

QUANTITIES = yaml.safe_load(Path(__file__).with_name("units.yaml").read_text())
USUAL = [(kind, unit) for kind, one in QUANTITY_DIMENSIONS.items() for unit in one.units]


@pytest.mark.parametrize(("text", "kind", "value"), QUANTITIES["read"])
def test_reads_quantities(text, kind, value):
    assert parse(text, kind) == value


@pytest.fixture(scope="module")
def registry():
    return pint.UnitRegistry()


@pytest.mark.parametrize(("kind", "unit"), USUAL)
def test_table_agrees_with_pint(registry, kind, unit):
    theirs = registry.Quantity(1.0, unit).to(QUANTITY_DIMENSIONS[kind].unit).magnitude
    assert math.isclose(parse(f"1 {unit}", kind), theirs, rel_tol=1e-9)


@pytest.mark.parametrize("kind", QUANTITY_DIMENSIONS)
def test_examples_in_messages_are_right(kind):
    assert parse(QUANTITY_DIMENSIONS[kind].example, kind) > 0


@pytest.mark.parametrize(("text", "kind", "says"), QUANTITIES["refused"])
def test_refuses(text, kind, says):
    with pytest.raises(st.UnitError) as caught:
        parse(text, kind)
    assert says in str(caught.value)
    assert QUANTITY_DIMENSIONS[kind].example in str(caught.value)


@given(
    some.sampled_from(USUAL),
    some.decimals(min_value="-1e12", max_value="1e12", places=6, allow_nan=False, allow_infinity=False),
)
def test_value_is_the_nearest_float(kind_and_unit, number):
    kind, unit = kind_and_unit
    assert parse(f"{number} {unit}", kind) == float(number * Decimal(QUANTITY_DIMENSIONS[kind].units[unit]))


@given(some.text(max_size=20), some.sampled_from(sorted(QUANTITY_DIMENSIONS)))
def test_any_text_is_read_or_refused(text, kind):
    try:
        assert math.isfinite(parse(text, kind))
    except st.UnitError:
        pass
