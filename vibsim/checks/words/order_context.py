"""What is known of the member that decided a convergence verdict, for the sentence and the advice on it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim import theory
from vibsim.apriori.force_discontinuities import is_on_a_point, words_of
from vibsim.apriori.formal_orders import (
    columns_of,
    formal_orders,
    has_corners,
    is_promised,
    options_of,
    special_orders,
    stability_limits,
)
from vibsim.checks.growth import ALIKE
from vibsim.checks.order.judge import expected_order
from vibsim.checks.words.costs import cost_in_words
from vibsim.checks.words.found import Found
from vibsim.checks.words.notation import PLAIN, Notation
from vibsim.checks.words.phase_amplitude import parts_in_words
from vibsim.comparison.exact_availability import has_exact
from vibsim.convergence.thresholds import HALF_SPACING
from vibsim.core.record import Record
from vibsim.models.shared.phase_amplitude_names import is_error_part, whole_of
from vibsim.observe.member_block import fastest
from vibsim.schemes import SCHEMES, Options, Scheme

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ConvergesCheck

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Corner:
    """The first corner of the force that steps feel."""

    words: str
    """What happens there."""
    time: float
    power: float
    """The highest power of dt that it leaves regular."""
    on_a_point: bool = False
    """Whether it is a jump at a grid point, not within a step."""


@dataclass(frozen=True)
class Story:
    """What a sentence on a convergence verdict needs to know about the member that decided it."""

    quantity: str
    reason: str
    order: float
    low: float
    high: float
    first: int
    last: int
    expected: float
    """The order that was expected; infinite where the quantity was to be exact."""
    tolerance: float
    norm: str
    levels: tuple[int, ...]
    culprit: int
    """Level that failed or is beyond the stability limit; -1 for none."""
    omega_dt: float
    """w dt at the culprit; NaN for none."""
    growth: tuple[float, float]
    """Growth factor per period at the culprit, predicted and measured; NaN where it is not known."""
    limit: float
    """Stability limit of the scheme; infinite for none."""
    options: Options
    """Options of the scheme."""
    is_position: bool
    scheme: str
    growth_of: tuple[bool, bool, int] = (True, True, 1)
    """What a growth is told of: whether the model is conservative, whether it is linear, its number of coordinates."""
    has_corners: bool = False
    """Whether steps have corners of a force from a table inside."""
    corner: Corner | None = None
    """The first other corner of the force within a step."""
    pulse: tuple[float, float] = (math.nan, math.nan)
    """Time and length of a pulse of the force that no level sees; NaN where there is none."""
    decay: float = math.nan
    """The largest rate at which damping takes a velocity away; NaN for none."""
    shortest: float = math.nan
    """The step of the finest level."""
    parts: str = ""
    """What phase and amplitude of the error say of it (`vibsim.checks.words.phase_amplitude`)."""
    kind: str = ""
    """Kind of the scheme."""
    promised: float = math.nan
    """The order that the scheme promises, ..."""
    special: float = math.nan
    """... and has at most, in a special case of motion, model or options, ..."""
    centred: float = math.nan
    """... and would promise with `start: centred`; NaN where it has that start, or no such option."""
    has_promise: bool = True
    """Whether that is a promise for the quantity; of a part of an error it may be the one for its position."""
    cause: str = "none"
    """Why the order is another one, one of `vibsim.comparison.order_causes.CAUSES`."""
    more: int = -1
    """Finer levels that are probably needed; -1 where that is not known, here and below."""
    readable: int = -1
    """Finest level at which an order can be read, ..."""
    compensated: int = -1
    """... and the same in compensated arithmetic."""
    cost: Callable[[Sequence[int]], str] = lambda levels: ""
    """What levels cost, in words."""
    has_exact: bool = True
    """Whether an exact solution or a reference is known, which alone shows a wrong limit."""
    orders: tuple[float, ...] = ()
    """The orders of successive levels in the norm of the check, the coarsest first; NaN where there is none."""
    failures: tuple[float, ...] = ()
    """When each level met a number that is not finite, in its first step at 0; NaN where it did not."""
    notation: Notation = PLAIN

    @property
    def what(self) -> str:
        """The quantity as a sentence has it."""
        return self.notation.quantity(self.quantity)

    @property
    def subject(self) -> str:
        """The quantity as it begins a sentence."""
        return self.notation.opening(self.what)

    def number(self, value: float, digits: int = 6) -> str:
        """Write a number."""
        return self.notation.number(value, digits)

    @property
    def singular(self) -> float:
        """Time at which the two finest levels failed alike, so that finer ones will, too; NaN where they did not."""
        if len(self.failures) < 2:
            return math.nan
        before, last = self.failures[-2:]
        return last if abs(before - last) <= ALIKE * before else math.nan


def is_adaptive(s: Story) -> bool:
    """Tell whether the scheme chooses its own steps."""
    return "tolerance" in s.options


def starts_low(s: Story) -> bool:
    """Tell whether the first step explains the order."""
    return s.options.get("start") == "first_order" and 0.5 < s.order < 1.5


def ends_low(s: Story) -> bool:
    """Tell whether the formula for the last velocity explains the order, or may."""
    one_sided = s.options.get("end_velocity") in {"backward", "extrapolate"}
    sees_end = s.norm != "linf_interior" and not s.is_position
    backward = s.options.get("end_velocity") == "backward"
    return one_sided and sees_end and (backward or s.reason == "pre_asymptotic")


def promises_less(s: Story) -> bool:
    """Tell whether the scheme itself promises a lower order than the check expects."""
    return math.isfinite(s.promised) and s.promised < s.expected - s.tolerance


def promises_more(s: Story) -> bool:
    """Tell whether the scheme itself promises a higher order than the check expects."""
    return s.promised > s.expected + s.tolerance


def shows_promise(s: Story) -> bool:
    """Tell whether the order that was found may be the one that the scheme promises, and not what was expected."""
    if not (promises_less(s) or promises_more(s)):
        return False
    # what has no interval may be any order
    return not (s.promised < s.low - s.tolerance or s.promised > s.high + s.tolerance)


def may_hide(s: Story) -> bool:
    """Tell whether the order that the scheme promises may be behind a higher one, as near a special case."""
    return s.promised + HALF_SPACING < min(s.order, s.special)


def due(s: Story) -> float:
    """Return the order that levels approach: the one that the scheme has, where the last order is nearer to that."""
    known = [order for order in s.orders if math.isfinite(order)]
    if not known or not math.isfinite(s.promised):
        return s.expected
    return min(s.expected, s.promised, key=lambda order: abs(known[-1] - order))


def first_sound(s: Story) -> int:
    """Return the coarsest level from which on none met a number that is not finite, as far as they tell."""
    failed = [level for level, t in zip(s.levels, s.failures, strict=False) if not math.isnan(t)]
    return max([s.culprit, s.levels[0], *failed]) + 1


def first_stable(s: Story) -> int:
    """Return the coarsest level whose w dt is within the limit."""
    if not (math.isfinite(s.omega_dt) and s.omega_dt > s.limit):
        return s.levels[-1] + 1
    return s.culprit + math.ceil(math.log2(s.omega_dt / s.limit) - 1e-9)


def story(f: Found, check: ConvergesCheck) -> Story:
    """Gather what is known of a scheme and a member."""
    experiment, record, scheme, case = f.experiment, f.record, f.scheme, f.case
    levels = tuple(int(level) for level in record["level"])
    culprit = f.fact("failed_level")
    first, last = f.fact("levels")
    spec, model = experiment.schemes[scheme], experiment.model.definition
    columns = columns_of(record)
    at = levels.index(culprit) if culprit >= 0 else None
    options = options_of(experiment, columns, scheme, case)
    p = math.nan if at is None else float(fastest(record)[case, at])
    return Story(
        quantity=check.converges,
        reason=f.reason,
        order=order if math.isfinite(order := f.fact("order")) else math.nan,
        low=f.fact("order_low"),
        high=f.fact("order_high"),
        first=first,
        last=last,
        expected=_of_member(expected_order(experiment, record, check), scheme, case),
        tolerance=check.tolerance,
        norm=check.norm,
        levels=levels,
        culprit=culprit,
        omega_dt=p,
        growth=_growth(record, SCHEMES[spec.kind], options, p, (scheme, case, at)),
        growth_of=(model.conservative, model.linear, len(model.positions)),
        limit=_of_member(stability_limits(experiment, columns), scheme, case),
        options=options,
        is_position=check.converges in model.positions,
        scheme=spec.name,
        has_corners=has_corners(model),
        corner=_corner(f),
        pulse=_pulse(record, case),
        decay=_decay(record, scheme, case),
        shortest=_shortest(record, case),
        parts=parts_in_words(f, check.converges),
        kind=spec.kind,
        promised=_of_member(formal_orders(experiment, check.converges, columns), scheme, case),
        special=_of_member(special_orders(experiment, check.converges, columns), scheme, case),
        centred=_centred(f, check.converges, SCHEMES[spec.kind], options),
        has_promise=not is_error_part(check.converges) or is_promised(experiment, check.converges),
        cause=f.word("cause"),
        more=f.fact("levels_needed"),
        readable=f.fact("readable_level"),
        compensated=f.fact("readable_level_compensated"),
        cost=partial(cost_in_words, experiment),
        has_exact=has_exact(record, check.converges, scheme, case),
        orders=_orders(record, check, scheme, case),
        failures=_failures(record, scheme, case),
        notation=f.notation,
    )


def _orders(record: Record, check: ConvergesCheck, scheme: int, case: int) -> tuple[float, ...]:
    """Return the orders of successive levels; none where the record does not have them, or the norm."""
    name, norms = f"{check.converges}_observed_order", record.words("norm")
    if name not in record or check.norm not in norms:
        return ()
    found = np.asarray(record[name])[scheme, case, :, norms.index(check.norm)]
    return tuple(float(order) for order in found)


def _failures(record: Record, scheme: int, case: int) -> tuple[float, ...]:
    """Return when each level broke down; see `Story.failures`. Data of other programs need not say it."""
    if "failure_time" not in record:
        return ()
    broken = record["status"][scheme, case] != 0
    times = np.asarray(record["failure_time"])[scheme, case]
    if "last_step" in record:
        times = np.where(np.asarray(record["last_step"])[scheme, case] > 0, times, 0.0)
    return tuple(float(t) for t in np.where(broken, times, np.nan))


def _corner(f: Found) -> Corner | None:
    """Return the first corner of the force that steps feel, None where there is none."""
    record, scheme, case = f.record, f.scheme, f.case
    if "corner_switch" not in record or record["corner_switch"][scheme, case] < 0:
        return None
    time = np.asarray(record["corner_time"])[scheme, case]
    dt = np.asarray(record["dt"])[0]
    return Corner(
        words_of(f.experiment.model.definition, int(record["corner_switch"][scheme, case])),
        float(time),
        float(record["corner_power"][scheme, case]),
        on_a_point=bool(is_on_a_point(time, dt[case] if dt.ndim else dt)),
    )


def _of_member(orders: Floats, scheme: int, case: int) -> float:
    """Return the order of one member, from those of shape (scheme, 1 or case)."""
    own = orders[scheme]
    return float(own[case if len(own) > 1 else 0])


def _pulse(record: Record, case: int) -> tuple[float, float]:
    """Return time and length of a pulse of the force that no level sees; NaN where there is none."""
    if "pulse_time" not in record:
        return math.nan, math.nan
    return float(record["pulse_time"][case]), float(record["pulse_width"][case])


def _decay(record: Record, scheme: int, case: int) -> float:
    """Return the rate at which damping takes a velocity away; NaN where there is none."""
    return float(record["decay_rate"][scheme, case]) if "decay_rate" in record else math.nan


def _shortest(record: Record, case: int) -> float:
    """Return the step of the finest level of a member."""
    dt = np.asarray(record["dt"])[-1]
    return float(dt[case] if dt.ndim else dt)


def _centred(f: Found, quantity: str, scheme: Scheme, options: Options) -> float:
    """Return the order that a scheme would promise with a centred start; NaN where its start is not of first order."""
    if options.get("start") != "first_order":
        return math.nan
    model = f.experiment.model.definition
    return float(scheme.formal_order(whole_of(quantity), model, {**options, "start": "centred"}))


def _growth(
    record: Record, scheme: Scheme, options: Options, p: float, place: tuple[int, int, int | None]
) -> tuple[float, float]:
    """Return the growth factor per period at w dt = p, predicted and measured; NaN where it is not known."""
    if math.isnan(p) or scheme.adaptive:
        return math.nan, math.nan
    predicted = float(theory.dominant(scheme.stepper(options), p)[0])
    measured = "measured_growth" in record
    return predicted, float(record["measured_growth"][place]) if measured else math.nan
