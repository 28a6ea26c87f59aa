"""The facts and common phrases of all sentences on results."""

from __future__ import annotations

import math
import string
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from vibsim import theory
from vibsim.apriori.stability_limits import stability_limits
from vibsim.checks.fields import field_values, name_of
from vibsim.checks.notation import PLAIN, Notation
from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER
from vibsim.experiment import Experiment
from vibsim.experiment.cost import level_cost
from vibsim.experiment.schema.checks import Measurement
from vibsim.experiment.sweep_columns import options_of, recorded_columns
from vibsim.models.base import Model
from vibsim.schemes import Options
from vibsim.schemes.orders import depends_on_velocity

LONG = 120.0
"""Times above this [s] are written in minutes, and above sixty times this in hours."""
FINER, MOST_FINER = 2, 12
"""Number of finer levels that advice suggests if the needed number is unknown, and at most."""

NOT_FINITE = (
    "{} has no meaning here, because the calculation produced a number that is not finite.",
    "Start `levels:` at a finer level. If finer levels do not avoid it, shorten `time: end`.",
)
"""Sentence and advice if the calculation produced a number that is not finite."""
NOTHING_MOVES = "Nothing moves here, so {} keeps its initial value with any scheme"
MOVE = "Choose `initial:` values or a force that cause motion."
"""Advice if nothing moves."""
WRONG_LIMIT_ADVICE = (
    "Check `model:` and `initial:` against the intended equation. If they are your own, check the code of scheme "
    "{scheme} and the `exact` of the model. Finer levels will not help."
)
"""Advice if levels approach another limit than the exact solution."""


class Template(string.Formatter):
    """Fills templates with attributes of an object: ``{name}``, or ``{name:4}`` for a number with 4 digits."""

    def __init__(self, source: object, notation: Notation) -> None:
        self.source, self.notation = source, notation

    def get_value(self, key: int | str, args: object, kwargs: object) -> Any:
        """Return an attribute, or the result of a method."""
        value = getattr(self.source, str(key))
        return value() if callable(value) else value

    def format_field(self, value: Any, format_spec: str) -> Any:
        """Write numbers in the notation."""
        if isinstance(value, float):
            return self.notation.number(value, int(format_spec or 6))
        return format(value, format_spec)


class Description(NamedTuple):
    """A result in words."""

    sentence: str
    """The measured result."""
    advice: str
    """What to change in the experiment file; empty if nothing needs to be changed."""
    brief: str = ""
    """A short form of the sentence; empty if there is none."""


@dataclass(frozen=True)
class MemberFacts:
    """The facts that a check measured for one scheme and one member."""

    experiment: Experiment
    record: Record
    """Convergence Record."""
    check: Measurement | None
    """The measuring check; None for the tolerance of the experiment."""
    id: str
    scheme: int
    case: int
    """Indices of scheme and member in the Record."""
    reason: str
    """Measured reason."""
    notation: Notation = PLAIN

    def fact(self, name: str) -> Any:
        """Return the value of a field for this scheme and member, or the common value of all."""
        values = np.asarray(field_values(self.record, self.id, name))
        return (values[self.scheme, self.case] if values.ndim else values).tolist()

    def word(self, name: str) -> str:
        """Return the word of a field that holds an index into a list of words."""
        return self.record.meanings(name_of(self.id, name))[self.fact(name)]

    def of_member(self, orders: Floats) -> float:
        """Return the entry of the member from an array of shape (scheme, 1 or case)."""
        return float(orders[self.scheme, self.case if orders.shape[1] > 1 else 0])

    @property
    def model(self) -> Model:
        """The model."""
        return self.experiment.model.definition

    @property
    def scheme_name(self) -> str:
        """Name of the scheme."""
        return self.experiment.schemes[self.scheme].name

    @property
    def options(self) -> Options:
        """Options of the scheme for this member."""
        columns = recorded_columns(self.record)
        return options_of(self.experiment, columns, self.scheme, self.case)

    @property
    def stability_limit(self) -> float:
        """The largest stable w dt; infinite if there is no limit."""
        limits = stability_limits(self.experiment, recorded_columns(self.record))
        return self.of_member(limits)

    @property
    def of_limit(self) -> str:
        """Words behind a stability limit, which is that of the undamped motion; empty if nothing damps it."""
        return " for the undamped motion" if depends_on_velocity(self.model) else ""

    @cached_property
    def speeds_differ(self) -> float:
        """The largest factor between the largest speeds of the finest three levels; NaN if they are not stored."""
        ends = ("min", "max")
        names = [f"{velocity}_{end}" for velocity in self.model.velocities for end in ends]
        if any(name not in self.record for name in names):
            return math.nan
        of_levels = np.max(
            [np.abs(self.record[name][self.scheme, self.case]) for name in names], axis=0
        )
        last = of_levels[-LEVELS_OF_AN_ORDER:]
        return float(np.max(last) / np.min(last)) if np.min(last) > 0.0 else math.nan

    @property
    def is_zero_stable(self) -> bool:
        """Whether the growth per step vanishes with dt, so that finer levels help; also of an adaptive scheme."""
        method = self.experiment.schemes[self.scheme].method
        return method.adaptive or theory.is_zero_stable(method.stepper(self.options))

    @cached_property
    def failed_at(self) -> float:
        """Time at which the level of the check produced a number that is not finite; NaN if it did not."""
        place = self.scheme, self.case, self.record.place("level", self.fact("level"))
        failed = self.record["status"][place]
        return float(self.record["failure_time"][place]) if failed else math.nan


NOT_ZERO_STABLE = (
    "Correct the coefficients of scheme {scheme}, or name another. It is not zero-stable: it grows at every step by a "
    "factor that does not tend to 1 with dt. Finer levels will not help, because more steps overflow sooner."
)
"""Advice on a scheme that no step makes stable."""


def growth_in_words(f: MemberFacts, predicted: float, measured: float) -> str:
    """Return a sentence on the predicted and the measured growth; empty if neither is known.

    The theory covers free linear oscillations without damping, and of several coordinates the fastest oscillation. The
    sentence says so for other models.
    """
    theory = "predicted" if f.model.linear else "predicted for small oscillations"
    if len(f.model.positions) > 1:
        theory = "predicted for the fastest small oscillations"
    word_of_measured = "measured"
    if not f.model.conservative:
        theory = "predicted for free oscillations without damping"
        word_of_measured = "measured of the motion itself"
    phrases = [
        f"{f.notation.factor(value)} ({word})"
        for value, word in ((predicted, theory), (measured, word_of_measured))
        if not math.isnan(value)
    ]
    return f" The growth factor per period is {' and '.join(phrases)}." if phrases else ""


def cost_in_words(experiment: Experiment, levels: Sequence[int]) -> str:
    """Return the estimated total cost of levels in words; the memory is that of the largest job."""
    costs = [level_cost(experiment, level) for level in levels]
    members = experiment.members
    steps = sum(cost.schemes * cost.steps * members for cost in costs)
    memory = max(cost.memory(min(members, cost.shard)) for cost in costs)
    count = f"{steps}" if steps < 100_000 else f"{steps:.2g}"
    size = f"{memory / 1e6:.0f} MB" if memory < 1e9 else f"{memory / 1e9:.1f} GB"
    time = _time(sum(cost.seconds(members) for cost in costs))
    return f"{count} steps, {time} on one core, {size} of memory"


def add_levels(finest: int, count: int, cost: Callable[[Sequence[int]], str]) -> str:
    """Ask for `count` more levels, with their cost in words; the text starts with the second letter."""
    last = finest + count
    finer = list(range(finest + 1, last + 1))
    names = {1: f"level {last}", 2: f"levels {finer[0]} and {last}"}
    which = names.get(count, f"levels {finer[0]} to {last}")
    return f"dd {which} to `levels:` ({cost(finer)})"


def _time(seconds: float) -> str:
    if seconds < 0.1:
        return "less than 0.1 s"
    if seconds < LONG:
        return f"{seconds:.2g} s"
    if seconds < LONG * 60:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.0f} h"
