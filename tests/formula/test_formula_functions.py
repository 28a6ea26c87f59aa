"""Formulas as users write them, against 50 digits of functions and conditions written here a second time."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np
import pytest
from thinned import thinned

from vibsim.elementary import ELEMENTARY, primitives
from vibsim.engine import text as kernel_text
from vibsim.formula import (
    FUNCTIONS,
    Call,
    evaluate,
    has_rule,
    integral,
    parse,
    to_statements,
    values,
    walk,
)
from vibsim.native.linking import link
from vibsim.native.machine import machine_code

mp = mpmath


def log2(x: Any) -> Any:
    return mp.log(x) / mp.log(2)


def root3(x: Any) -> Any:
    return mp.sign(x) * mp.cbrt(abs(x))


def rest(x: Any, y: Any) -> Any:
    return x - y * mp.floor(x / y)


CORPUS: dict[str, Any] = {
    "u": lambda u, k: u,
    "-u**2": lambda u, k: -(u**2),
    "2**-u": lambda u, k: mp.mpf(2) ** -u,
    "abs(u)**1.5": lambda u, k: abs(u) ** mp.mpf(1.5),
    "abs(u)**(k - 1/3)": lambda u, k: abs(u) ** (k - mp.mpf(1) / 3),
    "(u**2 + 1)**-0.5": lambda u, k: 1 / mp.sqrt(u**2 + 1),
    "u**100/(1 + u**100)": lambda u, k: u**100 / (1 + u**100),
    "e**u": lambda u, k: mp.exp(u),
    "sin(2*pi*u)": lambda u, k: mp.sin(2 * mp.pi * u),
    "k*u + 0.3*u**3 - .5E-1*u**5": lambda u, k: k * u + u**3 * 0.3 - u**5 * 0.05,
    "heaviside(u)": lambda u, k: mp.mpf(0 if u < 0 else 0.5 if u == 0 else 1),
    "heaviside(u - k)*(u - k)": lambda u, k: max(u - k, 0),
    "erf(u)": lambda u, k: mp.erf(u),
    "erf(u/sqrt(2)/k)": lambda u, k: mp.erf(u / mp.sqrt(2) / k),
    "erfc(u)": lambda u, k: mp.erfc(u),
    "exp(u**2)*erfc(u)": lambda u, k: mp.exp(u**2) * mp.erfc(u),
    "asinh(k*u)": lambda u, k: mp.asinh(k * u),
    "acosh(1 + u**2)": lambda u, k: mp.acosh(1 + u**2),
    "atanh(u/(1 + abs(u)))": lambda u, k: mp.atanh(u / (1 + abs(u))),
    "log10(1 + k*u**2)": lambda u, k: mp.log10(1 + k * u**2),
    "log2(u**2 + 2**-20)": lambda u, k: log2(u**2 + mp.mpf(2) ** -20),
    "log1p(u**2)": lambda u, k: mp.log1p(u**2),
    "expm1(-k*u)": lambda u, k: mp.expm1(-k * u),
    "hypot(u, k)": lambda u, k: mp.sqrt(u**2 + k**2),
    "u*(1 - k/hypot(u, 1))": lambda u, k: u * (1 - k / mp.sqrt(u**2 + 1)),
    "floor(u)": lambda u, k: mp.floor(u),
    "ceil(u*k)": lambda u, k: mp.ceil(u * k),
    "round(u)": lambda u, k: mp.nint(u),
    "mod(u, k)": rest,
    "mod(u, -k)": lambda u, k: rest(u, -k),
    "mod(u, 1) < 0.25": lambda u, k: mp.mpf(rest(u, 1) < 0.25),
    "2*abs(2*mod(u/k, 1) - 1) - 1": lambda u, k: 2 * abs(2 * rest(u / k, 1) - 1) - 1,
    "cbrt(u)": lambda u, k: root3(u),
    "sign(u)*cbrt(abs(u))**2": lambda u, k: mp.sign(u) * root3(abs(u)) ** 2,
    "u if u > 0 else k*u": lambda u, k: u if u > 0 else k * u,
    "1 if u < -1 else 2 if u < 1 else 3": lambda u, k: mp.mpf(1 if u < -1 else 2 if u < 1 else 3),
    "sqrt(u) if u >= 0 else -sqrt(-u)": lambda u, k: mp.sign(u) * mp.sqrt(abs(u)),
    "-1 < u <= k": lambda u, k: mp.mpf(-1 < u <= k),
    "-1 < u < k < 5 != u": lambda u, k: mp.mpf(-1 < u < k < 5 != u),
    "u < -1 or u > k": lambda u, k: mp.mpf(u < -1 or u > k),
    "not u < -1 and not u > k": lambda u, k: mp.mpf(not u < -1 and not u > k),
    "u < 0 or u > 1 and k > 9 or not k == u": lambda u, k: mp.mpf(
        u < 0 or (u > 1 and k > 9) or k != u
    ),
    "(u > 1)*(u - 1) - (u < -1)*(-1 - u)": lambda u, k: max(u - 1, 0) - max(-1 - u, 0),
    "max(u - k, 0) + min(u + k, 0)": lambda u, k: max(u - k, 0) + min(u + k, 0),
    "where(u, 1, 2)": lambda u, k: mp.mpf(1 if u else 2),
    "atan2(u, -k)": lambda u, k: mp.atan2(u, -k),
    "tan(u/9) + asin(u/9) + acos(u/9) + atan(u)": lambda u, k: (
        mp.tan(u / 9) + mp.pi / 2 + mp.atan(u)
    ),
    "sinh(u)*exp(-abs(u)) + cosh(u)/(1 + cosh(u)) + tanh(u)": lambda u, k: (
        mp.sinh(u) * mp.exp(-abs(u)) + mp.cosh(u) / (1 + mp.cosh(u)) + mp.tanh(u)
    ),
    "log(1e-9 + abs(u)) - cos(u)": lambda u, k: mp.log(mp.mpf(1e-9) + abs(u)) - mp.cos(u),
}
K = 1.75
PLACES = [-7.3, -2.0, -1.0, -0.6, -1e-8, 0.0, 1e-5, 0.3, 1.0, 1.75, 2.5, 3.0, 6.1]
TRUE = {
    text: [float(formula(mp.mpf(u), mp.mpf(K))) for u in PLACES] for text, formula in CORPUS.items()
}


def close(found: Any, text: str) -> None:
    # some ten operations, each off by 2 units in the last place of terms that are little above the sum
    np.testing.assert_allclose(found, TRUE[text], rtol=40 * 2.0**-52, atol=40 * 2.0**-52)


def test_every_function_is_in_the_corpus() -> None:
    trees = [parse(text, ("u", "k")) for text in CORPUS]
    used = {node.function for tree in trees for node in walk(tree) if isinstance(node, Call)}
    assert used == set(FUNCTIONS)


@pytest.mark.parametrize("text", CORPUS)
def test_plain_numbers_and_arrays(text: str) -> None:
    tree = parse(text, ("u", "k"))
    close([evaluate(tree, {"u": u, "k": K}) for u in PLACES], text)
    close(values(tree, {"u": np.array(PLACES), "k": K}) * np.ones(len(PLACES)), text)


@pytest.mark.slow
def test_the_compiled_lane_has_the_bits_of_the_plain_one() -> None:
    module = kernel_text.Module("", given=primitives.NAMES)
    for name, function in ELEMENTARY.items():
        kernel_text.collect(module, function.full, name, {}, is_called=True)
    lines = ["@called", "def corpus(u, k, found):"]
    for i, formula in enumerate(CORPUS):
        statements = to_statements({f"found[{i}]": parse(formula, ("u", "k"))})
        lines += [f"    {line}" for line in statements]
    text = module.text + "\n".join(lines)
    corpus = link(machine_code(text, "corpus", "f f f1"), "corpus", "f f f1")
    for j, u in enumerate(PLACES):
        found = np.empty(len(CORPUS))
        corpus(u, K, found)
        plain = [evaluate(parse(text, ("u", "k")), {"u": u, "k": K}) for text in CORPUS]
        assert found.tolist() == plain
        np.testing.assert_allclose(
            found, [TRUE[text][j] for text in CORPUS], rtol=40 * 2.0**-52, atol=40 * 2.0**-52
        )


BROKEN = {
    "heaviside(u)": [0.0],
    "heaviside(u - 1)": [1.0],
    "3*heaviside(1 - 2*u)": [0.5],
    "sign(u + 0.5)": [-0.5],
    "abs(u - 1)": [1.0],
    "floor(u)": range(-5, 6),
    "ceil(2*u - k)": [0.5 * (n + 1.7) for n in range(-12, 12)],
    "round(u/2)": [2 * n + 1 for n in range(-3, 4)],
    "mod(u, k)": [1.7 * n for n in range(-3, 4)],
    "mod(3*u + 1, -k)": [(1.7 * n - 1) / 3 for n in range(-9, 12)],
    "max(u - 1, 0)": [1.0],
    "max(k, 3 - u/2)": [2.6],
    "min(u, k)": [1.7],
    "min(-u, 1) + k*max(u, k)": [-1.0, 1.7],
    "u > 1": [1.0],
    "k*(u <= -1) - (3 >= 2*u)": [-1.0, 1.5],
    "k < u": [1.7],
    "(u - 1)*heaviside(u - 1)": [1.0],
    "k*(u + u**3)*(2*u <= 3)": [1.5],
    "k*(u + u**3)*(u*2 - 1 <= 2)": [1.5],
    "sin(u) if 2*(3*u)/4 - 0.5 < 1 else u**2": [1.0],
    "(-1 < u)*(1 - u)": [-1.0],
    "-1 < u < 2": [-1.0, 2.0],
    "(k < u)*u*erf(2)": [1.7],
    "max(u - 1, 0)**1.5": [1.0],
    "max(-k - 2*u, 0)**2": [-0.85],
    "u if u < 1 else 2*u - 1": [1.0],
    "k*u + 2 if u < -1 else u if u < 1 else sin(u)": [-1.0, 1.0],
    "u if k > 1 else 2*u": [],
    "where(heaviside(u - 1), sin(u), u**3)": [1.0],
}
SMOOTH = {
    "erf(k*u)": "erf(k*u)",
    "erfc(u)": "erfc(u)",
    "erfc(-u/k)": "erfc(-u/k)",
    "asinh(2*u)": "asinh(2*u)",
    "atanh(u/6)": "atanh(u/6)",
    "expm1(k*u)": "expm1(k*u)",
    "expm1(-u)": "expm1(-u)",
    "cbrt(k*u)": "cbrt(k*u)",
}
_MP: dict[str, Any] = {
    **{
        name: getattr(mp, name)
        for name in ("asinh", "atanh", "ceil", "erf", "erfc", "expm1", "floor")
    },
    **{"abs": abs, "cbrt": root3, "max": max, "min": min, "mod": rest, "round": mp.nint},
    **{"sin": mp.sin, "where": lambda condition, yes, no: yes if condition else no},
    **{"sign": mp.sign, "heaviside": lambda x: (1 + mp.sign(x)) / 2, "k": mp.mpf(1.7)},
}


def true_integrals(text: str, places: Sequence[float], breaks: Any) -> dict[float, float]:
    """Return the integrals from 0 with 30 digits, piece by piece between the places and the breaks."""
    code = compile(text, "formula", "eval")
    found = {}
    with mp.workdps(30):
        for side in (1.0, -1.0):
            # a break belongs to no piece: it is not exactly where the numbers of the formula have it
            ends = sorted({abs(x) for x in (*places, *breaks) if side * x > 0.0})
            total = mp.mpf(0)
            for a, b in itertools.pairwise(mp.mpf(side * end) for end in (0.0, *ends)):
                if side * b > max((side * u for u in places), default=0.0):
                    break
                total += mp.quad(lambda x: mp.mpf(eval(code, {**_MP, "u": x})), [a, (a + b) / 2, b])
                found[float(b)] = float(total)
    return {u: found[u] for u in places}


@pytest.mark.parametrize("text", thinned([*BROKEN, *SMOOTH], 3))
def test_integral_across_corners_and_jumps(text: str) -> None:
    tree = parse(text, ("u", "k"))
    assert has_rule(tree, "u")
    rule = integral(tree, "u")
    places = [-4.3, -1.2, -0.3, 1e-3, 0.7, 1.6, 2.9, 4.9]
    for u, true in true_integrals(text, places, BROKEN.get(text, [0.0])).items():
        found = float(values(rule, {"u": u, "k": 1.7}))
        assert found == pytest.approx(true, rel=2e-13, abs=2e-14), u


@pytest.mark.parametrize("slope", ["k", "0", "(k*k)"])
@pytest.mark.parametrize(
    "text",
    [
        "sin({}*u)", "cos({}*u)", "exp(-{}*u)", "erfc({}*u)", "abs({}*u - 1)", "floor({}*u + 2.5)",
        "mod({}*u + 1.2, 0.5)", "max({}*u - 1, 0)", "min({}*u, 0.4)", "{}*u < 0.3", "max({}*u + 2, 0)**1.5",
    ],
)  # fmt: skip
def test_without_a_slope_a_function_is_a_constant(text: str, slope: str) -> None:
    tree = parse(text.format(slope), ("u", "k"))
    assert has_rule(tree, "u")
    for u in (-1.7, 0.0, 2.3):
        numbers = {"u": u, "k": 0.0}
        constant = float(values(tree, numbers))
        assert float(values(integral(tree, "u"), numbers)) == pytest.approx(constant * u, rel=1e-15)


@pytest.mark.parametrize("text", [*SMOOTH, "mod(u, k)", "floor(u)", "abs(u)", "heaviside(u)"])
def test_a_small_energy_has_all_its_digits(text: str) -> None:
    rule = integral(parse(text, ("u", "k")), "u")
    for u, true in true_integrals(text, [1e-9, -1e-9, 1e-4, -0.01], [0.0]).items():
        found = float(values(rule, {"u": u, "k": 1.7}))
        assert found == pytest.approx(true, rel=1e-13, abs=0.0), u


@pytest.mark.parametrize(
    "text",
    [
        "max(u, k*u)",
        "u == 1",
        "hypot(u, 1)",
        "log1p(u)",
        "mod(k, u)",
        "u*(k*u > 1)",
        "u*(u > u**2)",
    ],
)
def test_what_has_no_rule_is_left_to_points(text: str) -> None:
    assert not has_rule(parse(text, ("u", "k")), "u")


@pytest.mark.parametrize(
    ("inner", "outer"), [("u", "(u > 1)*({})"), ("u", "u if u > 1 else {}"), ("u", "max(u, {})")]
)
def test_the_integral_of_conditions_in_each_other_stays_short(inner: str, outer: str) -> None:
    text = inner
    while len(longer := outer.format(text)) < 600:
        text = longer
    assert sum(1 for _ in walk(integral(parse(text, ("u",)), "u"))) < 50_000


@pytest.mark.parametrize("text", ["atanh(1.5)", "acosh(0.5)", "log1p(-2)", "mod(1, 0)", "log2(0)"])
def test_a_constant_without_a_value_is_told(text: str) -> None:
    assert not math.isfinite(float(values(parse(text, ()), {})))
    with pytest.raises(Exception, match="no finite value"):
        evaluate(parse(text, ()), {}, text)


@pytest.mark.parametrize("exponent", ["-(2 + 1)", "2*3", "-k", "5", "-7", "2**3", "k - 5"])
def test_a_constant_power_has_the_bits_of_the_engine(exponent):
    """Only a whole exponent that is written as a number is a multiplication."""
    formula = parse(f"u**({exponent})", ("u", "k"))
    text = "\n".join([*to_statements({"found": formula}), ""])
    for u in (0.1, 1e-3, 1.7, 12.25, 3.0):
        numbers = {"u": u, "k": 8.0, "power": ELEMENTARY["power"].full}
        exec(text, numbers)
        assert evaluate(formula, {"u": u, "k": 8.0}) == numbers["found"]
