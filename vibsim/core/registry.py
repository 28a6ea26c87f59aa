"""What the key ``kind`` may name: the models or the schemes of vibsim, and behind them those of installed packages.

A package offers a model or a scheme as an entry point of the group ``vibsim.models`` or ``vibsim.schemes``, whose name
is its kind. Entry points are looked up only where a kind is asked for that vibsim does not have, or where all are
listed. A name in an experiment file is compared with theirs; it is never imported itself.
"""

from __future__ import annotations

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


def hash_fault(entry: object) -> str:
    """Say why what is worked out of an entry cannot be kept for the next time; nothing where it can."""
    try:
        hash(entry)
    except TypeError as error:
        return f"it must have a hash: write tuples instead of lists ({error})"
    return ""


class Registry(Mapping[str, Entry]):
    """Models or schemes by kind. Counting and naming them imports no package, but its values do."""

    def __init__(
        self, group: str, entries: Iterable[Entry], fault_of: Callable[[object], str]
    ) -> None:
        self.group = group
        """Of entry points."""
        self.built_in: Mapping[str, Entry] = MappingProxyType({row.kind: row for row in entries})
        """Those that come with vibsim."""
        self._fault_of = fault_of
        self._loaded: dict[str, Entry] = {}

    def __getitem__(self, kind: str) -> Entry:
        """Return an entry; InputError where a package offers one that cannot be had."""
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
        """Return by kind what is given in memory, beside what is registered.

        Raises
        ------
        InputError
            Where one is nothing of this kind, or its name is taken.
        """
        found: dict[str, Entry] = {}
        for entry in entries:
            fault = self._fault_of(entry)
            name = "" if fault else entry.kind
            if not fault and found.get(name, self.built_in.get(name, entry)) is not entry:
                fault = "the name is taken: give it another kind"
            if fault:
                what = self.group.rpartition(".")[2]
                raise InputError([Fault(f"in memory, one of the {what}", 0, "", name, fault)])
            found[name] = entry
        return found

    def usable(self) -> tuple[dict[str, Entry], list[Fault]]:
        """Return all entries that can be had, and the faults of the packages that offer others."""
        found, faults = dict(self.built_in), list[Fault]()
        try:
            kinds = list(self._offers())
        except InputError as error:
            return found, [*error.faults]
        for kind in kinds:
            try:
                found[kind] = self[kind]
            except InputError as error:
                faults += error.faults
        return found, faults

    def _offers(self) -> Mapping[str, EntryPoint]:
        found = offers(self.group)
        for name in found.keys() & self.built_in.keys():
            raise _refusal(found[name], "vibsim has one of this name already: choose another kind")
        return found

    def _load(self, point: EntryPoint) -> Entry:
        step = "imported"
        try:
            entry: Any = point.load()
            step = "used"
            fault = self._fault_of(entry)
        except (Exception, SystemExit) as error:
            rule = f"cannot be {step}: {type(error).__name__}: {error}"
            raise _refusal(point, rule) from error
        if not fault and entry.kind != point.name:
            fault = f"its kind is '{entry.kind}': the entry point must have the same name"
        if fault:
            raise _refusal(point, fault)
        found: Entry = entry
        return found


@cache
def offers(group: str) -> Mapping[str, EntryPoint]:
    """Return the entry points of a group by name; InputError where two packages use one name."""
    # takes 20 ms to import
    from importlib.metadata import entry_points

    found: dict[str, EntryPoint] = {}
    for point in sorted(entry_points(group=group), key=lambda point: point.name):
        if found.setdefault(point.name, point) is not point:
            other = package_of(found[point.name])
            raise _refusal(point, f"{other} has an entry point of this name, too: remove one")
    return MappingProxyType(found)


def package_of(point: EntryPoint) -> str:
    """Name the package of an entry point, with its version."""
    return f"{point.dist.name} {point.dist.version}" if point.dist else "an unknown package"


def _refusal(point: EntryPoint, rule: str) -> InputError:
    key = f"entry point '{point.name}' of {point.group}"
    return InputError([Fault(f"package {package_of(point)}", 0, key, point.value, rule)])
