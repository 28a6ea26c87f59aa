"""Compare the levels of a user's solver, member by member: the content of ``convergence.nc`` and ``summary.json``."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vibsim.analysis.summary import WORST, heading
from vibsim.checks.fields import GROUP, name_of
from vibsim.checks.outcome import compared_reason
from vibsim.checks.solver_facts import SOLVER_FACTS
from vibsim.convergence.study.labelled import COLUMNS, dataset
from vibsim.convergence.study.verdict import LadderVerdict, Level
from vibsim.core.errors import VibsimError
from vibsim.core.record import Record, Variable, attributes, flags
from vibsim.core.vocabulary import REASON_NAMES, SEVERITY, STATUSES, jsonable, worst
from vibsim.experiment.schema.solver import SolverCheck
from vibsim.experiment.solver import SolverExperiment
from vibsim.solver import level_output
from vibsim.solver.level_output import plain
from vibsim.solver.verdicts import SolverResult, expected, judge

SCHEME = "solver"
"""Takes the place of the name of a scheme in results."""
ORDER = "order"
"""Fact that is stored for every check, because the page compares errors with it."""
SHOWN = ("values", "best_values")
"""Arrays that are stored for the decisive member only; the table of levels is stored for every member."""


@dataclass(frozen=True)
class CheckResults:
    """The results of one check for every member, the worst first."""

    check: SolverCheck
    results: Sequence[SolverResult]
    """Only the first one has the values of its levels."""

    @property
    def counts(self) -> dict[str, int]:
        """Number of results by status, after comparison with the expected one."""
        statuses = [result.compared for result in self.results]
        return {status: statuses.count(status) for status in STATUSES}

    @property
    def status(self) -> str:
        """The worst status of the results."""
        return worst(result.compared for result in self.results)


def judge_members(
    experiment: SolverExperiment, read: Callable[[int], Sequence[Record]]
) -> list[CheckResults]:
    """Judge every check of every member.

    Parameters
    ----------
    read
        Returns the levels of a member, the coarsest first.

    Raises
    ------
    VibsimError
        Where levels cannot be compared; it names member, quantity and levels.
    """
    rows: list[list[SolverResult]] = [[] for _ in experiment.checks]
    for member in range(experiment.members):
        records = read(member)
        for check, row in zip(experiment.checks, rows, strict=True):
            values = [level_output.stored(record, str(check.about)) for record in records]
            try:
                result = judge(experiment, check, member, values)
            except VibsimError as error:
                where = f"member {member}: " if experiment.sweep else ""
                raise VibsimError(f"{where}{error}") from None
            if row and _severity(result) < _severity(row[0]):
                row[0], result = result, row[0]
            # only the worst result, the first in the row, keeps its values
            bare = replace(result.verdict, values=np.empty(0), best_values=None, coords={})
            row.append(replace(result, verdict=bare) if row else result)
    return [
        CheckResults(check, sorted(row, key=_severity))
        for check, row in zip(experiment.checks, rows, strict=True)
    ]


def _severity(result: SolverResult) -> tuple[int, float, int]:
    return -SEVERITY[result.compared], -result.away, result.member


# ---- summary.json


def summarise(experiment: SolverExperiment, checks: Sequence[CheckResults]) -> dict[str, Any]:
    """Return the summary of an experiment, as `vibsim.analysis.summary.summarise` does."""
    plain: dict[str, Any] = jsonable(
        {
            **heading(experiment, worst(check.status for check in checks)),
            "checks": [_check(experiment, check) for check in checks],
            "failures": [],
            "failure_count": 0,
        }
    )
    return plain


def _check(experiment: SolverExperiment, checked: CheckResults) -> dict[str, Any]:
    check, verdict = checked.check, checked.results[0].verdict
    status, most = checked.status, None if experiment.sweep is None else WORST
    advice = verdict.advice or "Compare the expectation with the levels."
    return {
        "id": check.id,
        "kind": check.kind,
        "text": _text(experiment, checked),
        "quantity": check.about,
        "expected": expected(check),
        "status": status,
        "reason": compared_reason(check, status, verdict.status, verdict.reason),
        "advice": "" if status == "PASS" else advice,
        "results": [_result(experiment, result) for result in checked.results[:most]],
        "counts": checked.counts,
        "where": {},
        "note": None,
        "source": None,
    }


def _text(experiment: SolverExperiment, checked: CheckResults) -> str:
    """Return the sentence of the decisive member, after the number of members with its status."""
    decisive, status = checked.results[0], checked.status
    sentence = decisive.verdict.sentence
    total = len(checked.results)
    if total == 1:
        return sentence
    head = f"{status} in {checked.counts[status]} of {total} members"
    if status == "PASS":
        head = f"{'Both' if total == 2 else f'All {total}'} members passed"
    place = ", ".join(f"{k} = {v}" for k, v in experiment.parameters_of(decisive.member).items())
    return f"{head}. The hardest is member {decisive.member} ({place}). {sentence}"


def _result(experiment: SolverExperiment, result: SolverResult) -> dict[str, Any]:
    verdict = result.verdict
    fields = {
        "scheme": SCHEME,
        "case": result.member,
        "status": verdict.status,
        "reason": verdict.reason,
        "facts": result.facts,
        "sentence": verdict.sentence,
    }
    if experiment.sweep is None:
        return fields
    return fields | {
        "values": experiment.parameters_of(result.member),
        "command": experiment.command_of(result.member),
    }


# ---- convergence.nc


def record(experiment: SolverExperiment, checks: Iterable[CheckResults]) -> Record:
    """Return the stored results of all checks: the table of levels of every member, the values of the decisive one."""
    members, levels = experiment.members, list(experiment.levels)
    coords = {
        "level": plain(("level",), levels, "position of the level, the coarsest 0"),
        "case": plain(("case",), np.arange(members), "member of the sweep"),
    }
    for name, sizes in experiment.sizes.items():
        coords[name] = plain(("level",), np.array(sizes, float), f"size {name} of the level")
    for name in experiment.parameters_of(0):
        column = [experiment.parameters_of(i)[name] for i in range(members)]
        coords[name] = plain(("case",), column, f"parameter {name}")
    variables: dict[str, Variable] = {}
    for checked in checks:
        variables |= _check_variables(checked)
    return Record(coords, variables)


def _check_variables(checked: CheckResults) -> dict[str, Variable]:
    """Return the variables of a check."""
    id_, decisive = checked.check.id, checked.results[0]
    table: dict[str, Variable] = {}

    def add(name: str, dims: tuple[str, ...], values: Any, meaning: str, **more: Any) -> None:
        text = attributes(f"check {id_}: {meaning}", "1", **more)
        table[name_of(id_, name)] = Variable(dims, np.asarray(values), text, GROUP)

    by_member = sorted(checked.results, key=lambda result: result.member)
    for name, words in (("status", STATUSES), ("reason", REASON_NAMES)):
        codes = [words.index(getattr(result.verdict, name)) for result in by_member]
        add(name, ("case",), np.array(codes, dtype=np.int8), f"measured {name}", **flags(words))
    # None becomes NaN
    orders = np.array([result.verdict.order for result in by_member], float)
    add(ORDER, ("case",), orders, SOLVER_FACTS["converges"][ORDER])
    for name, meaning in SOLVER_FACTS[checked.check.kind].items():
        add(name, ("case",), np.array([r.facts[name] for r in by_member], float), meaning)
    for name, meaning in COLUMNS.items():
        rows = [[getattr(row, name) for row in result.verdict.levels] for result in by_member]
        add(f"level_{name}", ("case", "level"), np.array(rows, float), meaning)
    add("member", (), np.int64(decisive.member), "member that decides")
    shown = dataset(decisive.verdict)
    for name in SHOWN:
        if name in shown:
            dims = ("level" if dim == "h" else _dim(id_, str(dim)) for dim in shown[name].dims)
            add(f"of_{name}", tuple(dims), shown[name].values, shown[name].attrs["long_name"])
    for dim, points in decisive.verdict.coords.items():
        add(f"at_{dim}", (_dim(id_, dim),), points, f"common points along {dim}")
    return table


def _or_none(value: float) -> float | None:
    return None if math.isnan(value) else value


def _dim(id_: str, dim: str) -> str:
    return name_of(id_, f"at_{dim}")


def restored(
    experiment: SolverExperiment, stored: Record, check: SolverCheck, entry: Mapping[str, Any]
) -> LadderVerdict:
    """Return the verdict on the decisive member, from ``convergence.nc`` and the entry of the check in the summary."""
    id_ = check.id
    result = entry["results"][0]
    facts = result["facts"]
    member = int(stored[name_of(id_, "member")])
    columns = {name: stored[name_of(id_, f"level_{name}")][member].tolist() for name in COLUMNS}
    rows = zip(experiment.sizes[experiment.step], *columns.values(), strict=True)
    table = [(h, *map(_or_none, entries)) for h, *entries in rows]
    values, best = (name_of(id_, f"of_{name}") for name in SHOWN)
    dims = stored.variable(values).dims[1:] if values in stored else ()
    head = _dim(id_, "")
    is_order = check.kind == "converges"
    return LadderVerdict(
        quantity=str(check.about),
        status=result["status"],
        reason=result["reason"],
        order=_or_none(float(stored[name_of(id_, ORDER)][member])),
        order_low=facts.get("order_low"),
        order_high=facts.get("order_high"),
        h_used=tuple(facts.get("h_used") or ()),
        error=facts["error"],
        error_bound=facts["error_bound"],
        relative_error=facts["relative_error"],
        best=facts["best"],
        best_bound=facts["best_bound"],
        gci=facts["gci"],
        sentence=entry["text"],
        advice=entry["advice"],
        levels=tuple(Level(*row) for row in table),
        expected=getattr(check, "order", None) if is_order else None,
        at_least=getattr(check, "at_least", None) if is_order else None,
        size_name=experiment.step,
        is_exact_known=experiment.quantities[str(check.about)].exact is not None,
        dims=tuple(dim.removeprefix(head) for dim in dims),
        coords={dim.removeprefix(head): stored[dim] for dim in dims if dim in stored},
        values=stored[values]
        if values in stored
        else np.array([row[1] for row in table], dtype=float),
        best_values=np.asarray(stored[best]) if best in stored else None,
    )
