"""The words of a report: statuses, reasons, symbols and numbers, for a reader who meets them for the first time."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from vibsim.checks.notation import Notation
from vibsim.core import vocabulary
from vibsim.core.vocabulary import (
    AMPLITUDE,
    CENTRED,
    PHASE,
    TYPICAL_NORM,
    is_error_part,
    order_interval,
    plain_name,
    whole_of,
)
from vibsim.experiment.value_names import VALUES

NAMES = {
    "theta": ("θ", "the angle θ"),
    "omega": ("ω", "the angular velocity ω"),
    "energy": ("E", "the energy E"),
    "kinetic_energy": ("T", "the kinetic energy T"),
    "potential_energy": ("V", "the potential energy V"),
    "energy_deviation": ("ΔE", "the energy deviation ΔE = E(t) − E(0)"),
}
"""Letter and words of quantities; others go by their name."""

PARTS = {PHASE: ("φ({})", "phase error of {}"), AMPLITUDE: ("a({})", "amplitude error of {}")}
"""Of a part of a position's error, by the end of its name: letter and words."""


_KEY = re.compile(r"\b(initial|model(?:\.parameters)?|schemes|time)\.(\w+)(?:\.(\w+))?")
"""A swept key: its section, and one or two names."""


def swept(text: str) -> str:
    """Return a text with swept keys in the words of a page, such as `linear damping` for `model.damping.linear`.

    Dotted keys belong to experiment files, tables and commands.
    """

    def key(found: re.Match[str]) -> str:
        section, outer, inner = found.groups()
        if section == "initial":
            return f"initial {NAMES.get(outer, (outer,))[0]}"
        between = " of " if section == "schemes" else " "
        return f"{inner}{between}{outer}" if inner else outer

    return _KEY.sub(key, text).replace(" = -", " = −")


def _named(quantity: str) -> tuple[str, str]:
    """Return the letter and the words of a quantity, or of a part of a position's error."""
    if is_error_part(quantity):
        whole = whole_of(quantity)
        letter = symbol(whole)
        part, text = (form.format(letter) for form in PARTS[quantity.removeprefix(whole)])
        return part, text
    plain = plain_name(quantity)
    letter, text = NAMES.get(plain, (plain, plain))
    if plain == quantity:
        return letter, text
    return f"{letter} by [D₂ₜu]", f"{text} by the centred difference [D₂ₜu]"


def symbol(quantity: str) -> str:
    """Return the letter of a quantity; its name where it has none."""
    return _named(quantity)[0]


def title(quantity: str) -> str:
    """Return a quantity as it stands in the title of a figure, and in a sentence: its letter, or a part in words."""
    return _named(quantity)[is_error_part(quantity)]


def name(quantity: str) -> str:
    """Return a quantity in words."""
    letter, text = _named(quantity)
    return f"the {text}, {letter}" if is_error_part(quantity) else text


_LETTERED = NAMES.keys() - {"energy"}
"""Names that are no English words."""


def labelled(text: str, quantity: str | None) -> str:
    """Return a sentence on a quantity with the labels of a page for names; what stands between backticks is code."""
    names, ends = "|".join(filter(None, {*_LETTERED, quantity})), "|".join((CENTRED, *PARTS))
    word = re.compile(rf"(?<![\w.])({names})({ends})?(?!\w|\.\w)")
    parts = text.split("`")
    parts[::2] = [word.sub(lambda found: title(found.group()), part) for part in parts[::2]]
    return "`".join(parts)


def passed(statuses: Sequence[str], one: str = "check", many: str = "checks") -> str:
    """Say how many of some checks passed: `9 of 9 checks`, `1 of 3 checks passed`."""
    if not statuses:
        return f"no {one}"
    count, total = statuses.count("PASS"), len(statuses)
    # beside FAIL a bare count would be that of the failures
    return f"{count} of {total} {one if total == 1 else many}{' passed' * (count < total)}"


BADGES = {"PASS": "passed", "INCONCLUSIVE": "undecided", "FAIL": "failed"}
TRAP, REFUTED, CLAIMED = "trap caught", "refuted", "as claimed"
"""Words on a check that expected a failure and got it, and on a statement that is false or true as expected."""


def badge(check: Mapping[str, Any]) -> str:
    """Return the word on a check of a summary: passed, as claimed, trap caught, refuted, undecided or failed."""
    if check["status"] != "PASS":
        return BADGES.get(check["status"], str(check["status"]))
    if check["kind"] == "claim":
        return REFUTED if is_trap(check) else CLAIMED
    return TRAP if is_trap(check) else BADGES["PASS"]


MARKS = TRAP, REFUTED
"""Words on checks that are told beside a verdict: that something went wrong, as expected."""


def marks(checks: Sequence[Mapping[str, Any]]) -> list[tuple[str, int]]:
    """Return those of `MARKS` that checks have, with the number of checks."""
    found = [badge(check) for check in checks]
    return [(mark, found.count(mark)) for mark in MARKS if mark in found]


def is_trap(check: Mapping[str, Any]) -> bool:
    """Say whether a check of a summary expects a failure, or a statement to be false."""
    if check["kind"] == "claim":
        return bool(check["expected"] == "false")
    return str(check["expected"]).startswith(("FAIL", "INCONCLUSIVE"))


def broken(summary: Mapping[str, Any]) -> int:
    """Return the number of runs that broke down, listed or not."""
    return int(summary.get("failure_count") or len(summary.get("failures") or []))


ERRORS = {
    "error_linf": "largest error", "error_linf_interior": "largest error without the last point",
    "error_l1": "error in the L1 norm", "error_l2": "error in the L2 norm",
}  # fmt: skip
"""Words for the errors in a norm."""
NORMS = {
    "l1": "L1 norm", "l2": "L2 norm", "linf": "largest value", "linf_interior": "largest value without the last point",
}  # fmt: skip
"""Words for the norms over time."""
USUAL_NORM = NORMS[TYPICAL_NORM]
DIGITS = {"brief": 2, "close": 7, "full": 10, "step": 6, "value": 12}  # significant digits of forms
LEAST_PERCENT = 1e-5  # of a whole, that is written in per cent
MORE_DIGITS = 2  # of a number beside a printed one
MOST_DIGITS = 11  # characters of a mantissa that are read
PROSE = {"phase", "amplitude", "largest"} | {name.partition("_")[0] for name in VALUES}
"""With what the name of a value, or of a part of an error, begins."""


RAISE, LOWER = (str.maketrans("-0123456789", to) for to in ("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "₋₀₁₂₃₄₅₆₇₈₉"))
"""Digits to superscripts, and to subscripts."""


def power(exponent: int) -> str:
    """Write a power of ten in Unicode."""
    return "10" + str(exponent).translate(RAISE)


_FLOAT = re.compile(r"\b\d[\d.]*e[-+]?\d+\b")


class _Page(Notation):
    """The notation of a page: letters for quantities, words for values, powers of ten."""

    def quantity(self, name: str) -> str:
        return title(name)

    def value(self, name: str) -> str:
        return ERRORS.get(name, name.replace(CENTRED, " by [D₂ₜu]").replace("_", " "))

    def opening(self, text: str) -> str:
        # a letter of mathematics stays as it is
        return text[:1].upper() + text[1:] if text.partition(" ")[0] in PROSE else text

    def digits(self, text: str) -> str:
        mantissa, has_power, exponent = text.partition("e")
        if len(mantissa) > MOST_DIGITS or (mantissa.endswith(".0") and not has_power):
            mantissa = f"{float(mantissa):.10g}"
        mantissa = mantissa.replace("-", "−")
        if not has_power:
            return mantissa
        ten = power(int(exponent))
        return mantissa.replace("1", ten) if mantissa in ("1", "−1") else f"{mantissa}·{ten}"

    def powers(self, text: str) -> str:
        """Write the powers of ten in a sentence that was made for a terminal."""
        return _FLOAT.sub(lambda found: self.digits(found.group()), text)


PAGE = _Page()


def number(value: Any, form: str = "norm") -> str:
    """Write a number for reading; a dash for NaN and None.

    Forms are ``norm``: 4 significant digits; ``small``: the same, always with a power of ten; ``order``: 3 decimals;
    ``integer``; ``close``, ``full``: 7 and 10 significant digits; ``brief``: 2; ``step``, ``value``: up to 6 and 12
    significant digits, no trailing zeros.
    """
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if isinstance(value, float) and math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if form == "integer":
        return f"{int(value):,}".replace(",", "\N{NARROW NO-BREAK SPACE}").replace("-", "−")
    if form == "order":
        return f"{value:.3f}".replace("-", "−") if abs(value) < 1e4 else number(value)
    text = _significant(float(value), DIGITS.get(form, 4), fixed=form != "small")
    if form not in {"step", "value"} or "." not in text:
        return text
    mantissa, dot, exponent = text.partition("·")
    return mantissa.rstrip("0").rstrip(".") + dot + exponent


def ceiling(size: float) -> str:
    """Write a positive number with two digits that are not less than it."""
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    return number(math.ceil(size / unit) * unit, "brief")


def share(part: float) -> str:
    """Write a part of a whole: in per cent, or as a power of ten where it is very small."""
    return f"{number(100.0 * part, 'brief')} %" if part >= LEAST_PERCENT else number(part, "brief")


def printed(text: str) -> str:
    """Write a number as a source printed it, digit by digit, a power of ten in Unicode: ``1.120e8``."""
    found = re.fullmatch(r"\s*(.+?)\s*(?:[eE]|[x*·×]?\s*10\s*\^\s*)\{?([-+]?\d+)\}?\s*", text)
    if found is None:
        return text.strip().replace("-", "−")
    return f"{found[1]}·{power(int(found[2]))}".replace("-", "−")


def like(value: float, text: str) -> str:
    """Write a number in the manner of a printed one, with `MORE_DIGITS` behind those of `text`."""
    if not math.isfinite(value):
        return number(value)
    mantissa, _, _ = printed(text).partition("·")
    places = len(mantissa.partition(".")[2])
    if "·" in printed(text) and value != 0.0:
        head, exponent = f"{value:.{places + MORE_DIGITS}e}".split("e")
        return f"{head}·{power(int(exponent))}".replace("-", "−", 1)
    return f"{value:.{places + MORE_DIGITS}f}".replace("-", "−")


def _significant(value: float, digits: int, fixed: bool) -> str:
    if value == 0.0:
        return "0"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    if fixed and -3 <= int(exponent) < digits:
        return f"{value:.{digits - 1 - int(exponent)}f}".replace("-", "−")
    return f"{mantissa}·{power(int(exponent))}".replace("-", "−", 1)


def lowered(level: int) -> str:
    """Write a level as a subscript."""
    return str(level).translate(LOWER)


def raised(exponent: float) -> str:
    """Write an exponent: in Unicode where it is whole."""
    return power(int(exponent))[2:] if exponent == int(exponent) else f"^{exponent:g}"


def factor(value: float, base: float) -> str:
    """Write the factor of a rescaled curve, a large one as a power of `base` where it is one; empty for 1."""
    if value == 1.0:
        return ""
    exponent = round(math.log(value, base)) if base > 1.0 and value > 0.0 else 0
    is_power = base == int(base) and math.isclose(value, base**exponent, rel_tol=1e-9)
    if value < 1e3 or not is_power:
        return f"{number(float(value), 'step')} "
    return f"{int(base)}{raised(exponent)} "


def interval(bounds: Sequence[float | None] | None) -> str:
    """Write the interval of an order."""
    known = [b for b in bounds or () if b is not None and not math.isnan(b)]
    if len(known) < 2:
        return "–"
    if max(map(abs, known)) >= 1e4:
        return " to ".join(number(end, "order") for end in known)
    return " to ".join(end.replace("-", "−") for end in order_interval(*known))


def likely(bounds: Sequence[float | None] | None) -> str:
    """Write the interval of an order with what it is; empty where there is none."""
    text = interval(bounds)
    return f"95 % interval {text}" if text != "–" else ""


def with_interval(order: float | None, bounds: Sequence[float | None] | None) -> str:
    """Write an order, and in brackets its interval."""
    text = interval(bounds)
    return f"{number(order, 'order')}{f' ({text})' if text != '–' else ''}"


def levels(window: Sequence[int] | None) -> str:
    """Write the levels that a verdict rests on."""
    found = [level for level in window or () if level is not None]
    if not found:
        return "–"
    return str(found[0]) if len(found) == 1 else f"{min(found)} to {max(found)}"


def fact(result: Mapping[str, Any], name: str) -> Any:
    """Return a fact of a result in a summary; None where it has none."""
    return (result.get("facts") or {}).get(name)


def interval_of(result: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return the interval of the order of a result."""
    low, high = fact(result, "order_low"), fact(result, "order_high")
    has_order = None not in (fact(result, "order"), low, high)
    return (low, high) if has_order else None


def levels_of(result: Mapping[str, Any]) -> Sequence[int] | None:
    """Return the first and the last level that the order of a result rests on."""
    return None if fact(result, "order") is None else fact(result, "levels")


def number_of(result: Mapping[str, Any]) -> float | None:
    """Return the number that decides a result."""
    return vocabulary.decisive_number(result.get("facts") or {})


def measured(result: Mapping[str, Any]) -> tuple[Any, ...]:
    """Return the cells of a result: order, ends of its interval, levels, the number that decides, and `ERROR_FACTS`."""
    low, high = interval_of(result) or (None, None)
    window = levels_of(result)
    of_order = fact(result, "order"), low, high, levels(window) if window else None
    return (*of_order, number_of(result), *(fact(result, name) for name in vocabulary.ERROR_FACTS))
