"""Sweeps in parts: range after range of members, so that memory is bounded and the arrays stay in the cache.

The parts are made side by side by processes that are copies of this one (threads would wait for each other: the arrays
are small), and come in order. The files are read by the calling process alone.
"""

from __future__ import annotations

import json
import os
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from vibsim.analysis.compare_levels import analyse_records
from vibsim.checks.experiment_tolerance import is_bound
from vibsim.checks.order import is_of_parts
from vibsim.checks.value import UNITS, units_in
from vibsim.comparison.comparison_variables import known_errors
from vibsim.core.errors import VibsimError
from vibsim.core.processes import as_worker_of
from vibsim.core.record import Record, Variable
from vibsim.core.vocabulary import HIGHEST
from vibsim.experiment import Experiment, storage
from vibsim.experiment.cost import PART_SAMPLES

if TYPE_CHECKING:
    from concurrent.futures import Future

Reader = Callable[[int, int], Record]
"""Returns the level Record of members start..stop-1."""


def analyse_parts(
    experiment: Experiment,
    readers: Mapping[int, Reader],
    *,
    size: int | None = None,
    processes: int = 1,
) -> Iterator[Record]:
    """Compare the levels of an experiment, range after range of its members.

    Parameters
    ----------
    readers
        For every level, what returns its Record for a range of members.
    size
        Members of a part; by default as many as make `PART_SAMPLES` samples. No number depends on it.
    processes
        How many parts are made at the same time; at most one more is kept. No number depends on it.

    Yields
    ------
    Record
        What `analyse_records` returns, for consecutive ranges of members.

    Raises
    ------
    VibsimError
        As `analyse_records`, and where one of the processes is killed.
    """
    coarsest = experiment.levels[0]
    points = experiment.steps(coarsest) // storage.sampling(experiment, coarsest) + 1
    size = size or max(PART_SAMPLES // (points * len(experiment.schemes)), 1)
    count = experiment.members
    given = (
        {level: read(start, min(start + size, count)) for level, read in readers.items()}
        for start in range(0, count, size)
    )
    # the first part loads what the copies of this process share
    yield from (analyse_records(experiment, records) for records in islice(given, 1))
    # a second part alone is sooner made here
    if processes == 1 or count <= 2 * size:
        yield from (analyse_records(experiment, records) for records in given)
    else:
        yield from _by_processes(experiment, given, processes)


def _by_processes(
    experiment: Experiment, given: Iterable[dict[int, Record]], processes: int
) -> Iterator[Record]:
    # 14 ms, which no small analysis pays
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor
    from concurrent.futures.process import BrokenProcessPool

    # elsewhere (macOS) a copy of a process whose libraries have threads is not safe
    context = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
    pending: deque[Future[Record]] = deque()
    try:
        with ProcessPoolExecutor(processes, context, as_worker_of, (os.getpid(),)) as pool:
            for records in given:
                pending.append(pool.submit(analyse_records, experiment, records))
                if len(pending) > processes:
                    yield pending.popleft().result()
            while pending:
                yield pending.popleft().result()
    except BrokenProcessPool:
        raise VibsimError(
            "a process of the analysis was killed; there may be too little memory"
        ) from None


_OF_VERDICTS = (
    *("status", "failure_time", "last_step", "omega_dt", "stability_limit", "measured_growth"),
    *("decay_rate", "pulse_time", "pulse_width", HIGHEST),
)
"""Variables that every verdict and the summary may read, beside those that a check or its quantity has of its own."""


def keep_for_verdicts(
    experiment: Experiment, parts: Iterable[Record], thin: list[Record]
) -> Iterator[Record]:
    """Pass parts on, and keep of each in `thin` what `verdicts` and `summarise` need of it."""
    # a claim reads what the check that decides it reads
    measured = [check.measured for check in experiment.checks]
    checked = [one.converges for one in measured if one.kind == "converges"]
    which = ("observed_order", "formal_order", "coincidence")
    of_orders = {f"{name}_{one}" for name in checked for one in which}

    def is_read(name: str) -> bool:
        of_check = name.startswith(("check_", "corner_")) or is_bound(name) or is_of_parts(name)
        return of_check or name in _OF_VERDICTS or name in of_orders

    for part in parts:
        attrs = {**part.attrs, UNITS: json.dumps(units_in(part))}
        thinned = {name: one for name, one in part.variables.items() if is_read(name)}
        thin.append(Record(part.coords, thinned | known_errors(part), attrs))
        yield part


def join_parts(parts: Sequence[Record]) -> Record:
    """Return consecutive parts as one Record."""

    def join(name: str) -> Variable:
        first = parts[0].variable(name)
        if "case" not in first.dims:
            return first
        values = [part[name] for part in parts]
        joint = np.concatenate(values, axis=first.dims.index("case"))
        return Variable(first.dims, joint, first.attrs)

    coords = {name: join(name) for name in parts[0].coords}
    return Record(coords, {name: join(name) for name in parts[0].variables}, parts[0].attrs)
