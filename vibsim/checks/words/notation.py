"""How sentences write quantities and numbers, and the growth of a solution per period."""

from __future__ import annotations

import math

NEAR_ONE, ROUND_OFF = 1e-2, 1e-13
"""A factor that is nearer to 1 is written as 1 and the rest; nearer still, the rest is rounding."""


class Notation:
    """The notation of terminals and files: names as an experiment file has them, numbers as Python writes them.

    A page has another one (`vibsim.report.text.words.PAGE`).
    """

    def quantity(self, name: str) -> str:
        """Write a quantity."""
        return name

    def value(self, name: str) -> str:
        """Write the name of a number that a check can ask for."""
        return name

    def opening(self, text: str) -> str:
        """Write the beginning of a sentence."""
        return text

    def digits(self, text: str) -> str:
        """Write a number that is given in digits."""
        return text

    def number(self, value: float, digits: int = 6) -> str:
        """Write a number with up to so many significant digits."""
        return self.digits(f"{value:.{digits}g}")

    def factor(self, value: float) -> str:
        """Write a growth factor: near 1 as ``1 + 3.5e-06``, so that its growth can be read."""
        rest = value - 1.0
        if abs(rest) <= ROUND_OFF:
            return "1"
        if abs(rest) < NEAR_ONE:
            return f"1 {'+' if rest > 0 else '-'} {self.number(abs(rest), 3)}"
        return self.number(value)


PLAIN = Notation()


def vanishing_in_words(predicted: float, measured: float, notation: Notation) -> str:
    """Say by how much a scheme grows that grows at every step; empty where it does not, or nothing is known."""
    known = [value for value in (predicted, measured) if not math.isnan(value)]
    if not known or min(known) - 1.0 <= ROUND_OFF:
        return ""
    rest = known[0] - 1.0
    much = (
        f"by {notation.number(rest, 3)}"
        if rest < 1.0
        else f"by the factor {notation.number(known[0])}"
    )
    return f"; it grows {much} per period, which vanishes with dt"


def growth_in_words(
    predicted: float,
    measured: float,
    of: tuple[bool, bool, int] = (True, True, 1),
    notation: Notation = PLAIN,
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
        f"{notation.factor(value)} {word}"
        for value, word in ((predicted, theory), (measured, "measured"))
        if not math.isnan(value)
    ]
    return f": growth factor per period {', '.join(told)}" if told else ""
