"""Powers of two, and the parts of a double: the three operations that are written per lane.

Plain Python takes `math.ldexp` and `math.frexp`, which are exact. The compiled lanes take the bits of the double, in a
form that LLVM turns into vector instructions (`vibsim.native.operations`). Outside the stated arguments the lanes may
give different values, so a function that calls a primitive there must throw the value away.
"""

from __future__ import annotations

import math

NAMES = ("two_to", "exponent_of", "mantissa_of")
"""What a kernel must not write out from this module in a compiled lane: the compiler has them."""


def two_to(k: float) -> float:
    """Return ``2^k`` for whole k in -1022 ... 1023."""
    return math.ldexp(1.0, int(k)) if -1023.0 < k < 1024.0 else math.nan


def exponent_of(x: float) -> float:
    """Return the whole e with ``2^e <= x < 2^(e+1)``, for normal x > 0."""
    return math.frexp(x)[1] - 1.0


def mantissa_of(x: float) -> float:
    """Return ``x / 2^e`` in [1, 2) with the e of `exponent_of`, for normal x > 0."""
    return 2.0 * math.frexp(x)[0]
