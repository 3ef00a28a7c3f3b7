"""Divide a study into parts for several sites, by expected cost; each scene is in one part.

A part follows from the whole study and its number alone, so that all sites agree on it. Keys and numbers are those of
the whole study.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

from ..config.kind import kinds
from ..config.messages import StudyError

if TYPE_CHECKING:
    from ..config.kind import Kind
    from ..config.model import Study
    from ..runs.plan import Costs

Name = tuple[str | int, ...]
"""Name of a piece within its study kind."""


@dataclass(frozen=True)
class Division:
    """How a study is divided: what stays together (`by`, see `DEALT_BY`), and the most seconds of a piece."""

    by: str
    most: float

    def pieces(self, seconds: float, tasks: int) -> int:
        """Return the number of pieces of some tasks."""
        return min(tasks, ceil(seconds / self.most)) if self.most and seconds else 1

    def of_section(self, found: Mapping[Name, float]) -> dict[Name, float]:
        """Return the seconds of a section's pieces; a section is one piece if grids stay together."""
        return {(): sum(found.values())} if self.by == "grid" else dict(found)


def dealt(study: "Study", count: int, by: str) -> list[tuple[float, dict[str, list[Name]]]]:
    """Deal out the pieces of a study: the share of the cost of each part, and its pieces by kind."""
    found = _pieces(study, Division(by, 0.0))
    total = sum(found.values())
    most = total / count
    while by != "grid":
        before, found = len(found), _pieces(study, Division(by, most))
        if len(found) >= count or (len(found) == before and most < total / count):
            break
        most /= 2
    if len(found) < count:
        what = "grids and sections" if by == "grid" else "scenes or other tasks"
        other = ", or split it by mesh (--by mesh)" if by == "grid" else ""
        raise StudyError(f"{study.path}: {len(found)} {what} cannot be {count} parts; ask for at most "
                         f"{len(found)}{other}")  # fmt: skip
    seconds, held = [0.0] * count, [0] * count
    shares: list[dict[str, list[Name]]] = [{} for _ in range(count)]
    # The longest first, each to the part with the least work.
    for kind, name in sorted(found, key=lambda piece: -found[piece]):
        least = min(range(count), key=lambda number: (seconds[number], held[number], number))
        seconds[least] += found[kind, name]
        held[least] += 1
        shares[least].setdefault(kind, []).append(name)
    return [(one / (sum(seconds) or 1.0), share) for one, share in zip(seconds, shares)]


def part_of(study: "Study") -> "Study":
    """Return the part of a study that its file asks for."""
    if study.part is None:
        return study
    _, share = dealt(study, study.part.of, study.part.by)[study.part.number - 1]
    return taken(study, share)


def taken(study: "Study", share: Mapping[str, list[Name]]) -> "Study":
    """Return a study with some of its pieces alone."""
    for kind in kinds():
        if not study.parts[kind.name]:
            continue
        names = share.get(kind.name, [])
        if () in names:  # the whole section
            continue
        study = kind.take(study, names) if kind.take else replace(study, parts=study.parts | {kind.name: ()})
    return study


def _pieces(study: "Study", division: Division) -> dict[tuple[str, Name], float]:
    """Return the seconds of each piece by kind and name."""
    from ..runs.plan import Costs  # here: only a divided study needs it

    costs = Costs(Path("no costs"), {name: cost for kind in kinds() for name, cost in kind.costs.items()})
    found: dict[tuple[str, Name], float] = {}
    for kind in kinds():
        if study.parts[kind.name]:
            own = kind.pieces(study, costs, division) if kind.pieces else {(): _seconds(kind, study, costs)}
            found |= {(kind.name, name): seconds for name, seconds in own.items()}
    return found


def _seconds(kind: "Kind", study: "Study", costs: "Costs") -> float:
    """Return the seconds of all tasks of a kind."""
    made = (stage.members(study, costs) for stage in kind.stages if stage.members)
    return sum(seconds for members in made for seconds, _ in members.values())
