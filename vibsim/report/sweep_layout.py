"""How the members of a sweep are arranged: along a line, on a grid over two parameters, or as a cloud.

The arrangement follows from the swept values alone, however the file specifies them.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.array_types import Floats
from vibsim.report import words
from vibsim.report.data import Results, bin_of
from vibsim.report.style import LOG_RATIO, label

LARGEST_TO_SCALE = 1e100  # larger swept values are not drawn to scale
FEW, LINES = 5, 6
"""Most curves of a sweep over two keys, one for each value of the second, and over more; else it is a map or cloud."""
UP, DOWN = "going up →", "← going down"  # directions along a path
CELLS = 400  # most cells along each side of a map: more than its pixels can show
BINS = 8, 100  # fewest and most cells along each side of a map of scattered members


@dataclass(frozen=True)
class Key:
    """One swept key; words are numbered alphabetically."""

    key: str  # dotted
    unit: str
    values: Floats  # of every member, shape (case,)
    distinct: Floats  # ascending
    words: tuple[str, ...] = ()  # meaning of the numbers, if they stand for words

    @property
    def label(self) -> str:
        """Name with its unit, for an axis."""
        return label(self.name, self.unit)

    @property
    def name(self) -> str:
        """Name, as a page shows it."""
        return words.swept(self.key)

    @cached_property
    def is_log(self) -> bool:
        """Whether the values are spaced more evenly on a logarithmic axis."""
        return not self.words and is_geometric(self.distinct)

    def text(self, value: float) -> str:
        """Write a value of this key."""
        return self.words[int(value)] if self.words else words.number(value, "step")


def keys(record: Results) -> list[Key]:
    """Return the swept keys with more than one value, in the order of the experiment file."""
    return [key for name in record.swept if (key := _key(record, name)).distinct.size > 1]


def _key(record: Results, name: str) -> Key:
    key, unit = record.swept_label(name)
    values = np.asarray(record[name])
    if np.issubdtype(values.dtype, np.number):
        numbers = np.asarray(values, dtype=np.float64)
        distinct, inverse = np.unique(numbers, return_inverse=True)
        if np.max(np.abs(distinct)) < LARGEST_TO_SCALE:
            return Key(key, unit, numbers, distinct)
        # too large for an axis: the values are numbered like words
        names = [f"{value:.6g}" for value in distinct.tolist()]
    else:
        options, inverse = np.unique(values.astype(str), return_inverse=True)
        names = options.tolist()
    numbered = np.arange(len(names), dtype=np.float64)
    return Key(key, unit, inverse.ravel().astype(np.float64), numbered, tuple(names))


def is_geometric(distinct: Floats) -> bool:
    """Return whether ascending values span decades and their logarithms are spaced more evenly than they are."""
    low, high = float(distinct[0]), float(distinct[-1])
    if low <= 0.0 or high < LOG_RATIO * low:
        return False
    even = np.linspace(0.0, 1.0, distinct.size)
    linear = np.max(np.abs((distinct - low) / (high - low) - even))
    logarithmic = np.max(np.abs(np.log(distinct / low) / np.log(high / low) - even))
    return bool(logarithmic <= linear)


def edges(distinct: Floats, logarithmic: bool) -> Floats:
    """Return the borders of cells around ascending values, shape (n + 1,): the midpoints, extended at both ends."""
    x = np.log(distinct) if logarithmic else distinct
    half = 0.5 * np.diff(x)
    borders = np.concatenate([[x[0] - half[0]], x[:-1] + half, [x[-1] + half[-1]]])
    return np.asarray(np.exp(borders) if logarithmic else borders)


@dataclass(frozen=True)
class Grid:
    """Members in the cells of a map over two keys, one or more in a cell."""

    x: Key
    y: Key
    borders: tuple[Floats, Floats]  # of the cells along x and y
    cell: NDArray[np.intp]  # flat index of every member's cell in the table (y, x), shape (case,)
    note: str = ""  # what a cell shows, if it holds more than one member
    separatrix: tuple[Floats, Floats] = (np.empty(0), np.empty(0))  # infinite exact period

    def worst(self, values: NDArray[Any], badness: NDArray[Any] | None = None) -> Floats:
        """Return the value of the worst member of every cell, shape (y, x): the one of largest `badness`.

        Without `badness` the largest value is the worst. A cell without any finite value is NaN.
        """
        bad = np.asarray(values if badness is None else badness, dtype=np.float64)
        usable = np.flatnonzero(np.isfinite(values) & ~np.isnan(bad))
        columns, rows = (border.size - 1 for border in self.borders)
        most = np.full(rows * columns, -np.inf)
        np.maximum.at(most, self.cell[usable], bad[usable])
        worst = usable[bad[usable] == most[self.cell[usable]]]
        table = np.full((rows, columns), np.nan)
        table.ravel()[self.cell[worst]] = values[worst]
        return table


FEWEST_VALUES = 8  # values of a key from which a response over it tells more than one motion
FEWEST_OF_A_LINE = 5  # fewest swept values whose members a curve may join; else it invents a course


def grid_of(keys: list[Key]) -> Grid | None:
    """Return the map of members that differ in two `keys`; None if they differ in one key, or in more.

    Each member of a full grid has its own cell; too many to be visible are gathered in square blocks. Members scattered
    over the plane are gathered in bins, whose number grows with theirs.
    """
    if len(keys) != 2 or _is_on_curve(keys):
        return None
    x, y = keys
    size = x.distinct.size * y.distinct.size
    column, row = (np.searchsorted(key.distinct, key.values) for key in (x, y))
    is_full = size == x.values.size and np.all(
        np.bincount(row * x.distinct.size + column, minlength=size) == 1
    )
    if is_full:
        block = -(-max(x.distinct.size, y.distinct.size) // CELLS)
        full = (edges(key.distinct, key.is_log) for key in (x, y))
        across, up = (np.append(edge[:-1:block], edge[-1]) for edge in full)
        column, row = column // block, row // block
        note = f"A cell shows the worst of {block} × {block} members." if block > 1 else ""
    else:
        count = int(np.clip(np.sqrt(x.values.size) / 2.0, *BINS))
        across, up = (bins(key, count) for key in (x, y))
        column, row = bin_of(across, x.values), bin_of(up, y.values)
        note = "A cell shows the worst of the members within it; some cells have none."
    return Grid(x, y, (across, up), row * (across.size - 1) + column, note)


def bins(key: Key, count: int) -> Floats:
    """Return the borders of bins over a key: one bin for each value if there are at most `count`, else `count` bins."""
    if key.distinct.size <= count:
        return edges(key.distinct, key.is_log)
    low, high = float(key.distinct[0]), float(key.distinct[-1])
    return np.asarray((np.geomspace if key.is_log else np.linspace)(low, high, count + 1))


def layout_of(record: Results) -> Along | Grid | None:
    """Return the arrangement of the members of a sweep; None for a cloud, or if no key varies."""
    varying, sweep = keys(record), record.experiment.sweep
    return along_of(varying, sweep.follow if sweep is not None else None) or grid_of(varying)


Line = tuple[str, NDArray[np.intp]]  # name and members of a line


@dataclass(frozen=True)
class Along:
    """Members laid out along one key."""

    key: Key
    lines: tuple[Line, ...]
    """Without a name if there is only one line. The members are in ascending order of the key, or in their own order if
    values repeat. A path that turns back is one line for each direction; both share the member at the turn."""
    follows: bool = False  # whether other keys change with this one


def along_of(keys: list[Key], follow: str | None = None) -> Along | None:
    """Lay members out along one key, with one line for each combination of the others; None for too many lines.

    `follow` is the dotted key along which each member starts from the end of the one before, if the sweep has one. The
    lines run along it, else along the key with most values.
    """
    if not keys:
        return None
    longest = max(keys, key=lambda key: (key.key == follow, key.distinct.size))
    ways = _ways if longest.key == follow else _in_order
    others = [key for key in keys if key is not longest]
    order = np.arange(longest.values.size)
    if not others or longest.distinct.size == longest.values.size:
        # one of several keys that rise and fall together describes them all
        lines = ways(longest, order)
        is_one = not others or _is_on_curve(keys)
        return Along(longest, tuple(lines), bool(others)) if is_one else None
    if int(np.prod([key.distinct.size for key in others])) > (FEW if len(others) == 1 else LINES):
        return None
    number = np.zeros(longest.values.size, dtype=np.intp)
    for key in others:
        number = number * key.distinct.size + np.searchsorted(key.distinct, key.values)
    lines = []
    for code in np.unique(number):
        members = order[number == code]
        at = [f"{key.name} = {key.text(float(key.values[members[0]]))}" for key in others]
        for way, line in ways(longest, members):
            lines.append((", ".join([*at, way] if way else at), line))
    return Along(longest, tuple(lines))


def _in_order(key: Key, members: NDArray[np.intp]) -> list[Line]:
    """Return members as one line, in drawing order."""
    rising = members[np.argsort(key.values[members], kind="stable")]
    return [("", rising if np.all(np.diff(key.values[rising]) > 0.0) else members)]


def _ways(key: Key, members: NDArray[np.intp]) -> list[Line]:
    """Split members on a path into lines that go up and down; one line if it never turns, or turns too often."""
    is_up = np.diff(key.values[members]) > 0.0
    turns = (np.flatnonzero(is_up[1:] != is_up[:-1]) + 1).tolist()
    if not 0 < len(turns) < LINES:
        return [("", members)]
    ends = [0, *turns, members.size - 1]
    return [
        (UP if is_up[start] else DOWN, members[start : end + 1])
        for start, end in itertools.pairwise(ends)
    ]


def _is_on_curve(keys: list[Key]) -> bool:
    """Return whether every key is monotonic in the first, so that the members lie on one curve."""
    order = np.argsort(keys[0].values, kind="stable")
    steps = [np.diff(key.values[order]) for key in keys]
    return all(bool(np.all(step >= 0) or np.all(step <= 0)) for step in steps)
