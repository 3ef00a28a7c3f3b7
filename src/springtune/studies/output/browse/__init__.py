"""The page to browse a dataset with: one file that needs neither a server nor a network."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from ..dataset import Label


@dataclass(frozen=True)
class Plot:
    """A plot of a group; readers choose along unnamed dimensions.

    `by` has one line a label, or is a map's y axis. A line joins the points `along` a dimension if `x` is a variable.
    `log` names logarithmic axes ("x", "y", "xy"), which show magnitudes.
    """

    title: str
    value: str
    x: str
    by: str = ""
    shows: Literal["lines", "points", "map"] = "lines"
    along: str = ""
    ascending: bool = False
    log: Literal["", "x", "y", "xy"] = ""
    equal: bool = False
    beside: tuple[tuple[str, str, str], ...] = ()
    selection: Mapping[str, Label] = field(default_factory=dict)


@dataclass(frozen=True)
class View:
    """View of a group: its `plots`, without missing variables, and table `columns` for the root."""

    group: str
    title: str
    note: str = ""
    plots: tuple[Plot, ...] = ()
    columns: tuple[str, ...] = ()
