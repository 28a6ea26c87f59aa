"""``vibsim theory``: what a scheme makes of ``u'' + w^2 u = 0``, as formulas in ``p = w dt``.

Source: vibration text (B), sections 4.1, 4.3 and 5.6, exercises 7 and 17; the formulas are those of
`vibsim.theory.symbolic`.
"""

from __future__ import annotations

import math
import re
from argparse import Namespace
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

from vibsim.cli.jobs.common import refusal
from vibsim.cli.list_entry import Row, choices, laid_out, scheme_named, stable_until
from vibsim.core.errors import nearest

if TYPE_CHECKING:
    from vibsim.schemes import AnyOption, Options, Scheme
    from vibsim.schemes.base import Stepper
    from vibsim.theory.operators import Equation, Term

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
    from vibsim.theory import operators, symbolic

    stepper, notation = scheme.stepper(options), _Notation(latex)
    write = notation.number
    changed = (f"{k} = {v}" for k, v in options.items() if v != scheme.defaults()[k])
    yield "scheme", "; ".join((f"{scheme.kind}: {scheme.title}", *changed))
    yield "problem", "u'' + w^2 u = 0, u(0) = I, u'(0) = V; p = w dt"
    yield "stability limit", stable_until(scheme, options)
    yield "roots", f"{_characteristic(operators.recurrence(stepper), notation)} = 0"
    try:
        yield from [*_series_rows(scheme, options, terms, notation)]
    except ValueError:
        reason = "the numerical frequency does not tend to w as dt tends to 0"
        yield "series", f"not written: {reason}, so the scheme is not one for this equation"
    yield from _in_operators(stepper, notation)
    try:
        parts = symbolic.two_roots(stepper)
    except ValueError as reason:
        yield "solution", f"not written: {reason}"
        return
    yield "solution", "u_n = r^n (I cos(n th) + (u_1/r - I cos(th)) sin(n th)/sin(th)), with"
    yield "", f"r = {write(parts.growth)}"
    yield "", f"cos(th) = {write(parts.cosine)}"
    yield "", f"u_1 = {notation.sum(zip(parts.first, ('I', 'V dt'), strict=True))}"


def _series_rows(
    scheme: Scheme, options: Options, terms: int, notation: _Notation
) -> Iterator[Row]:
    """Yield what is known as series in p; ValueError where the frequency does not begin with w."""
    from vibsim.theory import operators, symbolic

    stepper, write = scheme.stepper(options), notation.number

    def series(formula: Any) -> str:
        return f"{write(formula)} + O({write(symbolic.symbol('p') ** (2 * terms))})"

    growth = series(symbolic.growth_series(stepper, terms))
    yield "amplitude", f"changes by the factor r = {growth} in each step"
    yield "frequency", f"w~/w = {series(symbolic.frequency_series(stepper, terms))}"
    early = series(symbolic.phase_error_series(stepper, terms))
    yield "phase", f"peaks come early by 1 - w/w~ = {early} of a period, in each period"
    error, following = map(write, symbolic.error_series(stepper))
    has_parasites = len(operators.recurrence(stepper)) > 3
    late = ", once parasitic roots have died out" if has_parasites else ""
    yield "error", f"u(t) - u_n = I ({error}) + O({following}) at a time t, for V = 0{late}"
    yield "limits", _limits(scheme, options, stepper, notation)


def _limits(scheme: Scheme, options: Options, stepper: Stepper, notation: _Notation) -> str:
    """Say what the frequency tends to for small steps, and where the scheme begins to grow."""
    from vibsim.theory import roots, stability_limit, symbolic

    small = f"w~/w -> {notation.number(symbolic.frequency_series(stepper, 1))} as p -> 0"
    limit = stability_limit(scheme, options)
    if not 0.0 < limit < math.inf:
        return small
    angle = float(roots(stepper, limit).angle)
    # where the roots meet, half of the digits are left
    angle = next((x for x in (0.0, math.pi) if abs(angle - x) < 1e-6), angle)
    turned = "pi" if angle == math.pi else f"{angle:.6g}"
    return f"{small}; w~ dt -> {turned} and w~/w -> {angle / limit:.6g} as p -> {limit:.6g}"


def _characteristic(factors: Sequence[Any], notation: _Notation) -> str:
    """Write the characteristic polynomial, without roots that are 0, by powers of x."""
    from vibsim.theory.symbolic import symbol

    powers = [symbol("x") ** k for k in reversed(range(len(factors)))]
    return notation.sum(zip(factors, [*map(notation.number, powers[:-1]), ""], strict=True))


def _in_operators(stepper: Stepper, notation: _Notation) -> Iterator[Row]:
    """Yield a scheme with and without its velocity, and what the operators mean that were needed."""
    from vibsim.theory import operators

    equation = notation.equation
    first, *others = operators.recurrence(stepper)
    times = [notation.at("u", Fraction(1 - k)) for k in range(len(others) + 1)]
    right = notation.sum(zip((-factor for factor in others), times[1:], strict=True))
    yield "without v", f"{notation.sum([(first, times[0])])} = {right}"
    rows = [equation(operators.without_velocity(stepper))]
    with suppress(ValueError):
        rows.append(f"with all at one time: {equation(operators.at_one_time(stepper))}")
    yield from (("", row) for row in rows)
    with suppress(ValueError):
        rows.append(", ".join(map(equation, operators.with_velocity(stepper))))
        yield "with v", rows[-1]
    definitions = {notation.operator(name): means for name, means in operators.NOTATION.items()}
    if notation.is_latex:
        braces = partial(re.sub, r"\^\(([^)]*)\)", r"^{\1}")
        definitions = {name: braces(means) for name, means in definitions.items()}
    used = [name for name in definitions if any(f"{name} " in row for row in rows)]
    texts = (f"{notation.at(f'[{x} u]', Fraction(0))} = {definitions[x]}" for x in used)
    yield "operators", "; ".join(texts)


@dataclass(frozen=True)
class _Notation:
    """How formulas are written: plainly, or as LaTeX."""

    is_latex: bool

    def number(self, formula: Any) -> str:
        """Write a formula or a number."""
        from sympy import latex, sstr

        write = latex if self.is_latex else sstr
        written = str(write(_short(formula), order="rev-lex", full_prec=False))
        return written if self.is_latex else written.replace("**", "^").replace("*", " ")

    def sum(self, terms: Iterable[tuple[Any, str]]) -> str:
        """Write a sum of coefficients times what they are of, which may be nothing; those that are 0 are left out."""
        written = ""
        for factor, of in terms:
            if factor == 0:
                continue
            number = self.number(factor)
            is_less = number.startswith("-")
            if is_less:
                number = self.number(-factor)
            if of and number == "1":
                number = ""
            elif of and not number.isalnum():
                number = f"({number})"
            sign = "-" if is_less else "+"
            written += f" {sign} " if written else sign.strip("+")
            written += f"{number} {of}".strip()
        return written

    def at(self, what: str, place: Fraction) -> str:
        """Write something at the time ``n + place``."""
        time = "n" + (f"{'+' if place > 0 else '-'}{abs(place)}" if place else "")
        if self.is_latex:
            return f"{what}^{{{time}}}"
        return f"{what}^{time if place == 0 else f'({time})'}"

    def operator(self, name: str) -> str:
        """Write the name of an operator."""
        if not self.is_latex:
            return name
        head, _, index = name.partition("_")
        if not index:
            return rf"\mathrm{{{name}}}\,"
        below = index.rstrip("+-")
        above = index.removeprefix(below)
        return f"{head}_{{{below}}}" + (f"^{{{above}}}" if above else "")

    def equation(self, equation: Equation) -> str:
        """Write terms with their operators, in one pair of brackets where they belong to one time."""
        from vibsim.theory.symbolic import symbol

        places = {term.place for side in equation for term in side}

        def term(one: Term) -> str:
            names = [self.operator(name) for name in one.operators]
            powers = (("w", one.powers[0]), ("dt", one.powers[1]))
            scale = [self.number(symbol(name) ** power) for name, power in powers if power]
            here = " ".join((*names, one.of))
            if len(places) > 1:
                here = self.at(f"[{here}]" if names else one.of, one.place)
            return " ".join((*scale, here))

        left, right = (
            self.sum((one.factor, term(one)) for one in side) or "0" for side in equation
        )
        if len(places) > 1:
            return f"{left} = {right}"
        return self.at(f"[{left} = {right}]", places.pop())


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
