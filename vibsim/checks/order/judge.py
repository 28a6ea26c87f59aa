"""What a ``converges`` check measured, compared with what was expected of every scheme and member."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from vibsim import theory
from vibsim.apriori.force_discontinuities import is_on_a_point, words_of
from vibsim.apriori.formal_orders import (
    columns_of,
    formal_orders,
    has_corners,
    options_of,
    special_orders,
    stability_limits,
)
from vibsim.apriori.phase_amplitude_orders import is_promised
from vibsim.checks.costs import cost_in_words
from vibsim.checks.fields import Field, facts, facts_of, measured
from vibsim.checks.order.advice import advise
from vibsim.checks.order.measure import FIELDS
from vibsim.checks.order.phase_amplitude_text import parts_in_words
from vibsim.checks.order.required_levels import UNKNOWN
from vibsim.checks.order.sentences import tell
from vibsim.checks.order.verdict_context import Corner, Story
from vibsim.checks.outcome import FAIL, INCONCLUSIVE, PASS, Outcome
from vibsim.comparison.exact_availability import has_exact
from vibsim.core.record import Record
from vibsim.core.vocabulary import REASON_NAMES, STATUSES
from vibsim.experiment.data import schemes_of
from vibsim.models.shared.phase_amplitude_names import is_error_part, whole_of
from vibsim.observe.member_block import fastest
from vibsim.schemes import SCHEMES, Options, Scheme

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import ConvergesCheck

Floats = NDArray[np.float64]
T = TypeVar("T")

EXPECTED = Field("order that is expected; none where the quantity is to be exact")


def converges(experiment: Experiment, record: Record, check: ConvergesCheck, id_: str) -> Outcome:
    """Compare the verdict on a quantity, of every scheme and member, with the expected one.

    Parameters
    ----------
    record
        Convergence Record.
    id_
        Id of the check in it.
    """
    found = facts(record, id_, FIELDS)
    status, reason = (measured(record, id_, field) for field in ("status", "reason"))
    order = expected_order(experiment, record, check)
    names = record.words("scheme")
    chosen = list(schemes_of(experiment, check))

    def story(scheme: int, case: int) -> Story:
        expected = order[scheme, case if order.shape[1] > 1 else 0]
        word = REASON_NAMES[int(reason[scheme, case])]
        of = facts_of(found, scheme, case)
        interval = [
            float(measured(record, id_, end)[scheme, case]) for end in ("order_low", "order_high")
        ]
        return _story(
            experiment, record, check, of, (*interval,), word, float(expected), scheme, case
        )

    expect = check.expect
    as_expected = status == STATUSES.index(expect.status)
    if expect.reason is not None:
        as_expected &= reason == REASON_NAMES.index(expect.reason)
    open_ = status == INCONCLUSIVE
    words = expect.status if expect.reason is None else f"{expect.status} ({expect.reason})"
    return Outcome(
        schemes=[names[i] for i in chosen],
        cases=np.asarray(record["case"]),
        scheme_index=chosen,
        case_index=np.arange(len(record["case"])),
        status=status,
        reason=reason,
        compared=np.where(as_expected, PASS, np.where(open_, INCONCLUSIVE, FAIL)).astype(np.int8),
        away=np.abs(measured(record, id_, "order") - order),
        expected=words,
        expects_pass=expect.status == "PASS",
        quantity=check.converges,
        tell=lambda scheme, case: tell(story(scheme, case)),
        advise=lambda scheme, case: advise(story(scheme, case)),
        facts={**found, "expected": (EXPECTED, np.broadcast_to(order, status.shape))},
    )


def expected_order(experiment: Experiment, record: Record, check: ConvergesCheck) -> Floats:
    """Return the order that a check expects, shape (scheme, 1 or case)."""
    if check.order == "scheme":
        return formal_orders(experiment, check.converges, columns_of(record))
    return np.full((len(experiment.schemes), 1), float(check.order))


def _story(
    experiment: Experiment,
    record: Record,
    check: ConvergesCheck,
    found: Mapping[str, Any],
    interval: tuple[float, ...],
    reason: str,
    expected: float,
    scheme: int,
    case: int,
) -> Story:
    levels = tuple(int(level) for level in record["level"])
    culprit = _or(found["failed_level"], -1)
    first, last = found["levels"] or (-1, -1)
    spec, model = experiment.schemes[scheme], experiment.model.definition
    columns = columns_of(record)
    limits = stability_limits(experiment, columns)[scheme]
    at = levels.index(culprit) if culprit >= 0 else None
    options = options_of(experiment, columns, scheme, case)
    p = float("nan") if at is None else float(fastest(record)[case, at])
    return Story(
        quantity=check.converges,
        reason=reason,
        order=_or(found["order"], math.nan),
        low=interval[0],
        high=interval[1],
        first=first,
        last=last,
        expected=expected,
        tolerance=check.tolerance,
        norm=check.norm,
        levels=levels,
        culprit=culprit,
        omega_dt=p,
        growth=_growth(record, SCHEMES[spec.kind], options, p, (scheme, case, at)),
        growth_of=(model.conservative, model.linear, len(model.positions)),
        limit=float(limits[case if len(limits) > 1 else 0]),
        options=options,
        is_position=check.converges in model.positions,
        scheme=spec.name,
        has_corners=has_corners(model),
        corner=_corner(experiment, record, scheme, case),
        pulse=_pulse(record, case),
        decay=_decay(record, scheme, case),
        shortest=_shortest(record, case),
        parts=parts_in_words(model, record, check.converges, scheme, case),
        kind=spec.kind,
        promised=_of_member(formal_orders(experiment, check.converges, columns), scheme, case),
        special=_of_member(special_orders(experiment, check.converges, columns), scheme, case),
        centred=_centred(experiment, check.converges, SCHEMES[spec.kind], options),
        has_promise=not is_error_part(check.converges) or is_promised(experiment, check.converges),
        cause=found["cause"],
        more=_or(found["levels_needed"], UNKNOWN),
        readable=_or(found["readable_level"], UNKNOWN),
        compensated=_or(found["readable_level_compensated"], UNKNOWN),
        cost=partial(cost_in_words, experiment),
        has_exact=has_exact(record, check.converges, scheme, case),
        orders=_orders(record, check, scheme, case),
        failures=_failures(record, scheme, case),
    )


def _or(value: T | None, otherwise: T) -> T:
    return otherwise if value is None else value


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


def _corner(experiment: Experiment, record: Record, scheme: int, case: int) -> Corner | None:
    """Return the first corner of the force that steps feel, None where there is none."""
    if "corner_switch" not in record or record["corner_switch"][scheme, case] < 0:
        return None
    time = np.asarray(record["corner_time"])[scheme, case]
    dt = np.asarray(record["dt"])[0]
    return Corner(
        words_of(experiment.model.definition, int(record["corner_switch"][scheme, case])),
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


def _centred(experiment: Experiment, quantity: str, scheme: Scheme, options: Options) -> float:
    """Return the order that a scheme would promise with a centred start; NaN where its start is not of first order."""
    if options.get("start") != "first_order":
        return math.nan
    model = experiment.model.definition
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
