"""Combinations of a grid's parameters."""

from collections.abc import Iterator, Mapping
from itertools import chain, product
from math import prod
from typing import Any

from .messages import Key, Problems
from .sections import GRID_PARAMETERS, ExcludeConfig, GridConfig

Factor = tuple[tuple[str, ...], list[tuple[Any, ...]]]
"""Names of zipped parameters, and one tuple of values for each combination."""

Combination = dict[str, Any]

SAME_VALUE = 1e-9
"""Relative difference below which two numbers are the same value."""


def values_of(grid: GridConfig, name: str) -> list[Any]:
    """Values of a grid's parameter; forces given by beam are joined."""
    values = getattr(grid, name)
    if isinstance(values, dict):
        return [force for forces in values.values() for force in forces]
    return values or []


def groups_of(grid: GridConfig) -> list[tuple[str, ...]]:
    """Groups of zipped parameters in the order of `GRID_PARAMETERS`."""
    zipped = {name: tuple(group) for group in grid.zip for name in group}
    given = [name for name in GRID_PARAMETERS if getattr(grid, name) is not None]
    return list(dict.fromkeys(zipped.get(name, (name,)) for name in given))


def check_groups(name: str, grid: GridConfig, content: Mapping[str, Any], problems: Problems) -> None:
    """Check that zipped lists have equal lengths and other lists no duplicates."""
    for group in groups_of(grid):
        if len(group) == 1:
            _check_repeats(name, group[0], grid, content, problems)
            continue
        where = ("grids", name, "zip")
        absent = [one for one in group if not values_of(grid, one)]
        if absent:
            problems.add(where, f"'{absent[0]}' is zipped and has no values; give it some, or leave it out of 'zip'")
        elif grid.force and "force" in group and None not in grid.force:
            problems.add(where, "'force' is zipped and has values for each beam; give one list for all, or zip neither")
        else:
            lengths = {one: len(values_of(grid, one)) for one in group}
            if len(set(lengths.values())) > 1:
                shown = ", ".join(f"{length} of '{one}'" for one, length in lengths.items())
                problems.add(where, f"{shown} cannot go together; give each as many values")


def _check_repeats(name: str, parameter: str, grid: GridConfig, content: Mapping[str, Any], problems: Problems) -> None:
    values = getattr(grid, parameter)
    for beam, listed in values.items() if isinstance(values, dict) else [(None, values)]:
        written = content.get(parameter)
        path: tuple[Key, ...] = ("grids", name, parameter)
        if beam is not None:
            written, path = written[beam], (*path, beam)  # type: ignore[index]
        seen = set()
        for number, value in enumerate(listed):
            if value in seen:
                shown = written[number] if isinstance(written, list) else value
                place = (*path, number) if isinstance(written, list) else path
                problems.add(place, f"'{shown}' is listed twice; remove one")
            seen.add(value)


def factors(grid: GridConfig) -> list[Factor]:
    """Factors whose product is all combinations of a grid."""
    found: list[Factor] = []
    for group in groups_of(grid):
        if group == ("force",) and grid.force and None not in grid.force:
            continue  # forces of each beam go with the beam
        if "force" in group and grid.force:
            columns = [grid.force[None] if one == "force" else getattr(grid, one) for one in group]  # type: ignore[index]
        else:
            columns = [getattr(grid, one) for one in group]
        found.append((group, list(zip(*columns, strict=True))))
    if grid.force and None not in grid.force:
        place = next(number for number, (group, _) in enumerate(found) if "beam" in group)
        group, rows = found[place]
        beam = group.index("beam")
        found[place] = (*group, "force"), [(*row, force) for row in rows for force in grid.force.get(row[beam], ())]
    return found


def count(grid: GridConfig) -> tuple[int, dict[str, int]]:
    """Count the combinations before exclusions, and the size of each factor."""
    lengths = {" and ".join(group): len(rows) for group, rows in factors(grid)}
    return prod(lengths.values()), lengths


def combinations(name: str, grid: GridConfig, problems: Problems) -> Iterator[Combination]:
    """Yield the combinations of a grid without excluded ones."""
    parts = factors(grid)
    names = [*chain.from_iterable(group for group, _ in parts)]
    left_out = [_given(one) for one in grid.exclude]
    matched = [False] * len(left_out)
    for rows in product(*(rows for _, rows in parts)):
        combination = dict(zip(names, chain.from_iterable(rows)))
        found = [all(_among(combination.get(key), values) for key, values in one.items()) for one in left_out]
        if True in found:
            matched = [before or now for before, now in zip(matched, found)]
            continue
        yield combination
    for number, there in enumerate(matched):
        if not there:
            shown = ", ".join(left_out[number])
            problems.add(
                ("grids", name, "exclude", number),
                f"no combination of the grid has these values of {shown}; correct them, or remove the entry",
            )


def _given(excluded: ExcludeConfig) -> dict[str, list[Any]]:
    return {name: getattr(excluded, name) for name in GRID_PARAMETERS if getattr(excluded, name) is not None}


def _among(value: Any, values: list[Any]) -> bool:
    """Return whether a value is listed; numbers match within `SAME_VALUE`."""
    if isinstance(value, float):
        return any(abs(value - one) <= SAME_VALUE * abs(one) for one in values)
    return value in values
