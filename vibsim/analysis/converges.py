"""What a ``converges`` check measures: the verdict on a quantity for every scheme and member."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.evidence import evidence, formal_orders, omega_dt
from vibsim.analysis.outcome import FAIL, INCONCLUSIVE, PASS, Outcome
from vibsim.analysis.verdict import Judgement, judge
from vibsim.analysis.wording import Story, advise, tell
from vibsim.models import MODELS
from vibsim.record import Record
from vibsim.schemes import SCHEMES
from vibsim.vocabulary import REASON_NAMES, STATUSES

if TYPE_CHECKING:
    from vibsim.spec import Experiment
    from vibsim.spec.checks import ConvergesCheck

Floats = NDArray[np.float64]


def judge_check(
    experiment: Experiment, record: Record, check: ConvergesCheck
) -> tuple[Judgement, Floats]:
    """Return the judgement of every scheme and member, and the order that was expected of every scheme."""
    order = formal_orders(experiment, check.converges)
    if check.order != "scheme":
        order = np.full_like(order, float(check.order))
    numbers = evidence(experiment, record, check.converges, check.norm, order, check.tolerance)
    return judge(numbers), order


def converges(experiment: Experiment, record: Record, check: ConvergesCheck) -> Outcome:
    """Compare the verdict on a quantity, of every scheme and member, with the expected one."""
    judged, order = judge_check(experiment, record, check)
    names = record.words("scheme")
    chosen = [i for i, name in enumerate(names) if check.schemes is None or name in check.schemes]

    def story(scheme: int, case: int) -> Story:
        return _story(experiment, record, check, judged, order, scheme, case)

    expect = check.expect
    as_expected = judged.status == STATUSES.index(expect.status)
    if expect.reason is not None:
        as_expected &= judged.reason == REASON_NAMES.index(expect.reason)
    open_ = judged.status == INCONCLUSIVE
    compared = np.where(as_expected, PASS, np.where(open_, INCONCLUSIVE, FAIL))
    words = expect.status if expect.reason is None else f"{expect.status} ({expect.reason})"
    return Outcome(
        schemes=[names[i] for i in chosen],
        cases=np.asarray(record["case"]),
        scheme_index=chosen,
        case_index=list(range(len(record["case"]))),
        status=judged.status,
        reason=judged.reason,
        compared=compared,
        away=np.abs(judged.order - order[:, None]),
        expected=words,
        expects_pass=expect.status == "PASS",
        quantity=check.converges,
        tell=lambda scheme, case: tell(story(scheme, case)),
        advise=lambda scheme, case: advise(story(scheme, case)),
        judged=judged,
    )


def _story(
    experiment: Experiment,
    record: Record,
    check: ConvergesCheck,
    judged: Judgement,
    order: Floats,
    scheme: int,
    case: int,
) -> Story:
    levels = tuple(int(level) for level in record["level"])
    culprit = int(judged.culprit[scheme, case])
    spec = experiment.schemes[scheme]
    limit = SCHEMES[spec.kind].stability_limit
    at = levels.index(culprit) if culprit >= 0 else None
    return Story(
        quantity=check.converges,
        reason=REASON_NAMES[int(judged.reason[scheme, case])],
        order=float(judged.order[scheme, case]),
        low=float(judged.low[scheme, case]),
        high=float(judged.high[scheme, case]),
        first=int(judged.first[scheme, case]),
        last=int(judged.last[scheme, case]),
        expected=float(order[scheme]),
        tolerance=check.tolerance,
        norm=check.norm,
        levels=levels,
        culprit=culprit,
        omega_dt=float("nan") if at is None else float(omega_dt(record)[case, at]),
        limit=float("inf") if limit is None else limit,
        options=spec.options,
        is_position=check.converges == MODELS[experiment.model.kind].position,
        scheme=spec.name,
    )
