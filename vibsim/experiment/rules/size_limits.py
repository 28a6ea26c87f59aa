"""What no experiment may exceed, found from counts alone: nothing is written out or allocated to find it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

from vibsim.experiment.cost import LevelCost, level_cost
from vibsim.experiment.data import ExperimentSpec, SchemeSpec, Sweep, TimeSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.storage import events_kept, extrema_kept, is_lean, stride
from vibsim.models import Model, quantities

MAX_MEMBERS = 10**7
MAX_MEMBER_STEPS = 2**40
"""Steps of every scheme, member and level together: about a day of one core."""
MAX_MEMORY = 8 * 2**30
"""Bytes that a job may hold: at least all samples of one member, every scheme, at one level."""
MAX_DISK = 2**40
"""Bytes of the files of all levels."""
MAX_FILES = 10_000
"""Files of all levels, each made by a job or a part of one: with more the workflow is busy with itself."""
MIN_DT = 1e-100
"""Smallest time step: its square and what is divided by that must not leave the range of floats."""

_SMALLEST_MODEL = 6
"""Series of the smallest model: two states and the energies."""
_D2T = 4
"""Series with the centred difference as velocity: itself, two energies, and a running maximum."""
_LEAN = 3
"""Series that a lean experiment keeps: two states and the energy deviation, and what else a check is about."""


@dataclass(frozen=True)
class Setting:
    """What an experiment consists of; None or empty where a section is faulty, and then nothing is said about it."""

    model: Model | None
    time: TimeSpec | None
    levels: tuple[int, ...]
    schemes: tuple[SchemeSpec, ...]
    """Those without a fault."""
    names: tuple[str, ...]
    """The names of the schemes as written, right or wrong."""
    sweep: Sweep
    """Its axes without a fault."""
    samples: int | str
    knows_sweep: bool = True
    """Whether the whole sweep is known."""
    by_tolerance: bool = False
    """Whether the levels are still to be chosen, so that none of them can be named."""
    knows_schemes: bool = True
    """Whether every scheme is known; where one is not, it may be of any kind."""

    def steps(self, level: int) -> int:
        """Return the number of steps at `level`; 1 at level 0 where the time is not known."""
        return (self.time.base_steps if self.time else 1) << level

    @property
    def trajectories(self) -> int:
        """Number of schemes times number of members, as far as they are known."""
        return self.scheme_count * (self.members or 1)

    @property
    def members(self) -> int | None:
        """Number of members, 1 without a sweep; None where it cannot be told."""
        return self.sweep.count if self.knows_sweep else None

    @property
    def scheme_count(self) -> int:
        """Number of schemes, at least 1."""
        return max(len(self.schemes), len(self.names), 1)

    @cached_property
    def adaptive(self) -> tuple[str, ...]:
        """Names of the schemes that choose their own steps."""
        return tuple(scheme.name for scheme in self.schemes if scheme.adaptive)

    @cached_property
    def own(self) -> tuple[str, ...]:
        """Names of the schemes with another velocity than the centred difference."""
        return tuple(scheme.name for scheme in self.schemes if scheme.own_velocity)

    @property
    def own_velocity(self) -> bool:
        """Whether some scheme has, or may have, another velocity than the centred difference."""
        return bool(self.own) or not self.knows_schemes

    @cached_property
    def quantities(self) -> tuple[str, ...]:
        """Names of every quantity that is kept over time."""
        return () if self.model is None else quantities(self.model, self.own_velocity)

    def stride(self, level: int) -> int:
        """Return n where every n-th step of `level` is stored; there must be levels."""
        coarsest = self.steps(self.levels[0])
        return stride(self.samples, coarsest, self.steps(level), self.trajectories)

    def level_cost(self, level: int) -> LevelCost:
        """Return what `level` asks of a job."""
        steps = self.steps(level)
        has_events = self.model is not None and self.model.events is not None
        d2t = bool(self.own) and not has_events
        samples = steps // self.stride(level) + 1
        cost = partial(LevelCost, self.scheme_count, steps, samples, chain=self.sweep.chain)
        if is_lean(self.samples, self.steps(self.levels[0]), self.trajectories):
            return cost(_LEAN, d2t=d2t)
        known = len(quantities(self.model)) if self.model else 0
        # with the running maximum of the energy deviation
        series = max(known, _SMALLEST_MODEL) + 1 + (_D2T if d2t else 0)
        extrema = extrema_kept(self.trajectories)
        events = events_kept(self.trajectories) if has_events else 0
        return cost(series, exact=2, extrema=extrema, events=events, d2t=True)


def check(setting: Setting, report: Report) -> None:
    """Note every limit that counts exceed."""
    members = setting.members or 1
    if members > MAX_MEMBERS:
        rule = f"must not have more than {MAX_MEMBERS} members, has {members}"
        report.add(("sweep",), rule, at_key=True)
    if setting.time is None or not setting.levels:
        return
    coarsest, finest = setting.steps(setting.levels[0]), setting.steps(setting.levels[-1])
    if coarsest < 2:
        rule = f"the coarsest level must have at least 2 steps, has {coarsest}"
        report.add(("levels",), rule, "begin at a higher level, or give more base_steps")
    if isinstance(setting.samples, int) and coarsest % setting.samples:
        rule = f"must divide the {coarsest} steps of the coarsest level"
        report.add(("samples", "every"), rule, value=setting.samples)
    if setting.sweep.least_end(setting.time) / min(finest, MAX_MEMBER_STEPS) < MIN_DT:
        report.add(("time",), f"the time step must not be less than {MIN_DT:g}", at_key=True)
    total = sum(map(setting.steps, setting.levels)) * setting.trajectories
    if total > MAX_MEMBER_STEPS:
        rule = f"the experiment must not take more than {MAX_MEMBER_STEPS} steps, it takes {total}"
        report.add(("levels",), rule, "steps of every level, scheme and member together")
        return
    costs = [setting.level_cost(level) for level in setting.levels]
    hint = "store fewer samples, or begin at a lower level"
    # one member, or one chain of them, is the least that a job can make
    least = setting.sweep.chain
    memory = max(cost.memory(least) for cost in costs)
    disk = sum(cost.disk(members) for cost in costs)
    if memory > MAX_MEMORY:
        what = "one member" if least == 1 else f"the {least} members that follow each other"
        rule = f"{what} at one level must not take more than {MAX_MEMORY} bytes of memory, it takes {memory}"
        report.add(("levels",), rule, hint, at_key=True)
    if disk > MAX_DISK:
        rule = f"the files must not take more than {MAX_DISK} bytes, they take {disk}"
        report.add(("levels",), rule, hint, at_key=True)


def check_files(experiment: ExperimentSpec, report: Report) -> None:
    """Note where the files of all levels are too many."""
    files = [
        level_cost(experiment, level).shards(experiment.members) for level in experiment.levels
    ]
    if sum(files) > MAX_FILES:
        rule = f"the levels must not have more than {MAX_FILES} files, they have {sum(files)}"
        finest = f"{files[-1]} of them are of level {experiment.levels[-1]}"
        hint = f"{finest}: leave levels out, or take fewer members"
        report.add(("levels",), rule, hint, at_key=True)
