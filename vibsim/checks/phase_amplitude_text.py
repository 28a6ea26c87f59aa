"""Which part of the error of a position, phase or amplitude, has less than the expected order, in words."""

from __future__ import annotations

import math

from vibsim.checks.sentences import MemberFacts
from vibsim.convergence.reasons import INCONCLUSIVE
from vibsim.core.vocabulary import AMPLITUDE, PHASE, TYPICAL_NORM

APART = 0.5
"""Orders that differ by less are equal."""
NEAR = 0.125
"""Largest distance of a reported order from a multiple of 1/2."""
FROM_THE_START = 0.5
"""A shift exists from the start if that of the first step is at least this part of the largest one."""
NO_PART = (
    "could not be measured: each level must oscillate with at least 6 common times in a period, and be like the true "
    "motion but for a shift in time and a factor"
)
"""Why a part of an error is missing, as the end of a sentence; common times are those of the coarsest level."""
PART_ADVICE = (
    "Start `levels:` finer, and use a `time: end` of a period or more. If the motion does not oscillate, check the "
    "position itself."
)
NAMES = {1.0: "first", 2.0: "second", 3.0: "third", 4.0: "fourth", 5.0: "fifth", 6.0: "sixth"}


def parts_in_words(f: MemberFacts, quantity: str, expected: float) -> str:
    """State the orders of phase and amplitude if they differ and the lower one is below the expected order.

    Empty otherwise, and for a quantity that is not a state.
    """
    model, record, place = f.model, f.record, (f.scheme, f.case)
    known = dict(zip((*model.positions, *model.velocities), model.positions * 2, strict=True))
    position = known.get(quantity, "")
    # a large run stores only the parts that checks use
    if any(f"{position}{end}_order" not in record for end in (PHASE, AMPLITUDE)):
        return ""
    norm = record.words("norm").index(TYPICAL_NORM)
    phase, amplitude = (
        float(record[f"{position}{end}_order"][*place, norm]) for end in (PHASE, AMPLITUDE)
    )
    lower = AMPLITUDE if amplitude < phase else PHASE
    if record[f"{position}{lower}_status"][place] == INCONCLUSIVE:
        return ""
    share = float(record[f"{position}{PHASE}_at_start"][place])
    whose = "" if quantity == position else f" of {f.notation.quantity(position)}"
    # an order that is too high may be that of one part alone, whatever was expected
    least = math.inf if f.reason == "order_high" else expected
    return sentence(phase, amplitude, share, least, whose)


def sentence(phase: float, amplitude: float, share: float, expected: float, whose: str = "") -> str:
    """State the orders of both parts, and the cause of the lower one.

    Parameters
    ----------
    phase, amplitude
        Orders; NaN if unknown.
    share
        Part of the phase error that exists from the start.
    expected
        The expected order; parts of this order or a higher one are correct.
    whose
        The position in words; empty if the verdict is on that position.
    """
    if not math.isfinite(phase + amplitude) or abs(phase - amplitude) < APART:
        return ""
    halves = [round(2 * order) / 2 for order in (phase, amplitude)]
    if any(
        abs(order - half) > NEAR or order <= 2 * NEAR
        for order, half in zip((phase, amplitude), halves, strict=True)
    ):
        return ""
    if min(halves) >= expected:
        return ""
    of_phase, of_amplitude = (
        f"{NAMES[half]} order" if half in NAMES else f"order {half:g}" for half in halves
    )
    both = f" The phase{whose} is of {of_phase}, the amplitude of {of_amplitude}"
    if amplitude < phase:
        return f"{both}. The error is one of the amplitude."
    if share >= FROM_THE_START:
        return f"{both}. The error is a shift in time from the first step on, so the start is of {of_phase}."
    return f"{both}. The error is a shift in time that grows, so the frequency is of {of_phase}."
