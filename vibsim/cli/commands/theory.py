"""``vibsim theory``: print the theory of a scheme on ``u'' + w^2 u = 0`` as formulas in ``p = w dt``.

Source: vibration text (B), sections 4.1, 4.3 and 5.6, exercises 7 and 17; the formulas are those of
`vibsim.theory.symbolic`.
"""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from vibsim.cli.jobs.common import refusal
from vibsim.cli.list_entry import Row, choices, laid_out, scheme_named, stable_until
from vibsim.core.errors import nearest

if TYPE_CHECKING:
    from vibsim.schemes import AnyOption, Options, Scheme
    from vibsim.schemes.base import Stepper
    from vibsim.theory.operators import Equation, Term

_LONGEST = 10**6  # fractions of larger numbers are written as decimals, as are roots
_DIGITS, _PRECISE = 8, 40  # digits of decimals in the output, and in the computation


def theory(options: Namespace) -> int:
    """Print characteristic polynomial, stability limit, series and solution of a scheme.

    Raises InputError where the scheme or an option is unknown, and for a scheme that chooses its own steps.
    """
    scheme = scheme_named(options.scheme)
    if scheme.adaptive:
        rule = "chooses its own steps: there is no theory in w dt"
        raise refusal("SCHEME", scheme.kind, rule)
    chosen = _options(scheme, options.options)
    print(*laid_out(theory_rows(scheme, chosen, options.terms)), sep="\n")
    return 0


def theory_rows(scheme: Scheme, options: Options, terms: int) -> Iterator[Row]:
    """Yield the theory of a scheme with constant steps; each series has `terms` terms."""
    from vibsim.theory import NoSeriesError, operators, symbolic

    stepper = scheme.stepper(options)
    changed = (f"{k} = {v}" for k, v in options.items() if v != scheme.defaults()[k])
    yield "scheme", "; ".join((f"{scheme.kind}: {scheme.title}", *changed))
    yield "problem", "u'' + w^2 u = 0, u(0) = I, u'(0) = V; p = w dt"
    yield "stability limit", stable_until(scheme, options)
    try:
        polynomial = operators.recurrence(stepper)
    except NoSeriesError as reason:
        yield "formulas", f"not written: {reason}"
        return
    yield "roots", f"{_characteristic(polynomial)} = 0"
    try:
        yield from [*_series_rows(scheme, options, terms)]
    except NoSeriesError as reason:
        yield "series", f"not written: {reason}, so the scheme is not one for this equation"
    yield from _in_operators(stepper)
    try:
        parts = symbolic.two_roots(stepper)
    except ValueError as reason:
        yield "solution", f"not written: {reason}"
        return
    yield "solution", "u_n = r^n (I cos(n th) + (u_1/r - I cos(th)) sin(n th)/sin(th)), with"
    yield "", f"r = {_number(parts.growth)}"
    yield "", f"cos(th) = {_number(parts.cosine)}"
    yield "", f"u_1 = {_sum(zip(parts.first, ('I', 'V dt'), strict=True))}"


def _series_rows(scheme: Scheme, options: Options, terms: int) -> Iterator[Row]:
    """Yield the results that are series in p; raise ValueError where the frequency does not tend to w."""
    from vibsim.theory import operators, symbolic

    stepper = scheme.stepper(options)

    def series(formula: Any) -> str:
        return f"{_number(formula)} + O({_number(symbolic.symbol('p') ** (2 * terms))})"

    growth = series(symbolic.growth_series(stepper, terms))
    yield "amplitude", f"changes by the factor r = {growth} in each step"
    yield "frequency", f"w~/w = {series(symbolic.frequency_series(stepper, terms))}"
    early = series(symbolic.phase_error_series(stepper, terms))
    yield "phase", f"peaks come early by 1 - w/w~ = {early} of a period, in each period"
    error, following = map(_number, symbolic.error_series(stepper))
    has_parasites = len(operators.recurrence(stepper)) > 3
    late = ", once parasitic roots have died out" if has_parasites else ""
    yield "error", f"u(t) - u_n = I ({error}) + O({following}) at a time t, for V = 0{late}"
    yield "limits", _limits(scheme, options, stepper)


def _limits(scheme: Scheme, options: Options, stepper: Stepper) -> str:
    """Return the limits of the numerical frequency for small steps and at the stability limit."""
    from vibsim.theory import roots, stability_limit, symbolic

    small = f"w~/w -> {_number(symbolic.frequency_series(stepper, 1))} as p -> 0"
    limit = stability_limit(scheme, options)
    if not 0.0 < limit < math.inf:
        return small
    angle = float(roots(stepper, limit).angle)
    # at a double root only half of the digits are correct
    angle = next((x for x in (0.0, math.pi) if abs(angle - x) < 1e-6), angle)
    turned = "pi" if angle == math.pi else f"{angle:.6g}"
    return f"{small}; w~ dt -> {turned} and w~/w -> {angle / limit:.6g} as p -> {limit:.6g}"


def _characteristic(factors: Sequence[Any]) -> str:
    """Return the characteristic polynomial in powers of x, without its zero roots."""
    from vibsim.theory.symbolic import symbol

    powers = [symbol("x") ** k for k in reversed(range(len(factors)))]
    return _sum(zip(factors, [*map(_number, powers[:-1]), ""], strict=True))


def _in_operators(stepper: Stepper) -> Iterator[Row]:
    """Yield the scheme in operator notation, without and with its velocity, and the definitions of the operators."""
    from vibsim.theory import operators

    first, *others = operators.recurrence(stepper)
    times = [_at("u", Fraction(1 - k)) for k in range(len(others) + 1)]
    right = _sum(zip((-factor for factor in others), times[1:], strict=True))
    yield "without v", f"{_sum([(first, times[0])])} = {right}"
    rows = [_equation(operators.without_velocity(stepper))]
    with suppress(ValueError):
        rows.append(f"with all at one time: {_equation(operators.at_one_time(stepper))}")
    yield from (("", row) for row in rows)
    with suppress(ValueError):
        rows.append(", ".join(map(_equation, operators.with_velocity(stepper))))
        yield "with v", rows[-1]
    used = [name for name in operators.NOTATION if any(f"{name} " in row for row in rows)]
    texts = (f"[{name} u]^n = {operators.NOTATION[name]}" for name in used)
    yield "operators", "; ".join(texts)


def _number(formula: Any) -> str:
    """Return a formula or a number as text."""
    from sympy import sstr

    written = str(sstr(_short(formula), order="rev-lex", full_prec=False))
    return written.replace("**", "^").replace("*", " ")


def _sum(terms: Iterable[tuple[Any, str]]) -> str:
    """Return a sum of terms, each a coefficient and a possibly empty factor; zero terms are left out."""
    written = ""
    for coefficient, factor in terms:
        if coefficient == 0:
            continue
        number = _number(coefficient)
        is_negative = number.startswith("-")
        if is_negative:
            number = _number(-coefficient)
        if factor and number == "1":
            number = ""
        elif factor and not number.isalnum():
            number = f"({number})"
        sign = "-" if is_negative else "+"
        written += f" {sign} " if written else sign.strip("+")
        written += f"{number} {factor}".strip()
    return written


def _at(quantity: str, shift: Fraction) -> str:
    """Return a quantity at the time ``n + shift``."""
    time = f"(n{'+' if shift > 0 else '-'}{abs(shift)})" if shift else "n"
    return f"{quantity}^{time}"


def _equation(equation: Equation) -> str:
    """Return an equation with operators, in one pair of brackets if all terms are at the same time."""
    from vibsim.theory.symbolic import symbol

    places = {term.place for side in equation for term in side}

    def text(term: Term) -> str:
        powers = (("w", term.powers[0]), ("dt", term.powers[1]))
        scale = [_number(symbol(name) ** power) for name, power in powers if power]
        operand = " ".join((*term.operators, term.of))
        if len(places) > 1:
            operand = _at(f"[{operand}]" if term.operators else term.of, term.place)
        return " ".join((*scale, operand))

    left, right = (_sum((term.factor, text(term)) for term in side) or "0" for side in equation)
    if len(places) > 1:
        return f"{left} = {right}"
    return _at(f"[{left} = {right}]", places.pop())


def _short(formula: Any) -> Any:
    """Return a formula with roots, long decimals, and fractions of large numbers, as short decimals."""
    from sympy import Float, Integer, Pow, Rational, fraction, together

    from vibsim.theory.symbolic import symbol

    is_long = any(max(abs(x.p), x.q) > _LONGEST for x in formula.atoms(Rational))
    has_roots = any(x.is_number and not x.is_Rational for x in formula.atoms(Pow))
    if not is_long and not has_roots and not formula.atoms(Float):
        return formula
    numerator, denominator = (x.expand().evalf(_PRECISE) for x in fraction(together(formula)))
    scale = denominator.subs(symbol("p"), 0)
    rounded = ((numerator / scale).expand() / (denominator / scale).expand()).evalf(_DIGITS)
    return rounded.xreplace({x: Integer(x) for x in rounded.atoms(Float) if float(x).is_integer()})


def _options(scheme: Scheme, words: Sequence[str]) -> Options:
    """Return the options of a scheme: its defaults, changed by words of the form ``NAME=VALUE``."""
    known = {option.name: option for option in scheme.options}
    values: dict[str, str | float | bool] = {**scheme.defaults()}
    for word in words:
        name, equals, value = word.partition("=")
        if name not in known:
            hint = nearest(name, list(known)) if known else "it has none"
            raise refusal("OPTION", name, f"is not an option of {scheme.kind}", hint)
        if not equals:
            raise refusal("OPTION", word, "needs a value", f"such as {name}={values[name]}")
        values[name] = _value(known[name], value)
    return values


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
    raise refusal(option.name, text, "is not a valid value", hint)
