"""What a level costs: bytes on disk and in memory, seconds; found from counts alone, without allocating anything.

The constants are measured (`docs/benchmarks.md`). The size of a shard depends on the cost of one member at its level
and on nothing else, so that neither more members nor another machine move the border between two shards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vibsim.experiment.data import ExperimentSpec

PLAIN_MEMBER_STEPS = 40_000
"""Member-steps of one scheme up to which plain Python takes less time than a compiled kernel takes to be loaded."""
PLAIN_SECONDS = 1.2e-6
"""Of one member-step in plain Python."""
ONE_SECONDS = 12e-9
"""Of one compiled step of a member that is alone: a chain in which each operation waits for the one before."""
MANY_SECONDS = 3e-9
"""Of one compiled member-step among many members."""
EVALUATION = 0.45
"""Part of an explicit step with one evaluation of the acceleration that each further evaluation takes as well; the rest
is what every step has: the scheme's arithmetic, energies, extrema."""
ITERATED = 3.0
"""Steps with one evaluation that an implicit step takes as long as, for each evaluation of an iteration."""
EVENTFUL = 2.5
"""Steps of a smooth motion that one takes as long as where an event may be."""
COUPLED = 2.0
"""Steps of one coordinate that one of several takes as long as, and one with a force from a table."""
STRUCTURE_SECONDS = (35e-6, 12e-9)
"""Of a step of a linear structure, and beside it for each entry of the stiffness matrix that is not 0."""
WRITTEN_SECONDS = 4e-9
"""Of one byte that is made, written, sealed and flushed."""
JOB_SECONDS = 0.5
"""Of a job before and after its steps: start, imports, kernels from the disk."""

BYTES_BESIDE_SERIES = 160
"""Bytes that are kept of a scheme and member beside its series: extremes, peaks, periods, status."""
GATHERED_D2T = 8
"""Bytes beside these where a scheme has another velocity than the centred difference."""
EXTREMUM = 64
"""Bytes of a peak and a trough: time and height, of the parabola and of the grid."""
EVENT = 8
"""Bytes of the time of an event."""
CONSTANT = 48
"""Bytes that are kept of a member whatever the schemes: index, frequency, swept values."""
FILE = 33_000
"""Bytes of a file beside its data."""
SERIES_FILE = 11_000
"""Bytes of a file beside these where every series is kept, and extrema."""
COORDINATE_FILE = 14_000
"""Bytes of a file beside these for each coordinate behind the first: the heads of its variables."""

PACKED_UP_TO = 2**25
"""Bytes of a file with every series up to which it is compressed, in a second, and until then kept in memory."""
PACKED_FROM = 2**14
"""Bytes of a variable from which it is compressed."""
PACKED_SERIES, PACKED_EXTREMA = 0.65, 0.15
"""What is left of such series, and of tables of peaks, many of which are nearly empty: of 165 levels of the default
experiments 163 have the size that follows to a factor of 1.5, and 27 of 32 analyses."""
PAGE_BYTES = 600_000
"""Bytes of a page with its figures and tables."""

PLAIN_MEMORY = 68 * 10**6
"""Bytes of a simulate job without its arrays, in plain Python."""
COMPILED_MEMORY = 120 * 10**6
"""Bytes of a simulate job without its arrays, with a compiled kernel."""
ADAPTIVE_MEMORY = 160 * 10**6
"""Bytes of a simulate job with an adaptive scheme or a structure beside all others: SciPy, and what it keeps."""
TABULATED = 64
"""Bytes that such a job holds of each point of a level."""
SCRATCH = 520
"""Bytes that a job holds of a scheme and member beside its series: what is gathered, as it is and as it is kept."""
EXACT_SCRATCH = 5
"""Arrays that a job holds for each series of the exact solution while it works it out."""

SHARD_SECONDS = 4.0
"""Work of one core that a shard is meant to hold."""
SHARD_BYTES = 320 * 10**6
"""Arrays that a shard may hold."""
LARGEST_SHARD = 2**20
"""Members of a shard at most."""

ANALYSIS_MEMORY = 180 * 10**6
"""Bytes of an analysis without its arrays, with LLVM and the process that watches over it."""
ANALYSED = 3.8
"""Bytes that an analysis holds at its peak for each byte that it reads of the members at hand."""
PART_SAMPLES = 2**16
"""Samples of one variable that an analysis takes at a time: a few arrays of them fit into the cache of a core."""
PROCESS_MEMORY = 30 * 10**6
"""Bytes that each of several processes of an analysis holds without its part of the members."""
RESULT = 124
"""Bytes that an analysis keeps of each scheme and member until its end."""

ANALYSIS_BYTES = (140, 190)
"""Bytes that an analysis writes of a scheme and member: once, and for each level; two norms, and no series."""
COMPARED_SERIES = (-48, 184)
"""Bytes beside these of a scheme, member and sample, where an analysis writes series."""
COMPARED_NUMBERS = 785
"""Bytes beside these of a scheme and member: the limits of numbers (`vibsim.comparison.best_values`)."""
COMPARED_FILE = 130_000
"""Bytes of the file of an analysis beside its data."""
COMPARED_SERIES_FILE = 60_000
"""Bytes beside these where an analysis writes series."""


def work(force_evaluations: int, explicit: bool, alone: float | None = None) -> tuple[float, float]:
    """Return what a step of a scheme takes in explicit steps with one evaluation: as such steps, and as iterations.

    Parameters
    ----------
    force_evaluations
        Of a step; of an implicit scheme, of an iteration.
    alone
        Where members are stepped one by one whatever the scheme: how many steps of one coordinate without events a step
        takes as long as, `EVENTFUL` or `COUPLED`.
    """
    one, iterated = 1.0 + EVALUATION * (force_evaluations - 1), 0.0
    if not explicit:
        one, iterated = 0.0, ITERATED * force_evaluations
    return (one, iterated) if alone is None else (0.0, alone * (one + iterated))


@dataclass(frozen=True)
class LevelCost:
    """What one level asks of a job, apart from the number of members."""

    schemes: int
    steps: int
    samples: int
    """Samples that are kept of each series of a member."""
    series: int
    """Series that are kept of a scheme and member."""
    exact: int = 0
    """Series that are kept of a member whatever the schemes: the states of the exact solution."""
    work: float | None = None
    """Work of a step of all explicit schemes together (`work`); a step with one evaluation each where None."""
    iterated: float = 0.0
    """Work of a step of all implicit schemes together, which one member takes as long as many."""
    extrema: int = 0
    """Peaks, and troughs, that are kept of a scheme and member."""
    events: int = 0
    """Events whose times are kept of a scheme and member."""
    d2t: bool = False
    """Whether a scheme has another velocity than the centred difference."""
    own: float = 0.0
    """Seconds that SciPy takes of a member: schemes which choose their own steps, and the steps of a structure."""
    shared: float = 0.0
    """Those of them that all levels of a job take together: such schemes run once."""
    coordinates: int = 1
    chain: int = 1
    """Members that start one from the other, and so are stepped one after the other, in one job."""

    @property
    def stored(self) -> int:
        """Bytes on disk of one member."""
        series = self.schemes * self.series + self.exact
        numbers = BYTES_BESIDE_SERIES + self._kept + (GATHERED_D2T if self.d2t else 0)
        return 8 * self.samples * series + numbers * self.schemes + CONSTANT

    @property
    def _kept(self) -> int:
        """Bytes of the extrema and events of a scheme and member."""
        return EXTREMUM * self.extrema + EVENT * self.events

    @property
    def held(self) -> int:
        """Bytes in memory of one member at the peak of a job."""
        series = self.schemes * self.series + EXACT_SCRATCH * self.exact
        # those of several schemes are held twice while they are put together
        kept = self._kept * (2 if self.schemes > 1 else 1)
        return 8 * self.samples * series + (SCRATCH + kept) * self.schemes

    @property
    def shard(self) -> int:
        """Members of a shard: a power of two of chains, so that another measured constant seldom changes it."""
        by_time = SHARD_SECONDS / (self.steps * self._step(MANY_SECONDS, ONE_SECONDS) + self.own)
        most = min(int(by_time), SHARD_BYTES // self.held, LARGEST_SHARD) // self.chain
        return self.chain << (max(most, 1).bit_length() - 1)

    def shards(self, members: int) -> int:
        """Return the number of shards that `members` fill."""
        return -(-members // self.shard)

    def disk(self, members: int) -> int:
        """Return the bytes of the files of `members`, before any of them is compressed."""
        each = FILE + (SERIES_FILE if self.extrema else 0)
        each += COORDINATE_FILE * (self.coordinates - 1)
        return members * self.stored + self.shards(members) * each

    def written(self, members: int) -> int:
        """Return about how many bytes the files of `members` take."""
        each = 8 * self.samples * members
        series = each * (self.schemes * self.series + self.exact)
        return _written(
            self.disk(members), (each * self.schemes, series), self.all_extrema(members)
        )

    def all_extrema(self, members: int) -> tuple[int, int]:
        """Return the bytes of one of the variables of the extrema of `members`, and of all of them."""
        each = self.extrema * self.schemes * members
        return 8 * each, EXTREMUM * each

    def memory(self, members: int) -> int:
        """Return the bytes that a job with `members` holds at its peak."""
        base = PLAIN_MEMORY if self._is_plain(members) else COMPILED_MEMORY
        base += ADAPTIVE_MEMORY + TABULATED * self.steps if self.own else 0
        return base + members * self.held + _packed(members * self.stored, self.extrema)

    def seconds(self, members: int) -> float:
        """Return the seconds of one core that the steps and the files of `members` take."""
        compiled = MANY_SECONDS + (ONE_SECONDS - MANY_SECONDS) * self.chain / members
        step = self._step(compiled, ONE_SECONDS)
        if self._is_plain(members):
            step = self._step(PLAIN_SECONDS, PLAIN_SECONDS)
        return members * (self.steps * step + self.own + self.stored * WRITTEN_SECONDS)

    def _step(self, explicit: float, iterated: float) -> float:
        """Return the seconds of a step of all schemes, where one with one evaluation takes so many."""
        units = self.schemes if self.work is None else self.work
        return units * explicit + self.iterated * iterated

    def _is_plain(self, members: int) -> bool:
        return members * self.steps <= PLAIN_MEMBER_STEPS * self.chain


def _written(size: int, series: tuple[int, int], extrema: tuple[int, int]) -> int:
    """Return about how many bytes are left of a file once it is compressed; a lean one, without extrema, is not.

    Of series and extrema it is given how many bytes one of their variables has, and how many all of them have.
    """
    if not extrema[0] or size > PACKED_UP_TO:
        return size
    kinds = ((PACKED_SERIES, *series), (PACKED_EXTREMA, *extrema))
    return size - round(
        sum((1.0 - left) * whole for left, one, whole in kinds if one >= PACKED_FROM)
    )


def _packed(size: int, extrema: int) -> int:
    """Return the bytes of a file that are in memory until it is closed; lean ones keep no extrema."""
    return size if extrema and size <= PACKED_UP_TO else 0


def analysis_memory(levels: Sequence[LevelCost], members: int) -> int:
    """Return the bytes that an analysis in one process holds at its peak; `levels` are those of every level."""
    written = _packed(analysis_disk(levels, members, is_lean=False), levels[0].extrema)
    result = RESULT * levels[0].schemes * members
    return ANALYSIS_MEMORY + _part_memory(levels, members) + result + written


def process_memory(levels: Sequence[LevelCost], members: int) -> int:
    """Return the bytes that each process holds where several share an analysis."""
    return PROCESS_MEMORY + _part_memory(levels, members)


def _part_memory(levels: Sequence[LevelCost], members: int) -> int:
    part = max(1, PART_SAMPLES // (levels[0].samples * levels[0].schemes))
    return round(ANALYSED * min(members, part) * sum(level.stored for level in levels))


def analysis_disk(levels: Sequence[LevelCost], members: int, is_lean: bool) -> int:
    """Return the bytes that an analysis of `members` writes, before they are compressed.

    `levels` are those of every level; `is_lean` tells whether series are left out.
    """
    once, each = ANALYSIS_BYTES
    size, file = once + each * len(levels), COMPARED_FILE
    if not is_lean:
        once, each = COMPARED_SERIES
        size += levels[0].samples * (once + each * len(levels))
        size += EXTREMUM * len(levels) * max(level.extrema for level in levels) + COMPARED_NUMBERS
        size += EVENT * len(levels) * max(level.events for level in levels)
        file += COMPARED_SERIES_FILE
        # those of one coordinate
        size, file = levels[0].coordinates * size, levels[0].coordinates * file
    return levels[0].schemes * members * size + file


def analysis_written(levels: Sequence[LevelCost], members: int, is_lean: bool) -> int:
    """Return about how many bytes the file of an analysis takes; see `analysis_disk`."""
    samples = levels[0].schemes * members * levels[0].samples
    once, each = COMPARED_SERIES
    series = levels[0].coordinates * samples * (once + each * len(levels))
    one, all_ = max(level.all_extrema(members) for level in levels)
    return _written(
        analysis_disk(levels, members, is_lean),
        (8 * samples * len(levels), series),
        (one * len(levels), all_ * len(levels) * levels[0].coordinates),
    )


def level_cost(experiment: ExperimentSpec, level: int) -> LevelCost:
    """Return what one member of `experiment` costs at `level`."""
    from vibsim.experiment.storage import (
        event_times,
        extrema_kept,
        is_bounded,
        sampling,
        stored_series,
    )
    from vibsim.models import has_solution
    from vibsim.schemes.adaptive import seconds

    model, steps = experiment.model.definition, experiment.steps(level)
    lean = is_bounded(experiment)
    # members of such a model are stepped one by one
    alone = COUPLED if model.coordinates > 1 or model.lookup is not None else None
    alone = EVENTFUL if model.events is not None else alone
    kinds = [experiment.schemes[i].method for i in experiment.ladder]
    works = [work(kind.force_evaluations, kind.explicit, alone) for kind in kinds]
    # of a member that is not swept
    turns = experiment.time.end * float(model.natural_frequency(experiment.model.parameters))
    shared = sum(
        seconds(scheme.kind, float(scheme.options["tolerance"]), turns / (2.0 * math.pi))
        for scheme in experiment.schemes
        if scheme.adaptive
    )
    has_exact = model.exact is not None or (has_solution(model) and experiment.chain == 1)
    whole = 0.0
    if model.loaded is not None:
        each, of_entry = STRUCTURE_SECONDS
        entries = len(model.loaded.structure.stiffness.entries)
        whole = steps * len(kinds) * (each + of_entry * entries)
    return LevelCost(
        schemes=len(experiment.schemes),
        steps=steps,
        samples=steps // sampling(experiment, level) + 1,
        series=len(stored_series(experiment)),
        exact=len(model.states) if has_exact and not lean else 0,
        work=sum(explicit for explicit, _ in works),
        iterated=sum(iterated for _, iterated in works),
        extrema=0 if lean else extrema_kept(experiment.trajectories),
        events=event_times(experiment),
        d2t=experiment.own_velocity or not lean,
        own=shared + whole,
        shared=shared,
        coordinates=model.coordinates,
        chain=experiment.chain,
    )
