"""What was found, in one line and in one short paragraph: templates by status and reason, filled from facts."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from vibsim.checks.order_context import COINCIDE
from vibsim.checks.order_text import UNSEEN
from vibsim.checks.outcome import about_members
from vibsim.convergence import LadderVerdict
from vibsim.core.record import Record
from vibsim.report import data, words
from vibsim.report.choice import Lead, is_refutation, is_trap
from vibsim.report.text import assertions, reasons
from vibsim.report.types import Experiment, Measurement

ORDINALS = {1: "first", 2: "second", 3: "third", 4: "fourth", 5: "fifth", 6: "sixth", 8: "eighth"}
WITH_AN_ORDER = ("asymptotic", "order_low", "order_high")
"""Reasons of a result whose order is known: any other has at most an estimate that may be an accident."""
NEAR = 0.15
"""An order this near to a whole number is spoken of as that number."""

ON_ORDER = {
    "asymptotic": "{What} converges {at}{everywhere}",
    "exact": "{What} is exact{everywhere}: the levels differ by round-off only",
    "match": "{What} behaves as the check expects{everywhere}",
    "order_low": "{What} converges {at_measured}, not {expected_order}",
    "order_high": "{What} converges {at_measured}, not {expected_order}",
    "mismatch": "{What} does not behave as the check expects",
    "wrong_limit": "{What} approaches a wrong solution",
    "unstable": "The run is unstable, so {what} shows no order",
    "non_finite": "The run breaks down before its end",
    "pre_asymptotic": "The levels are too coarse to show the order of {what}",
    "round_off": "{What} has reached round-off, so it shows no order",
    "oscillating": "The error of {what} changes its sign from level to level",
    "non_smooth": "{What} has no regular order, because the problem is not smooth",
    "too_few_levels": "There are too few levels to judge {what}",
    "not_applicable": "There is nothing to judge of {what} here",
}
"""Reason to the title of a page about an order."""
MATCHED = {
    "value": "{Subject} is as expected{everywhere}",
    "accurate": "{What} is as accurate as asked{everywhere}",
    "stable": "{Schemes} {stability}, as expected{everywhere}",
    "conserves": "The energy {drift}{everywhere}",
    "equal": "{What} by {first} equals {second}{everywhere}",
    "tolerance": "The solution is within the tolerance{everywhere}",
}
"""Kind of a check that passed to the title of a page about it."""
MISSED = {
    "value": "{Subject} is not as expected",
    "accurate": "{What} is not as accurate as asked",
    "stable": "{Schemes} {not_stability}",
    "conserves": "The energy does not keep what is asked: that it {drift}",
    "equal": "{What} by {first} differs from {second}",
    "tolerance": "The error bound is beyond the tolerance",
}
"""Kind of a check that failed to the title of a page about it."""
OPEN = {
    "value": "It is undecided whether {subject} is as expected",
    "accurate": "It is undecided whether {what} is as accurate as asked",
    "stable": "It is undecided whether the run is stable",
    "conserves": "It is undecided how the energy behaves",
    "equal": "It is undecided whether {what} by {first} equals {second}",
    "tolerance": "It is undecided whether the tolerance is reached",
}
"""Kind of a check that stayed open to the title of a page about it."""
NO_CHECK = "The motion was computed, and nothing was asked of it"
BROKE_DOWN = "The run breaks down before its end"
CLAIMS = {
    ("PASS", False): "",
    ("PASS", True): "Refuted: ",
    ("FAIL", False): "Not confirmed: ",
    ("FAIL", True): "Not refuted: ",
    ("INCONCLUSIVE", False): "Undecided: ",
}
"""Status of a statement, and whether it is expected to be false, to what stands before it in a title."""
_FORMULA = re.compile(r"\S+ *[=<>≤≥]|\w dt\b|\w+[(^]")
"""With what a statement begins that opens with a formula, whose letters stay as they are."""
LONG_CLAIM = 110  # most letters of a statement in a title
NOTHING_ASKED = (
    "Without a check there is no verdict. Add `checks:` to the experiment, such as `- {{converges: {position}}}`, and "
    "three levels at least."
)
CONVERGES = "Halving the step divides the error by about {factor}. {trust}{beside}{unseen}"
TRUSTED = (
    "The rescaled differences of the levels coincide, so the estimate of the error can be trusted."
)
ROUGH = "The rescaled differences of the levels do not coincide yet, so the estimate of the error is rough."
BESIDE = " The true error is known here, and the estimate is within {part} % of it."


def title(experiment: Experiment, record: Record, lead: Lead, printed: Collection[str]) -> str:
    """Return the finding of an experiment in one line; `printed` names the checks of printed numbers."""
    if lead.entry is None:
        return NO_CHECK
    entry, finding = lead.entry, _of_claim(lead) or _by_check(experiment, record, lead)
    if entry["status"] != "PASS":
        against = ", against what the check expects" if _is_trap_of_a_number(lead) else ""
        return f"{finding}{against}{_of_some(record, entry)}"
    if entry["id"] in printed:
        return f"All {len(printed)} printed numbers are as expected"
    checked = [check.value for check in experiment.checks if check.kind == "value"]
    if len(checked) > 1 and lead.asserted is not None and lead.asserted.kind == "value":
        finding = f"All {len(checked)} numbers are as expected"
        if len(set(checked)) == 1:
            finding = f"{_opened(f'the {words.PAGE.value(checked[0])}')} is as expected in all {len(checked)} checks"
    return f"{finding}{_caught(experiment, lead)}"


def _of_some(record: Record, entry: Mapping[str, Any]) -> str:
    """Say of how many members or schemes a verdict is that not all of them have; empty where all do."""
    count, total = entry["counts"][entry["status"]], sum(entry["counts"].values())
    if not 0 < count < total:
        return ""
    noun = "members" if len(record["scheme"]) == 1 else "runs"
    noun = noun if data.swept(record) else "schemes"
    few, all_of = (words.number(n, "integer") for n in (count, total))
    return f", in {few} of {all_of} {noun}"


def _of_claim(lead: Lead) -> str:
    """Return the title of a page about a statement: the statement, and whether it is so; empty of another check."""
    assert lead.entry is not None
    check = lead.asserted
    if check is None or check.kind != "claim":
        return ""
    claim = check.claim
    if _FORMULA.match(claim) is None:
        claim = claim[:1].upper() + claim[1:]
    claim = claim if len(claim) <= LONG_CLAIM else f"{claim[: LONG_CLAIM - 1]}…"
    status = lead.entry["status"]
    is_false = not check.holds and status != "INCONCLUSIVE"
    return f"{CLAIMS[status, is_false]}{claim}"


def _is_trap_of_a_number(lead: Lead) -> bool:
    """Say whether the check expects that something else than an order is not as asked."""
    check = lead.asserted
    return check is not None and check.kind not in ("claim", "converges") and is_trap(check)


def _caught(experiment: Experiment, lead: Lead) -> str:
    """Say that traps were caught, where the page is about something else."""
    traps = [check for check in experiment.checks if check.kind != "claim" and is_trap(check)]
    if not traps:
        return ""
    if is_trap(lead.asserted):
        return ": the trap is caught"
    return f", and {'the trap is' if len(traps) == 1 else f'{len(traps)} traps are'} caught"


def _by_check(experiment: Experiment, record: Record, lead: Lead) -> str:
    """Return the title that the check deserves which decides."""
    assert lead.entry is not None
    status, reason = lead.entry["status"], lead.entry["reason"]
    kind = lead.measured.kind if lead.measured else "tolerance"
    filled = _phrases(experiment, record, lead)
    if kind == "converges":
        # of a trap, what was found says more than that it was expected
        word = lead.result["reason"] if reason == "match" else reason
        if word == "exact" and any(result["reason"] != "exact" for result in lead.entry["results"]):
            # some are exact, as they promise; the others have an order
            word = "asymptotic"
        return ON_ORDER.get(word, ON_ORDER["mismatch"]).format_map(filled)
    if reason == "non_finite":
        return BROKE_DOWN
    if _is_trap_of_a_number(lead):
        # what was found says more than that it was expected
        status = lead.result.get("status", status)
    table = {"PASS": MATCHED, "FAIL": MISSED}.get(status, OPEN)
    return table[kind].format_map(filled)


def _phrases(experiment: Experiment, record: Record, lead: Lead) -> dict[str, str]:
    """Return the words that fill a title."""
    measured, what = lead.measured, _named(experiment, lead.quantity)
    order, expected = lead.facts.get("order"), lead.facts.get("expected")
    named = _named_schemes(record, lead)
    filled = {
        "what": what, "What": _opened(what), "everywhere": _everywhere(record, lead),
        "at": _at(expected, order), **_apart(order, expected),
        "Schemes": f"Scheme {named[0]}" if len(named) == 1 else "The schemes",
        "first": "", "second": "", "drift": "", "stability": "", "not_stability": "", "subject": "", "Subject": "",
    }  # fmt: skip
    if measured is None:
        return filled
    match measured.kind:
        case "value":
            subject = assertions.subject(measured, record)
            filled |= {"subject": subject, "Subject": _opened(words.PAGE.opening(subject))}
        case "equal":
            second = assertions.SOLUTIONS.get(measured.second, f"that by {measured.second}")
            filled |= {"first": measured.first, "second": second}
        case "conserves":
            filled["drift"] = assertions.DRIFTS[measured.drift]
        case "stable":
            found = ["is stable", "makes the amplitude grow"]
            if len(named) > 1:
                found = ["are stable", "make the amplitude grow"]
            expected, other = found if measured.stable else found[::-1]
            filled |= {"stability": expected, "not_stability": f"{other}, against what is asked"}
    if _has_own_orders(record, lead):
        filled["at"] = "at the order that its scheme promises"
        if (each := len(named)) > 1:
            schemes = "both schemes promise" if each == 2 else f"each of {each} schemes promises"
            filled |= {"at": f"at the order that {schemes}", "everywhere": ""}
    return filled


def _named_schemes(record: Record, lead: Lead) -> Sequence[str]:
    """Return the schemes that a check is about."""
    return getattr(lead.measured, "schemes", None) or record.words("scheme")


def _has_own_orders(record: Record, lead: Lead) -> bool:
    """Say whether a check asks for the order of the scheme, and its schemes and members have several."""
    asks = getattr(lead.measured, "order", None) == "scheme"
    if not asks or f"{lead.quantity}_formal_order" not in record:
        return False
    every = record.words("scheme")
    places = [every.index(scheme) for scheme in _named_schemes(record, lead)]
    return len(set(data.formal_orders(record, lead.quantity)[places].flat)) > 1


def _apart(order: float | None, expected: float | None) -> dict[str, str]:
    """Return the words for a measured order and for another one that was expected."""
    if expected is None or not math.isfinite(expected):
        return {"at_measured": _at(order), "expected_order": "exact"}
    measured, other = _at(order), _at(expected).removesuffix(" order")
    if order is not None and measured == _at(expected):
        measured, other = f"with order {order:.2f}", f"with order {expected:g}"
    return {"at_measured": measured, "expected_order": other}


def _named(experiment: Experiment, quantity: str) -> str:
    """Return a quantity in words: those of the model where it has no letter of its own."""
    name, model = words.name(quantity), experiment.model.definition
    long = {state.name: state.long_name for state in model.states}
    long |= {output.name: output.long_name for output in model.outputs}
    if name != quantity or quantity not in long:
        return name
    return f"the {long[quantity]}{'' if _has_words(quantity) else f' {quantity}'}"


def short(experiment: Experiment, quantity: str) -> str:
    """Return the letter of a quantity; in words where it has none and its name has several."""
    letter = words.symbol(quantity)
    return _named(experiment, quantity) if _has_words(letter) else letter


def _has_words(name: str) -> bool:
    """Say whether a name has several words, and not a letter with an index such as ``x_3``."""
    return re.search("_[^0-9]", name) is not None


def _everywhere(record: Record, lead: Lead) -> str:
    """Say of how many members and schemes it holds; empty for one result of the only scheme."""
    assert lead.entry is not None
    total, schemes = sum(lead.entry["counts"].values()), record.words("scheme")
    named = _named_schemes(record, lead)
    kind = lead.measured.kind if lead.measured else ""
    is_named = kind in ("converges", "accurate") and len(named) == 1 < len(schemes)
    by = f" with scheme {named[0]}" if is_named else ""
    members = len(record["case"])
    is_of_one = total < 2 and (members < 2 or kind not in ("converges", "accurate"))
    if is_of_one:
        return by
    if data.swept(record):
        which = {1: "the", 2: "both"}.get(total, f"all {words.number(total, 'integer')}")
        noun = "runs" if total > members else "members" if total > 1 else "member"
        values = assertions.swept_values(lead.measured) if lead.measured else []
        asked = f"with {words.swept(', '.join(values))}" if values else "asked about"
        about = f" {asked}, of {words.number(members, 'integer')} in all" if total < members else ""
        return f" in {which} {noun}{about}{by}"
    if total == len(schemes) == 2:
        return " by both schemes"
    return f" by {'all' if total == len(schemes) else f'{total} of'} {len(schemes)} schemes"


def _at(*orders: float | None) -> str:
    """Say with which order something converges: the first that is known."""
    order = next((x for x in orders if x is not None and math.isfinite(x)), None)
    if order is None:
        return "with no order"
    whole = round(order)
    if whole in ORDINALS and abs(order - whole) <= NEAR:
        return f"at {ORDINALS[whole]} order"
    return f"with order {order:.2f}"


def _opened(text: str) -> str:
    """Begin a sentence: with a capital where it begins with an article."""
    return text[:1].upper() + text[1:] if text.startswith("the ") else text


def of_ladder(verdict: LadderVerdict) -> str:
    """Return the finding on a ladder that another solver computed, in one line."""
    words_of = {
        "what": verdict.quantity, "What": verdict.quantity, "everywhere": "",
        "at": _at(verdict.expected, verdict.order), **_apart(verdict.order, verdict.expected),
    }  # fmt: skip
    if verdict.expected is None and verdict.at_least is not None:
        words_of["expected_order"] = f"{_at(verdict.at_least)} or above"
    return ON_ORDER[verdict.reason].format_map(words_of)


def factor(lead: Lead) -> float | None:
    """Return by what halving the step divides the error; None where the result that decides has no settled order."""
    if lead.entry is None or not lead.is_on_order or lead.entry["status"] == "INCONCLUSIVE":
        return None
    order = words.fact(lead.result, "order")
    is_settled = lead.result["reason"] in WITH_AN_ORDER and order is not None
    return 2.0**order if is_settled else None


def paragraph(experiment: Experiment, record: Record, lead: Lead, levels: int) -> str:
    """Return what the finding means, for who meets it for the first time."""
    if lead.entry is None:
        return NOTHING_ASKED.format(position=experiment.model.definition.position)
    found, is_passed = factor(lead), lead.entry["status"] == "PASS"
    if found is not None and is_passed and lead.result["reason"] == "asymptotic":
        part = _estimate_over_true(record, lead)
        distance = data.coincidence(record, lead.quantity, lead.member)
        is_rough = distance > COINCIDE or (part is not None and part > COINCIDE)
        percent = "" if part is None else words.number(max(100.0 * part, 0.1), "brief")
        return CONVERGES.format(
            factor=f"{found:.2g}",
            trust=ROUGH if is_rough else TRUSTED,
            beside="" if part is None else BESIDE.format(part=percent),
            unseen=UNSEEN if part is None else "",
        )
    if is_refutation(lead.asserted) and lead.entry["reason"] == "match":
        return reasons.REFUTED
    kind = lead.measured.kind if lead.measured else lead.entry["kind"]
    value = getattr(lead.measured, "value", "") if kind == "value" else ""
    word = lead.result.get("reason") if lead.is_on_order else lead.entry["reason"]
    is_promised = keeps_promise(record, lead.measured, lead.entry)
    return reasons.reason(word, kind, value, levels, is_promised).meaning


def asked_of(record: Record, lead: Lead) -> str:
    """Say of how many members a check asks for an order, where others are not judged; else nothing."""
    asked, every = int(about_members(record, lead.measured).sum()), len(record["case"])
    if not lead.is_on_order or asked == every:
        return ""
    few, all_of, rest = (words.number(n, "integer") for n in (asked, every, every - asked))
    return (
        f"The check asks about {few} of the {all_of} members, and does not judge the other {rest}."
    )


def keeps_promise(record: Record, measured: Measurement | None, check: Mapping[str, Any]) -> bool:
    """Say whether the result that decides has the order of its scheme, and the check asks for another one."""
    decisive: Mapping[str, Any] = next(iter(check.get("results") or []), {})
    order, place = words.fact(decisive, "order"), data.place_of(record, decisive.get("case", -1))
    if measured is None or measured.kind != "converges" or measured.order == "scheme":
        return False
    if order is None or place is None:
        return False
    promised = data.formal_orders(record, measured.converges)
    own = promised[record.words("scheme").index(decisive["scheme"]), place]
    is_due = data.basis_of_order(record, measured.converges) == "promised"
    return bool(is_due and abs(own - order) <= measured.tolerance)


def _estimate_over_true(record: Record, lead: Lead) -> float | None:
    """Return how far the estimated error of the finest level is from the true one; None where that is not known."""
    from vibsim.report import finest_level

    found = finest_level.error(record, lead.quantity)
    place = lead.member.scheme, lead.member.case
    true, estimate = float(found.true[place]), float(found.estimate[place])
    if not (math.isfinite(true) and math.isfinite(estimate) and true > 0.0):
        return None
    return abs(estimate / true - 1.0)
