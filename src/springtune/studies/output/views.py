"""What a page to browse shows of a group of the dataset, as a study kind declares it in its module ``views``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from .dataset import Label


@dataclass(frozen=True)
class Plot:
    """One plot of a group: what stands along its axes. Dimensions that it does not name are for the reader to choose.

    Attributes
    ----------
    value : str
        Variable that is plotted: up the axis of lines, by colour on a map.
    by : str
        Dimension with a line a label, or that of a map along y.
    along : str
        Dimension whose points a line joins, where `x` is a variable.
    ascending : bool
        Whether a line joins them in the order of `x`.
    log : str
        Logarithmic axes: ``"x"``, ``"y"`` or ``"xy"``. What is along a logarithmic axis is shown without its sign.
    beside : tuple of tuple
        Further lines, each the variable or dimension along x, the variable up the axis, and a name.
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
    """View of a group.

    Attributes
    ----------
    plots : tuple of Plot
        Plots to choose from, the first of them at the beginning; one whose variables are not there is left out.
    columns : tuple of str
        Variables in the columns of the table of cells, for the root.
    """

    group: str
    title: str
    note: str = ""
    plots: tuple[Plot, ...] = ()
    columns: tuple[str, ...] = ()
