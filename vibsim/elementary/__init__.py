"""The elementary functions of the engine, in strict ``+ - * /`` and square roots.

Results must not depend on the lane or the machine, so forces never call the C library, whose last digit differs between
versions. One text serves every lane: plain Python executes it, the compiled lanes compile it without contraction. Only
access to the parts of a double differs between lanes (`primitives`).

Sine and cosine have an error below 2.5 units in the last place over all doubles, every other function below 1 (tested
against 50 digits). All have the special values of C99, annex F, except that a comparison with NaN gives NaN, and so
does `hypot`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from vibsim.elementary.circular import cos, cos_fast, sin, sin_fast, tan, tan_fast
from vibsim.elementary.error_function import erf, erfc
from vibsim.elementary.exact import (
    absolute,
    ceil,
    floor,
    heaviside,
    larger,
    mod,
    mod_fast,
    nearest,
    sign,
    smaller,
    sqrt,
    where,
)
from vibsim.elementary.exponential import (
    cbrt,
    exp,
    expm1,
    hypot,
    log,
    log1p,
    log2,
    log10,
    power,
    power_fast,
)
from vibsim.elementary.hyperbolic import acosh, asinh, atanh, cosh, sinh, tanh
from vibsim.elementary.inverse import acos, asin, atan, atan2, atan2_fast

__all__ = ["ELEMENTARY", "Elementary"]


@dataclass(frozen=True)
class Elementary:
    """One function in two versions, which are the same if it needs no branches."""

    full: Callable[..., float]
    """Valid for every double."""
    fast: Callable[..., float]
    """Branch-free, so that a loop over members can be vectorised: the bits of `full`, or NaN outside its stated range
    and for NaN."""


_WITH_BRANCHES: dict[str, tuple[Callable[..., float], Callable[..., float]]] = {
    **{"atan2": (atan2, atan2_fast), "cos": (cos, cos_fast), "mod": (mod, mod_fast)},
    **{"power": (power, power_fast), "sin": (sin, sin_fast), "tan": (tan, tan_fast)},
}
_WITHOUT: dict[str, Callable[..., float]] = {
    **{"acos": acos, "acosh": acosh, "asin": asin, "asinh": asinh, "atan": atan, "atanh": atanh},
    **{"cbrt": cbrt, "cosh": cosh, "erf": erf, "erfc": erfc, "exp": exp, "expm1": expm1},
    **{"hypot": hypot, "log": log, "log10": log10, "log1p": log1p, "log2": log2},
    **{"sinh": sinh, "sqrt": sqrt, "tanh": tanh},
    **{"abs": absolute, "ceil": ceil, "floor": floor, "heaviside": heaviside, "max": larger},
    **{"min": smaller, "round": nearest, "sign": sign, "where": where},
}
ELEMENTARY: Mapping[str, Elementary] = MappingProxyType(
    {
        name: Elementary(*_WITH_BRANCHES.get(name) or (_WITHOUT[name],) * 2)
        for name in sorted((*_WITH_BRANCHES, *_WITHOUT))
    }
)
"""The functions that a formula may call, by their names in formulas, and ``power``."""
