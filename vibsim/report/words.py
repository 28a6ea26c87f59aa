"""How a report writes statuses, reasons, symbols and numbers, for first-time readers."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from vibsim.checks.notation import Notation
from vibsim.core import vocabulary
from vibsim.core.decimals import order_interval
from vibsim.core.vocabulary import (
    AMPLITUDE,
    CENTRED,
    PHASE,
    TYPICAL_NORM,
    VECTORS,
    is_error_part,
    is_trap,
    plain_name,
    whole_of,
)
from vibsim.experiment.value_names import IN_WORDS, VALUES

NAMES = {
    "theta": ("θ", "the angle θ"),
    "omega": ("ω", "the angular velocity ω"),
    "energy": ("E", "the energy E"),
    "kinetic_energy": ("T", "the kinetic energy T"),
    "potential_energy": ("V", "the potential energy V"),
    "energy_deviation": ("ΔE", "the energy deviation ΔE = E(t) − E(0)"),
    **{name: (text := name.replace("_", " "), f"the {text}") for name in VECTORS},
}
"""Quantity to its letter and its words; other quantities go by their name."""

LETTERS = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "zeta": "ζ", "eta": "η", "theta": "θ",
    "kappa": "κ", "lambda": "λ", "mu": "μ", "nu": "ν", "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ", "psi": "ψ",
    "omega": "ω",
}  # fmt: skip
"""Name to its Greek letter; other names stay as they are."""
PARTS = {PHASE: ("φ({})", "phase error of {}"), AMPLITUDE: ("a({})", "amplitude error of {}")}
"""Suffix of a part of a position's error to its letter and its words."""
_KEY = re.compile(r"\b(initial|model(?:\.parameters)?|schemes|time)\.(\w+)(?:\.(\w+))?")
"""A swept key: its section, and one or two names."""


def swept(text: str) -> str:
    """Replace swept keys in a text by words, such as `model.damping.linear` by `linear damping`.

    Dotted keys belong to experiment files, tables and commands.
    """

    def key(match: re.Match[str]) -> str:
        section, outer, inner = match.groups()
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
    letter, text = NAMES.get(plain) or (plain.replace("_", " ") if is_phrase(plain) else plain,) * 2
    if plain == quantity:
        return letter, text
    return f"{letter} by [D₂ₜu]", f"{text} by the centred difference [D₂ₜu]"


def is_phrase(name: str) -> bool:
    """Return whether a name has several words, unlike a letter with an index: ``x_3``, ``u_left``, ``theta_left``."""
    is_letter = name.partition("_")[0] in LETTERS
    return not is_letter and re.fullmatch(r"[^\W\d_]{2,}(_[^\W\d_]{2,})+", name) is not None


def symbol(quantity: str) -> str:
    """Return the letter of a quantity, or its name if it has none."""
    return _named(quantity)[0]


def title(quantity: str) -> str:
    """Return a quantity as titles and sentences show it: its letter, or words for a part of an error or a vector."""
    return _named(quantity)[is_error_part(quantity) or quantity in VECTORS]


def name(quantity: str) -> str:
    """Return a quantity in words."""
    letter, text = _named(quantity)
    return f"the {text.replace(' of', f' {letter} of', 1)}" if is_error_part(quantity) else text


_LETTERED = NAMES.keys() - {"energy"}  # names that are not English words


def labelled(text: str, quantity: str | None) -> str:
    """Replace names of quantities in a sentence by the labels of a page; code between backticks stays as it is."""
    names, ends = "|".join(filter(None, {*_LETTERED, quantity})), "|".join((CENTRED, *PARTS))
    word = re.compile(rf"(?<![\w.])({names})({ends})?(?!\w|\.\w)")
    parts = text.split("`")
    parts[::2] = [word.sub(lambda match: title(match.group()), part) for part in parts[::2]]
    return "`".join(parts)


def capitalized(text: str) -> str:
    """Capitalize the first letter of a text, and change no other."""
    return text[:1].upper() + text[1:]


def spelled(value: str) -> str:
    """Write the name of a value, such as ``period_error``, in words."""
    return value.replace(CENTRED, " by [D₂ₜu]").replace("_", " ")


def passed(statuses: Sequence[str], one: str = "check", many: str = "checks") -> str:
    """Write how many checks passed: `9 of 9 checks`, `1 of 3 checks passed`."""
    if not statuses:
        return f"no {one}"
    count, total = statuses.count("PASS"), len(statuses)
    # beside FAIL a bare count would be that of the failures
    return f"{count} of {total} {one if total == 1 else many}{' passed' * (count < total)}"


BADGES = {"PASS": "passed", "INCONCLUSIVE": "undecided", "FAIL": "failed"}
TRAP, REFUTED, CLAIMED = "trap caught", "shown to be false", "as claimed"
"""Badges of a check that expected a failure and got it, and of a claim that is false or true as expected."""


def badge(check: Mapping[str, Any]) -> str:
    """Return the badge of a check in a summary: one of `BADGES`, or of `TRAP`, `REFUTED` and `CLAIMED`."""
    if check["status"] != "PASS":
        return BADGES.get(check["status"], str(check["status"]))
    if check["kind"] == "claim":
        return REFUTED if is_trap(check) else CLAIMED
    return TRAP if is_trap(check) else BADGES["PASS"]


MARKS = TRAP, REFUTED  # badges that are shown beside a verdict: something went wrong, as expected


def marks(checks: Sequence[Mapping[str, Any]]) -> list[tuple[str, int]]:
    """Return the `MARKS` of checks, each with its number of checks."""
    badges = [badge(check) for check in checks]
    return [(mark, badges.count(mark)) for mark in MARKS if mark in badges]


def broken(summary: Mapping[str, Any]) -> int:
    """Return the number of runs that broke down, listed or not."""
    return int(summary["failure_count"])


VALUE_NAMES = {
    "period_error": "relative error of the period",
    "error_linf": "largest error", "error_linf_interior": "largest error without the last point",
    "error_l1": "error in the L1 norm", "error_l2": "error in the L2 norm",
    "min": "least value", "max": "largest value", "running_max": "largest absolute value so far",
    "max_abs": "largest absolute value", "max_abs_interior": "largest absolute value without the last point",
    "max_abs_ratio": "ratio between levels of the largest absolute value",
    "max_abs_interior_ratio": "ratio between levels of the largest absolute value without the last point",
}  # fmt: skip
"""Words for values whose names need more than their underscores replaced."""
NORMS = {
    "l1": "L1 norm", "l2": "L2 norm", "linf": "largest value", "linf_interior": "largest value without the last point",
}  # fmt: skip
"""Words for the norms over time."""
USUAL_NORM = NORMS[TYPICAL_NORM]
DIGITS = {"brief": 2, "close": 7, "full": 10, "step": 6, "value": 12}  # significant digits by form
LEAST_PERCENT = 1e-5  # smallest fraction written in per cent
MORE_DIGITS = 2  # digits of a measured number beyond those of the printed one
MOST_DIGITS = 11  # longer mantissas are shortened
PROSE = {"the", "phase", "amplitude", "value"} | {name.partition("_")[0] for name in VALUES}
PROSE |= {text.partition(" ")[0] for text in (*VALUE_NAMES.values(), *IN_WORDS.values())}
"""First words of the names of numbers, one by one and of all members, and of parts of an error."""
RAISE, LOWER = (str.maketrans("-0123456789", to) for to in ("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "₋₀₁₂₃₄₅₆₇₈₉"))
"""Digits to superscripts, and to subscripts."""


def power(exponent: int) -> str:
    """Write a power of ten with a Unicode exponent."""
    return "10" + str(exponent).translate(RAISE)


_FLOAT = re.compile(r"\b\d[\d.]*e[-+]?\d+\b")


class _Page(Notation):
    """The notation of a page: letters for quantities, words for values, powers of ten."""

    def quantity(self, name: str) -> str:
        return title(name)

    def value(self, name: str) -> str:
        return VALUE_NAMES.get(name, spelled(name))

    def opening(self, text: str) -> str:
        # symbols keep their case
        return capitalized(text) if text.partition(" ")[0] in PROSE else text

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
        """Write the powers of ten in a sentence made for the terminal in Unicode."""
        return _FLOAT.sub(lambda match: self.digits(match.group()), text)


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
    """Write a positive number with two digits, rounded up."""
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    return number(math.ceil(size / unit) * unit, "brief")


def share(part: float) -> str:
    """Write a fraction in per cent, or as a power of ten if it is tiny."""
    return f"{number(100.0 * part, 'brief')} %" if part >= LEAST_PERCENT else number(part, "brief")


def printed(text: str) -> str:
    """Write a number with the digits that a source prints, such as ``1.120e8``, and its power of ten in Unicode."""
    match = re.fullmatch(r"\s*(.+?)\s*(?:[eE]|[x*·×]?\s*10\s*\^\s*)\{?([-+]?\d+)\}?\s*", text)
    if match is None:
        return text.strip().replace("-", "−")
    return f"{match[1]}·{power(int(match[2]))}".replace("-", "−")


def in_style_of(value: float, text: str) -> str:
    """Write a number in the notation of the printed `text`, with `MORE_DIGITS` more digits."""
    if not math.isfinite(value):
        return number(value)
    mantissa, _, _ = printed(text).partition("·")
    places = len(mantissa.partition(".")[2])
    if "·" in printed(text) and value != 0.0:
        head, exponent = f"{value:.{places + MORE_DIGITS}e}".split("e")
        return f"{head}·{power(int(exponent))}".replace("-", "−", 1)
    if abs(value) >= 10.0 ** max(MOST_DIGITS, len(mantissa)):
        return number(value)
    return f"{value:.{places + MORE_DIGITS}f}".replace("-", "−")


def _significant(value: float, digits: int, fixed: bool) -> str:
    if value == 0.0:
        return "0"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    if fixed and -3 <= int(exponent) < digits:
        return f"{value:.{digits - 1 - int(exponent)}f}".replace("-", "−")
    return f"{mantissa}·{power(int(exponent))}".replace("-", "−", 1)


def subscript(level: int) -> str:
    """Write a level as a subscript."""
    return str(level).translate(LOWER)


def superscript(exponent: float) -> str:
    """Write an exponent, as a superscript if it is an integer."""
    return power(int(exponent))[2:] if exponent == int(exponent) else f"^{exponent:g}"


def factor(value: float, base: float) -> str:
    """Write the factor of a rescaled curve; as a power of `base` if it is a large one, empty for 1."""
    if value == 1.0:
        return ""
    exponent = round(math.log(value, base)) if base > 1.0 and value > 0.0 else 0
    is_power = base == int(base) and math.isclose(value, base**exponent, rel_tol=1e-9)
    if value < 1e3 or not is_power:
        return f"{number(float(value), 'step')} "
    return f"{int(base)}{superscript(exponent)} "


def interval(bounds: Sequence[float | None] | None) -> str:
    """Write the interval of an order; a dash if a bound is missing."""
    ends = [b for b in bounds or () if b is not None and not math.isnan(b)]
    if len(ends) < 2:
        return "–"
    if max(map(abs, ends)) >= 1e4:
        return " to ".join(number(end, "order") for end in ends)
    return " to ".join(end.replace("-", "−") for end in order_interval(*ends))


def likely(bounds: Sequence[float | None] | None) -> str:
    """Write the interval of an order after the words ``95 % interval``; empty if there is none."""
    text = interval(bounds)
    return f"95 % interval {text}" if text != "–" else ""


def with_interval(order: float | None, bounds: Sequence[float | None] | None) -> str:
    """Write an order with its interval in brackets."""
    text = interval(bounds)
    return f"{number(order, 'order')}{f' ({text})' if text != '–' else ''}"


def levels(window: Sequence[int] | None) -> str:
    """Write the levels that a verdict rests on."""
    ends = [level for level in window or () if level is not None]
    if not ends:
        return "–"
    return str(ends[0]) if len(ends) == 1 else f"{min(ends)} to {max(ends)}"


def fact(result: Mapping[str, Any], name: str) -> Any:
    """Return a fact of a result in a summary; None if it is absent."""
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
    """Return the cells of a result: order, ends of its interval, levels, decisive number, and `ERROR_FACTS`."""
    low, high = interval_of(result) or (None, None)
    window = levels_of(result)
    order = fact(result, "order"), low, high, levels(window) if window else None
    return (*order, number_of(result), *(fact(result, name) for name in vocabulary.ERROR_FACTS))
