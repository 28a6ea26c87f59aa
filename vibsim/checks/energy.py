"""The check ``conserves``: how the error of the energy grows with time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from vibsim.apriori.formal_orders import columns_of, formal_orders
from vibsim.checks.fields import Field, facts, measured
from vibsim.checks.of_schemes import (
    MATCH,
    MISMATCH,
    MOTIONS,
    MOVE,
    NON_FINITE,
    NOT_APPLICABLE,
    NOTHING_MOVES,
    PRE_ASYMPTOTIC,
    ROUND_OFF,
    by_reason,
    level_of,
    lies_still,
    place_of,
)
from vibsim.checks.outcome import Outcome
from vibsim.core.record import Record
from vibsim.core.vocabulary import DRIFTS, REASON_NAMES
from vibsim.experiment.schema.checks import Drift
from vibsim.observe.member_block import Part
from vibsim.observe.member_energy_drift import drift_at

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import ConservesCheck

KNOWN_DRIFTS = get_args(Drift)
"""What `drift:` may be."""

FIELDS = {
    "drift": Field("how the energy error grows", np.int8, DRIFTS),
    "drift_rate": Field("rate of the drift per period, as a part of the energy at the start"),
    "drift_power": Field("power of time with which the energy error grows"),
    "energy_error": Field("largest energy error, as a part of the energy at the start"),
    "motion": Field("whether anything moves", np.int8, MOTIONS),
    "level": Field("level", np.int16, dims=()),
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


def measure(part: Part, check: ConservesCheck) -> Mapping[str, Any]:
    """Return what a check measures."""
    level = level_of(part, check)
    found = drift_at(part, level, check.about or "")
    return {
        "drift": found.kind,
        "drift_rate": found.rate,
        "drift_power": found.power,
        "energy_error": found.largest,
        "motion": lies_still(part, level),
        "level": level,
        "window_means": found.means,
        "round_off": found.round_off,
    }


def judge(experiment: Experiment, record: Record, check: ConservesCheck, id_: str) -> Outcome:
    """Compare how the energy error grows with what a check expects."""
    kind, largest, rate = (
        measured(record, id_, field) for field in ("drift", "energy_error", "drift_rate")
    )
    still = measured(record, id_, "motion") != 0
    broken = record["status"][..., place_of(record, int(measured(record, id_, "level")))] != 0
    wanted = {DRIFTS.index(check.drift)}
    if check.drift == "bounded":
        # what is conserved is bounded too
        wanted.add(DRIFTS.index("none"))
    unclear = kind == DRIFTS.index("unclear")
    # an error that theory has, lost in round-off, may grow in any way; one that it has not does not grow
    has_error = np.isfinite(formal_orders(experiment, check.about or "", columns_of(record)))
    lost = (kind == DRIFTS.index("none")) & has_error
    masks = [
        (broken, NON_FINITE),
        (np.isnan(largest) & unclear, NOT_APPLICABLE),
        (still & (kind == DRIFTS.index("none")), NOT_APPLICABLE),
        # an error above round-off is not none, however short the run
        (unclear & (check.drift != "none"), PRE_ASYMPTOTIC),
        (np.isin(kind, list(wanted)), MATCH),
        (lost, ROUND_OFF),
    ]
    reason = np.select([mask for mask, _ in masks], [code for _, code in masks], MISMATCH)

    def tell(scheme: int, case: int) -> str:
        if reason[scheme, case] == NON_FINITE:
            return f"{check.conserves} means nothing here: the calculation met a number that is not finite."
        if reason[scheme, case] == NOT_APPLICABLE and still[scheme, case]:
            return f"{NOTHING_MOVES.format('the energy')}, and there is nothing to conserve."
        if reason[scheme, case] == NOT_APPLICABLE:
            return f"{check.conserves} does not exist here, or was not stored."
        if reason[scheme, case] == ROUND_OFF:
            return (
                f"The error of {check.conserves} is at most {largest[scheme, case]:.4g} of the energy, which round-off "
                f"may have made: how it grows cannot be told. Expected is: {check.drift}."
            )
        size, per = float(largest[scheme, case]), float(rate[scheme, case])
        told = _DRIFT_WORDS[DRIFTS[int(kind[scheme, case])]]
        if told == _DRIFT_WORDS["exponential"] and per < 0:
            told = "is that of an energy that decays exponentially"
        speed = (
            "" if not per else f", {_RATES.get(DRIFTS[int(kind[scheme, case])], '')}".format(per)
        )
        most = f"it is at most {size:.4g} of the energy" if np.isfinite(size) else "the energy is 0"
        return (
            f"The error of {check.conserves} {told}{speed if np.isfinite(per) else ''}; {most}. "
            f"Expected is: {check.drift}."
        )

    def advise(scheme: int, case: int) -> str:
        if reason[scheme, case] == NOT_APPLICABLE and still[scheme, case]:
            return MOVE
        found = DRIFTS[int(kind[scheme, case])]
        return _advise(REASON_NAMES[int(reason[scheme, case])], found, check.conserves, check.drift)

    return by_reason(
        experiment,
        record,
        check,
        facts(record, id_, FIELDS),
        reason,
        largest,
        check.drift,
        tell,
        largest,
        advise,
    )


_DRIFT_WORDS = {
    "none": "is round-off",
    "bounded": "is bounded: its largest value no longer grows",
    "linear": "grows in proportion to the time",
    "quadratic": "grows in proportion to the square of the time",
    "exponential": "grows exponentially with time",
    "unclear": "is more than round-off, and grows in a way that this run does not show",
}
_RATES = {
    "linear": "by {:.4g} of the energy per period",
    "quadratic": "by {:.4g} of the energy per period squared",
    "exponential": "the energy by the factor exp({:.4g}) per period",
}


def _advise(reason: str, drift: str, quantity: str, expected: str) -> str:
    """Say what to change where the energy does not drift as a check expects.

    Parameters
    ----------
    drift, expected
        The kind of drift that was measured, and the one that the check asks for.
    """
    if reason == "not_applicable":
        return f"Name `schemes:` that have {quantity}, or ask for `conserves: energy`."
    if reason == "pre_asymptotic":
        return "Lengthen the run (`time: end`), or store more of it (`samples: all`): it is too short to show a drift."
    if reason == "round_off":
        return (
            "Take a coarser `level:`, whose error is larger than round-off, lengthen the run (`time: end`), or set "
            "`drift: none`, which is what this level shows."
        )
    if drift in KNOWN_DRIFTS and KNOWN_DRIFTS.index(drift) < KNOWN_DRIFTS.index(expected):
        return f"Set `drift: {drift}`, which was measured: the energy is conserved better than the check asks for."
    other = (
        f"set `drift: {drift}`, which was measured"
        if drift in KNOWN_DRIFTS
        else "leave the check out (`checks:`)"
    )
    return (
        f"Take a scheme that conserves the energy better (`schemes:`), or {other}: finer `levels:` make the error "
        "smaller, but do not change how it grows."
    )
