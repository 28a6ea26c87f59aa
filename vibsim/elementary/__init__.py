"""The elementary functions of the engine, in strict ``+ - * /`` and square roots.

A member's numbers must not depend on the lane or the machine that computes them, so its forces never call the C
library, whose last digit differs between versions. One text serves every lane: plain Python runs it as it stands, the
compiled lanes compile it without contraction. Only taking a double apart is written per lane (`primitives`).

Sine and cosine have an error below 2.5 units in the last place over all doubles, every other function below 1 (test:
against 50 digits). All have the special values of C99, annex F, except that a comparison with NaN gives
NaN, and so does `hypot`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from vibsim.elementary.circular import cos, cos_fast, sin, sin_fast
from vibsim.elementary.error_function import erf, erfc
from vibsim.elementary.exponential import exp, expm1
from vibsim.elementary.hyperbolic import cosh, sinh, tanh
from vibsim.elementary.inverse import acos, asin, atan, atan2, atan2_fast
from vibsim.elementary.inverse_hyperbolic import acosh, asinh, atanh
from vibsim.elementary.logarithm import log, log1p, log2, log10
from vibsim.elementary.power import power, power_fast
from vibsim.elementary.root import cbrt, hypot
from vibsim.elementary.selection import absolute, heaviside, larger, sign, smaller, sqrt, where
from vibsim.elementary.tangent import tan, tan_fast
from vibsim.elementary.whole import ceil, floor, mod, mod_fast, nearest

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
        "acosh": Elementary(acosh, acosh),
        "asin": Elementary(asin, asin),
        "asinh": Elementary(asinh, asinh),
        "atan": Elementary(atan, atan),
        "atan2": Elementary(atan2, atan2_fast),
        "atanh": Elementary(atanh, atanh),
        "cbrt": Elementary(cbrt, cbrt),
        "ceil": Elementary(ceil, ceil),
        "cos": Elementary(cos, cos_fast),
        "cosh": Elementary(cosh, cosh),
        "erf": Elementary(erf, erf),
        "erfc": Elementary(erfc, erfc),
        "exp": Elementary(exp, exp),
        "expm1": Elementary(expm1, expm1),
        "floor": Elementary(floor, floor),
        "heaviside": Elementary(heaviside, heaviside),
        "hypot": Elementary(hypot, hypot),
        "log": Elementary(log, log),
        "log10": Elementary(log10, log10),
        "log1p": Elementary(log1p, log1p),
        "log2": Elementary(log2, log2),
        "max": Elementary(larger, larger),
        "min": Elementary(smaller, smaller),
        "mod": Elementary(mod, mod_fast),
        "power": Elementary(power, power_fast),
        "round": Elementary(nearest, nearest),
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
