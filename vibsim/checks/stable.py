"""The check ``stable``: whether schemes grow where the exact solution does not, and as fast as theory predicts.

A scheme is unstable if it overflows, if w dt exceeds its stability limit, or if it grows more than the exact solution
and refinement within the ladder does not remove the growth (``docs/verdicts.md``, Stable, conserves, equal). The growth
of Forward Euler vanishes with dt and does not count. An overflow whose time does not change on finer levels is a
property of the motion (an escape, or a formula without a value), not an instability. If the motion becomes infinite and
the levels pass through that, their speeds tell of it, and nothing is decided. At the limit itself a scheme may
be stable or grow in proportion to t: there only the measurement decides.

Beyond the limit of a linear model the growth must be the predicted one. The amplitude may follow with a delay: at a
limit two roots coincide, and a factor ``1 + 2 N`` precedes the power. So the logarithms of both growths over the whole
run may differ by the part `GROWTH_TOLERANCE` plus ln(4 + 2 N). A larger difference means that the scheme is not the one
that the theory describes.
"""

from __future__ import annotations

import math

import numpy as np

from vibsim.checks.fields import LEVEL, STATUS, Field, Measured
from vibsim.checks.notation import ROUND_OFF
from vibsim.checks.outcome import Judged
from vibsim.checks.sentences import NOT_ZERO_STABLE, Description, MemberFacts, growth_in_words
from vibsim.comparison.quantity_comparison import Compared
from vibsim.convergence.reasons import FAIL, INCONCLUSIVE, PASS, STATUS_OF, code, first_reason
from vibsim.convergence.thresholds import (
    BLOWN_UP,
    LIMIT_ROUNDING,
    RESOLVED_DECAY,
    UNEVEN_SPEEDS,
)
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER, REASON_NAMES
from vibsim.elementary import on_arrays
from vibsim.elementary.exponential import log2
from vibsim.experiment import Experiment
from vibsim.experiment.schema.checks import StableCheck
from vibsim.observe import oscillation, predicted_oscillation
from vibsim.observe.member_block import MemberBlock, by_level, stored_or_nan

FIELDS = {
    "status": STATUS,
    "reason": Field(
        "match where it is stable, mismatch where theory and growth differ, non_finite where the motion itself ends, "
        "pre_asymptotic where no level follows it",
        np.int8,
        REASON_NAMES,
    ),
    "growth": Field("growth factor of the amplitude per period"),
    "predicted_growth": Field("growth factor of the amplitude per period by theory"),
    "omega_dt": Field("highest w dt"),
    "excess": Field("largest value of the position over the largest exact one"),
    "level": LEVEL,
}

SAME_TIME = 0.15
"""Failure times within this relative distance are equal: the finer level fails at most a step earlier."""
FAR = 1000.0
"""On linear equations a scheme is unstable if its solution exceeds the theoretical growth by this factor.

Theory knows a single oscillation without damping; the square of its growth is allowed."""
GROWS = 1.01
"""Least growth factor per period of a motion that grows."""
COARSE = 1.0
"""Step over the inverse frequency of small oscillations above which speeds depend on the step."""
GROWTH_TOLERANCE = 0.1
"""Largest relative deviation of the logarithm of a growth from the predicted one."""


def measure(block: MemberBlock, compared: Compared, check: StableCheck) -> Measured:
    """Return the measured fields of a check."""
    level = block.grid.levels[-1] if check.level is None else check.level
    index = block.grid.levels.index(level)
    w_dt = np.broadcast_to(block.fastest[:, index], block.shape)
    limit, growth, broken = block.stability_limit, block.growth, block.failed[..., index]
    exceeds_limit = w_dt > limit * (1.0 + LIMIT_ROUNDING)
    at_limit = _is_at_limit(w_dt, limit)
    grown = (growth[..., index] > BLOWN_UP) & (at_limit | ~_is_removed(growth, index))
    escaped = broken & ~exceeds_limit & _fail_at_same_time(block)
    measured = oscillation.growth_of_motion(block, level)
    predicted = predicted_oscillation.dominant_growth(block, level)
    contradicted = ~broken & predicted_oscillation.is_simple(block) & exceeds_limit
    contradicted &= _differs(block, index, measured, predicted)
    exceeds_theory = _is_beyond_theory(block, index, predicted)
    unstable = (broken & ~escaped) | exceeds_limit | grown | exceeds_theory
    cases = [
        (contradicted, "mismatch"),
        (unstable, "unstable"),
        (escaped, "non_finite"),
        (_meets_a_pole(block), "pre_asymptotic"),
    ]
    reason = first_reason(cases, "match")
    return {
        "status": STATUS_OF[reason],
        "reason": reason,
        "growth": measured,
        "predicted_growth": predicted,
        "omega_dt": w_dt,
        "excess": growth[..., index],
        "level": level,
    }


def _is_removed(growth: Floats, index: int) -> Flags:
    """Say where refinement to the next finer level, or at the finest level from the previous one, halves the growth."""
    if growth.shape[-1] == 1:
        return np.zeros(growth.shape[:-1], dtype=bool)
    coarse = min(index, growth.shape[-1] - 2)
    return np.asarray(growth[..., coarse + 1] < 0.5 * growth[..., coarse])


def _is_beyond_theory(block: MemberBlock, index: int, growth_per_period: Floats) -> Flags:
    """Say where linear equations grow far more than the growth per period allows, shape (scheme, case)."""
    if not (block.model.linear or block.model.superposed):
        return np.zeros(block.shape, dtype=bool)
    periods = block.fastest[:, index] * block.grid.steps[index] / (2.0 * np.pi)
    with np.errstate(divide="ignore", invalid="ignore"):
        allowed = np.fmax(2.0 * on_arrays.log(growth_per_period) * periods, 0.0)
        return np.asarray(on_arrays.log(block.growth[..., index] / FAR) > allowed)


def _fail_at_same_time(block: MemberBlock) -> Flags:
    """Say where the two finest levels broke down at the same time, as finer ones would, shape (scheme, case)."""
    finest = [block.records[level] for level in block.grid.levels[-2:]]
    if len(finest) == 1 or any("failure_time" not in record for record in finest):
        return np.zeros(block.shape, dtype=bool)
    previous, last = (np.asarray(record["failure_time"], dtype=float) for record in finest)
    is_same = np.abs(previous - last) <= SAME_TIME * previous
    return np.asarray(np.all(block.failed[..., -2:], axis=-1) & is_same)


def _meets_a_pole(block: MemberBlock) -> Flags:
    """Say where the largest speeds of the finest levels tell of an infinite force, shape (scheme, case).

    They differ, and do not fall with the step, as the growth of a scheme does. With an exact solution there is none,
    and speeds of levels that broke down, or are too coarse for the motion, tell nothing.
    """
    names = [f"{velocity}_{end}" for velocity in block.model.velocities for end in ("min", "max")]
    levels = block.grid.levels[-LEVELS_OF_AN_ORDER:]
    rows = [[stored_or_nan(block.records[n], name, block.shape) for name in names] for n in levels]
    speeds = by_level([np.max(np.abs(np.stack(row)), axis=0) for row in rows])
    count = len(levels)
    is_coarse = np.any(block.omega_dt[:, -count:] > COARSE, axis=-1)
    is_coarse = is_coarse | (block.decay * block.group.end / block.grid.steps[-1] > RESOLVED_DECAY)
    is_used = ~np.any(block.failed[..., -count:], axis=-1) & np.isnan(block.growth[..., -1])
    with np.errstate(invalid="ignore", divide="ignore"):
        is_uneven = np.max(speeds, axis=-1) > UNEVEN_SPEEDS * np.min(speeds, axis=-1)
        falls = np.all(np.diff(speeds, axis=-1) < 0.0, axis=-1)
    return np.asarray(is_used & is_uneven & ~falls & ~is_coarse & ~block.adaptive[:, None])


def _differs(block: MemberBlock, index: int, measured: Floats, expected: Floats) -> Flags:
    periods = predicted_oscillation.natural_frequency(block) * block.group.end / (2.0 * np.pi)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.abs(on_arrays.log(measured) - on_arrays.log(expected)) * periods
        predicted_log = on_arrays.log(expected) * periods
    delay = on_arrays.log(4.0 + 2.0 * block.grid.steps[index])
    return np.asarray(distance > GROWTH_TOLERANCE * np.abs(predicted_log) + delay)


def judge(experiment: Experiment, record: Record, check: StableCheck, facts: Measured) -> Judged:
    """Compare the stability of schemes with the expectation of a check."""
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.abs(on_arrays.log(facts["growth"]))
    as_expected = facts["reason"] == code("match" if check.stable else "unstable")
    away = np.where(np.isnan(size), np.inf, size)
    is_open = facts["reason"] == code("pre_asymptotic")
    status = np.where(as_expected, PASS, np.where(is_open, INCONCLUSIVE, FAIL))
    return Judged(facts["reason"], away, status)


def describe(f: MemberFacts, check: StableCheck) -> Description:
    """Say whether a scheme is stable at the level of a check, and why."""
    level, w_dt, failed = f.fact("level"), f.fact("omega_dt"), f.failed_at
    number = f.notation.number
    time = "" if math.isnan(failed) else number(failed, 4)
    if f.reason == "non_finite":
        return Description(
            f"Scheme {f.scheme_name} produced a number that is not finite or too large at level "
            f"{level}{f', at t = {time}' if time else ''}, and the finest levels did so at the same time. Either "
            "the motion itself escapes or a formula has no finite value, so this says nothing about stability.",
            f"End the time interval (`time: end`){f' before t = {time}' if time else ''}, or check the formulas of "
            "`model:`.",
        )
    if f.reason == "pre_asymptotic":
        factor = f.speeds_differ
        by = f" by a factor of {number(factor, 2)}" if math.isfinite(factor) else ""
        return Description(
            f"The largest speeds of the finest levels of scheme {f.scheme_name} differ{by}, as where a force becomes "
            "infinite. No level follows a motion through such a point, so this says nothing about stability.",
            "End the time interval (`time: end`) before the force becomes infinite, or take finer `levels:` if the "
            "step is too coarse.",
        )
    factors = f.fact("predicted_growth"), f.fact("growth")
    brief = f"{'stable' if f.reason == 'match' else 'unstable'} at level {level}"
    brief += f", where w dt = {number(w_dt, 4)}" if math.isfinite(w_dt) else ""
    sentence = f"Scheme {f.scheme_name} is {brief}."
    if f.reason == "unstable" and not time and f.model.linear and _is_at_limit(w_dt, _limit(f)):
        sentence += " This is its limit, at which the amplitude grows in proportion to the time."
    else:
        sentence += growth_in_words(f, *factors)
    if f.reason == "unstable" and (excess := f.fact("excess")) > FAR:
        sentence += f" The solution becomes {number(excess, 2)} times as large as the exact one."
    if f.reason == "match" and not f.model.conservative and factors[1] > GROWS:
        sentence += (
            " The motion itself grows: `stable` is about the scheme, `max_abs` about the motion."
        )
    if f.reason == "match" and _limit(f) == 0.0:
        # a scheme that grows at every step has no limit of its own
        sentence += _vanishing(f, factors)
    if time:
        sentence += f" It produced a number that is not finite or too large at t = {time}."
    if f.reason == "mismatch":
        sentence += " Prediction and measurement disagree, so this is not the scheme that the theory describes."
    return Description(sentence, _advice(f, level, w_dt, time), brief)


def _is_at_limit(w_dt: Floats, limit: Floats) -> Flags:
    """Say where w dt is at the stability limit."""
    low, high = limit * (1.0 - LIMIT_ROUNDING), limit * (1.0 + LIMIT_ROUNDING)
    return np.asarray((w_dt >= low) & (w_dt <= high))


def _limit(f: MemberFacts) -> Floats:
    """Return the limit of w dt of a scheme: 0 if it grows at every step, NaN if the record has none."""
    known = "stability_limit" in f.record
    return np.asarray(f.record["stability_limit"][f.scheme, f.case] if known else np.nan)


def _vanishing(f: MemberFacts, factors: tuple[float, float]) -> str:
    """Say by how much a scheme grows that is unstable at any step; empty if the growth is 0 or unknown."""
    known = [value for value in factors if not math.isnan(value)]
    if not known or min(known) - 1.0 <= ROUND_OFF:
        return ""
    number = f.notation.number
    is_small = known[0] < 2.0
    much = f"of {number(known[0] - 1.0, 3)}" if is_small else f"by the factor {number(known[0])}"
    return f" This growth {much} per period vanishes with dt."


def first_within(limit: float, level: int, omega_dt: float) -> int:
    """Return the coarsest level within a stability limit, from a level beyond it and its w dt."""
    return level + math.ceil(log2(omega_dt / limit) - LIMIT_ROUNDING)


def _advice(f: MemberFacts, level: int, w_dt: float, time: str) -> str:
    if f.reason == "match":
        return "Set `stable: true`, or take coarser `levels:` if the scheme has a limit (w dt beyond it)."
    if f.reason == "mismatch":
        return (
            "Take another `kind:` in `schemes:`, or look for an error in this one, which does not grow as its own "
            "theory predicts."
        )
    if not f.is_zero_stable:
        return NOT_ZERO_STABLE.format(scheme=f.scheme_name)
    limit = f.stability_limit
    if math.isfinite(limit) and math.isfinite(w_dt) and w_dt > limit:
        return (
            f"Take finer `levels:`, from {first_within(limit, level, w_dt)} on (w dt within the limit "
            f"{f.notation.number(limit)}{f.of_limit}), or correct `stable:`."
        )
    if time:
        return (
            f"End the time interval (`time: end`) before t = {time} if the motion itself escapes there, take "
            "finer `levels:` if it does not, or correct `stable:`."
        )
    return "Take finer `levels:`, shorten `time: end`, or correct `stable:`."
