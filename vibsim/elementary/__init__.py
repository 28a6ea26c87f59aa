"""The elementary functions of the engine, in strict ``+ - * /`` and square roots.

A member's numbers must not depend on the lane or the machine that computes them, so its forces never call the C
library, whose last digit differs between versions. One text serves every lane: plain Python runs it as it stands, the
compiled lanes compile it without contraction. Only taking a double apart is written per lane (`primitives`).

Every function has an error below 1 unit in the last place over all doubles (test: against 50 digits), and the special
values of C99, annex F, except that a comparison with NaN gives NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from vibsim.elementary.circular import cos, cos_fast, sin, sin_fast
from vibsim.elementary.exponential import exp
from vibsim.elementary.hyperbolic import cosh, sinh, tanh
from vibsim.elementary.inverse import acos, asin, atan, atan2, atan2_fast
from vibsim.elementary.logarithm import log
from vibsim.elementary.power import power, power_fast
from vibsim.elementary.selection import absolute, larger, sign, smaller, sqrt, where
from vibsim.elementary.tangent import tan, tan_fast

__all__ = ["ELEMENTARY", "Elementary"]


@dataclass(frozen=True)
class Elementary:
    """One function in two texts, which are one where it needs no branches."""

    full: Callable[..., float]
    """Right for every double."""
    fast: Callable[..., float]
    """Free of branches, so that a loop over members becomes vector instructions: the bits of `full`, or NaN outside
    the range that it states and for NaN."""


ELEMENTARY: Mapping[str, Elementary] = MappingProxyType(
    {
        "abs": Elementary(absolute, absolute),
        "acos": Elementary(acos, acos),
        "asin": Elementary(asin, asin),
        "atan": Elementary(atan, atan),
        "atan2": Elementary(atan2, atan2_fast),
        "cos": Elementary(cos, cos_fast),
        "cosh": Elementary(cosh, cosh),
        "exp": Elementary(exp, exp),
        "log": Elementary(log, log),
        "max": Elementary(larger, larger),
        "min": Elementary(smaller, smaller),
        "power": Elementary(power, power_fast),
        "sign": Elementary(sign, sign),
        "sin": Elementary(sin, sin_fast),
        "sinh": Elementary(sinh, sinh),
        "sqrt": Elementary(sqrt, sqrt),
        "tan": Elementary(tan, tan_fast),
        "tanh": Elementary(tanh, tanh),
        "where": Elementary(where, where),
    }
)
"""The functions that a formula may call, by the names that formulas use, and ``power``."""
