"""The elementary functions against 50 digits, and their special values."""

import inspect
import itertools
import math

import numpy as np
import pytest
from elementary_arguments import EXACT, arguments, errors

from vibsim import formula
from vibsim.elementary import ELEMENTARY

INF, NAN, PI, TINY = math.inf, math.nan, math.pi, math.ulp(0.0)
CORNERS = (0.0, -0.0, 1.0, -1.0, INF, -INF, NAN)
BOUNDS = {"sin": 2.5, "cos": 2.5}
"""In units in the last place, 1 where nothing is said; every docstring states it."""

ODD = (
    *("asin", "asinh", "atan", "atanh", "cbrt", "erf", "round"),
    *("sign", "sin", "sinh", "tan", "tanh"),
)
EVEN = ("abs", "cos", "cosh")

SPECIAL_VALUES: dict[str, list[tuple[float, ...]]] = {
    "abs": [(-0.0, 0.0), (-INF, INF), (NAN, NAN), (-3.0, 3.0)],
    "acos": [(1.0, 0.0), (-1.0, PI), (0.0, PI / 2), (1.0 + 2**-52, NAN), (INF, NAN), (NAN, NAN)],
    "acosh": [(1.0, 0.0), (1.0 - 2**-53, NAN), (-2.0, NAN), (INF, INF), (-INF, NAN), (NAN, NAN)],
    "asin": [(-0.0, -0.0), (1.0, PI / 2), (-1.1, NAN), (INF, NAN), (NAN, NAN)],
    "asinh": [(0.0, 0.0), (-0.0, -0.0), (TINY, TINY), (INF, INF), (-INF, -INF), (NAN, NAN)],
    "atan": [(-0.0, -0.0), (INF, PI / 2), (-INF, -PI / 2), (NAN, NAN)],
    "atanh": [
        *((0.0, 0.0), (-0.0, -0.0), (TINY, TINY), (1.0, INF), (-1.0, -INF), (1.0 + 2**-52, NAN)),
        *((-2.0, NAN), (INF, NAN), (NAN, NAN)),
    ],
    "cbrt": [
        *((0.0, 0.0), (-0.0, -0.0), (27.0, 3.0), (-0.001, -0.1), (1e-300, 1e-100)),
        *((8 * TINY, 2.0**-357), (INF, INF), (-INF, -INF), (NAN, NAN)),
    ],
    "ceil": [
        *((0.0, 0.0), (-0.0, -0.0), (TINY, 1.0), (-0.5, -0.0), (2.5, 3.0), (-2.5, -2.0)),
        *((-3.0, -3.0), (2.0**51 + 0.5, 2.0**51 + 1.0), (2.0**52 - 0.5, 2.0**52)),
        *((1e300, 1e300), (INF, INF), (-INF, -INF), (NAN, NAN)),
    ],
    "cos": [(0.0, 1.0), (-0.0, 1.0), (INF, NAN), (-INF, NAN), (NAN, NAN)],
    "cosh": [(0.0, 1.0), (-0.0, 1.0), (INF, INF), (-INF, INF), (NAN, NAN)],
    "erf": [(0.0, 0.0), (-0.0, -0.0), (6.0, 1.0), (INF, 1.0), (-INF, -1.0), (NAN, NAN)],
    "erfc": [
        *((0.0, 1.0), (-0.0, 1.0), (-6.0, 2.0), (27.3, 0.0), (1e300, 0.0)),
        *((INF, 0.0), (-INF, 2.0), (NAN, NAN)),
    ],
    "exp": [(0.0, 1.0), (-0.0, 1.0), (INF, INF), (-INF, 0.0), (NAN, NAN)],
    "expm1": [
        *((0.0, 0.0), (-0.0, -0.0), (TINY, TINY), (-TINY, -TINY), (-40.0, -1.0), (-1e300, -1.0)),
        *((710.0, INF), (INF, INF), (-INF, -1.0), (NAN, NAN)),
    ],
    "floor": [
        *((0.0, 0.0), (-0.0, -0.0), (-TINY, -1.0), (0.5, 0.0), (2.5, 2.0), (-2.5, -3.0)),
        *((-3.0, -3.0), (2.0**51 + 0.5, 2.0**51), (2.0**52 - 0.5, 2.0**52 - 1.0)),
        *((1e300, 1e300), (INF, INF), (-INF, -INF), (NAN, NAN)),
    ],
    "heaviside": [
        *((0.0, 0.5), (-0.0, 0.5), (TINY, 1.0), (-TINY, 0.0)),
        *((INF, 1.0), (-INF, 0.0), (NAN, NAN)),
    ],
    # unlike C99, NaN beside infinity is NaN
    "hypot": [
        *((3.0, -4.0, 5.0), (0.0, -0.0, 0.0), (-TINY, 0.0, TINY), (1e200, -1e-200, 1e200)),
        *((3e307, 4e307, 5e307), (1.7e308, 1.7e308, INF), (3 * TINY, 4 * TINY, 5 * TINY)),
        *((INF, 1.0, INF), (0.0, -INF, INF), (INF, NAN, NAN), (NAN, 1.0, NAN)),
    ],
    "log": [(0.0, -INF), (-0.0, -INF), (1.0, 0.0), (INF, INF), (-1.0, NAN), (NAN, NAN)],
    "log10": [
        *((0.0, -INF), (-0.0, -INF), (1.0, 0.0), (INF, INF), (-1.0, NAN), (NAN, NAN)),
        *((float(f"1e{k}"), float(k)) for k in range(23)),
    ],
    "log1p": [
        *((0.0, 0.0), (-0.0, -0.0), (TINY, TINY), (-1.0, -INF), (-1.0 - 2**-52, NAN)),
        *((INF, INF), (-INF, NAN), (NAN, NAN)),
    ],
    "log2": [
        *((0.0, -INF), (-0.0, -INF), (INF, INF), (-1.0, NAN), (NAN, NAN)),
        *((2.0**k, float(k)) for k in range(-1074, 1024)),
    ],
    "max": [(1.0, 2.0, 2.0), (-INF, 1.0, 1.0), (NAN, 1.0, NAN), (1.0, NAN, NAN)],
    "min": [(1.0, 2.0, 1.0), (-INF, 1.0, -INF), (NAN, 1.0, NAN), (1.0, NAN, NAN)],
    # Python's, but for y = 0
    "mod": [
        *((x, y, x % y) for x in (0.0, -0.0, 1.0, -1.0, 5.5, -5.5) for y in (2.5, -2.5, INF, -INF)),
        *((x, y, x % y) for x in (1e300, -1e300, 1.7e308) for y in (TINY, 3.0, -1e-300, 1.1e308)),
        *((-1e-300, 2.0, 2.0), (7 * TINY, 3 * TINY, TINY), (-TINY, TINY, 0.0), (1.0, 0.0, NAN)),
        *((INF, 1.0, NAN), (-INF, INF, NAN), (1.0, NAN, NAN), (NAN, 1.0, NAN)),
    ],
    "round": [
        *((0.0, 0.0), (-0.0, -0.0), (0.5, 0.0), (-0.5, -0.0), (1.5, 2.0), (2.5, 2.0)),
        *((0.5 - 2.0**-54, 0.0), (-2.6, -3.0), (2.0**51 + 0.5, 2.0**51), (2.0**52 - 0.5, 2.0**52)),
        *((1e300, 1e300), (INF, INF), (-INF, -INF), (NAN, NAN)),
    ],
    "sign": [(-2.0, -1.0), (-0.0, 0.0), (0.0, 0.0), (INF, 1.0), (NAN, NAN)],
    "sin": [(0.0, 0.0), (-0.0, 0.0), (INF, NAN), (-INF, NAN), (NAN, NAN)],
    "sinh": [(-0.0, -0.0), (INF, INF), (-INF, -INF), (NAN, NAN)],
    "sqrt": [(-0.0, -0.0), (4.0, 2.0), (INF, INF), (-1.0, NAN), (-INF, NAN), (NAN, NAN)],
    "tan": [(0.0, 0.0), (-0.0, -0.0), (INF, NAN), (-INF, NAN), (NAN, NAN)],
    "tanh": [(-0.0, -0.0), (INF, 1.0), (-INF, -1.0), (NAN, NAN)],
    "where": [
        (1.0, 2.0, 3.0, 2.0),
        (0.0, 2.0, 3.0, 3.0),
        (-0.0, NAN, 3.0, 3.0),
        (NAN, 1.0, 1.0, NAN),
    ],
    # the C library's, which is exact there
    "atan2": [(y, x, math.atan2(y, x)) for y, x in itertools.product(CORNERS, CORNERS)],
    "power": [
        *((x, y, 1.0) for x in (0.0, -2.0, INF, NAN) for y in (0.0, -0.0)),
        *((1.0, y, 1.0) for y in (3.5, -INF, INF, NAN)),
        *((-1.0, y, 1.0) for y in (-INF, INF, 2.0**53, 4.0)),
        *((-1.0, 3.0, -1.0), (-1.0, 0.5, NAN), (-2.0, TINY, NAN), (-8.0, 1.0 / 3.0, NAN)),
        *((0.0, -3.0, INF), (-0.0, -3.0, -INF), (-0.0, -2.0, INF), (-0.0, -0.5, INF)),
        *((0.0, 3.0, 0.0), (-0.0, 3.0, -0.0), (-0.0, 2.0, 0.0), (-0.0, 0.5, 0.0)),
        *((0.0, INF, 0.0), (-0.0, -INF, INF), (INF, INF, INF), (-INF, -INF, 0.0)),
        *((0.5, -INF, INF), (-0.5, INF, 0.0), (2.0, -INF, 0.0), (-2.0, INF, INF)),
        *((-INF, -3.0, -0.0), (-INF, -2.5, 0.0), (-INF, 3.0, -INF), (-INF, 2.5, INF)),
        *((INF, -0.5, 0.0), (INF, 0.5, INF), (NAN, 1.0, NAN), (2.0, NAN, NAN)),
        *((-2.0, 1023.0, -(2.0**1023)), (-2.0, -1074.0, TINY), (4.0, 0.5, 2.0), (9.0, 2.5, 243.0)),
        *((1.0 + 2.0**-52, 1e300, INF), (1.0 - 2.0**-53, 1e300, 0.0), (-2.0, 1e4, INF)),
    ],
}
"""Arguments and value, those of C99, annex F, and of exact results."""


def bits(value):
    return "nan" if math.isnan(value) else value.hex()


def test_every_function_of_a_formula_is_there():
    assert set(ELEMENTARY) == {*formula.FUNCTIONS, "power"}
    for name, (count, _) in formula.FUNCTIONS.items():
        assert len(inspect.signature(ELEMENTARY[name].full).parameters) == count


def worst(name, n):
    """Return the largest error over about `n` finite arguments, and where it is."""
    columns = arguments(name, n)
    rows = zip(*map(np.ndarray.tolist, columns), strict=True)
    rows = [row for row in rows if all(math.isfinite(x) and x != 0.0 for x in row)]
    full = ELEMENTARY[name].full
    return max(zip(errors(name, rows, [full(*row) for row in rows]), rows, strict=True))


@pytest.mark.parametrize("name", EXACT)
def test_error_is_below_the_bound(name):
    assert worst(name, 500) < (BOUNDS.get(name, 1.0),)


@pytest.mark.slow
@pytest.mark.parametrize("name", EXACT)
def test_error_is_below_the_bound_at_a_hundred_times_as_many(name):
    assert worst(name, 100_000) < (BOUNDS.get(name, 1.0),)


@pytest.mark.parametrize("name", EXACT)
def test_the_bound_is_stated(name):
    text = inspect.getdoc(ELEMENTARY[name].full)
    bound = BOUNDS.get(name, 1)
    stated = f"error below {bound} unit{'s' if bound > 1 else ''} in the last place"
    assert stated in text or "correctly rounded" in text


@pytest.mark.parametrize("name", ELEMENTARY)
def test_special_values(name):
    for *row, value in SPECIAL_VALUES[name]:
        assert bits(ELEMENTARY[name].full(*row)) == bits(value), row


@pytest.mark.parametrize("name", [*ODD, *EVEN])
def test_symmetry_to_the_last_bit(name):
    full = ELEMENTARY[name].full
    (column,) = arguments(name, 2000)
    for x in column.tolist():
        expected = -full(x) if name in ODD else full(x)
        # the sign of a zero is no sign
        assert bits(full(-x)) == bits(0.0 if name in ("sign", "sin") and x == 0.0 else expected)
