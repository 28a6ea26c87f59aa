"""The elementary functions on arrays, and that what is stored uses no others."""

from __future__ import annotations

import ast
import math
from pathlib import Path

import numpy as np
import pytest

import vibsim
from vibsim.elementary import ELEMENTARY, on_arrays

ROOMS = (
    *("analysis", "apriori", "checks", "comparison", "convergence", "engine", "formula", "ladder"),
    *("models", "observe", "schemes", "simulation", "solver", "theory"),
)
OF_LIBRARIES = frozenset(
    f"{module}.{name}"
    for module in ("np", "math")
    for name in (
        *("acos", "acosh", "arccos", "arccosh", "arcsin", "arcsinh", "arctan", "arctan2"),
        *("arctanh", "asin", "asinh", "atan", "atan2", "atanh", "angle", "cbrt", "cos", "cosh"),
        *("erf", "erfc", "exp", "exp2", "expm1", "float_power", "gamma", "hypot", "lgamma", "log"),
        *("log10", "log1p", "log2", "logaddexp", "pow", "power", "sin", "sinh", "tan", "tanh"),
    )
)
ALLOWED = {
    # digits that are shown, and advice on levels: whole numbers
    *("checks/order_text.py", "checks/value_text.py"),
    *("convergence/study/figure.py", "convergence/study/notation.py"),
    "convergence/study/terminal.py",
    # a border between verdicts
    "convergence/extrapolation/thresholds.py",
}


def test_results_call_no_elementary_function_of_a_library() -> None:
    """Their last digits differ from processor to processor."""
    package, found = Path(vibsim.__file__).parent, []
    for room in ROOMS:
        for path in sorted((package / room).rglob("*.py")):
            name = str(path.relative_to(package))
            tree = ast.parse(path.read_text(encoding="utf-8"))
            used = {ast.unparse(n) for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
            if used & OF_LIBRARIES and name not in ALLOWED:
                found.append((name, sorted(used & OF_LIBRARIES)))
    assert not found


@pytest.mark.parametrize("name", ["exp", "log", "expm1", "sin", "cos", "atan2", "power", "hypot"])
def test_arrays_have_the_bits_of_single_numbers(name: str) -> None:
    """In every layout, over the whole range, and where a function has branches."""
    full = ELEMENTARY[name].full
    x = np.concatenate([np.linspace(-9.0, 9.0, 97), [0.0, -0.0, 1e300, -1e300, 1e-310, math.inf]])
    grid = [x] if full.__code__.co_argcount == 1 else [x[:, None], x[::-1][None, ::5]]
    shape = np.broadcast_shapes(*(a.shape for a in grid))
    expected = np.array(
        [
            full(*map(float, p))
            for p in zip(*(np.broadcast_to(a, shape).flat for a in grid), strict=True)
        ]
    )
    found = getattr(on_arrays, name)(*grid)
    assert found.tobytes() == expected.tobytes()
    assert np.shape(getattr(on_arrays, name)(*(a.flat[3] for a in grid))) == ()


def test_functions_of_complex_numbers() -> None:
    z = np.array([0.3 - 0.2j, -1e-9 + 2e-9j, -40.0 + 3.0j, 0.0, 2.0 - 700.0j])
    assert np.allclose(on_arrays.complex_exp(z), np.exp(z), rtol=1e-15)
    assert np.allclose(on_arrays.complex_expm1(z), np.expm1(z), rtol=4e-16)
    assert np.allclose(on_arrays.complex_product(z, z[::-1]), z * z[::-1], rtol=1e-15)
    assert np.allclose(on_arrays.complex_size(z), np.abs(z), rtol=1e-15)
    # an infinite part leaves the other one as it is
    assert on_arrays.complex_of(1.0, math.inf) == complex(1.0, math.inf)
