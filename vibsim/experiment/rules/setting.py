"""The parts of an experiment that rules refer to, while some of them may be faulty."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from vibsim.experiment.data import SchemeSpec, Sweep, TimeSpec
from vibsim.experiment.storage import stride
from vibsim.models import Model, quantities


@dataclass(frozen=True)
class Setting:
    """The sections that rules refer to; None or empty (which skips rules) if a section is faulty."""

    model: Model | None
    time: TimeSpec | None
    levels: tuple[int, ...]
    schemes: tuple[SchemeSpec, ...]  # the schemes without a fault
    names: tuple[str, ...]  # the names of the schemes in the file, valid or not
    sweep: Sweep  # the sweep, with only its valid axes
    samples: int | str
    knows_sweep: bool = True  # whether all axes of the sweep are valid
    by_tolerance: bool = False  # whether a tolerance chooses the levels, which no check can name
    knows_schemes: bool = True  # whether every kind of scheme is known; else it may be any

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
