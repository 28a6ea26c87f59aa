"""What no experiment may exceed, found from counts alone: nothing is written out or allocated to find it."""

from __future__ import annotations

from dataclasses import dataclass

from vibsim.experiment.cost import Load, load_of
from vibsim.experiment.data import ExperimentSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.storage import extrema_kept, is_lean, stride

MAX_MEMBERS = 10**7
MAX_MEMBER_STEPS = 2**40
"""Steps of every scheme, member and level together: about a day of one core."""
MAX_MEMORY = 8 * 2**30
"""Bytes that a job may hold: at least all samples of one member, every scheme, at one level."""
MAX_DISK = 2**40
"""Bytes of the files of all levels."""
MAX_FILES = 10_000
"""Files of all levels, each made by a job or a part of one: with more the workflow is busy with itself."""

_FEWEST = 6
"""Series of the smallest model: two states and the energies."""
_STATES = 2
_RUNNING = 1
"""Running maxima: that of the energy deviation."""
_D2T = 4
"""Series with the centred difference as velocity: itself, two energies, and a running maximum."""
_LEAN = 3
"""Series that a lean experiment keeps: two states and the energy deviation, and what else a check is about."""
MIN_DT = 1e-100
"""Smallest time step: its square and what is divided by that must not leave the range of floats."""


@dataclass(frozen=True)
class Shape:
    """The counts of an experiment; None or empty where a section is faulty."""

    base_steps: int | None
    levels: tuple[int, ...]
    schemes: int
    members: int | None
    samples: int | str
    variables: int
    """Quantities of the model that are kept as series; 0 where the model is unknown."""
    end: float | None
    own_velocity: bool = False
    """Whether a scheme has another velocity than the centred difference, which is then kept beside it."""

    def steps(self, level: int) -> int | None:
        """Return the number of steps at `level`."""
        return None if self.base_steps is None else self.base_steps * 2**level

    @property
    def trajectories(self) -> int:
        """Number of schemes times number of members, where they are known."""
        return max(self.schemes, 1) * (self.members or 1)

    def stride(self, level: int) -> int:
        """Return n where every n-th step of `level` is stored; levels and steps must be known."""
        coarsest = self.steps(self.levels[0]) or 1
        return stride(self.samples, coarsest, self.steps(level) or 1, self.trajectories)

    def load(self, level: int) -> Load:
        """Return what `level` asks of a job; levels and steps must be known."""
        steps, coarsest = self.steps(level) or 1, self.steps(self.levels[0]) or 1
        kept = steps // self.stride(level) + 1
        series = max(self.variables, _FEWEST)
        schemes = max(self.schemes, 1)
        if is_lean(self.samples, coarsest, self.trajectories):
            return Load(schemes, steps, kept, _LEAN, d2t=self.own_velocity)
        return Load(
            schemes,
            steps,
            kept,
            series + _RUNNING + (_D2T if self.own_velocity else 0),
            exact=_STATES,
            extrema=extrema_kept(steps, self.trajectories),
            d2t=True,
        )


def check(shape: Shape, report: Report) -> None:
    """Note every limit that `shape` exceeds."""
    members = shape.members or 1
    if members > MAX_MEMBERS:
        rule = f"must not have more than {MAX_MEMBERS} members, has {members}"
        report.add(("sweep",), rule, at_key=True)
    if shape.base_steps is None or not shape.levels:
        return
    coarsest = shape.base_steps * 2 ** shape.levels[0]
    if coarsest < 2:
        rule = f"the coarsest level must have at least 2 steps, has {coarsest}"
        report.add(("levels",), rule, "begin at a higher level, or give more base_steps")
    if isinstance(shape.samples, int) and coarsest % shape.samples:
        rule = f"must divide the {coarsest} steps of the coarsest level"
        report.add(("samples", "every"), rule, value=shape.samples)
    finest = shape.base_steps << shape.levels[-1]
    if shape.end is not None and shape.end / min(finest, MAX_MEMBER_STEPS) < MIN_DT:
        report.add(("time",), f"the time step must not be less than {MIN_DT:g}", at_key=True)
    if _check_steps(shape, shape.base_steps, members, report):
        _check_storage(shape, members, report)


def _check_steps(shape: Shape, base_steps: int, members: int, report: Report) -> bool:
    """Tell whether the steps are not too many; numbers beyond are too large to go on with."""
    steps = base_steps * sum(1 << level for level in shape.levels)
    total = steps * members * max(shape.schemes, 1)
    if total > MAX_MEMBER_STEPS:
        rule = f"the experiment must not take more than {MAX_MEMBER_STEPS} steps, it takes {total}"
        report.add(("levels",), rule, "steps of every level, scheme and member together")
    return total <= MAX_MEMBER_STEPS


def _check_storage(shape: Shape, members: int, report: Report) -> None:
    """Refuse what cannot be held, kept or named; one member is the least that a job can make."""
    loads = [shape.load(level) for level in shape.levels]
    hint = "store fewer samples, or begin at a lower level"
    memory = max(load.memory(1) for load in loads)
    if memory > MAX_MEMORY:
        rule = f"one member at one level must not take more than {MAX_MEMORY} bytes of memory, it takes {memory}"
        report.add(("levels",), rule, hint, at_key=True)
    disk = sum(load.disk(members) for load in loads)
    if disk > MAX_DISK:
        rule = f"the files must not take more than {MAX_DISK} bytes, they take {disk}"
        report.add(("levels",), rule, hint, at_key=True)


def check_files(experiment: ExperimentSpec, report: Report) -> None:
    """Note where the files of all levels are too many."""
    loads = [load_of(experiment, level) for level in experiment.levels]
    files = [load.shards(experiment.members) for load in loads]
    if sum(files) <= MAX_FILES:
        return
    rule = f"the levels must not have more than {MAX_FILES} files, they have {sum(files)}"
    finest = f"{files[-1]} of them are of level {experiment.levels[-1]}"
    hint = f"{finest}: leave levels out, or take fewer members"
    report.add(("levels",), rule, hint, at_key=True)
