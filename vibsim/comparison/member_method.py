"""A scheme with its options on a model, and the numbers of members: what is to be extrapolated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vibsim.comparison.thresholds import LONG_RUN
from vibsim.convergence.state_extrapolation import Tableau, tableau
from vibsim.core.array_types import Floats, Integers
from vibsim.models import Model
from vibsim.schemes import Options, Scheme


@dataclass(frozen=True)
class Method:
    """A scheme with its options on a model."""

    model: Model
    scheme: Scheme
    options: Options

    @cached_property
    def position_powers(self) -> tuple[int, int]:
        """First power of the expansion of the error, and the distance to the next."""
        return self._powers(self.model.position, self.options)

    @cached_property
    def velocity_powers(self) -> tuple[int, int]:
        """The same of the velocity before the last time."""
        return self._powers(self.model.velocity, self._own_end())

    @cached_property
    def end_powers(self) -> tuple[int, int]:
        """The same of the velocity at the last time."""
        return self._powers(self.model.velocity, self.options)

    @cached_property
    def has_one_expansion(self) -> bool:
        """Whether position and velocity have the same powers at all times."""
        return self.position_powers == self.velocity_powers == self.end_powers

    @cached_property
    def twin(self) -> Options | None:
        """Options of the same method with other rounding errors; None where there are none."""
        for option in self.scheme.words:
            for choice in option.choices:
                other = {**self.options, option.name: choice}
                if self.scheme.round_off(other, LONG_RUN) != self.scheme.round_off(
                    self.options, LONG_RUN
                ):
                    return other
        return None

    def round_off(self, steps: Sequence[int]) -> tuple[float, ...]:
        """Return the predicted round-off relative to the solution."""
        return tuple(self.scheme.round_off(self.options, n) for n in steps)

    def tableau(self, steps: tuple[int, ...], powers: tuple[int, int]) -> Tableau:
        """Return the tableau of a quantity whose error has these powers."""
        known = self._tableaux.get((steps, powers))
        if known is None:
            known = tableau(steps, *powers, self.round_off(steps))
            self._tableaux[steps, powers] = known
        return known

    @cached_property
    def _tableaux(self) -> dict[tuple[tuple[int, ...], tuple[int, int]], Tableau]:
        return {}

    def _powers(self, quantity: str, options: Options) -> tuple[int, int]:
        p = int(self.scheme.formal_order(quantity, self.model, options))
        return p, 2 if self.scheme.has_even_powers(quantity, self.model, options) else 1

    def _own_end(self) -> Options:
        """Return the options with which the last velocity is the scheme's own, as all others are."""
        for option in self.scheme.words:
            for choice in option.choices:
                other = {**self.options, option.name: choice}
                if self.scheme.stepper(other).end == "own" and self._same_start(other):
                    return other
        return self.options

    def _same_start(self, other: Options) -> bool:
        mine, its = self.scheme.stepper(self.options), self.scheme.stepper(other)
        return (mine.start, mine.step, mine.variant) == (its.start, its.step, its.variant)


@dataclass(frozen=True)
class Start:
    """The numbers of some members."""

    parameters: Floats  # in the order of `Model.parameters`, shape (case, n_parameters)
    initial: Floats  # position and velocity, shape (case, 2)
    end: Floats  # shape (case,)
    frequency: Floats  # angular frequency of small oscillations, shape (case,)

    def of(self, some: Integers | slice) -> Start:
        """Return the numbers of some of the members."""
        return Start(*(values[some] for values in vars(self).values()))


def rate_of(start: Start) -> Floats:
    """Return w, shape (case,): a change of the velocity is w times one of the position. At least 1 over the time."""
    return np.asarray(np.fmax(start.frequency, 1.0 / start.end))
