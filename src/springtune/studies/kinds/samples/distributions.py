"""Distributions of a parameter, as a study writes them."""

from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from springtune.problem.quantities import LEAST, nearest

from ...config.fields import number, quantity
from ...config.messages import refuse, show
from .designs import PARAMETERS

DISTRIBUTION_KEYS = {
    "uniform": ("from", "to"),
    "log-uniform": ("from", "to"),
    "triangular": ("from", "mode", "to"),
    "normal": ("mean", "deviation"),
}
"""Keys that each distribution needs."""

DEVIATIONS = 4.0
"""Standard deviations from the mean at which a normal distribution ends by default."""

MOST_DEVIATIONS = 8.0
"""Largest distance of the range of a normal distribution from its mean, in standard deviations."""

LEGAL = {"poisson_ratio": (0.0, 0.5), "relative_mesh_size": (LEAST, 1.0)}
"""Range of the parameters that are not just positive."""

_NUMBERS = {
    "poisson_ratio": number("a number from 0 to 0.5, such as 0.3", 0, 0.5),
    "relative_mesh_size": number("a number above 0 and at most 1, such as 0.2", 0, 1, above=True),
}


class Distributed:
    """Annotation of a parameter: a value, or the distribution to draw it from."""

    def __init__(self, name: str, example: str) -> None:
        scalar = _NUMBERS.get(name) or quantity(PARAMETERS[name][0])
        self.name, self.scalar, self.example = name, scalar, example
        self.words = f"{scalar.words}, or a range such as `{example}`"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        single = handler.generate_schema(Annotated[float, self.scalar])
        fixed = core_schema.no_info_after_validator_function(
            lambda value: {"distribution": "fixed", "low": value, "high": value}, single
        )
        choices: dict[Any, CoreSchema] = {
            "fixed": fixed,
            "drawn": core_schema.no_info_plain_validator_function(self._read),
        }
        return core_schema.tagged_union_schema(
            choices, lambda value: "drawn" if isinstance(value, dict | list) else "fixed"
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        value = dict(self.scalar.schema)
        keys = dict.fromkeys((key for needed in DISTRIBUTION_KEYS.values() for key in needed), value)
        drawn = {
            "type": "object",
            "properties": {"distribution": {"enum": list(DISTRIBUTION_KEYS)}} | keys,
            "additionalProperties": False,
        }
        return {"anyOf": [value, drawn]}

    def _read(self, value: object) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise refuse(f"{show(value)}, as in a grid; a sample has a value or a range: give {self.example}")
        name = value.get("distribution") or "uniform"
        if not isinstance(name, str) or name not in DISTRIBUTION_KEYS:
            raise refuse(f"unknown distribution {show(name)}; {nearest(str(name), DISTRIBUTION_KEYS)}", "distribution")
        needed = DISTRIBUTION_KEYS[name]
        known = [*dict.fromkeys([*needed, "from", "to"]), "distribution"]
        for key in value:
            if key not in known:
                raise refuse(f"unknown key {show(key)} of a {name} distribution; {nearest(str(key), known)}", key)
        for key in needed:
            if value.get(key) is None:
                raise refuse(f"'{key}' is missing: a {name} distribution needs {' and '.join(needed)}; give them, such "
                             f"as {self.example}")  # fmt: skip
        read = {key: self._number(key, one) for key, one in value.items() if key != "distribution" and one is not None}
        if name == "normal":
            read = self._ended(read)
        low, high = read.pop("from"), read.pop("to")
        if not low < high:
            ends = f"{show(value.get('from', low))} is not below 'to', {show(value.get('to', high))}"
            raise refuse(f"{ends}; exchange them, or give one value for a parameter that does not vary", "from")
        if name == "log-uniform" and not low > 0:
            raise refuse(f"{show(value['from'])} has no logarithm; give a 'from' above zero, or a uniform one", "from")
        if name == "triangular" and not low <= read["mode"] <= high:
            raise refuse(f"{show(value['mode'])} is not between 'from' and 'to'; give a mode between them", "mode")
        if name == "normal":
            most = MOST_DEVIATIONS * read["deviation"]
            where = (
                "below 'from'" if read["mean"] + most <= low else "above 'to'" if read["mean"] - most >= high else ""
            )
            if where:
                raise refuse(f"{show(value['mean'])} is far {where}; give ends near the mean", "mean")
        return {"distribution": name, "low": low, "high": high} | read

    def _number(self, key: str, value: object) -> float:
        """Read a number of the parameter's own kind; what is wrong with it goes under its key."""
        if not isinstance(value, str):
            raise refuse(f"{show(value)} instead of {self.scalar.words}; give {self.scalar.words}", key)
        try:
            return float(self.scalar.read(value.strip()))
        except Exception as error:
            message = getattr(error, "context", None) or {"message": str(error)}
            raise refuse(message["message"], key) from None

    def _ended(self, read: dict[str, float]) -> dict[str, float]:
        """Add the ends of a normal distribution: by default some deviations from the mean, within its legal range."""
        if not read["deviation"] > 0:
            raise refuse("'0' is no deviation; give one above zero, or one value", "deviation")
        least, most = LEGAL.get(self.name, (0.0, float("inf")))
        below, above = (read["mean"] + sign * DEVIATIONS * read["deviation"] for sign in (-1, 1))
        if "from" not in read and below <= least and self.name != "poisson_ratio":
            raise refuse(
                f"{DEVIATIONS:g} deviations below the mean are not above zero; give where the distribution ends, "
                "from: <smallest value>",
                "deviation",
            )
        return {"from": max(least, below), "to": min(most, above)} | read
