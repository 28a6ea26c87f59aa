"""What the reason of a verdict means and what would settle the question, for first-time readers."""

from __future__ import annotations

from typing import NamedTuple

from vibsim.core.vocabulary import BY_TOLERANCE
from vibsim.experiment.value_names import VALUES


class Reason(NamedTuple):
    """What a reason means and what would settle the question."""

    meaning: str
    needs: str


REASONS = {
    "asymptotic": Reason(
        "The error shrinks from level to level with the expected order.",
        "At least three levels, differences above round-off, and no likely explanation of them by another order. "
        "The levels named meet all three.",
    ),
    "exact": Reason(
        "The levels differ by round-off only. The scheme has no truncation error here.",
        "Nothing more, if exactness is expected here; otherwise a problem on which the scheme does make an error.",
    ),
    "match": Reason(
        "The outcome is as expected, but it is not plain convergence. The check may be a trap, for instance.",
        "The measured and the expected verdict agree. The measured reason says what was detected.",
    ),
    "order_low": Reason(
        "The error does shrink, but more slowly than the scheme promises. A first-order start, a one-sided formula at "
        "the end, or a mistake in the code does this.",
        "The levels exclude the expected order, and finer ones will not change that. Look for a step of lower order.",
    ),
    "order_high": Reason(
        "The error shrinks faster than promised. Either the leading error term vanishes for this problem, or the order "
        "was stated too low.",
        "A problem without special symmetry, or the higher order as the expected one.",
    ),
    "mismatch": Reason(
        "The measured outcome is not the expected one.",
        "Compare the expected value with the measured one. One of the two is wrong.",
    ),
    "wrong_limit": Reason(
        "The levels approach each other, but not the exact solution. The scheme converges to a wrong answer.",
        "The differences alone cannot show this; the exact solution does. Check the equation that is being solved, "
        "and the code of a scheme of your own.",
    ),
    "unstable": Reason(
        "The numerical solution grows where the exact one does not. Either w dt is beyond the limit of the scheme, or "
        "the next finer level grows no less.",
        "A smaller step (w dt below the stability limit), or a scheme without such a limit.",
    ),
    "non_finite": Reason(
        "The calculation overflowed or produced an undefined number. Nothing after that moment has a meaning.",
        "A smaller step, or a look at the member, level and time in the table of runs that broke down.",
    ),
    "pre_asymptotic": Reason(
        "The step is still too coarse. More than one order may explain the levels, or none does.",
        "Finer levels, until the ratios settle and the rescaled curves coincide.",
    ),
    "round_off": Reason(
        "The differences have reached round-off, and rounding noise says nothing about the scheme.",
        "Coarser levels, or an arithmetic with a lower floor (increment or compensated).",
    ),
    "oscillating": Reason(
        "The error changes its sign from level to level.",
        "More levels, another norm, or a comparison at times where the error does not change its sign.",
    ),
    "non_smooth": Reason(
        "The problem is not smooth, so its error has no regular expansion in powers of dt.",
        "Located events, an interval that ends before the corner of the force, or an expected order that allows "
        "for it.",
    ),
    "too_few_levels": Reason(
        "Two levels cannot show an order, because a single difference has nothing to compare with.",
        "At least three levels; four or more show the trend of the ratios.",
    ),
    "not_applicable": Reason(
        "The measured number does not exist here, so there is nothing to judge.",
        "A quantity, scheme or time for which the number exists.",
    ),
}

OUTCOMES = {
    "exact": "no error but round-off", "order_low": "a lower order", "order_high": "a higher order",
    "mismatch": "another outcome", "wrong_limit": "a wrong limit", "unstable": "an unstable run",
    "non_finite": "a run that breaks down", "pre_asymptotic": "no order: the step is too coarse",
    "round_off": "no order: round-off", "oscillating": "no order: the error changes its sign",
    "non_smooth": "no regular order: not smooth", "too_few_levels": "no order: too few levels",
    "not_applicable": "nothing to judge",
}  # fmt: skip
"""Reason to the outcome of an order in a few words."""

_NUMBERS = {
    "several": "A number on which finer levels agree, and which is not close to its limit. The tables show both.",
    "one": "More levels. One level alone does not show the error of the step.",
    "scheme": "Nothing more. It follows from the equations of the scheme or the model, without a run.",
    "counted": "Nothing more. It is a count, and exact.",
}
"""Needs of a number that is as expected: from several levels, from one, from the scheme alone, or a count."""
_BY_KIND = {
    ("stable", "match"): Reason(
        "The growth of the amplitude is as the check expects.",
        "A growth factor that agrees with the predicted one. If the scheme has a limit, w dt should be well within or "
        "well beyond it; if not, a finer level should show whether the growth becomes smaller.",
    ),
    ("conserves", "match"): Reason(
        "The error of the energy changes with time as the check expects.",
        "A run of many periods, because an oscillation hides a slow drift at first. The figure of the running "
        "maximum shows it at every time.",
    ),
    ("accurate", "match"): Reason(
        "The error of the finest level is as the check expects.",
        "An error that is known: the true one, or an estimate on levels that show their order. The bound is a tested "
        "estimate, not a proof.",
    ),
    ("equal", "match"): Reason(
        "The two solutions are as close as the check expects.",
        "A distance well below the allowed one at every stored time. Without `atol`, the rounding errors of both are "
        "allowed.",
    ),
    ("stable", "pre_asymptotic"): Reason(
        "The levels do not follow one motion. Their largest speeds differ, as where a force becomes infinite.",
        "An interval that ends before the force becomes infinite, or finer levels if the step is too coarse.",
    ),
    ("conserves", "pre_asymptotic"): Reason(
        "The run does not show how the error of the energy grows. It is too short, or too little of it is stored.",
        "A run of at least four periods of the slowest small oscillation, with more stored samples (`samples: all`).",
    ),
    (BY_TOLERANCE, "match"): Reason(
        "The error bound of the extrapolated solution is within the tolerance, for every scheme and member at every "
        "stored time.",
        "The bound is a tested estimate, not a proof. best.nc has it for every time (output: best).",
    ),
    (BY_TOLERANCE, "mismatch"): Reason(
        "The levels were chosen by a pilot of a few members. Another member is harder, and its error is not known to "
        "be within the tolerance.",
        "Finer levels, or a pilot that tries such members. The worst are listed below.",
    ),
}
"""Explanation of a reason for one kind of check, where it differs from that for others."""

_OF_PROMISE = {
    "order_low": Reason(
        "The error shrinks with the order that the scheme promises here, which is lower than the expected one.",
        "Nothing more. The levels show the order that they should. Ask for the order of the scheme, or take a scheme "
        "of higher order.",
    ),
    "order_high": Reason(
        "The error shrinks faster than expected, as the scheme promises here.",
        "Nothing more. The levels show the order that they should. Ask for the order of the scheme.",
    ),
}
"""Explanation of an order that differs from that of the check, but is the one of the scheme."""

REFUTED = "The measurement contradicts the statement, as expected."
"""Meaning of a match for a claim that is expected to be false."""


def reason(
    word: str | None, kind: str, value: str = "", levels: int = 2, is_promised: bool = False
) -> Reason:
    """Return the explanation of a reason for a kind of measurement; empty if it has none.

    `value` is the number of a ``value`` check, measured on `levels` levels; `is_promised` says whether an order that
    misses the one of the check is the one that the scheme promises.
    """
    word = word or ""
    if is_promised and word in _OF_PROMISE:
        return _OF_PROMISE[word]
    if (kind, word) in _BY_KIND:
        return _BY_KIND[kind, word]
    if word == "match" and kind != "converges":
        origin = "several" if levels > 1 else "one"
        if value and not VALUES[value].depends_on_level:
            origin = "scheme"
        if value and VALUES[value].is_count_of_work:
            origin = "counted"
        return Reason("The measured number is as expected.", _NUMBERS[origin])
    return REASONS.get(word, Reason("", ""))
