"""Numbers as sentences have them, and the growth of a solution per period."""

from __future__ import annotations

import math

NEAR_ONE, ROUND_OFF = 1e-2, 1e-13
"""A factor that is nearer to 1 is written as 1 and the rest; nearer still, the rest is rounding."""


def number(value: float) -> str:
    """Write a number with up to 6 significant digits."""
    return f"{value:.6g}"


def factor_in_words(value: float) -> str:
    """Write a growth factor: near 1 as ``1 + 3.5e-06``, so that its growth can be read."""
    rest = value - 1.0
    if abs(rest) <= ROUND_OFF:
        return "1"
    if abs(rest) < NEAR_ONE:
        return f"1 {'+' if rest > 0 else '-'} {abs(rest):.3g}"
    return number(value)


def vanishing_in_words(predicted: float, measured: float) -> str:
    """Say by how much a scheme grows that grows at every step; empty where it does not, or nothing is known."""
    known = [value for value in (predicted, measured) if not math.isnan(value)]
    if not known or min(known) - 1.0 <= ROUND_OFF:
        return ""
    rest = known[0] - 1.0
    much = f"by {rest:.3g}" if rest < 1.0 else f"by the factor {number(known[0])}"
    return f"; it grows {much} per period, which vanishes with dt"


def growth_in_words(
    predicted: float, measured: float, of: tuple[bool, bool, int] = (True, True, 1)
) -> str:
    """Say what growth theory predicts and what was measured; empty where neither is known.

    The theory is of free linear oscillations without damping: of a model with damping or a force in time, and of a
    nonlinear one, that is said. Of several coordinates it is that of their fastest oscillation.

    Parameters
    ----------
    of
        Whether the model is conservative, whether it is linear, and its number of coordinates.
    """
    is_conservative, is_linear, coordinates = of
    small = "predicted" if is_linear else "predicted of small oscillations"
    if coordinates > 1:
        small = "predicted of the fastest small oscillations"
    theory = small if is_conservative else "predicted of free oscillations without damping"
    told = [
        f"{factor_in_words(value)} {word}"
        for value, word in ((predicted, theory), (measured, "measured"))
        if not math.isnan(value)
    ]
    return f": growth factor per period {', '.join(told)}" if told else ""
