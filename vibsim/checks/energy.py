"""The check ``conserves``: how the error of the energy grows with time."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np

from vibsim.apriori.formal_orders import formal_orders
from vibsim.checks.fields import LEVEL, MOTION, Field, Measured
from vibsim.checks.outcome import Judged
from vibsim.checks.sentences import MOVE, NOT_FINITE, NOTHING_MOVES, Description, MemberFacts
from vibsim.comparison.quantity_comparison import Compared
from vibsim.convergence.reasons import first_reason
from vibsim.convergence.thresholds import ABOVE_ROUND_OFF
from vibsim.core.array_types import Flags
from vibsim.core.record import Record
from vibsim.core.vocabulary import DRIFTS
from vibsim.experiment import Experiment
from vibsim.experiment.schema.checks import ConservesCheck, Drift
from vibsim.experiment.sweep_columns import recorded_columns
from vibsim.observe.energy_drift import drift_at
from vibsim.observe.member_block import MemberBlock
from vibsim.observe.thresholds import LEAST_PERIODS, LEAST_SAMPLES

FIELDS = {
    "drift": Field("how the energy error grows", np.int8, DRIFTS),
    "drift_rate": Field("rate of the drift per period, as a part of the energy at the start"),
    "drift_power": Field("power of time with which the energy error grows"),
    "energy_error": Field("largest energy error, as a part of the energy at the start"),
    "motion": MOTION,
    "level": LEVEL,
    "window_means": Field(
        "means of the largest energy error so far over [T/8, T/4], [T/4, T/2] and [T/2, T], in the unit of the energy",
        dims=("scheme", "case", "window"),
        of_figure=True,
    ),
    "round_off": Field(
        "largest energy error that is taken for round-off, in the unit of the energy",
        of_figure=True,
    ),
}

EXPECTED_DRIFTS = get_args(Drift)
"""What `drift:` may be."""
_DRIFTS = {
    "none": "is round-off",
    "bounded": "is bounded and its largest value no longer grows",
    "linear": "grows linearly with time",
    "quadratic": "grows quadratically with time",
    "exponential": "shows that the energy grows exponentially",
    "unclear": "exceeds round-off, but this run does not show how it grows",
}
_BRIEF = {
    "none": "round-off", "bounded": "bounded", "linear": "grows like t", "quadratic": "grows like t²",
    "exponential": "exponential", "unclear": "growth not known",
}  # fmt: skip
_RATES = {
    "linear": ", by {} of the energy per period",
    "quadratic": ", by {} of the energy per period squared",
    "exponential": ", by the factor exp({}) per period",
}


def measure(block: MemberBlock, compared: Compared, check: ConservesCheck) -> Measured:
    """Return the measured fields of a check."""
    level = block.grid.levels[-1] if check.level is None else check.level
    drift = drift_at(block, level, check.about or "")
    return {
        "drift": drift.kind,
        "drift_rate": drift.rate,
        "drift_power": drift.power,
        "energy_error": drift.largest,
        "motion": lies_still(block, level),
        "level": level,
        "window_means": drift.means,
        "round_off": drift.round_off,
    }


def lies_still(block: MemberBlock, level: int) -> Flags:
    """Say where no position moves by more than round-off at a level, shape (scheme, case)."""
    record, still = block.records[level], np.ones(block.shape, dtype=bool)
    floor = ABOVE_ROUND_OFF * block.relative_floor[..., block.grid.levels.index(level)]
    for name in block.model.positions:
        if f"{name}_min" not in record:
            return np.zeros(block.shape, dtype=bool)
        low, high = (np.asarray(record[f"{name}_{end}"], dtype=float) for end in ("min", "max"))
        with np.errstate(invalid="ignore"):
            still &= high - low <= floor * np.maximum(np.abs(low), np.abs(high))
    return still


def judge(experiment: Experiment, record: Record, check: ConservesCheck, facts: Measured) -> Judged:
    """Compare the growth of the energy error with the expectation of a check."""
    kind, largest, still = facts["drift"], facts["energy_error"], facts["motion"] != 0
    broken = record["status"][..., record.place("level", int(facts["level"]))] != 0
    is_none, unclear = (kind == DRIFTS.index(name) for name in ("none", "unclear"))
    is_expected = kind == DRIFTS.index(check.drift)
    if check.drift == "bounded":
        # a conserved energy is bounded, too
        is_expected |= is_none
    # an error hidden by round-off may grow in any way, unless theory says that there is none
    has_error = np.isfinite(formal_orders(experiment, check.about or "", recorded_columns(record)))
    cases = [
        (broken, "non_finite"),
        (np.isnan(largest) & unclear, "not_applicable"),
        (still & is_none, "not_applicable"),
        # an error above round-off contradicts `none` in any run
        (unclear & (check.drift != "none"), "pre_asymptotic"),
        (is_expected, "match"),
        (is_none & has_error, "round_off"),
    ]
    reason = first_reason(cases, "mismatch")
    return Judged(reason, largest)


def describe(f: MemberFacts, check: ConservesCheck) -> Description:
    """Say how the energy error grows with time, and what to change if the check expects otherwise."""
    size, rate, drift = f.fact("energy_error"), f.fact("drift_rate"), f.word("drift")
    number, name = f.notation.number, f.notation.value(check.conserves)
    expects = f"The check expects `drift: {check.drift}`."
    match f.reason:
        case "non_finite":
            return Description(NOT_FINITE[0].format(name), NOT_FINITE[1])
        case "not_applicable" if f.word("motion") == "rests":
            sentence = f"{NOTHING_MOVES.format('the energy')}, and there is nothing to conserve."
            return Description(sentence, MOVE)
        case "not_applicable":
            return Description(
                f"{name} does not exist here, or was not stored.",
                f"Name `schemes:` that have {name}, or ask for `conserves: energy`.",
            )
        case "round_off":
            return Description(
                f"The error of {name} is at most {number(size, 4)} of the energy, which may be round-off, so its "
                f"growth cannot be seen. {expects}",
                "Take a coarser `level:`, whose error is larger than round-off, lengthen the run (`time: end`), or set "
                "`drift: none`, which is what this level shows.",
            )
    brief = sentence = _DRIFTS[drift]
    if drift == "exponential" and rate < 0:
        sentence = "shows that the energy decays exponentially"
    if rate and math.isfinite(rate):
        sentence += _RATES.get(drift, "").format(number(rate, 4))
    most = "The energy is 0"
    if math.isfinite(size):
        most = f"The error is at most {number(size, 4)} of the energy"
        brief = f"{_BRIEF[drift]}, at most {number(size, 4)} of the energy"
    sentence = f"The error of {name} {sentence}. {most}. {expects}"
    return Description(sentence, _advice(f, drift, check), brief)


def _advice(f: MemberFacts, drift: str, check: ConservesCheck) -> str:
    if f.reason == "pre_asymptotic":
        longer = "Lengthen the run (`time: end`), or store more of it (`samples: all`)."
        until = ""
        if f.experiment.members == 1:
            frequency = float(f.model.natural_frequency(f.experiment.model.parameters))
            least = LEAST_PERIODS * 2.0 * math.pi / frequency if frequency > 0.0 else 0.0
            if 0.0 < least < f.experiment.time.end:
                return longer
            until = f" (until t = {f.notation.number(least, 3)} here)" if least else ""
        return (
            f"{longer} To show a drift takes at least four periods of the slowest small oscillation{until}, and "
            f"{LEAST_SAMPLES} stored samples."
        )
    other = "leave the check out (`checks:`)"
    if drift in EXPECTED_DRIFTS:
        if EXPECTED_DRIFTS.index(drift) < EXPECTED_DRIFTS.index(check.drift):
            return f"Set `drift: {drift}`, which was measured. The energy is conserved better than the check asks for."
        other = f"set `drift: {drift}`, which was measured"
    return (
        f"Take a scheme that conserves the energy better (`schemes:`), or {other}. Finer `levels:` make the error "
        "smaller, but do not change how it grows."
    )
