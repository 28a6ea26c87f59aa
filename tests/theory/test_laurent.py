"""Series in dt with exact coefficients, against SymPy's own series."""

from fractions import Fraction

import pytest
import sympy
from sympy import QQ

from vibsim.theory.laurent import HALF, Field

KNOWN = 8
FIELD = Field(QQ, KNOWN)
H = sympy.Symbol("h")


def series_of(coefficients, first=0):
    return sum(
        (FIELD.series(QQ(*c), first + k) for k, c in enumerate(coefficients)), FIELD.constant(0.0)
    )


A, A_TEXT = series_of([(2, 3), (-1, 5), (0, 1), (7, 2)]), "2/3 - h/5 + 7*h**3/2"
D, D_TEXT = series_of([(3, 1), (1, 4)], 1), "3*h + h**2/4"


@pytest.mark.parametrize(
    ("found", "text"),
    [
        (A + D, f"({A_TEXT}) + ({D_TEXT})"),
        (1.5 - D, f"3/2 - ({D_TEXT})"),
        (A - D * 2.0, f"({A_TEXT}) - 2*({D_TEXT})"),
        (A * D, f"({A_TEXT})*({D_TEXT})"),
        (D / A, f"({D_TEXT})/({A_TEXT})"),
        (A / D, f"({A_TEXT})/({D_TEXT})"),
        (0.5 / D, f"1/(2*({D_TEXT}))"),
        (A**3, f"({A_TEXT})**3"),
        (abs(-D), D_TEXT),
        ((1.0 + D).logarithm(), f"log(1 + {D_TEXT})"),
        pytest.param(
            (1.0 - D * D).square_of_angle(),
            f"acos(1 - ({D_TEXT})**2)**2",
            marks=pytest.mark.slow,
        ),
        ((1.0 + D) ** HALF, f"sqrt(1 + {D_TEXT})"),
    ],
)
def test_operations_are_those_on_functions(found, text):
    expected = sympy.series(sympy.sympify(text), H, 0, KNOWN).removeO()
    assert found.end >= KNOWN - 2
    for power in range(-2, found.end):
        assert found.at(power) == QQ.from_sympy(expected.coeff(H, power))


def test_a_quotient_claims_no_more_than_is_known():
    one = FIELD.series(QQ(1), 1) - FIELD.series(QQ(1), 1)
    assert one.leading is None
    assert (A / D).end == KNOWN - 2
    with pytest.raises(ZeroDivisionError):
        A / one


def test_a_float_is_the_decimal_that_was_written():
    assert FIELD.constant(0.1).at(0) == QQ(1, 10)
    assert FIELD.series(FIELD.number(Fraction(1, 3))).leading == (0, QQ(1, 3))


def test_a_root_is_taken_where_the_series_begins_with_one():
    with pytest.raises(ValueError, match="begins with 1"):
        A**HALF
