"""The finding of an experiment in one line and in one short paragraph: templates by status and reason."""

from __future__ import annotations

import math
import re
from collections.abc import Collection

import numpy as np

from vibsim.checks.kinds import KINDS
from vibsim.checks.order_context import COINCIDE
from vibsim.checks.order_sentences import UNSEEN
from vibsim.checks.outcome import Result, about_members
from vibsim.checks.verdict_text import Wording
from vibsim.convergence import LadderVerdict
from vibsim.core.vocabulary import plain_name
from vibsim.models import Model
from vibsim.report import words
from vibsim.report.choice import CheckedLadder, is_trap
from vibsim.report.text import assertions, reasons

ORDINALS = {1: "first", 2: "second", 3: "third", 4: "fourth", 5: "fifth", 6: "sixth", 8: "eighth"}
NUMERALS = dict(enumerate(("three", "four", "five", "six", "seven", "eight", "nine"), 3))
WITH_AN_ORDER = ("asymptotic", "order_low", "order_high")
"""Reasons of results with a settled order; any other order is an estimate that may be an accident."""
NEAR = 0.15  # an order within this distance of an integer is called by its ordinal

ON_ORDER = {
    "asymptotic": "{What} {converges} {at}{everywhere}",
    "exact": "{What} is exact{everywhere}: the levels differ by round-off only",
    "match": "{What} behaves as the check expects{everywhere}",
    "order_low": "{What} converges {at_measured}, not {expected_order}",
    "order_high": "{What} converges {at_measured}, not {expected_order}",
    "mismatch": "{What} does not behave as the check expects",
    "wrong_limit": "{What} approaches a wrong solution",
    "unstable": "The run is unstable, so {what} shows no order",
    "non_finite": "The run{by} breaks down before its end",
    "pre_asymptotic": "The levels are too coarse to show the order of {what}",
    "round_off": "The differences of {what} are round-off, so no order can be measured",
    "oscillating": "The error of {what} changes its sign from level to level",
    "non_smooth": "{What} has no regular order, because the problem is not smooth",
    "too_few_levels": "There are too few levels to judge {what}",
    "not_applicable": "There is nothing to judge of {what} here",
}
"""Reason to the title of a page on an order."""
MATCHED = {
    "value": "{Subject} is as expected{everywhere}",
    "accurate": "{What} is as accurate as asked{everywhere}",
    "stable": "{Schemes} {stability}, as expected{everywhere}",
    "conserves": "The energy {drift}{everywhere}",
    "equal": "{What} by {first} equals {second}{everywhere}",
    "tolerance": "The solution is within the tolerance{everywhere}",
}
"""Kind of a passed check to the title of a page on it."""
MISSED = {
    "value": "{Subject} is not as expected",
    "accurate": "{What} is not as accurate as asked",
    "stable": "The amplitude{by} {grows}, against what is asked",
    "conserves": "Not as asked: that the energy{by} {drift}",
    "equal": "{What} by {first} differs from {second}",
    "tolerance": "The error bound{by} is beyond the tolerance",
}
"""Kind of a failed check to the title of a page on it."""
OPEN = {
    "value": "It is undecided whether {subject} is as expected",
    "accurate": "It is undecided whether {what} is as accurate as asked",
    "stable": "It is undecided whether the run{by} is stable",
    "conserves": "It is undecided how the energy{by} behaves",
    "equal": "It is undecided whether {what} by {first} equals {second}",
    "tolerance": "It is undecided whether the tolerance is reached",
}
"""Kind of an undecided check to the title of a page on it."""
IN_NUMBERS = {
    "value": "It is {found}, not {asked}.",
    "accurate": "The error is {found}; {asked} is asked for.",
    "equal": "They are {found}.",
}
"""Kind of a failed check to its numbers, under a title that says what failed."""
GROWN = 2.0  # ratio of the finest error to the smallest one from which refinement does harm
NO_CHECK = "The motion was computed, and nothing was asked of it"
CLAIMS = {
    ("PASS", False): "",
    ("PASS", True): "Shown to be false: ",
    ("FAIL", False): "Not confirmed: ",
    ("FAIL", True): "Not shown to be false: ",
    ("INCONCLUSIVE", False): "Undecided: ",
}
"""Status of a claim, and whether it is expected to be false, to the prefix of its title."""
_FORMULA = re.compile(r"\S+ *[=<>≤≥]|\w dt\b|\w+[(^]")
"""Beginning of a claim that opens with a formula, which is not capitalized."""
LONG_CLAIM = 140  # most characters of a claim in a title
NOTHING_ASKED = (
    "Without a check there is no verdict. Add `checks:` to the experiment, such as `- {{converges: {position}}}`, and "
    "three levels at least."
)
CONVERGES = "Halving the step divides the error by {factor}{due}. {trust}{beside}{unseen}"
TRUSTED = (
    "The rescaled differences of the levels coincide, so the estimate of the error can be trusted."
)
ROUGH = "The rescaled differences of the levels do not coincide yet, so the estimate of the error is rough."
BESIDE = " The estimate is within {part} % of the error against the {name} solution."


def title(lead: CheckedLadder, printed: Collection[str]) -> str:
    """Return the finding of an experiment in one line; `printed` are the ids of checks of printed numbers."""
    if not lead.entry:
        return NO_CHECK
    entry, finding = lead.entry, _claim_title(lead) or _check_title(lead)
    if lead.status != "PASS":
        against = ", against what the check expects" if _is_trap_of_a_number(lead) else ""
        return f"{finding}{against}{_share_of_runs(lead)}"
    if entry["id"] in printed:
        many = f"All {len(printed)} printed numbers are as expected"
        return many if len(printed) > 1 else "The printed number is as expected"
    checked = [check.value for check in lead.record.experiment.checks if check.kind == "value"]
    if len(checked) > 1 and lead.asserted is not None and lead.asserted.kind == "value":
        finding = f"All {len(checked)} numbers are as expected"
        if len(set(checked)) == 1:
            name = words.PAGE.value(checked[0])
            finding = f"{_capitalized(f'the {name}')} is as expected in all {len(checked)} checks"
    return f"{finding}{_caught(lead)}"


def _share_of_runs(lead: CheckedLadder) -> str:
    """Say how many members or schemes have the verdict, by name if it is one scheme; empty if all have."""
    count = lead.entry["counts"][lead.status]
    if not 0 < count < lead.total:
        return ""
    if count == 1 and not lead.record.swept:
        return f",{_by(lead)}" if _claim_title(lead) else ""
    noun = "members" if len(lead.record.schemes) == 1 else "runs"
    noun = noun if lead.record.swept else "schemes"
    part, whole = (words.number(n, "integer") for n in (count, lead.total))
    return f", in {part} of {whole} {noun}"


def _claim_title(lead: CheckedLadder) -> str:
    """Return the title of a page on a claim: the claim and whether it holds; empty for other checks."""
    check = lead.asserted
    if check is None or check.kind != "claim":
        return ""
    claim = check.claim
    if _FORMULA.match(claim) is None:
        claim = words.capitalized(claim)
    claim = claim if len(claim) <= LONG_CLAIM else f"{claim[: LONG_CLAIM - 1]}…"
    is_false = not check.holds and lead.status != "INCONCLUSIVE"
    return f"{CLAIMS[lead.status, is_false]}{claim}"


def _is_trap_of_a_number(lead: CheckedLadder) -> bool:
    """Return whether the check is a trap on something other than an order or a claim."""
    check = lead.asserted
    return lead.is_trap and check is not None and check.kind not in ("claim", "converges")


def _caught(lead: CheckedLadder) -> str:
    """Say that traps were caught; empty if the experiment has none."""
    checks = lead.record.experiment.checks
    traps = [check for check in checks if check.kind != "claim" and is_trap(check)]
    if not traps:
        return ""
    if lead.is_trap:
        return ": the trap is caught"
    return f", and {'the trap is' if len(traps) == 1 else f'{len(traps)} traps are'} caught"


def _check_title(lead: CheckedLadder) -> str:
    status, reason = lead.status, lead.reason
    filled = _phrases(lead)
    if lead.is_on_order:
        # the outcome of a trap says more than that it was expected
        word = str(lead.result["reason"] if reason == "match" else reason)
        if word == "exact" and any(result["reason"] != "exact" for result in lead.entry["results"]):
            word = "asymptotic"  # some schemes are exact, as they promise; the others have an order
        return ON_ORDER.get(word, ON_ORDER["mismatch"]).format_map(filled)
    if reason == "non_finite":
        return ON_ORDER["non_finite"].format_map(filled)
    if _is_trap_of_a_number(lead):
        # the outcome says more than that it was expected
        status = lead.result.get("status", status)
    table = {"PASS": MATCHED, "FAIL": MISSED}.get(status, OPEN)
    return table[lead.kind].format_map(filled)


def _phrases(lead: CheckedLadder) -> dict[str, str]:
    """Return the words that fill the template of a title."""
    measured, by = lead.measured, _by(lead)
    what = f"{_in_words(lead.record.model, lead.quantity)}{by}"
    order, expected = lead.facts.get("order"), lead.facts.get("promised")
    judged = lead.schemes
    filled = {
        "what": what, "What": _capitalized(what), "by": by, "everywhere": _everywhere(lead),
        "converges": "tends to zero" if plain_name(lead.quantity) == "energy_deviation" else "converges",
        "at": _at(expected, order), **_contrast(order, expected),
        "Schemes": f"Scheme {judged[0]}" if len(judged) == 1 else "The schemes",
        "first": "", "second": "", "drift": "", "stability": "", "grows": "", "subject": "", "Subject": "",
    }  # fmt: skip
    if measured is None:
        return filled
    match measured.kind:
        case "value":
            subject = f"{assertions.subject(measured, lead.record)}{by}"
            filled |= {"subject": subject, "Subject": _capitalized(words.PAGE.opening(subject))}
        case "equal":
            second = assertions.SOLUTIONS.get(measured.second, f"that by {measured.second}")
            filled |= {"first": measured.first, "second": second}
        case "conserves":
            filled["drift"] = assertions.DRIFTS[measured.drift]
        case "stable":
            outcomes = ["is stable", "makes the amplitude grow"]
            if len(judged) > 1:
                outcomes = ["are stable", "make the amplitude grow"]
            grows = "grows" if measured.stable else "does not grow"
            filled |= {"stability": outcomes[not measured.stable], "grows": grows}
    if _has_several_orders(lead):
        filled["at"] = "at the order that its scheme promises"
        if (count := len(judged)) > 1:
            schemes = "both schemes promise" if count == 2 else f"each of {count} schemes promises"
            filled |= {"at": f"at the order that {schemes}", "everywhere": ""}
    return filled


def _has_several_orders(lead: CheckedLadder) -> bool:
    """Return whether a check expects the scheme's order and this differs between its schemes or members."""
    is_formal = getattr(lead.measured, "order", None) == "scheme"
    if not is_formal or "formal_order" not in lead:
        return False
    positions = [lead.record.schemes.index(scheme) for scheme in lead.schemes]
    return len(set(lead.record.formal_orders(lead.quantity)[positions].flat)) > 1


def _contrast(order: float | None, expected: float | None) -> dict[str, str]:
    """Return words that contrast a measured order with a different expected one."""
    if expected is None or not math.isfinite(expected):
        return {"at_measured": _at(order), "expected_order": "exact"}
    measured, wanted = _at(order), _at(expected).removesuffix(" order")
    if order is not None and measured == _at(expected):
        measured, wanted = f"with order {order:.2f}", f"with order {expected:g}"
    return {"at_measured": measured, "expected_order": wanted}


def _in_words(model: Model, quantity: str) -> str:
    """Return a quantity in words; in those of the model if it has no letter of its own."""
    long_names = {state.name: state.long_name for state in model.states}
    long_names |= {output.name: output.long_name for output in model.outputs}
    if quantity in words.NAMES or quantity not in long_names:
        return words.name(quantity)
    return f"the {long_names[quantity]}{'' if words.is_phrase(quantity) else f' {quantity}'}"


def short(model: Model, quantity: str) -> str:
    """Return the letter of a quantity, or its words if its name is a phrase."""
    is_phrase = words.is_phrase(quantity)
    return _in_words(model, quantity) if is_phrase else words.symbol(quantity)


def _by(lead: CheckedLadder) -> str:
    """Name the scheme of a finding that is about one of several; empty where the subject names it, or for all."""
    check, schemes = lead.measured, lead.schemes
    if lead.kind == "equal" or (check is not None and check.kind == "value" and check.at.scheme):
        return ""
    if lead.status != "PASS" and lead.entry["counts"][lead.status] == 1 and not lead.record.swept:
        schemes = (lead.result["scheme"],)
    return f" by {schemes[0]}" if len(schemes) == 1 < len(lead.record.schemes) else ""


def _everywhere(lead: CheckedLadder) -> str:
    """Say for which members and schemes the finding holds; empty for one result of the only scheme."""
    total, schemes, members = lead.total, lead.record.schemes, lead.record.count
    if total < 2 and (members < 2 or lead.kind not in ("converges", "accurate")):
        return ""
    if lead.record.swept:
        count = {1: "the", 2: "both"}.get(total, f"all {words.number(total, 'integer')}")
        noun = "runs" if total > members else "members" if total > 1 else "member"
        values = assertions.swept_values(lead.measured, lead.record) if lead.measured else []
        subset = f"with {words.swept(', '.join(values))}" if values else "asked about"
        of = f" {subset}, of {words.number(members, 'integer')} in all" * (total < members)
        return f" in {count} {noun}{of}"
    if total == len(schemes) == 2:
        return " with both schemes"
    count = NUMERALS.get(len(schemes), str(len(schemes)))
    return f" with {'all' if total == len(schemes) else f'{total} of'} {count} schemes"


def _at(*orders: float | None) -> str:
    """Say with which order something converges: the first finite one."""
    order = next((x for x in orders if x is not None and math.isfinite(x)), None)
    if order is None:
        return "with no order"
    integer = round(order)
    if integer in ORDINALS and abs(order - integer) <= NEAR:
        return f"at {ORDINALS[integer]} order"
    return f"with order {order:.2f}"


def _capitalized(text: str) -> str:
    """Capitalize the article at the beginning of a sentence; symbols keep their case."""
    return words.capitalized(text) if text.startswith("the ") else text


def of_ladder(verdict: LadderVerdict) -> str:
    """Return the finding on a ladder of another solver in one line."""
    filled = {
        "what": verdict.quantity, "What": verdict.quantity, "by": "", "everywhere": "", "converges": "converges",
        "at": _at(verdict.expected, verdict.order), **_contrast(verdict.order, verdict.expected),
    }  # fmt: skip
    if verdict.expected is None and verdict.at_least is not None:
        filled["expected_order"] = f"{_at(verdict.at_least)} or above"
    return ON_ORDER[verdict.reason].format_map(filled)


def factor(lead: CheckedLadder) -> float | None:
    """Return the factor by which halving the step divides the error; None without a settled order that decides."""
    if not lead.entry or not lead.is_on_order or lead.status == "INCONCLUSIVE":
        return None
    order = words.fact(lead.result, "order")
    is_settled = lead.result["reason"] in WITH_AN_ORDER and order is not None
    return 2.0**order if is_settled else None


def paragraph(lead: CheckedLadder) -> str:
    """Return what the finding means, for a first-time reader."""
    record = lead.record
    if not lead.entry:
        return NOTHING_ASKED.format(position=record.model.position)
    ratio, is_passed = factor(lead), lead.status == "PASS"
    if ratio is not None and is_passed and lead.result["reason"] == "asymptotic":
        deviation, beside, unseen = _estimate_deviation(lead), "", UNSEEN
        if deviation is not None:
            percent = words.number(max(100.0 * deviation, 0.1), "brief")
            beside, unseen = BESIDE.format(part=percent, name=record.name_of_exact), ""
        is_rough = lead.coincidence > COINCIDE or (deviation or 0.0) > COINCIDE
        order = words.fact(lead.result, "promised")
        due = f" (order {order:g} predicts {2.0**order:.3g})" if order else ""
        trust = ROUGH if is_rough else TRUSTED
        return CONVERGES.format(
            factor=f"{ratio:.3g}", due=due, trust=trust, beside=beside, unseen=unseen
        )
    if lead.is_refutation and lead.reason == "match":
        return reasons.REFUTED
    if lead.kind == "value" and lead.reason == "match":
        return ""  # the number stands above, with what is asked for
    word = lead.result.get("reason") if lead.is_on_order else lead.reason
    if word == "mismatch" and lead.kind in KINDS:
        # what was found says more than that it is not as expected
        wording = Wording(record.experiment, record, lead.asserted, words.PAGE)
        result, template = Result.of(lead.result), IN_NUMBERS.get(lead.kind)
        if template is None or getattr(lead.measured, "take", None) is not None:
            return words.swept(wording.sentence(result))
        return words.swept(template.format(found=wording.brief(result), asked=_asked(lead)))
    meaning = explained(lead, word).meaning
    return meaning + (_growing_error(lead) if word == "round_off" else "")


def _asked(lead: CheckedLadder) -> str:
    """Say what is asked of a number, with its unit, or of an error."""
    check = lead.measured
    if check is not None and check.kind == "accurate":
        return words.PAGE.number(check.accuracy)
    if check is None or check.kind != "value":
        return ""
    unit = lead.record.unit_of_number(check)
    return assertions.wanted(lead.record.experiment, check, unit=unit)


def _growing_error(lead: CheckedLadder) -> str:
    """Say from which level on finer ones have a larger true error; empty if none do, or it is unknown."""
    error = lead.at("error_norm", lead.norm) if "error_norm" in lead else np.empty(0)
    if not error.size or not np.isfinite(error).all() or not 0.0 < GROWN * error.min() <= error[-1]:
        return ""
    level = lead.record.levels[int(np.argmin(error))]
    times = words.number(float(error[-1] / error.min()), "brief")
    return f" The error is smallest at level {level}; at the finest level it is {times} times as large."


def asked_of(lead: CheckedLadder) -> str:
    """Say of how many members a check asks for an order, where others are not judged; else nothing."""
    asked, every = int(about_members(lead.record, lead.measured).sum()), lead.record.count
    if not lead.is_on_order or asked == every:
        return ""
    few, all_of, rest = (words.number(n, "integer") for n in (asked, every, every - asked))
    return (
        f"The check asks about {few} of the {all_of} members, and does not judge the other {rest}."
    )


def explained(lead: CheckedLadder, word: str | None) -> reasons.Reason:
    """Return the explanation of a reason of a check."""
    check = lead.measured
    value = check.value if check is not None and check.kind == "value" else ""
    levels = len(lead.record.levels)
    return reasons.reason(word, lead.kind, value, levels, _keeps_promise(lead))


def _keeps_promise(lead: CheckedLadder) -> bool:
    """Return whether the decisive result has the order of its scheme although the check states an order of its own."""
    check, order = lead.measured, words.fact(lead.result, "order")
    if check is None or check.kind != "converges" or check.order == "scheme" or order is None:
        return False
    is_promised = lead.basis_of_order == "promised"
    return bool(is_promised and abs(lead.formal_order - order) <= check.tolerance)


def _estimate_deviation(lead: CheckedLadder) -> float | None:
    """Return the relative deviation of the estimated error of the finest level from the true one; None if unknown."""
    from vibsim.report import finest_level

    error = finest_level.error(lead.record, lead.quantity)
    true, estimate = (float(part[lead.member.place]) for part in (error.true, error.estimate))
    if not (math.isfinite(true) and math.isfinite(estimate) and true > 0.0):
        return None
    return abs(estimate / true - 1.0)
