"""Powers of two, and the parts of a double: the only three operations that differ between lanes.

Plain Python uses `math.ldexp` and `math.frexp`, which are exact. The compiled lanes use the bits of the double, in a
form that LLVM can vectorise (`vibsim.native.operations`). Outside the stated ranges the lanes may give different
values, so a function that calls a primitive there must discard the result.
"""

from __future__ import annotations

import math

NAMES = ("two_to", "exponent_of", "mantissa_of")
"""Functions that a kernel must not collect in a compiled lane, because the compiler provides them."""


def two_to(k: float) -> float:
    """Return ``2^k`` for an integer k in -1022 ... 1023."""
    return math.ldexp(1.0, int(k)) if -1023.0 < k < 1024.0 else math.nan


def exponent_of(x: float) -> float:
    """Return the integer e with ``2^e <= x < 2^(e+1)``, for normal x > 0."""
    return math.frexp(x)[1] - 1.0


def mantissa_of(x: float) -> float:
    """Return ``x / 2^e`` in [1, 2) with the e of `exponent_of`, for normal x > 0."""
    return 2.0 * math.frexp(x)[0]
