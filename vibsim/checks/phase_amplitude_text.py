"""What the parts of a position's error say of a verdict on the position: which has less than the expected order."""

from __future__ import annotations

import math

from vibsim.checks.sentences import Found
from vibsim.convergence.reasons import INCONCLUSIVE
from vibsim.core.vocabulary import AMPLITUDE, PHASE, TYPICAL_NORM

APART = 0.5
"""Orders that differ by less are the same."""
NEAR = 0.125
"""How near to a whole or half order a stated one must be to be reported."""
FROM_THE_START = 0.5
"""A shift is there from the start where that of the first step is at least this part of the largest."""
NO_PART = (
    "could not be measured: each level must oscillate with at least 6 common times in a period, and be like the true "
    "motion but for a shift in time and a factor"
)
"""Why a part of an error is not there, behind its name; common times are those of the coarsest level."""
PART_ADVICE = (
    "Start `levels:` finer, and use a `time: end` of a period or more. If the motion does not oscillate, check the "
    "position itself."
)
NAMES = {1.0: "first", 2.0: "second", 3.0: "third", 4.0: "fourth", 5.0: "fifth", 6.0: "sixth"}


def parts_in_words(f: Found, quantity: str, expected: float) -> str:
    """Say of which order phase and amplitude are where one is below the expected order and the other is another one.

    Empty where that is not so or not known, and for a quantity that is no state.
    """
    model, record, place = f.model, f.record, (f.scheme, f.case)
    known = dict(zip((*model.positions, *model.velocities), model.positions * 2, strict=True))
    position = known.get(quantity, "")
    # a large run keeps only the part that a check asks for
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
    """Tell two orders apart, and where the lower one comes from.

    Parameters
    ----------
    phase, amplitude
        Orders; NaN where none is stated.
    share
        Part of the phase error that is there from the start.
    expected
        The order that the verdict expects: a part of this order or a higher one is as it should be.
    whose
        Of which position they are, in words; empty where the verdict is on that position.
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
