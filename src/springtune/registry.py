"""Registries of definitions, engines, loads and mesh types, and imports by name.

A decorator adds a function; the modules of its package are imported on first use. Other packages have entry points in
``springtune.definitions``, ``springtune.engines``, ``springtune.loads`` and ``springtune.mesh_types``.
"""

import inspect
import os
import pkgutil
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

HOOKS = {"drawing": "studies.output.style", "files": "handover.formats"}
"""Modules that others call by name, mostly those of upper rooms: grimp counts an import inside a function, so that the
import linter would find circles, and a new figure would change the keys of results."""


PLUGINS_VARIABLE = "SPRINGTUNE_PLUGINS"
"""Environment variable; ``none`` ignores the entry points of other packages."""


class PluginWarning(UserWarning):
    """An entry point of another package is left out; the message says why."""


GROUPS = ("definitions", "engines", "loads", "mesh_types")  # groups of entry points, after ``springtune.``


@cache
def plugins() -> dict[str, list[Any]]:
    """Entry points of other packages by group, sorted by package."""
    if os.environ.get(PLUGINS_VARIABLE) == "none":
        return dict.fromkeys(GROUPS, [])
    from importlib.metadata import entry_points  # here: it costs more than a light command

    found = entry_points()
    return {group: sorted(found.select(group=f"springtune.{group}"), key=_package) for group in GROUPS}


def _package(one: Any) -> str:
    return one.dist.name if one.dist else one.module


@cache
def plugin_packages() -> set[str]:
    """Top-level modules of the packages with entry points."""
    return {one.module.partition(".")[0] for group in plugins().values() for one in group}


def import_name(name: str) -> Any:
    """Import a module of the package, or with ``module:name`` an attribute of it."""
    module, _, attribute = name.partition(":")
    found = import_module(f"springtune.{module}")
    return getattr(found, attribute) if attribute else found


def hook(name: str) -> Any:
    """Module of `HOOKS`."""
    return import_name(HOOKS[name])


@dataclass(frozen=True, eq=False)
class Declaration:
    """Declared function with its name in studies; entries are sorted by `order`, then by name."""

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
        """File of the function; None if it was typed into a notebook or a prompt."""
        found = inspect.getsourcefile(inspect.unwrap(self.function))
        return Path(found).absolute() if found and Path(found).is_file() else None


NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,59}")
NAME_RULE = (
    "use letters, digits, '.', '_' and '-', at most 60 of them, and no '.' in front: names become parts of file names"
)


Entry = TypeVar("Entry")
Function = TypeVar("Function", bound=Declaration)


class ExtensibleMapping(Mapping[str, Entry]):
    """Read-only mapping of the package's entries and of other packages' entry points, without faulty ones.

    `adopt` checks an imported object, and returns the entry or raises ValueError: then a `PluginWarning` says why.
    """

    def __init__(self, what: str, group: str, entries: dict[str, Entry], adopt: Any = None) -> None:
        self._what, self._group, self._adopt = what, group, adopt
        self._entries = entries
        self._tried: dict[Any, str] = {}
        self.packages: dict[str, str] = {}

    def _discover(self) -> None:
        """Find the package's own entries."""

    def _enter(self, name: str, found: Any) -> None:
        """Add the entry of another package."""
        if name in self._entries:
            raise ValueError(f"'{self.packages.get(name, 'springtune')}' has one of this name already; rename it")
        self._entries = self._entries | {name: self._adopt(name, found)}

    def _load(self, name: str = "") -> str:
        """Import the entry points of a name, or all; return the reasons of failures."""
        self._discover()
        asked = [one for one in plugins()[self._group] if name in ("", one.name)]
        for one in asked:
            if one in self._tried:
                continue
            before, self._tried[one] = self._entries, ""
            try:
                self._enter(one.name, one.load())
                self.packages[one.name] = _package(one)
            except (Exception, SystemExit) as error:  # whatever a package does, others work
                self._entries = before
                self._tried[one] = (
                    f"{self._what} '{one.name}' of the package '{_package(one)}' is left out: "
                    f"{error or type(error).__name__}; update or uninstall this package, or set {PLUGINS_VARIABLE}=none"
                )
                warnings.warn(self._tried[one], PluginWarning, stacklevel=2)
        return "; ".join(filter(None, map(self._tried.get, asked)))

    def __contains__(self, name: object) -> bool:
        if isinstance(name, str) and name not in self._entries:
            self._discover()
            if name not in self._entries:
                self._load(name)
        return isinstance(name, str) and name in self._entries

    def __getitem__(self, name: str) -> Entry:
        if name not in self:
            raise KeyError(self._load(name) or f"unknown {self._what} '{name}'; known: {', '.join(self)}")
        return self._entries[name]

    def __iter__(self) -> Iterator[str]:
        self._load()
        return iter(self._entries)

    def __len__(self) -> int:
        self._load()
        return len(self._entries)

    def __repr__(self) -> str:
        return f"<{self._what}s: {', '.join(self)}>"


class Registry(ExtensibleMapping[Function]):
    """Mapping of declared functions; imports the package's modules when needed."""

    def __init__(self, package: str, what: str, group: str):
        super().__init__(what, group, {})
        self._package = package
        self._complete = False

    def declare(self, entry: Function) -> Any:
        """Add an entry, and return its function; one declared again, as in a notebook cell, replaces the former one."""
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
        return entry.function

    def discard(self, name: str) -> None:
        """Remove an entry; unknown names are ignored."""
        self._entries = {one: entry for one, entry in self._entries.items() if one != name}

    def _discover(self) -> None:
        if not self._complete:
            for module in pkgutil.iter_modules(import_module(self._package).__path__):
                import_module(f"{self._package}.{module.name}")
            self._complete = True

    def _enter(self, name: str, found: Any) -> None:
        """Check that an imported function declared itself under the name of its entry point."""
        if name not in self._entries or self._entries[name].function is not found:
            raise ValueError(f"{found!r} is not declared as '{name}'; its decorator and entry point need one name")


def how_to_install(extra: str) -> str:
    """Return how to install an extra; no package index has springtune."""
    from importlib.metadata import version

    wheel = f"springtune-{version('springtune')}-py3-none-any.whl[{extra}]"
    return f"install the extra, in a clone `pip install '.[{extra}]'`, of a wheel `pip install '{wheel}'`"
