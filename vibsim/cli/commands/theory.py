"""``vibsim theory``: what a scheme makes of ``u'' + w^2 u = 0``, as formulas in ``p = w dt``.

Source: vibration text (B), sections 4.1, 4.3 and 5.6, exercises 7 and 17; the formulas are those of
`vibsim.theory.symbolic`.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from vibsim.cli.entry import Row, choices, laid_out, scheme_named, stable_until
from vibsim.cli.jobs.common import refusal
from vibsim.core.errors import nearest

if TYPE_CHECKING:
    from vibsim.schemes import AnyOption, Options, Scheme

_LONGEST = 10**6
"""Fractions with larger numbers, and roots, are written as decimals."""
_DIGITS, _PRECISE = 8, 40
"""Digits that are written, and those that are computed with."""


def theory(options: Namespace) -> int:
    """Print characteristic polynomial, stability limit, series and solution of a scheme.

    Raises
    ------
    InputError
        Where there is no such scheme or option, and for a scheme that chooses its own steps.
    """
    scheme = scheme_named(options.scheme)
    if scheme.adaptive:
        rule = "chooses its own steps: there is no theory in w dt"
        raise refusal("SCHEME", scheme.kind, rule)
    given = _options(scheme, options.options)
    print(*laid_out(theory_rows(scheme, given, options.terms, latex=options.latex)), sep="\n")
    return 0


def theory_rows(scheme: Scheme, options: Options, terms: int, *, latex: bool) -> Iterator[Row]:
    """Yield the theory of a scheme with equal steps; each series has `terms` terms."""
    from vibsim.theory import symbolic

    stepper = scheme.stepper(options)
    write = _latex if latex else _plain

    def series(formula: Any) -> str:
        return f"{write(formula)} + O({write(symbolic.symbol('p') ** (2 * terms))})"

    changed = (f"{k} = {v}" for k, v in options.items() if v != scheme.defaults()[k])
    yield "scheme", "; ".join((f"{scheme.kind}: {scheme.title}", *changed))
    yield "problem", "u'' + w^2 u = 0, u(0) = I, u'(0) = V; p = w dt"
    yield "stability limit", stable_until(scheme, options)
    yield "roots", f"{_characteristic(symbolic.characteristic(stepper), write)} = 0"
    yield (
        "amplitude",
        f"changes by the factor r = {series(symbolic.growth_series(stepper, terms))} in each step",
    )
    yield "frequency", f"w~/w = {series(symbolic.frequency_series(stepper, terms))}"
    early = series(symbolic.phase_error_series(stepper, terms))
    yield "phase", f"peaks come early by 1 - w/w~ = {early} of a period, in each period"
    try:
        parts = symbolic.two_roots(stepper)
    except ValueError as reason:
        yield "solution", f"not written: {reason}"
        return
    yield "solution", "u_n = r^n (I cos(n th) + (u_1/r - I cos(th)) sin(n th)/sin(th)), with"
    yield "", f"r = {write(parts.growth)}"
    yield "", f"cos(th) = {write(parts.cosine)}"
    yield "", f"u_1 = {_sum(zip(parts.first, ('I', 'V dt'), strict=True), write)}"


def _characteristic(polynomial: Any, write: Callable[[Any], str]) -> str:
    """Write the characteristic polynomial by powers of x, without denominators and roots that are 0."""
    from sympy import Poly, fraction, together

    from vibsim.theory.symbolic import symbol

    x, p = symbol("x"), symbol("p")
    coefficients = Poly(fraction(together(polynomial))[0], x).all_coeffs()
    while coefficients[-1] == 0:
        coefficients.pop()
    scale = coefficients[0].subs(p, 0)
    powers = range(len(coefficients) - 1, -1, -1)
    rows = zip((c / scale for c in coefficients), powers, strict=True)
    return _sum(((c.expand(), write(x**k) if k else "") for c, k in rows if c != 0), write)


def _sum(terms: Iterable[tuple[Any, str]], write: Callable[[Any], str]) -> str:
    """Write a sum of coefficients times what they are of, which may be nothing."""
    rows = []
    for factor, of in terms:
        number = write(factor)
        if of and number == "1":
            number = ""
        elif " " in number or number.startswith("-"):
            number = f"({number})"
        rows.append(f"{number} {of}".strip())
    return " + ".join(rows)


def _plain(formula: Any) -> str:
    from sympy import sstr

    written = str(sstr(_short(formula), order="rev-lex", full_prec=False))
    return written.replace("**", "^").replace("*", " ")


def _latex(formula: Any) -> str:
    from sympy import latex

    return str(latex(_short(formula), order="rev-lex", full_prec=False))


def _short(formula: Any) -> Any:
    """Write roots, and fractions of large numbers, as decimals."""
    from sympy import Float, Integer, Pow, Rational, fraction, together

    from vibsim.theory.symbolic import symbol

    is_long = any(max(abs(x.p), x.q) > _LONGEST for x in formula.atoms(Rational))
    has_roots = any(x.is_number and not x.is_Rational for x in formula.atoms(Pow))
    if not is_long and not has_roots:
        return formula
    above, below = (part.expand().evalf(_PRECISE) for part in fraction(together(formula)))
    scale = below.subs(symbol("p"), 0)
    rounded = ((above / scale).expand() / (below / scale).expand()).evalf(_DIGITS)
    return rounded.xreplace({x: Integer(x) for x in rounded.atoms(Float) if float(x).is_integer()})


def _options(scheme: Scheme, words: Sequence[str]) -> Options:
    """Return the options of a scheme, some of them as ``NAME=VALUE``."""
    known = {option.name: option for option in scheme.options}
    found: dict[str, str | float | bool] = {**scheme.defaults()}
    for word in words:
        name, equals, value = word.partition("=")
        if name not in known:
            hint = nearest(name, list(known)) if known else "it has none"
            raise refusal("OPTION", name, f"is no option of {scheme.kind}", hint)
        if not equals:
            raise refusal("OPTION", word, "needs a value", f"such as {name}={found[name]}")
        found[name] = _value(known[name], value)
    return found


def _value(option: AnyOption, text: str) -> str | float | bool:
    from vibsim.formula import ExpressionError, constant
    from vibsim.schemes import Flag, Option

    hint = choices(option)
    if isinstance(option, Option):
        if text in option.choices:
            return text
    elif isinstance(option, Flag):
        if text in ("true", "false"):
            return text == "true"
    else:
        with suppress(ExpressionError):
            value = constant(text)
            if option.least <= value <= option.most:
                return value
    raise refusal(option.name, text, "is no value of this option", hint)
