"""What a ``converges`` check measured, compared with what was expected of every scheme and member."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim import theory
from vibsim.analysis.advice import advise
from vibsim.analysis.causes import CAUSES
from vibsim.analysis.corners import is_on_a_point, words_of
from vibsim.analysis.costs import cost_in_words
from vibsim.analysis.outcome import FAIL, INCONCLUSIVE, PASS, Orders, Outcome
from vibsim.analysis.part import fastest
from vibsim.analysis.part_promise import is_promised
from vibsim.analysis.parts_told import parts_in_words
from vibsim.analysis.promise import (
    Columns,
    columns_of,
    formal_orders,
    has_corners,
    options_of,
    stability_limits,
)
from vibsim.analysis.seen import has_exact
from vibsim.analysis.sentences import tell
from vibsim.analysis.story import Corner, Story
from vibsim.models.error_parts import is_error_part, whole_of
from vibsim.record import Record
from vibsim.schemes import SCHEMES, Options, Scheme
from vibsim.spec.about import schemes_of
from vibsim.vocabulary import REASON_NAMES, STATUSES

if TYPE_CHECKING:
    from vibsim.spec import Experiment
    from vibsim.spec.checks import ConvergesCheck

Floats = NDArray[np.float64]


def converges(experiment: Experiment, record: Record, check: ConvergesCheck, index: int) -> Outcome:
    """Compare the verdict on a quantity, of every scheme and member, with the expected one.

    Parameters
    ----------
    record
        Convergence Record.
    index
        Number of the check in it.
    """
    of, status, reason = (
        Orders(
            *(
                record[f"check_{name}"][index]
                for name in ("value", "low", "high", "first", "last", "culprit")
            )
        ),
        record["check_status"][index],
        record["check_reason"][index],
    )
    order = expected_order(experiment, record, check)
    names = record.words("scheme")
    chosen = list(schemes_of(experiment, check))

    def story(scheme: int, case: int) -> Story:
        expected = order[scheme, case if order.shape[1] > 1 else 0]
        word = REASON_NAMES[int(reason[scheme, case])]
        told = _story(experiment, record, check, of, word, float(expected), scheme, case)
        return replace(told, **_foreseen(record, index, scheme, case))

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
        away=np.abs(of.order - order),
        expected=words,
        expects_pass=expect.status == "PASS",
        quantity=check.converges,
        tell=lambda scheme, case: tell(story(scheme, case)),
        advise=lambda scheme, case: advise(story(scheme, case)),
        orders=of,
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
    found: Orders,
    reason: str,
    expected: float,
    scheme: int,
    case: int,
) -> Story:
    levels = tuple(int(level) for level in record["level"])
    culprit = int(found.culprit[scheme, case])
    spec, model = experiment.schemes[scheme], experiment.model.definition
    columns = columns_of(record)
    limits = stability_limits(experiment, columns)[scheme]
    at = levels.index(culprit) if culprit >= 0 else None
    options = options_of(experiment, columns, scheme, case)
    p = float("nan") if at is None else float(fastest(record)[case, at])
    return Story(
        quantity=check.converges,
        reason=reason,
        order=float(found.order[scheme, case]),
        low=float(found.low[scheme, case]),
        high=float(found.high[scheme, case]),
        first=int(found.first[scheme, case]),
        last=int(found.last[scheme, case]),
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
        parts=parts_in_words(model, record, check.converges, scheme, case),
        kind=spec.kind,
        promised=_promised(experiment, check.converges, columns, scheme, case),
        centred=_centred(experiment, check.converges, SCHEMES[spec.kind], options),
        has_promise=not is_error_part(check.converges) or is_promised(experiment, check.converges),
        cost=partial(cost_in_words, experiment),
        has_exact=has_exact(record, check.converges, scheme, case),
        orders=_orders(record, check, scheme, case),
        failures=_failures(record, scheme, case),
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


def _promised(
    experiment: Experiment, quantity: str, columns: Columns, scheme: int, case: int
) -> float:
    """Return the order that the scheme of a member promises."""
    orders = formal_orders(experiment, quantity, columns)[scheme]
    return float(orders[case if len(orders) > 1 else 0])


def _centred(experiment: Experiment, quantity: str, scheme: Scheme, options: Options) -> float:
    """Return the order that a scheme would promise with a centred start; NaN where its start is not of first order."""
    if options.get("start") != "first_order":
        return math.nan
    model = experiment.model.definition
    return float(scheme.formal_order(whole_of(quantity), model, {**options, "start": "centred"}))


def _foreseen(record: Record, index: int, scheme: int, case: int) -> dict[str, Any]:
    """Return what would settle the verdict on a member, or explain it."""
    found = {
        name: int(record[f"check_{name}"][index, scheme, case])
        for name in ("more", "readable", "compensated", "cause")
    }
    return {**found, "cause": CAUSES[found["cause"]]}


def _growth(
    record: Record, scheme: Scheme, options: Options, p: float, place: tuple[int, int, int | None]
) -> tuple[float, float]:
    """Return the growth factor per period at w dt = p, predicted and measured; NaN where it is not known."""
    if math.isnan(p) or scheme.adaptive:
        return math.nan, math.nan
    predicted = float(theory.dominant(scheme.stepper(options), p)[0])
    measured = "measured_growth" in record
    return predicted, float(record["measured_growth"][place]) if measured else math.nan
