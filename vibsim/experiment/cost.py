"""The cost of a level in bytes on disk, bytes of memory and seconds, from counts alone: nothing is allocated.

The constants are measured (`docs/benchmarks.md`). The size of a shard depends only on the cost of one member at its
level, so the borders between shards are the same for any number of members and on any machine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vibsim.experiment.data import ExperimentSpec
    from vibsim.models import Model

PLAIN_WORK = 40_000
"""Work of one scheme (`work`, times member-steps) up to which plain Python is faster than loading a compiled kernel."""
PLAIN_SECONDS = 1.2e-6  # time of one member-step in plain Python [s]
ONE_SECONDS = 12e-9  # time of one compiled step of one member [s]: operations wait for each other
MANY_SECONDS = 3e-9  # time of one compiled member-step among many members [s]
EVALUATION_WORK = 0.45
"""Work of each further force evaluation, in explicit steps with one. The remainder of such a step is independent of the
number of evaluations: the scheme's arithmetic, energies, extrema."""
IMPLICIT_WORK = 3.0
"""Work of an implicit step, in explicit steps with one evaluation, for each force evaluation of an iteration."""
EVENTFUL = 2.5  # work of a step of a model with events, in steps of a smooth motion
LOOKED_UP = 2.0  # work of a step with a force from a table, in steps with a force from a formula
STRUCTURE_SECONDS = (35e-6, 12e-9)
"""Time of a step of a linear structure, and additional time per nonzero of the stiffness matrix [s]."""
SECONDS_PER_BYTE = 4e-9  # time to produce, write, seal and flush one byte [s]
JOB_SECONDS = 0.5  # overhead of a job [s]: process start, imports, loading kernels

SUMMARY_BYTES = 160  # bytes per scheme and member besides series: extremes, periods, status
D2T_BYTES = 8  # further bytes per scheme and member if a velocity is not the centred difference
EXTREMUM_BYTES = 64  # bytes of a peak and a trough: time and height, by parabola and on the grid
EVENT_BYTES = 8  # bytes of an event: its time
MEMBER_BYTES = 48  # bytes per member independent of the schemes: index, frequency, swept values
FILE_BYTES = 33_000  # bytes of a file besides its data
SERIES_FILE_BYTES = 11_000  # further bytes of a file that stores all series and extrema
COORDINATE_BYTES = 14_000  # further bytes of a file for each coordinate after the first: headers

PACKED_UP_TO = 2**25
"""Largest file [bytes] that is held in memory and compressed, which takes a second; lean files never are."""
PACKED_FROM = 2**14  # smallest variable [bytes] that is compressed
SERIES_RATIO, EXTREMA_RATIO = 0.65, 0.15
"""Compressed over raw size of series, and of tables of peaks, many of which are nearly empty. The predicted sizes are
right to a factor of 1.5 for 163 of 165 levels and for 27 of 32 analyses of the default experiments."""
PAGE_BYTES = 600_000  # bytes of a report page with its figures and tables

PLAIN_MEMORY = 68 * 10**6  # bytes of a simulate job without its arrays, in plain Python
COMPILED_MEMORY = 120 * 10**6  # bytes of a simulate job without its arrays, with a compiled kernel
ADAPTIVE_MEMORY = 160 * 10**6  # further bytes of a simulate job that needs SciPy and its data
STEP_BYTES = 64  # bytes that a job with SciPy holds per step of the level
SCRATCH_BYTES = 520
"""Bytes that a job holds per scheme and member besides its series: the accumulators, and their stored form."""
EXACT_ARRAYS = 5  # arrays that a job holds for each series of the exact solution while computing it

SHARD_SECONDS = 4.0  # target work of a shard on one core [s]
SHARD_BYTES = 320 * 10**6  # largest total size of the arrays of a shard [bytes]
LARGEST_SHARD = 2**20  # largest number of members of a shard

ANALYSIS_MEMORY = 190 * 10**6
"""Bytes of an analysis without its arrays, including LLVM and the supervising process."""
ANALYSIS_FACTOR = 3.8  # peak memory of an analysis over the bytes read for one block of members
PART_SAMPLES = 2**16  # samples of one variable in a block of an analysis, for the cache of a core
PROCESS_MEMORY = 30 * 10**6  # bytes of each worker process of an analysis without its members
RESULT_BYTES = 124  # bytes that an analysis keeps per scheme and member until its end

ANALYSIS_BYTES = (140, 190)  # bytes written per scheme and member: once, and per level; no series
COMPARED_SERIES = (-48, 184)
"""Further bytes per scheme, member and sample, once and per level, if an analysis writes series."""
COMPARED_NUMBERS = 785  # bytes per scheme and member: limits of numbers (`comparison.best_values`)
COMPARED_FILE = 130_000  # bytes of the file of an analysis besides its data
COMPARED_SERIES_FILE = 60_000  # further bytes of that file if an analysis writes series


def work_alone(model: Model) -> float | None:
    """Return the work of a step of `model`, in steps of one coordinate and a smooth motion, or None.

    None says that members can be stepped together by vector instructions. They cannot if the model has events, which
    divide the steps of a member, or several coordinates, or a table, which each member looks up at its own place.
    """
    if model.coordinates == 1 and model.lookup is None and model.events is None:
        return None
    table = 1.0 if model.lookup is None else LOOKED_UP
    return model.coordinates * table * (1.0 if model.events is None else EVENTFUL)


def work(force_evaluations: int, explicit: bool, alone: float | None = None) -> tuple[float, float]:
    """Return the vectorised and the member-by-member work of a step, in explicit steps with one force evaluation.

    `force_evaluations` are those of a step, of an implicit scheme those of an iteration. `alone` is what `work_alone`
    says of the model.
    """
    explicit_work, iterated = 1.0 + EVALUATION_WORK * (force_evaluations - 1), 0.0
    if not explicit:
        explicit_work, iterated = 0.0, IMPLICIT_WORK * force_evaluations
    return (explicit_work, iterated) if alone is None else (0.0, alone * (explicit_work + iterated))


@dataclass(frozen=True)
class LevelCost:
    """The resources that one level needs, as functions of the number of members."""

    schemes: int
    steps: int
    samples: int  # stored samples of each series
    series: int  # stored series per scheme and member
    exact: int = 0  # stored series per member of all schemes: the exact solution
    work: float = field(kw_only=True)  # of a step, over the explicit schemes (first of `work`)
    iterated: float = 0.0
    """Work of a step, summed over the implicit schemes (second number of `work`), which are not vectorised."""
    extrema: int = 0  # stored peaks (and as many troughs) per scheme and member
    events: int = 0  # stored event times per scheme and member
    d2t: bool = False  # whether the velocity of some scheme differs from the centred difference
    scipy_seconds: float = 0.0  # SciPy per member [s]: adaptive schemes, steps of a structure
    shared: float = 0.0
    """The part of `scipy_seconds` that is spent once for all levels of a job: adaptive schemes run once [s]."""
    coordinates: int = 1
    chain: int = 1
    """Length of a chain of members that each start from the previous one, and are stepped one by one in one job."""

    @property
    def stored(self) -> int:
        """Bytes of one member on disk."""
        series = self.schemes * self.series + self.exact
        numbers = SUMMARY_BYTES + self._extrema_and_events + (D2T_BYTES if self.d2t else 0)
        return 8 * self.samples * series + numbers * self.schemes + MEMBER_BYTES

    @property
    def _extrema_and_events(self) -> int:
        """Bytes of the extrema and events per scheme and member."""
        return EXTREMUM_BYTES * self.extrema + EVENT_BYTES * self.events

    @property
    def held(self) -> int:
        """Bytes of one member in memory at the peak of a job."""
        series = self.schemes * self.series + EXACT_ARRAYS * self.exact
        # the tables of several schemes are held twice while they are concatenated
        tables = self._extrema_and_events * (2 if self.schemes > 1 else 1)
        return 8 * self.samples * series + (SCRATCH_BYTES + tables) * self.schemes

    @property
    def shard(self) -> int:
        """Members of a shard: a power of two of chains, so that a remeasured constant seldom changes it."""
        seconds = self.steps * self._step(MANY_SECONDS, ONE_SECONDS) + self.scipy_seconds
        by_time = int(SHARD_SECONDS / seconds)
        largest = min(by_time, SHARD_BYTES // self.held, LARGEST_SHARD) // self.chain
        return self.chain << (max(largest, 1).bit_length() - 1)

    def shards(self, members: int) -> int:
        """Return the number of shards for `members`."""
        return -(-members // self.shard)

    def disk(self, members: int) -> int:
        """Return the bytes of the files of `members` before compression."""
        per_file = FILE_BYTES + (SERIES_FILE_BYTES if self.extrema else 0)
        per_file += COORDINATE_BYTES * (self.coordinates - 1)
        return members * self.stored + self.shards(members) * per_file

    def written(self, members: int) -> int:
        """Return the approximate bytes of the files of `members` after compression."""
        one = 8 * self.samples * members
        series = one * (self.schemes * self.series + self.exact)
        return _compressed(
            self.disk(members), (one * self.schemes, series), self.all_extrema(members)
        )

    def all_extrema(self, members: int) -> tuple[int, int]:
        """Return the bytes of one extrema variable of `members`, and of all of them together."""
        count = self.extrema * self.schemes * members
        return 8 * count, EXTREMUM_BYTES * count

    def memory(self, members: int) -> int:
        """Return the peak memory of a job with `members` [bytes]."""
        base = PLAIN_MEMORY if self._is_plain(members) else COMPILED_MEMORY
        base += ADAPTIVE_MEMORY + STEP_BYTES * self.steps if self.scipy_seconds else 0
        return base + members * self.held + _buffered(members * self.stored, self.extrema)

    def seconds(self, members: int) -> float:
        """Return the time of the steps and files of `members` on one core [s]."""
        compiled = MANY_SECONDS + (ONE_SECONDS - MANY_SECONDS) * self.chain / members
        step = self._step(compiled, ONE_SECONDS)
        if self._is_plain(members):
            step = self._step(PLAIN_SECONDS, PLAIN_SECONDS)
        return members * (self.steps * step + self.scipy_seconds + self.stored * SECONDS_PER_BYTE)

    def _step(self, explicit: float, iterated: float) -> float:
        """Return the time of a step of all schemes, given that of a unit of each kind of work [s]."""
        return self.work * explicit + self.iterated * iterated

    def _is_plain(self, members: int) -> bool:
        """Whether the engine steps in plain Python, judged by the mean work of the schemes."""
        total = members * self.steps * (self.work + self.iterated)
        return total <= PLAIN_WORK * self.chain * self.schemes


def _compressed(size: int, series: tuple[int, int], extrema: tuple[int, int]) -> int:
    """Return the approximate bytes of a file after compression; a lean file, without extrema, is not compressed.

    `series` and `extrema` hold the bytes of one variable and of all variables of that kind.
    """
    if not extrema[0] or size > PACKED_UP_TO:
        return size
    kinds = ((SERIES_RATIO, *series), (EXTREMA_RATIO, *extrema))
    return size - round(
        sum((1.0 - ratio) * total for ratio, one, total in kinds if one >= PACKED_FROM)
    )


def _buffered(size: int, extrema: int) -> int:
    """Return the bytes of a file that stay in memory until it is closed; none of a lean file, without extrema."""
    return size if extrema and size <= PACKED_UP_TO else 0


def analysis_memory(levels: Sequence[LevelCost], members: int) -> int:
    """Return the peak memory of an analysis in one process [bytes]; `levels` holds the costs of all levels."""
    buffered = _buffered(analysis_disk(levels, members, is_lean=False), levels[0].extrema)
    result = RESULT_BYTES * levels[0].schemes * members
    return ANALYSIS_MEMORY + _block_memory(levels, members) + result + buffered


def process_memory(levels: Sequence[LevelCost], members: int) -> int:
    """Return the memory of each process of an analysis with several [bytes]."""
    return PROCESS_MEMORY + _block_memory(levels, members)


def _block_memory(levels: Sequence[LevelCost], members: int) -> int:
    block = max(1, PART_SAMPLES // (levels[0].samples * levels[0].schemes))
    return round(ANALYSIS_FACTOR * min(members, block) * sum(level.stored for level in levels))


def analysis_disk(levels: Sequence[LevelCost], members: int, is_lean: bool) -> int:
    """Return the bytes that an analysis of `members` writes before compression.

    `levels` holds the costs of all levels; `is_lean` leaves out series.
    """
    once, per_level = ANALYSIS_BYTES
    size, file = once + per_level * len(levels), COMPARED_FILE
    if not is_lean:
        once, per_level = COMPARED_SERIES
        size += levels[0].samples * (once + per_level * len(levels)) + COMPARED_NUMBERS
        size += EXTREMUM_BYTES * len(levels) * max(level.extrema for level in levels)
        size += EVENT_BYTES * len(levels) * max(level.events for level in levels)
        file += COMPARED_SERIES_FILE
        # so far for one coordinate
        size, file = levels[0].coordinates * size, levels[0].coordinates * file
    return levels[0].schemes * members * size + file


def analysis_written(levels: Sequence[LevelCost], members: int, is_lean: bool) -> int:
    """Return the approximate bytes of the file of an analysis after compression; see `analysis_disk`."""
    samples = levels[0].schemes * members * levels[0].samples
    once, per_level = COMPARED_SERIES
    series = levels[0].coordinates * samples * (once + per_level * len(levels))
    one, total = max(level.all_extrema(members) for level in levels)
    return _compressed(
        analysis_disk(levels, members, is_lean),
        (8 * samples * len(levels), series),
        (one * len(levels), total * len(levels) * levels[0].coordinates),
    )


def level_cost(experiment: ExperimentSpec, level: int) -> LevelCost:
    """Return the cost of `level` of `experiment`."""
    from vibsim.experiment import storage
    from vibsim.models import has_solution
    from vibsim.schemes.adaptive import seconds

    model, steps = experiment.model.definition, experiment.steps(level)
    lean = storage.is_bounded(experiment)
    kinds = [experiment.schemes[i].method for i in experiment.ladder]
    # the engine does not step a linear structure
    stepped = kinds if model.loaded is None else []
    works = [work(kind.evaluations, kind.explicit, work_alone(model)) for kind in stepped]
    # periods of an unswept member
    turns = experiment.time.end * float(model.natural_frequency(experiment.model.parameters))
    shared = sum(
        seconds(scheme.kind, float(scheme.options["tolerance"]), turns / (2.0 * math.pi))
        for scheme in experiment.schemes
        if scheme.adaptive
    )
    has_exact = model.exact is not None or (has_solution(model) and experiment.chain == 1)
    structure_seconds = 0.0
    if model.loaded is not None:
        per_step, per_entry = STRUCTURE_SECONDS
        entries = len(model.loaded.structure.stiffness.entries)
        structure_seconds = steps * len(kinds) * (per_step + per_entry * entries)
    return LevelCost(
        schemes=len(experiment.schemes),
        steps=steps,
        samples=steps // storage.sampling(experiment, level) + 1,
        series=len(storage.stored_series(experiment)),
        exact=len(model.states) if has_exact and not lean else 0,
        work=sum(explicit for explicit, _ in works),
        iterated=sum(iterated for _, iterated in works),
        extrema=0 if lean else storage.extrema_kept(experiment.trajectories),
        events=storage.event_times(experiment),
        d2t=experiment.own_velocity or not lean,
        scipy_seconds=shared + structure_seconds,
        shared=shared,
        coordinates=model.coordinates,
        chain=experiment.chain,
    )
