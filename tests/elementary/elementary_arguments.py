"""Arguments that ask much of an elementary function, and what it should be there."""

import math
import sys
from fractions import Fraction

import mpmath
import numpy as np

PI = math.pi
BEYOND = mpmath.mpf(2) ** 1024 - mpmath.mpf(2) ** 970
"""From there on the nearest double is infinite."""


def remainder(x, y):
    """Return ``x - floor(x/y) y`` of whole multiples of a common unit, however far apart x and y are."""
    a, b = (Fraction(int(z.man) * (-1 if z < 0 else 1)) * Fraction(2) ** int(z.exp) for z in (x, y))
    rest = a % b
    with mpmath.workprec(2200):
        return mpmath.mpf(rest.numerator) / rest.denominator


EXACT = {
    "acos": mpmath.acos,
    "acosh": mpmath.acosh,
    "asin": mpmath.asin,
    "asinh": mpmath.asinh,
    "atan": mpmath.atan,
    "atan2": mpmath.atan2,
    "atanh": mpmath.atanh,
    "cbrt": lambda x: mpmath.sign(x) * mpmath.cbrt(abs(x)),
    "cos": mpmath.cos,
    "cosh": lambda x: mpmath.cosh(clipped(x)),
    "erf": lambda x: mpmath.erf(clipped(x)),
    "erfc": lambda x: mpmath.erfc(clipped(x)),
    "exp": lambda x: mpmath.exp(clipped(x)),
    "expm1": lambda x: mpmath.expm1(clipped(x)),
    "hypot": mpmath.hypot,
    "log": mpmath.log,
    "log10": mpmath.log10,
    "log1p": mpmath.log1p,
    "log2": lambda x: mpmath.log(x, 2),
    "mod": remainder,
    "power": lambda x, y: whole_power(x, y) if x < 0 else mpmath.exp(clipped(y * mpmath.log(x))),
    "sin": mpmath.sin,
    "sinh": lambda x: mpmath.sinh(clipped(x)),
    "sqrt": mpmath.sqrt,
    "tan": mpmath.tan,
    "tanh": lambda x: mpmath.tanh(clipped(x)),
}
"""The functions that round; the others choose."""

EXTENDED = {
    **{name: getattr(np, name) for name in ("cbrt", "cos", "cosh", "exp", "expm1", "hypot", "log")},
    **{name: getattr(np, name) for name in ("log10", "log1p", "log2", "mod", "power", "sin")},
    **{name: getattr(np, name) for name in ("sinh", "sqrt", "tan", "tanh")},
    **{f"a{name}": getattr(np, f"arc{name}") for name in ("cos", "cosh", "sin", "sinh", "tan")},
    **{"atan2": np.arctan2, "atanh": np.arctanh},
}
"""Those that numpy knows with the 11 bits more of an extended double."""

INTERVALS: dict[str, list[tuple[float, float]]] = {
    "abs": [(-2, 2)],
    "acos": [(-1, 1), (0.99, 1), (-1, -0.99), (0.3, 0.4), (0.7, 0.71)],
    "acosh": [(1, 1.01), (1, 2), (1, 100), (9e9, 1.1e10)],
    "asin": [(-1, 1), (0.99, 1), (-1e-8, 1e-8), (0.38, 0.39), (0.7, 0.71)],
    "atan": [(-1, 1), (0.41, 0.42), (2.4, 2.42), (0.99, 1.01), (-1e3, 1e3), (-1e-8, 1e-8)],
    "asinh": [(-0.1, 0.1), (-2, 2), (-100, 100), (9e9, 1.1e10), (-2e-8, 2e-8)],
    "atanh": [(-0.2, 0.2), (0.171, 0.172), (-1, 1), (0.3, 0.4), (0.99, 1), (-1e-8, 1e-8)],
    "cbrt": [(-1, 1), (0.7, 1.5), (1, 8)],
    "ceil": [(-3, 3), (-1e6, 1e6), (2.0**51, 2.0**53)],
    "cos": [(0, 1e-2), (-PI, PI), (0.5, 0.6), (3.13, 3.15), (-30, 30), (-1e5, 1e5), (1e5, 1e9)],
    "cosh": [(-1, 1), (0.3, 0.4), (-30, 30), (-712, 712), (709.7, 710.5)],
    "erf": [(-0.6, 0.6), (0.6, 0.7), (-1, 1), (-7, 7), (-1e-8, 1e-8)],
    "erfc": [(-0.6, 0.6), (0.6, 0.7), (-1, 1), (-7, 7), (0, 28), (26, 27.3)],
    "exp": [(-0.4, 0.4), (0.3, 0.4), (-30, 30), (-746, 710), (-746, -708), (709.7, 709.8)],
    "expm1": [(-0.4, 0.4), (-0.14, -0.1), (0.34, 0.4), (-2, 2), (-40, 40), (709.7, 709.8)],
    "floor": [(-3, 3), (-1e6, 1e6), (2.0**51, 2.0**53)],
    "heaviside": [(-2, 2)],
    "log": [(0.7, 1.42), (0.999, 1.001), (1.41, 1.5), (0.7, 0.71), (0, 1e3)],
    "log10": [(0.7, 1.42), (0.999, 1.001), (0, 10), (0, 1e3)],
    "log1p": [(-0.3, 0.5), (-0.01, 0.01), (-1, -0.99), (0, 1e3), (-1e-8, 1e-8), (1e15, 1e17)],
    "log2": [(0.7, 1.42), (0.999, 1.001), (0, 10), (0, 1e3)],
    "round": [(-3, 3), (-1e6, 1e6), (2.0**51, 2.0**53)],
    "sign": [(-2, 2)],
    "sin": [(-PI / 2, PI / 2), (1.4, 1.7), (4.7, 4.72), (-30, 30), (-1e5, 1e5), (1e5, 1e9)],
    "sinh": [(-1.1, 1.1), (0.8, 1.2), (-30, 30), (-712, 712), (709.7, 710.5)],
    "sqrt": [(0, 4)],
    "tan": [(-PI / 4, PI / 4), (-PI, PI), (1.4, 1.7), (-30, 30), (-1e5, 1e5), (1e5, 1e9)],
    "tanh": [(-0.6, 0.6), (0.5, 1.2), (-25, 25)],
}

PAIRS = ("atan2", "hypot", "max", "min", "mod", "power")
"""The functions of two arguments."""

SPECIAL = [
    *(0.0, math.ulp(0.0), sys.float_info.min, 1e-300, 1e-20, 0.5, 1.0, 2.0, 1e5, 1e22, 1e300),
    *(1.0 - 2.0**-53, 1.0 + 2.0**-52, math.sqrt(0.5), math.sqrt(2.0), sys.float_info.max, math.inf),
    *(709.782712893384, 709.7827128933841, 745.1332191019411, 745.1332191019412, 710.4758600739439),
]


def clipped(x):
    """Keep exponentials within what can be written down; beyond, they are infinite or zero to any double."""
    return min(max(x, mpmath.mpf(-2000)), mpmath.mpf(2000))


def whole_power(x, y):
    """Return ``x^y`` for x < 0; NaN where y is not whole."""
    if y != mpmath.floor(y):
        return mpmath.nan
    sign = 1 - 2 * int(y % 2)
    return sign * EXACT["power"](-x, y)


def binades(rng, n):
    """Return doubles of both signs out of every binade."""
    with np.errstate(under="ignore"):
        sizes = np.ldexp(rng.uniform(1.0, 2.0, n), rng.integers(-1074, 1024, n))
    return rng.choice([-1.0, 1.0], n) * sizes


def nearly_multiples_of_half_pi(exponents):
    """Return the doubles ``M 2^E`` that come nearest to multiples of pi/2, by the continued fraction of 2^E/(pi/2)."""
    found = []
    for exponent in exponents:
        with mpmath.workprec(1300):
            rest = mpmath.ldexp(2 / mpmath.pi, exponent)
            before, denominator = 1, 0
            while True:
                digit = int(mpmath.floor(rest))
                before, denominator = denominator, digit * denominator + before
                if denominator >= 2**53:
                    break
                rest = 1 / (rest - digit)
        times = -(-(2**52) // before)
        if before * times < 2**53:
            found.append(math.ldexp(before * times, exponent))
    return np.array(found)


def single(name, rng, n):
    intervals = INTERVALS[name]
    parts = [rng.uniform(*interval, n // len(intervals)) for interval in intervals]
    parts += [binades(rng, n // 4), np.array(SPECIAL), -np.array(SPECIAL)]
    if name in ("cos", "sin", "tan"):
        parts += [0.5 * PI * np.arange(1.0, 60_000.0, 97.0)]
        parts += [nearly_multiples_of_half_pi(range(-52, 972, 8)), [6381956970095103 * 2.0**797]]
    return (np.concatenate(parts),)


def pairs(name, rng, n):
    special = [*SPECIAL, 3.0, 2.5, 2.0**53 - 1.0, 2.0**53]
    corners = np.meshgrid(*[[*special, *(-x for x in special)]] * 2)
    x, y = binades(rng, n // 4), binades(rng, n // 4)
    others = [(x, y), tuple(map(np.ravel, corners))]
    if name == "power":
        base = np.concatenate([np.abs(x), rng.uniform(0.0, 3.0, n // 4), rng.uniform(0.9, 1.1, n)])
        # exponents up to where the power over- or underflows
        exponent = rng.uniform(-750.0, 750.0, len(base)) / np.log(base)
        others += [(base, exponent), (rng.uniform(0, 9, n // 4), rng.uniform(-5, 5, n // 4))]
        others += [(-rng.uniform(0, 9, n // 8), rng.integers(-9, 9, n // 8).astype(float))]
    else:
        with np.errstate(over="ignore"):
            others += [(x, np.clip(x * rng.uniform(-3, 3, n // 4), -1e308, 1e308))]
        others += [(rng.uniform(-1, 1, n // 2), rng.uniform(-1, 1, n // 2))]
        others += [(rng.uniform(-1e6, 1e6, n // 4), rng.uniform(-3, 3, n // 4))]
        # almost whole quotients
        y = rng.uniform(0.1, 3.0, n // 4)
        others += [(np.nextafter(y * rng.integers(-40, 40, n // 4), 0.0), y)]
    return tuple(np.concatenate(column) for column in zip(*others, strict=True))


def arguments(name, n):
    """Return about `n` arguments of the function `name`: a tuple of arrays, one for each argument."""
    rng = np.random.default_rng([20261121, *name.encode()])
    if name == "where":
        yes, no = pairs(name, rng, n)
        return rng.choice([0.0, 1.0, -2.0, math.nan], len(yes)), yes, no
    return (pairs if name in PAIRS else single)(name, rng, n)


def exact(name, values):
    """Return the value of the function `name` to 50 digits; NaN where it has none."""
    with mpmath.workdps(50):
        value = EXACT[name](*map(mpmath.mpf, values))
    return value if isinstance(value, mpmath.mpf) else mpmath.nan


def error(value, true):
    """Return the error of a double in units in the last place of the true value."""
    if mpmath.isnan(true) or math.isnan(value):
        return 0.0 if mpmath.isnan(true) and math.isnan(value) else math.inf
    if math.isinf(value) or abs(true) >= BEYOND:
        return 0.0 if abs(true) >= BEYOND and value == math.copysign(math.inf, true) else math.inf
    return float(abs(mpmath.mpf(value) - true) / mpmath.mpf(math.ulp(float(true))))


def errors(name, rows, values):
    """Yield the error of the function `name` at each of some rows, in units in the last place.

    Extended doubles tell it to a hundredth of a unit; 50 digits, for which they take a hundred times as long, are for
    what is above 0.9 of it, or near the ends of the range. Where a machine has no extended doubles, all is.
    """
    rough = np.full(len(rows), np.inf)
    if name in EXTENDED and np.finfo(np.longdouble).nmant > 60:
        with np.errstate(all="ignore"):
            true = EXTENDED[name](*np.array(rows, dtype=np.longdouble).T)
            size = np.abs(true.astype(float))
            known = (size > 1e-300) & (size < 1e300)
            off = np.abs(np.array(values) - true) / np.spacing(size)
        rough = np.where(known, off, np.inf)
    for row, value, about in zip(rows, values, rough.tolist(), strict=True):
        yield about if about < 0.9 else error(value, exact(name, row))
