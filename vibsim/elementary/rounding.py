"""Rounding to whole numbers without a call."""

from __future__ import annotations

_ROUND = 6755399441055744.0  # 1.5 * 2^52: there doubles are whole numbers


def nearest_whole(x: float) -> float:
    r"""Return the whole number nearest to `x`, the even one of two, for \|x\| <= 2^51."""
    return (x + _ROUND) - _ROUND
