"""Registries of the models and schemes that the key ``kind`` may name: those of vibsim, then of installed packages.

A package offers a model or a scheme by an entry point of the group ``vibsim.models`` or ``vibsim.schemes``, named by
its kind. Entry points are looked up only for a kind that vibsim does not have, or to list all. A name in an experiment
file is compared with their names, and never imported itself.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from vibsim.core.errors import Fault, InputError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


class _HasKind(Protocol):
    @property
    def kind(self) -> str: ...


Entry = TypeVar("Entry", bound=_HasKind)


class Registry(Mapping[str, Entry]):
    """Models or schemes by kind. Iterating over the kinds imports no package; looking up a value does."""

    def __init__(
        self,
        group: str,
        type_: type[Entry],
        entries: Iterable[Entry],
        fault_of: Callable[[Entry], str],
    ) -> None:
        self.group = group
        """Group of the entry points."""
        self.built_in: Mapping[str, Entry] = MappingProxyType({row.kind: row for row in entries})
        """The entries of vibsim itself."""
        self._type, self._own_fault_of = type_, fault_of
        self._loaded: dict[str, Entry] = {}

    def __getitem__(self, kind: str) -> Entry:
        """Return an entry; raise InputError where a package offers it but it cannot be loaded."""
        if kind in self.built_in:
            return self.built_in[kind]
        if kind not in self._loaded:
            self._loaded[kind] = self._load(self._offers()[kind])
        return self._loaded[kind]

    def __iter__(self) -> Iterator[str]:
        return iter((*self.built_in, *self._offers()))

    def __len__(self) -> int:
        return len(self.built_in) + len(self._offers())

    def __contains__(self, kind: object) -> bool:
        return kind in self.built_in or kind in self._offers()

    def own(self, entries: Iterable[Any]) -> dict[str, Entry]:
        """Return a user's own models or schemes by kind, after checking them.

        Raises
        ------
        InputError
            Where an object is not a valid entry, or its kind is taken.
        """
        checked: dict[str, Entry] = {}
        for entry in entries:
            fault = self._fault_of(entry)
            name = str(entry.kind) if isinstance(entry, self._type) else ""
            if not fault and checked.get(name, self.built_in.get(name, entry)) is not entry:
                fault = "the name is taken: give it another kind"
            if fault:
                plural = self.group.rpartition(".")[2]
                raise InputError([Fault(f"in memory, one of the {plural}", 0, "", name, fault)])
            checked[name] = entry
        return checked

    def usable(self) -> tuple[dict[str, Entry], list[Fault]]:
        """Return all entries that can be loaded, and the faults of the packages whose entries cannot."""
        entries, faults = dict(self.built_in), list[Fault]()
        try:
            kinds = list(self._offers())
        except InputError as error:
            return entries, [*error.faults]
        for kind in kinds:
            try:
                entries[kind] = self[kind]
            except InputError as error:
                faults += error.faults
        return entries, faults

    def _fault_of(self, entry: object) -> str:
        """Return why an object cannot be added; empty if it can."""
        if not isinstance(entry, self._type):
            known, given = f"{self.group}.{self._type.__name__}", type(entry).__name__
            return f"is no {known}, but of the type {given}"
        try:
            # results derived from it are cached
            hash(entry)
        except TypeError as error:
            return f"it must have a hash: write tuples instead of lists ({error})"
        try:
            if not re.fullmatch("[a-z0-9_]+", entry.kind):
                return "its kind must consist of a to z, 0 to 9 and _"
            return self._own_fault_of(entry)
        except (Exception, SystemExit) as error:
            return f"cannot be used: {type(error).__name__}: {error}"

    def _offers(self) -> Mapping[str, EntryPoint]:
        points = offers(self.group)
        for name in points.keys() & self.built_in.keys():
            raise _refusal(points[name], "vibsim has one of this name already: choose another kind")
        return points

    def _load(self, point: EntryPoint) -> Entry:
        try:
            entry: Any = point.load()
        except (Exception, SystemExit) as error:
            rule = f"cannot be imported: {type(error).__name__}: {error}"
            raise _refusal(point, rule) from error
        fault = self._fault_of(entry)
        if not fault and entry.kind != point.name:
            fault = f"its kind is '{entry.kind}': the entry point must have the same name"
        if fault:
            raise _refusal(point, fault)
        loaded: Entry = entry
        return loaded


@cache
def offers(group: str) -> Mapping[str, EntryPoint]:
    """Return the entry points of a group by name; raise InputError where two packages use the same name."""
    # imported here, because it takes 20 ms
    from importlib.metadata import entry_points

    points: dict[str, EntryPoint] = {}
    for point in sorted(entry_points(group=group), key=lambda point: point.name):
        if points.setdefault(point.name, point) is not point:
            other = package_of(points[point.name])
            raise _refusal(point, f"{other} has an entry point of this name, too: remove one")
    return MappingProxyType(points)


def package_of(point: EntryPoint) -> str:
    """Return name and version of the package of an entry point."""
    return f"{point.dist.name} {point.dist.version}" if point.dist else "an unknown package"


def _refusal(point: EntryPoint, rule: str) -> InputError:
    key = f"entry point '{point.name}' of {point.group}"
    return InputError([Fault(f"package {package_of(point)}", 0, key, point.value, rule)])
