"""How sentences write names and numbers; used by quick commands, so it imports only the standard library."""

from __future__ import annotations

NEAR_ONE, ROUND_OFF = 1e-2, 1e-13
"""A factor within the first distance of 1 is written as 1 plus the rest; below the second one the rest is rounding."""


class Notation:
    """The notation of terminals and files: names as in experiment files, numbers as in Python.

    Pages have another notation (`vibsim.report.words.PAGE`).
    """

    def quantity(self, name: str) -> str:
        """Write a quantity."""
        return name

    def value(self, name: str) -> str:
        """Write the name of a number of a ``value`` check."""
        return name

    def opening(self, text: str) -> str:
        """Write the beginning of a sentence."""
        return text

    def digits(self, text: str) -> str:
        """Write the digits of a number."""
        return text

    def number(self, value: float, digits: int = 6) -> str:
        """Write a number with up to `digits` significant digits."""
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
    """Write a number with two digits, or with as many as show on which side of the limit it lies."""
    for digits in range(2, 16):
        rounded = float(f"{value:.{digits}g}")
        if (rounded > limit, rounded < limit) == (value > limit, value < limit):
            return notation.number(value, digits)
    return notation.number(value, 16)
