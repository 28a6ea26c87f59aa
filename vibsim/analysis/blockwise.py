"""Analyse a sweep in parts, ranges of members, so that memory is bounded and the arrays fit into the cache.

Worker processes analyse parts in parallel and the results come in order. Threads would wait for each other, because the
arrays are small. Only the calling process reads files.
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
from vibsim.checks.number_units import UNITS, units_in
from vibsim.checks.order import is_of_parts
from vibsim.comparison.comparison_variables import known_errors
from vibsim.core.errors import VibsimError
from vibsim.core.processes import as_worker_of
from vibsim.core.record import Record, Variable
from vibsim.core.vocabulary import HIGHEST
from vibsim.experiment import Experiment, storage
from vibsim.experiment.cost import PART_SAMPLES
from vibsim.models.base import components

if TYPE_CHECKING:
    from concurrent.futures import Future

Reader = Callable[[int, int], Record]
"""Returns the Record of a level for members start..stop-1."""


def analyse_parts(
    experiment: Experiment,
    readers: Mapping[int, Reader],
    *,
    size: int | None = None,
    processes: int = 1,
) -> Iterator[Record]:
    """Compare the levels of an experiment for one range of members after the other.

    Parameters
    ----------
    readers
        The reader of every level.
    size
        Number of members of a part; by default a part has about `PART_SAMPLES` samples. No result depends on it.
    processes
        Number of parts analysed in parallel; at most one more is in memory. No result depends on it.

    Yields
    ------
    Record
        The result of `analyse_records` for consecutive ranges of members.

    Raises
    ------
    VibsimError
        Where `analyse_records` does, or where a process is killed.
    """
    coarsest = experiment.levels[0]
    points = experiment.steps(coarsest) // storage.sampling(experiment, coarsest) + 1
    size = size or max(PART_SAMPLES // (points * len(experiment.schemes)), 1)
    count = experiment.members
    parts = (
        {level: read(start, min(start + size, count)) for level, read in readers.items()}
        for start in range(0, count, size)
    )
    # the first part loads modules that the forked processes then share
    yield from (analyse_records(experiment, records) for records in islice(parts, 1))
    # starting processes for a single further part does not pay
    if processes == 1 or count <= 2 * size:
        yield from (analyse_records(experiment, records) for records in parts)
    else:
        yield from _in_parallel(experiment, parts, processes)


def _in_parallel(
    experiment: Experiment, parts: Iterable[dict[int, Record]], processes: int
) -> Iterator[Record]:
    # imported here, because it takes 14 ms
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor
    from concurrent.futures.process import BrokenProcessPool

    # on macOS it is not safe to fork a process whose libraries have threads
    context = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
    pending: deque[Future[Record]] = deque()
    try:
        with ProcessPoolExecutor(processes, context, as_worker_of, (os.getpid(),)) as pool:
            for records in parts:
                pending.append(pool.submit(analyse_records, experiment, records))
                if len(pending) > processes:
                    yield pending.popleft().result()
            while pending:
                yield pending.popleft().result()
    except BrokenProcessPool:
        raise VibsimError(
            "a process of the analysis was killed; there may be too little memory"
        ) from None


_ALWAYS_READ = (
    *("status", "failure_time", "last_step", "omega_dt", "stability_limit", "measured_growth"),
    *("decay_rate", "pulse_time", "pulse_width", HIGHEST, "event_count", "last_event_time"),
)
"""Variables that any verdict or the summary may read, besides those of its own check and quantity."""


def keep_for_verdicts(
    experiment: Experiment, parts: Iterable[Record], thin: list[Record]
) -> Iterator[Record]:
    """Yield the parts, and append to `thin` of each part the variables that `verdicts` and `summarise` read."""
    # a claim reads the variables of the check that decides it
    measured = [check.measured for check in experiment.checks]
    quantities = [check.converges for check in measured if check.kind == "converges"]
    # whether the levels approach another solution, beside which no best value has a bound
    model = experiment.model.definition
    numbers = [check.quantity or model.position for check in measured if check.kind == "value"]
    suffixes = ("observed_order", "formal_order", "coincidence")
    of_orders = {f"{quantity}_{suffix}" for quantity in quantities for suffix in suffixes}
    of_orders |= {f"{quantity}_reason" for quantity in numbers}
    if quantities:
        # of a vector of low order, the coordinate with the largest share is named
        vectors = (components(model, quantity) for quantity in quantities)
        of_orders |= {
            f"{name}_difference_norm" for names in vectors if len(names) > 1 for name in names
        }
        # where levels part, their largest speeds tell whether a force becomes infinite
        of_orders |= {
            f"{velocity}_{end}" for velocity in model.velocities for end in ("min", "max")
        }

    def is_read(name: str) -> bool:
        of_check = name.startswith(("check_", "corner_")) or is_bound(name) or is_of_parts(name)
        return of_check or name in _ALWAYS_READ or name in of_orders

    for part in parts:
        attrs = {**part.attrs, UNITS: json.dumps(units_in(part))}
        read = {name: variable for name, variable in part.variables.items() if is_read(name)}
        thin.append(Record(part.coords, read | known_errors(part), attrs))
        yield part


def join_parts(parts: Sequence[Record]) -> Record:
    """Join consecutive parts into one Record."""

    def join(name: str) -> Variable:
        first = parts[0].variable(name)
        if "case" not in first.dims:
            return first
        values = np.concatenate([part[name] for part in parts], axis=first.dims.index("case"))
        return Variable(first.dims, values, first.attrs)

    coords = {name: join(name) for name in parts[0].coords}
    return Record(coords, {name: join(name) for name in parts[0].variables}, parts[0].attrs)
