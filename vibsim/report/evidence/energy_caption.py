"""The caption of a drift: the numbers by which it was named, and what the dashed line of its picture is."""

from __future__ import annotations

import math

import numpy as np

from vibsim.observe.thresholds import LEAST_PERIODS, LEAST_SAMPLES, STILL
from vibsim.report.evidence.energy_error import NAMES, POWERS, EnergyError
from vibsim.report.evidence.frame import brief, short

TOO_SHORT = f"That is too short a run to name a drift: {LEAST_PERIODS:g} periods and {LEAST_SAMPLES} times are needed."


def told(found: EnergyError) -> str:
    """Say by which number the drift was named."""
    third, second, first = found.means
    numbers = [f"{n} = {short(float(m))}" for n, m in zip(NAMES, found.means, strict=True)]
    bars = f"the largest energy error so far has the means (bars) {', '.join(numbers)}."
    if found.is_round_off:
        return (
            f"the largest energy error, {brief(found.most)}, is within the round-off of this run, "
            f"{brief(found.round_off)}."
        )
    if found.is_broken:
        return "the largest energy error so far; it ends where the run breaks down."
    rise, before = first - second, second - third
    if found.kind == "bounded":
        part = 100.0 * float(rise) / found.most
        how = "no growth" if part <= 100.0 * STILL else "it creeps ever more slowly"
        return f"{bars} m₁ is above m₂ by {brief(part)} % of the largest error: {how}."
    if found.kind == "exponential":
        factor = short(float(np.exp(found.rate)))
        return f"{bars} The energy itself changes by the factor {factor} per period: exponential."
    if math.isnan(found.power):
        return f"{bars} {TOO_SHORT}"
    law = f"(m₁ − m₂)/(m₂ − m₃) = {short(float(rise / before)) if before else '∞'}"
    if found.kind in POWERS:
        power = POWERS[found.kind]
        return f"{bars} {law}; a drift like {'t²' if power == 2 else 't'} has {2**power}."
    return f"{bars} {law}, which is that of no drift that has a name."


def dashed(found: EnergyError) -> str:
    """Say what the dashed line is."""
    if found.is_broken:
        return ""
    if found.has_border:
        return "Dashed: the most that is taken for round-off."
    if found.asked == "bounded":
        return "Dashed: m₂, above which a bounded error does not rise."
    return f"Dashed: a drift in proportion to {'t²' if found.asked == 'quadratic' else 't'} through m₂ and m₁."
