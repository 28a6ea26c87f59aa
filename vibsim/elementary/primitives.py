"""Powers of two, and the parts of a double: the three operations that are written per lane.

Plain Python takes `math.ldexp` and `math.frexp`, which are exact. The compiled lanes take the bits of the double, in a
form that LLVM turns into vector instructions; `header` is their text. Outside the stated arguments the lanes may give
different values, so a function that calls a primitive there must throw the value away.
"""

from __future__ import annotations

import math

NAMES = ("two_to", "exponent_of", "mantissa_of")
"""What a kernel must not write out from this module in a compiled lane, but take from `COMPILED`."""


def two_to(k: float) -> float:
    """Return ``2^k`` for whole k in -1022 ... 1023."""
    return math.ldexp(1.0, int(k)) if -1023.0 < k < 1024.0 else math.nan


def exponent_of(x: float) -> float:
    """Return the whole e with ``2^e <= x < 2^(e+1)``, for normal x > 0."""
    return math.frexp(x)[1] - 1.0


def mantissa_of(x: float) -> float:
    """Return ``x / 2^e`` in [1, 2) with the e of `exponent_of`, for normal x > 0."""
    return 2.0 * math.frexp(x)[0]


COMPILED = """\
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_BITS = ir.IntType(64)
_DOUBLE = ir.DoubleType()


def _word(value):
    return ir.Constant(_BITS, value)


@intrinsic
def two_to(typing, k):
    def build(context, builder, signature, arguments):
        # the low bits of 1.5 * 2^52 + 1023 + k are the biased exponent
        shifted = builder.fadd(arguments[0], ir.Constant(_DOUBLE, 6755399441056767.0))
        bits = builder.shl(builder.bitcast(shifted, _BITS), _word(52))
        return builder.bitcast(bits, _DOUBLE)

    return types.float64(types.float64), build


@intrinsic
def exponent_of(typing, x):
    def build(context, builder, signature, arguments):
        bits = builder.lshr(builder.bitcast(arguments[0], _BITS), _word(52))
        # the biased exponent as the low bits of 2^52: no conversion from integers, which AVX2 lacks
        shifted = builder.bitcast(builder.or_(bits, _word(0x4330000000000000)), _DOUBLE)
        return builder.fsub(shifted, ir.Constant(_DOUBLE, 4503599627371519.0))

    return types.float64(types.float64), build


@intrinsic
def mantissa_of(typing, x):
    def build(context, builder, signature, arguments):
        bits = builder.and_(builder.bitcast(arguments[0], _BITS), _word(0xFFFFFFFFFFFFF))
        return builder.bitcast(builder.or_(bits, _word(0x3FF0000000000000)), _DOUBLE)

    return types.float64(types.float64), build
"""
"""The text of the same three functions for a compiled kernel."""
