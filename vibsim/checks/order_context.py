"""The facts about the member that decided a convergence verdict, for its sentence and advice."""

from __future__ import annotations

import math
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from vibsim import theory
from vibsim.apriori.force_discontinuities import words_of
from vibsim.apriori.formal_orders import (
    is_promised,
    orders_in,
    orders_on_oscillator,
    special_orders,
)
from vibsim.apriori.table_corners import is_on_a_point
from vibsim.checks.accurate import error_in_words
from vibsim.checks.phase_amplitude_text import parts_in_words
from vibsim.checks.sentences import MemberFacts, cost_in_words, growth_in_words
from vibsim.checks.stable import SAME_TIME, first_within
from vibsim.comparison.comparison_variables import has_exact
from vibsim.core.record import Record
from vibsim.core.vocabulary import (
    POSITION_VECTOR,
    TYPICAL_NORM,
    is_error_part,
    whole_of,
)
from vibsim.experiment.schema.checks import ConvergesCheck
from vibsim.experiment.sweep_columns import recorded_columns
from vibsim.models.base import components
from vibsim.observe.member_block import fastest
from vibsim.schemes.base import LOW_STARTS, Scheme

COINCIDE = 0.1
"""Largest relative distance of rescaled differences that coincide."""


class Corner(NamedTuple):
    """The first corner of the force that affects steps."""

    words: str
    """Its description."""
    time: float
    power: float
    """The highest power of dt that it leaves regular."""
    on_a_point: bool = False
    """Whether it is a jump at a grid point instead of within a step."""


class OrderContext:
    """The facts for sentences on a convergence verdict; unknown numbers are NaN, unknown levels -1."""

    def __init__(self, f: MemberFacts, check: ConvergesCheck) -> None:
        experiment, record, scheme, case = f.experiment, f.record, f.scheme, f.case
        quantity = check.converges
        self._facts = f
        self.quantity, self.norm, self.tolerance = quantity, check.norm, check.tolerance
        self.is_position = quantity in (*f.model.positions, POSITION_VECTOR)
        self.notation, self.reason = f.notation, f.reason
        self.cause = f.word("cause")
        """Why the order differs from the expected one: one of `vibsim.comparison.order_verdict.CAUSES`."""
        order = float(f.fact("order"))
        self.order = order if math.isfinite(order) else math.nan
        self.low, self.high = float(f.fact("order_low")), float(f.fact("order_high"))
        self.first, self.last = f.fact("levels")
        self.levels = tuple(int(level) for level in record["level"])
        self.orders = _orders(record, check, scheme, case)
        """Local orders in the norm of the check, the coarsest levels first."""
        self.more: int = f.fact("levels_needed")
        """Number of finer levels that are probably needed."""
        self.readable: int = f.fact("readable_level")
        """Finest level at which an order can be read."""
        self.compensated: int = f.fact("readable_level_compensated")
        """The same in compensated arithmetic."""
        self.has_exact = has_exact(record, quantity, scheme, case)
        self.cost = partial(cost_in_words, experiment)
        self.error = error_in_words(f, quantity, check.norm)
        """A sentence on the error of the finest level; empty if it is unknown."""

        self.scheme, self.kind = f.scheme_name, experiment.schemes[scheme].kind
        self.options = f.options
        self.promised = f.of_member(orders_in(experiment, record, quantity))
        """The order that the scheme promises."""
        columns = recorded_columns(record)
        self.special = f.of_member(special_orders(experiment, quantity, columns))
        """Its highest order in a special case of motion, model or options."""
        self.on_oscillator = f.of_member(orders_on_oscillator(experiment, quantity, columns))
        """Its order on the linear oscillator if it does not come with vibsim, else infinite."""
        self.expected = self.promised if check.order == "scheme" else float(check.order)
        """The expected order; infinite for exactness."""
        self.parts = parts_in_words(f, quantity, self.expected)
        self.has_promise = not is_error_part(quantity) or is_promised(experiment, quantity)
        """Whether `promised` is for the quantity itself; for a part of an error it may be for its position."""

        self.culprit: int = f.fact("failed_level")
        """Level that failed or exceeds the stability limit."""
        self.failures = _failures(record, scheme, case)

        self.table_corner = self._stored("table_corner_time", case)
        """The first time at which a table of the force has a corner within a step."""
        self.corner = _corner(f)
        self.pulse = self._stored("pulse_time", case), self._stored("pulse_width", case)
        """Time and length of a pulse of the force that no level sees."""
        self.decay = self._stored("decay_rate", scheme, case)
        """The largest decay rate of a velocity by damping."""
        self.shortest = record.step(-1, case)
        self.parts_at = float(f.fact("parting_time"))
        self.parting_rate = float(f.fact("parting_rate"))
        """When the finest levels of a chaotic motion part, and how fast."""
        self.end = self.shortest * experiment.steps(self.levels[-1])

    def _stored(self, name: str, *place: int) -> float:
        record = self._facts.record
        return float(record[name][place]) if name in record else math.nan

    @cached_property
    def rescaled_distance(self) -> float:
        """Relative distance of the finest two rescaled differences of the levels that decide."""
        for i, finest in enumerate(self.levels[2:]):
            if finest == self.last:
                place = self._facts.scheme, self._facts.case, i
                return self._stored(f"{self.quantity}_coincidence", *place)
        return math.nan

    @cached_property
    def squares(self) -> dict[str, float]:
        """The squares of the finest differences of all coordinates of a vector; empty for any other quantity."""
        names, record = components(self._facts.model, self.quantity), self._facts.record
        if len(names) == 1 or not all(f"{name}_difference_norm" in record for name in names):
            return {}
        norm = record.words("norm").index(TYPICAL_NORM)
        place = self._facts.scheme, self._facts.case, -1, norm
        return {name: float(record[f"{name}_difference_norm"][place]) ** 2 for name in names}

    @property
    def speeds_differ(self) -> float:
        """The largest factor between the largest speeds of the finest three levels; NaN if they are not stored."""
        return self._facts.speeds_differ

    @cached_property
    def centred(self) -> float:
        """The order that the scheme would promise with `start: centred`; NaN if its start is not of lower order."""
        if self.options.get("start") not in LOW_STARTS:
            return math.nan
        options = {**self.options, "start": "centred"}
        model = self._facts.model
        return float(self._method.formal_order(whole_of(self.quantity), model, options))

    @property
    def _method(self) -> Scheme:
        return self._facts.experiment.schemes[self._facts.scheme].method

    @cached_property
    def omega_dt(self) -> float:
        """The step of the culprit times the fastest frequency; NaN if no level failed."""
        if self.culprit < 0:
            return math.nan
        place = self._facts.case, self.levels.index(self.culprit)
        return float(fastest(self._facts.record)[place])

    @cached_property
    def is_zero_stable(self) -> bool:
        """Whether finer levels grow less, as those of every useful scheme do."""
        return self._facts.is_zero_stable

    @cached_property
    def limit(self) -> float:
        """The largest stable w dt of the scheme, infinite for none; NaN if no level failed."""
        return math.nan if self.culprit < 0 else self._facts.stability_limit

    @property
    def of_limit(self) -> str:
        """Words behind the limit: of which motion it is, if the motion is damped."""
        return self._facts.of_limit

    @cached_property
    def growth_in_words(self) -> str:
        """A sentence on the growth of the solution at the culprit."""
        if math.isnan(self.omega_dt) or self._method.adaptive:
            return ""
        predicted = float(theory.dominant(self._method.stepper(self.options), self.omega_dt)[0])
        place = self._facts.scheme, self._facts.case, self.levels.index(self.culprit)
        return growth_in_words(self._facts, predicted, self._stored("measured_growth", *place))

    @property
    def what(self) -> str:
        """The quantity inside a sentence."""
        return self.notation.quantity(self.quantity)

    @property
    def subject(self) -> str:
        """The quantity at the beginning of a sentence."""
        return self.notation.opening(self.what)

    @property
    def starts_low(self) -> bool:
        """Whether the first step explains the order."""
        return self.start_fault != "" and 0.5 < self.order < 1.5

    @property
    def start_fault(self) -> str:
        """The fault of the formula of the first step; empty if there is none."""
        return LOW_STARTS.get(str(self.options.get("start")), "")

    @property
    def ends_low(self) -> bool:
        """Whether the formula for the last velocity explains, or may explain, the order."""
        formula = self.options.get("end_velocity")
        if self.norm == "linf_interior" or self.is_position:
            return False
        return formula == "backward" or (
            formula == "extrapolate" and self.reason == "pre_asymptotic"
        )

    @property
    def promises_less(self) -> bool:
        """Whether the scheme itself promises a lower order than the check expects."""
        return math.isfinite(self.promised) and self.promised < self.expected - self.tolerance

    @property
    def promises_more(self) -> bool:
        """Whether the scheme itself promises a higher order than the check expects."""
        return self.promised > self.expected + self.tolerance

    @property
    def shows_promise(self) -> bool:
        """Whether the observed order may be the promised one, which differs from the expected one."""
        # without an interval any order is possible
        excluded = (
            self.promised < self.low - self.tolerance or self.promised > self.high + self.tolerance
        )
        return (self.promises_less or self.promises_more) and not excluded

    @property
    def singular(self) -> float:
        """Time at which both finest levels failed, so that finer ones will, too; NaN if the times differ."""
        if len(self.failures) < 2:
            return math.nan
        before, last = self.failures[-2:]
        return last if abs(before - last) <= SAME_TIME * before else math.nan

    @property
    def is_beyond_limit(self) -> bool:
        """Whether w dt exceeds the stability limit at the culprit."""
        return math.isfinite(self.omega_dt) and self.omega_dt > self.limit

    @property
    def first_stable(self) -> int:
        """The coarsest level whose w dt is within the limit."""
        if not self.is_beyond_limit:
            return self.levels[-1] + 1
        return first_within(self.limit, self.culprit, self.omega_dt)


def _orders(record: Record, check: ConvergesCheck, scheme: int, case: int) -> tuple[float, ...]:
    """Return the local orders; empty if the record does not have them, or the norm."""
    name, norms = f"{check.converges}_observed_order", record.words("norm")
    if name not in record or check.norm not in norms:
        return ()
    return tuple(record[name][scheme, case, :, norms.index(check.norm)].astype(float).tolist())


def _failures(record: Record, scheme: int, case: int) -> tuple[float, ...]:
    """Return the failure time of each level, 0 for its first step and NaN for none; empty if it is not stored."""
    if "failure_time" not in record:
        return ()
    times = np.asarray(record["failure_time"], dtype=float)[scheme, case]
    if "last_step" in record:
        times = np.where(record["last_step"][scheme, case] > 0, times, 0.0)
    broken = record["status"][scheme, case] != 0
    return tuple(np.where(broken, times, np.nan).tolist())


def _corner(f: MemberFacts) -> Corner | None:
    record, place = f.record, (f.scheme, f.case)
    if "corner_switch" not in record or record["corner_switch"][place] < 0:
        return None
    time = np.asarray(record["corner_time"])[place]
    return Corner(
        words_of(f.model, int(record["corner_switch"][place])),
        float(time),
        float(record["corner_power"][place]),
        on_a_point=bool(is_on_a_point(time, np.asarray(record.step(0, f.case)))),
    )
