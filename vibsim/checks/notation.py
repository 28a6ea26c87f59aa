"""How sentences write names and numbers; quick commands use it, so that it imports nothing but Python."""

from __future__ import annotations

NEAR_ONE, ROUND_OFF = 1e-2, 1e-13
"""A factor that is nearer to 1 is written as 1 and the rest; nearer still, the rest is rounding."""


class Notation:
    """The notation of terminals and files: names as an experiment file has them, numbers as Python writes them.

    A page has another one (`vibsim.report.words.PAGE`).
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


def beside(notation: Notation, value: float, limit: float) -> str:
    """Write a number with two digits, or with as many as show on which side of a limit it is."""
    for digits in range(2, 16):
        rounded = float(f"{value:.{digits}g}")
        if (rounded > limit, rounded < limit) == (value > limit, value < limit):
            return notation.number(value, digits)
    return notation.number(value, 16)
