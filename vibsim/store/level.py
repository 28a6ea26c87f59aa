"""All files of one level as one: read by ranges of members, whatever files they are in."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from itertools import accumulate
from pathlib import Path
from typing import Any

from vibsim.core.record import Record
from vibsim.store.reading import naming, opened, read_record
from vibsim.store.shards import join


@dataclass
class Level:
    """The files of a level, in the order of their members; one is open at a time."""

    files: Sequence[tuple[Path, str | None]]
    borders: Sequence[int]
    """First member of each file, and the number of all members."""
    _open: ExitStack = field(default_factory=ExitStack)
    _number: int = -1
    _dataset: Any = None

    @property
    def cases(self) -> int:
        """Number of members."""
        return self.borders[-1]

    def read(
        self, start: int = 0, stop: int | None = None, names: Collection[str] | None = None
    ) -> Record:
        """Return members start..stop-1.

        Parameters
        ----------
        start, stop
            Range of members; all by default.
        names
            Variables wanted, None for all; coordinates are always there.
        """
        last = self.cases if stop is None else stop
        first, final = self._file_of(start), self._file_of(max(start, last - 1))
        parts = []
        for number in range(first, final + 1):
            border = self.borders[number]
            wanted = slice(
                max(start, border) - border, min(last, self.borders[number + 1]) - border
            )
            with naming(self.files[number][0]):
                parts.append(read_record(self._opened(number), wanted, names))
        return join(parts)

    def _file_of(self, member: int) -> int:
        return min(bisect_right(self.borders, member), len(self.files)) - 1

    def _opened(self, number: int) -> Any:
        if number != self._number:
            self.close()
            self._dataset = self._open.enter_context(opened(*self.files[number]))
            self._number = number
        return self._dataset

    def close(self) -> None:
        """Close the file that is open."""
        self._open.close()
        self._number, self._dataset = -1, None


@contextmanager
def open_level(files: Sequence[tuple[Path, str | None]]) -> Iterator[Level]:
    """Open the files of a level, whose seals were checked before (`vibsim.store.check`).

    Parameters
    ----------
    files
        Path and digest of each, in the order of their members; a file of its own is a level as well.

    Raises
    ------
    DamagedFileError
        When a file cannot be read.
    StaleFileError
        When a file is another job's.
    """
    sizes = []
    for path, digest in files:
        with opened(path, digest) as dataset:
            sizes.append(len(dataset.dimensions["case"]))
    level = Level(files, [0, *accumulate(sizes)])
    try:
        yield level
    finally:
        level.close()
