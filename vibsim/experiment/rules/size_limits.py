"""Limits on the size of an experiment, checked by counts alone: nothing is expanded or allocated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from vibsim.experiment.cost import level_cost
from vibsim.experiment.data import ExperimentSpec, SchemeSpec, Sweep, TimeSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.storage import stride
from vibsim.models import Model, quantities

MAX_MEMBERS = 10**7
MAX_MEMBER_STEPS = 2**40
"""Total steps of all schemes, members and levels: about a day of one core."""
MAX_MEMORY = 8 * 2**30
"""Memory of a job [bytes], which holds at least all samples of one member and all schemes at one level."""
MAX_DISK = 2**40
"""Bytes of the files of all levels."""
MAX_FILES = 10_000
"""Files of all levels. With more of them the overhead of the workflow dominates."""
MIN_DT = 1e-100
"""Smallest time step: its square, and quotients by that, must stay within the range of floats."""


@dataclass(frozen=True)
class Setting:
    """The parts of an experiment that rules refer to; None or empty (which skips rules) if a section is faulty."""

    model: Model | None
    time: TimeSpec | None
    levels: tuple[int, ...]
    schemes: tuple[SchemeSpec, ...]
    """The schemes without a fault."""
    names: tuple[str, ...]
    """The names of the schemes in the file, valid or not."""
    sweep: Sweep
    """The sweep, with only its valid axes."""
    samples: int | str
    knows_sweep: bool = True
    """Whether all axes of the sweep are valid."""
    by_tolerance: bool = False
    """Whether a tolerance will choose the levels, so that checks cannot name them."""
    knows_schemes: bool = True
    """Whether the kind of every scheme is known; an unknown one may be of any kind."""

    def steps(self, level: int) -> int:
        """Return the number of steps at `level`, with 1 base step if the time is not known."""
        return (self.time.base_steps if self.time else 1) << level

    @property
    def trajectories(self) -> int:
        """Number of schemes times number of members, as far as they are known."""
        return max(len(self.schemes), len(self.names), 1) * (self.members or 1)

    @property
    def members(self) -> int | None:
        """Number of members, 1 without a sweep; None if the sweep is faulty."""
        return self.sweep.count if self.knows_sweep else None

    @cached_property
    def adaptive(self) -> tuple[str, ...]:
        """Names of the adaptive schemes."""
        return tuple(scheme.name for scheme in self.schemes if scheme.adaptive)

    @cached_property
    def with_own_velocity(self) -> tuple[str, ...]:
        """Names of the schemes whose velocity differs from the centred difference."""
        return tuple(scheme.name for scheme in self.schemes if scheme.own_velocity)

    @property
    def own_velocity(self) -> bool:
        """Whether the velocity of some scheme differs, or may differ, from the centred difference."""
        return bool(self.with_own_velocity) or not self.knows_schemes

    @cached_property
    def quantities(self) -> tuple[str, ...]:
        """Names of all quantities that are stored over time."""
        return () if self.model is None else quantities(self.model, self.own_velocity)

    def stride(self, level: int) -> int:
        """Return n such that every n-th step of `level` is stored. Requires `levels`."""
        coarsest = self.steps(self.levels[0])
        return stride(self.samples, coarsest, self.steps(level), self.trajectories)


def check(setting: Setting, report: Report) -> None:
    """Report every limit on counts that is exceeded."""
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


def check_costs(experiment: ExperimentSpec, report: Report) -> None:
    """Report if a job takes too much memory, or the levels too much disk or too many files."""
    costs = [level_cost(experiment, level) for level in experiment.levels]
    hint = "store fewer samples, or begin at a lower level"
    # the smallest job makes one member, or one chain of members
    smallest = experiment.chain
    memory = max((cost.memory(smallest) for cost in costs), default=0)
    disk = sum(cost.disk(experiment.members) for cost in costs)
    files = [cost.shards(experiment.members) for cost in costs]
    if memory > MAX_MEMORY:
        what = "one member" if smallest == 1 else f"the {smallest} members that follow each other"
        rule = f"{what} at one level must not take more than {MAX_MEMORY} bytes of memory, it takes {memory}"
        report.add(("levels",), rule, hint, at_key=True)
    if disk > MAX_DISK:
        rule = f"the files must not take more than {MAX_DISK} bytes, they take {disk}"
        report.add(("levels",), rule, hint, at_key=True)
    if sum(files) > MAX_FILES:
        rule = f"the levels must not have more than {MAX_FILES} files, they have {sum(files)}"
        finest = f"{files[-1]} of them are of level {experiment.levels[-1]}"
        hint = f"{finest}: leave levels out, or take fewer members"
        report.add(("levels",), rule, hint, at_key=True)
