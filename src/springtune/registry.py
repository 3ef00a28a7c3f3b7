"""Registries of named functions: a decorator adds each to a mapping.

On first use the mapping imports all modules of a package to find what they declare. Code outside the package uses the
same decorator.
"""

import inspect
import pkgutil
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

HOOKS = {"drawing": "studies.output.drawing", "writing": "handover.written"}
"""Modules of upper layers that lower ones call by name, so that no result depends on them."""


def imported(name: str) -> Any:
    """Import a module of the package, or with ``module:name`` an attribute of it.

    All imports by text use this function: commands, study kinds, stages, outputs, public names and hooks.
    """
    module, _, attribute = name.partition(":")
    found = import_module(f"springtune.{module}")
    return getattr(found, attribute) if attribute else found


def hook(name: str) -> Any:
    """Module of `HOOKS`."""
    return imported(HOOKS[name])


@dataclass(frozen=True, eq=False)
class Declared:
    """Function with its name in studies; entries are sorted by `order`, then by name."""

    name: str
    function: Callable[..., Any]
    order: float

    @property
    def summary(self) -> str:
        """First line of the function's docstring, without its full stop."""
        return (inspect.getdoc(self.function) or "").partition("\n")[0].rstrip(".")

    @property
    def place(self) -> str:
        """Module and name of the function."""
        return f"{self.function.__module__}.{self.function.__qualname__}"

    @cached_property
    def file(self) -> Path | None:
        """File where the function stands; None where it was typed into a notebook or a prompt."""
        found = inspect.getsourcefile(inspect.unwrap(self.function))
        return Path(found).absolute() if found and Path(found).is_file() else None


Entry = TypeVar("Entry", bound=Declared)


NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,59}")
NAME_RULE = (
    "use letters, digits, '.', '_' and '-', at most 60 of them, and no '.' in front: names become parts of file names"
)


class Registry(Mapping[str, Entry]):
    """Read-only ordered mapping from names to declared entries; imports the package's modules when needed."""

    def __init__(self, package: str, what: str):
        self._package, self._what = package, what
        self._entries: dict[str, Entry] = {}
        self._complete = False

    def declare(self, entry: Entry) -> None:
        """Add an entry; the decorators call it.

        A function declared again from the same place, as in a notebook cell, replaces the former one.
        """
        if not (isinstance(entry.name, str) and NAME.fullmatch(entry.name)):
            raise ValueError(f"{self._what}: {entry.name!r} cannot name one; {NAME_RULE}")
        if not callable(entry.function):
            raise ValueError(f"{self._what} '{entry.name}': {entry.function!r} is not a function; decorate one")
        if isinstance(entry.order, bool) or not (isinstance(entry.order, int | float) and entry.order == entry.order):
            raise ValueError(f"{self._what} '{entry.name}': order {entry.order!r} is not a number; give one")
        if not entry.function.__module__.startswith(f"{self._package}."):
            self._discover()
        former = self._entries.get(entry.name)
        if former is not None and former.place != entry.place:
            raise ValueError(
                f"{self._what} '{entry.name}' is {former.place} already; choose another name for {entry.place}"
            )
        entries = [*(self._entries | {entry.name: entry}).values()]
        self._entries = {one.name: one for one in sorted(entries, key=lambda one: (one.order, one.name))}

    def discard(self, name: str) -> None:
        """Remove what code outside the package declared; unknown names are ignored."""
        self._entries = {one: entry for one, entry in self._entries.items() if one != name}

    def _discover(self) -> None:
        if not self._complete:
            for module in pkgutil.iter_modules(import_module(self._package).__path__):
                import_module(f"{self._package}.{module.name}")
            self._complete = True

    def __getitem__(self, name: str) -> Entry:
        self._discover()
        if name not in self._entries:
            raise KeyError(f"unknown {self._what} '{name}'; known: {', '.join(self._entries)}")
        return self._entries[name]

    def __iter__(self) -> Iterator[str]:
        self._discover()
        return iter(self._entries)

    def __len__(self) -> int:
        self._discover()
        return len(self._entries)

    def __repr__(self) -> str:
        return f"<{self._what}s: {', '.join(self)}>"
