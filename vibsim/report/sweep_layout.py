"""How the members of a sweep lie: along a line, on a grid of two swept parameters, or as a cloud.

Everything is found out from the swept values, so that it does not matter how a file wrote them.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.report import words
from vibsim.report.data import swept, swept_label
from vibsim.report.style import LOG_RATIO, label
from vibsim.report.types import Experiment

LARGEST_TO_SCALE = 1e100  # swept values from here on are not drawn to scale
FEW, LINES = 5, 6
"""Most lines that the other parameter of a sweep of two may make, and those of one of more; others are no curves."""
UP, DOWN = "going up →", "← going down"
"""Ways along a path."""
CELLS = 400  # most cells along each side of a map: more than its pixels could show
BINS = 8, 100  # least and most cells along each side of a map of members that lie on no grid


@dataclass(frozen=True)
class Key:
    """One swept key; option words are numbered in the order of the alphabet."""

    key: str  # dotted
    unit: str
    values: Floats  # of every member, shape (case,)
    distinct: Floats  # ascending
    words: tuple[str, ...] = ()  # what the numbers stand for, where they are words

    @property
    def label(self) -> str:
        """Name with its unit, for an axis."""
        return label(self.name, self.unit)

    @property
    def name(self) -> str:
        """Name in the words of a page."""
        return words.swept(self.key)

    @cached_property
    def is_log(self) -> bool:
        """Whether the values are more even on a logarithmic axis."""
        return not self.words and is_geometric(self.distinct)

    def text(self, value: float) -> str:
        """Write a value of this key."""
        return self.words[int(value)] if self.words else words.number(value, "step")


def keys(record: Record) -> list[Key]:
    """Return the swept keys that do vary, in the order written."""
    found = [_key(record, name) for name in swept(record)]
    return [key for key in found if key.distinct.size > 1]


def _key(record: Record, name: str) -> Key:
    key, unit = swept_label(record, name)
    values = np.asarray(record[name])
    if np.issubdtype(values.dtype, np.number):
        numbers = np.asarray(values, dtype=np.float64)
        distinct, place = np.unique(numbers, return_inverse=True)
        if np.max(np.abs(distinct)) < LARGEST_TO_SCALE:
            return Key(key, unit, numbers, distinct)
        # no axis reaches so far: the values are numbered like words
        names = [f"{value:.6g}" for value in distinct.tolist()]
    else:
        known, place = np.unique(values.astype(str), return_inverse=True)
        names = known.tolist()
    numbered = np.arange(len(names), dtype=np.float64)
    return Key(key, unit, place.ravel().astype(np.float64), numbered, tuple(names))


def is_geometric(distinct: Floats) -> bool:
    """Say whether ascending values spread over decades, and more evenly in their logarithm than as they are."""
    low, high = float(distinct[0]), float(distinct[-1])
    if low <= 0.0 or high < LOG_RATIO * low:
        return False
    even = np.linspace(0.0, 1.0, distinct.size)
    linear = np.max(np.abs((distinct - low) / (high - low) - even))
    logarithmic = np.max(np.abs(np.log(distinct / low) / np.log(high / low) - even))
    return bool(logarithmic <= linear)


def edges(distinct: Floats, logarithmic: bool) -> Floats:
    """Return the borders of cells around ascending values, shape (n + 1,): halfway, and as far again at the ends."""
    x = np.log(distinct) if logarithmic else distinct
    half = 0.5 * np.diff(x)
    borders = np.concatenate([[x[0] - half[0]], x[:-1] + half, [x[-1] + half[-1]]])
    return np.asarray(np.exp(borders) if logarithmic else borders)


@dataclass(frozen=True)
class Grid:
    """Members in the cells of a map over two keys, one or several in a cell."""

    x: Key
    y: Key
    borders: tuple[Floats, Floats]  # of the cells along x and y
    cell: NDArray[np.intp]  # position of every member in the table (y, x) of cells, shape (case,)
    note: str = ""
    """What a cell stands for, where it is not one member."""
    separatrix: tuple[Floats, Floats] = (np.empty(0), np.empty(0))
    """Points along x and y where the exact period is infinite."""

    def worst(self, values: NDArray[Any], badness: NDArray[Any] | None = None) -> Floats:
        """Return the value of every cell's worst member, shape (y, x): the one of most `badness`.

        Without `badness` the largest value is the worst. A cell is NaN where no member has a finite value.
        """
        bad = np.asarray(values if badness is None else badness, dtype=np.float64)
        there = np.flatnonzero(np.isfinite(values) & ~np.isnan(bad))
        columns, rows = (border.size - 1 for border in self.borders)
        most = np.full(rows * columns, -np.inf)
        np.maximum.at(most, self.cell[there], bad[there])
        worst = there[bad[there] == most[self.cell[there]]]
        table = np.full((rows, columns), np.nan)
        table.ravel()[self.cell[worst]] = values[worst]
        return table


def grid_of(found: list[Key]) -> Grid | None:
    """Return the map of members that differ in two `keys`; None where they differ in one, or in more.

    Members on a full grid have a cell each, or are gathered in square blocks where they are too many to be seen;
    members anywhere in the plane are gathered in as many cells as there are members for.
    """
    if len(found) != 2 or _moves_together(found):
        return None
    x, y = found
    size = x.distinct.size * y.distinct.size
    column, row = (np.searchsorted(key.distinct, key.values) for key in (x, y))
    is_full = size == x.values.size and np.all(
        np.bincount(row * x.distinct.size + column, minlength=size) == 1
    )
    if is_full:
        block = -(-max(x.distinct.size, y.distinct.size) // CELLS)
        whole = (edges(key.distinct, key.is_log) for key in (x, y))
        across, up = (np.append(border[:-1:block], border[-1]) for border in whole)
        column, row = column // block, row // block
        note = f"A cell shows the worst of {block} × {block} members." if block > 1 else ""
    else:
        count = int(np.clip(np.sqrt(x.values.size) / 2.0, *BINS))
        across, up = (bins(key, count) for key in (x, y))
        column, row = place_in(x, across), place_in(y, up)
        note = "A cell shows the worst of the members within it; some cells have none."
    return Grid(x, y, (across, up), row * (across.size - 1) + column, note)


def bins(key: Key, count: int) -> Floats:
    """Return the borders of bins over a key: around each value where these are few, else `count` even ones."""
    if key.distinct.size <= count:
        return edges(key.distinct, key.is_log)
    low, high = float(key.distinct[0]), float(key.distinct[-1])
    return np.asarray((np.geomspace if key.is_log else np.linspace)(low, high, count + 1))


def place_in(key: Key, borders: Floats) -> NDArray[np.intp]:
    """Return the bin of every member, shape (case,)."""
    found = np.searchsorted(borders, key.values, side="right") - 1
    return np.clip(found, 0, borders.size - 2)


def layout_of(experiment: Experiment, record: Record) -> Along | Grid | None:
    """Return how the members of a sweep lie; None where they are a cloud, or differ in nothing."""
    found, sweep = keys(record), experiment.sweep
    return along_of(found, sweep.follow if sweep is not None else None) or grid_of(found)


Line = tuple[str, NDArray[np.intp]]
"""The name of a line, and its members."""


@dataclass(frozen=True)
class Along:
    """Members laid out along one key."""

    key: Key
    lines: tuple[Line, ...]
    """Members that belong to one line, with a name; without where there is one line. They are in ascending order of the
    key, or in their own where values repeat. A path that turns is a line for each of its ways: these share the member
    at the turn."""
    follows: bool = False  # whether other keys change with this one


def along_of(found: list[Key], follow: str | None = None) -> Along | None:
    """Lay members out along a key, one line per value of the others; None for too many lines.

    `follow` is the dotted key along which each member starts where the one before ended, if there is one. The lines are
    drawn along it, else along the key with most values.
    """
    if not found:
        return None
    longest = max(found, key=lambda key: (key.key == follow, key.distinct.size))
    ways = _ways if longest.key == follow else _in_order
    others = [key for key in found if key is not longest]
    order = np.arange(longest.values.size)
    if not others or longest.distinct.size == longest.values.size:
        # of keys that move together one says it all
        lines = ways(longest, order)
        is_one = not others or _moves_together(found)
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
    """Return the one line of members, in the order in which it is drawn."""
    rising = members[np.argsort(key.values[members], kind="stable")]
    return [("", rising if np.all(np.diff(key.values[rising]) > 0.0) else members)]


def _ways(key: Key, members: NDArray[np.intp]) -> list[Line]:
    """Return the ways up and down of members on a path, or one line where it never turns or turns too often."""
    is_up = np.diff(key.values[members]) > 0.0
    turns = (np.flatnonzero(is_up[1:] != is_up[:-1]) + 1).tolist()
    if not 0 < len(turns) < LINES:
        return [("", members)]
    ends = [0, *turns, members.size - 1]
    return [
        (UP if is_up[start] else DOWN, members[start : end + 1])
        for start, end in itertools.pairwise(ends)
    ]


def _moves_together(found: list[Key]) -> bool:
    """Say whether every key rises or falls steadily with the first: the members lie on one curve."""
    order = np.argsort(found[0].values, kind="stable")
    steps = [np.diff(key.values[order]) for key in found]
    return all(bool(np.all(step >= 0) or np.all(step <= 0)) for step in steps)
