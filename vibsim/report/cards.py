"""The words of a page: the verdict on every check, what was computed, and where it came from."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.plan.versions import DRAWING, versions
from vibsim.record import Record
from vibsim.report import assertions, contents, data, words
from vibsim.report.tables import Cell, Column, Table

if TYPE_CHECKING:
    from vibsim.spec import Experiment


def context(
    experiment: Experiment,
    record: Record,
    summary: Mapping[str, Any],
    provenance: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the words of a page by the names that its template uses."""
    is_ours = experiment.collection != "adhoc"
    target = f"{experiment.collection}/{experiment.name}" if is_ours else f"{experiment.name}.yaml"
    return {
        "collection": experiment.collection,
        "name": experiment.name,
        "title": experiment.title,
        "source": experiment.source,
        "status": summary["status"],
        "sentence": words.overall(summary),
        "unsettled": words.unsettled(summary),
        "checks": [card(experiment, record, check) for check in summary["checks"]],
        "brief": len(summary["checks"]) > BRIEF,
        "failures": contents.failures(summary, record),
        "unlisted": _unlisted(summary),
        "setup": list(setup(experiment, record)),
        "provenance": list(_provenance(provenance)),
        "used": json.dumps(provenance.get("experiment"), indent=1, ensure_ascii=False, default=str)
        if provenance.get("experiment")
        else "",
        "target": target,
        "python": PYTHON.format(file=f"configs/{target}.yaml" if is_ours else target),
    }


SETTLED = ("asymptotic", "order_low", "order_high")
"""Reasons of a result whose order is known: any other has at most an estimate that may be an accident."""
BRIEF = 3
"""With more checks than this, the evidence of those that passed is folded away."""
PYTHON = """\
from vibsim import Experiment, analyse, simulate, verdicts

experiment = Experiment.from_yaml("{file}")
convergence = analyse(experiment, {{level: simulate(experiment, level) for level in experiment.levels}})
for verdict in verdicts(experiment, convergence):
    print(verdict.id, verdict.status, verdict.reason)"""


def card(experiment: Experiment, record: Record, check: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the page says of one check."""
    explained = words.reason(check["reason"], check["kind"])
    asserted = next((spec for spec in experiment.checks if spec.id == check["id"]), None)
    heading = assertions.heading(asserted) if asserted else words.told(check)
    return {
        "id": check["id"],
        "kind": check["kind"],
        "heading": heading,
        "background": assertions.background(asserted) if asserted else "",
        "text": words.told(check).removeprefix(heading).lstrip(". "),
        "status": check["status"],
        "reason": check["reason"] or "–",
        "meaning": explained.meaning,
        "needs": explained.needs,
        "advice": words.told(check, "advice"),
        "expected": words.expectation(check.get("expected")),
        "factor": _factor(check),
        "results": _results(record, check),
        "more": _more(check),
    }


def _factor(check: Mapping[str, Any]) -> str:
    """Say by what factor halving the step shrinks the error, where the result that decides has a settled order."""
    decisive: Mapping[str, Any] = next(iter(check.get("results") or []), {})
    settled = check["status"] != "INCONCLUSIVE" and decisive.get("reason") in SETTLED
    return words.ratio(decisive.get("order")) if settled else ""


def _results(record: Record, check: Mapping[str, Any]) -> Table | None:
    results: Sequence[Mapping[str, Any]] = check.get("results") or []
    if not results:
        return None
    cases = {int(case): i for i, case in enumerate(record["case"])}
    sweep = bool(data.swept(record))
    measured = check.get("kind") == "converges" or any(r.get("order") is not None for r in results)
    valued = any(r.get("value") is not None for r in results)
    columns = [
        Column("scheme"),
        *([Column("member")] if sweep else []),
        Column("measured"),
        Column("reason"),
    ]
    columns += (
        [Column("order", form="order"), Column("interval"), Column("levels")] if measured else []
    )
    columns += [Column("value", form="value")] if valued else []
    rows = [tuple(_cells(record, r, cases, sweep, measured, valued)) for r in results]
    return Table(f"results_{check['id']}", "Measured", tuple(columns), tuple(rows))


def _cells(
    record: Record,
    result: Mapping[str, Any],
    cases: Mapping[int, int],
    sweep: bool,
    measured: bool,
    valued: bool,
) -> Iterator[Cell]:
    yield result.get("scheme")
    if sweep:
        case = cases.get(result.get("case", -1))
        yield data.case_name(record, case) if case is not None else "all"
    yield result.get("status")
    yield result.get("reason")
    if measured:
        yield from (
            result.get("order"),
            words.interval(result.get("interval")),
            words.levels(result.get("levels")),
        )
    if valued:
        yield result.get("value")


def _more(check: Mapping[str, Any]) -> str:
    """Say how many members the listed results stand for."""
    counts: Mapping[str, Any] = check.get("counts") or {}
    told = ", ".join(
        f"{count} {word}" for word, count in counts.items() if isinstance(count, int) and count
    )
    total = sum(count for count in counts.values() if isinstance(count, int))
    listed = len(check.get("results") or [])
    return f"In all: {told}. Listed are the {listed} worst." if total > listed else ""


def _unlisted(summary: Mapping[str, Any]) -> str:
    """Say how many failures the summary counts but does not list."""
    total, listed = words.broken(summary), len(summary.get("failures") or [])
    return (
        f"In all {total} runs broke down; listed are the first {listed}." if total > listed else ""
    )


def setup(experiment: Experiment, record: Record) -> Iterator[tuple[str, str]]:
    """Yield what was computed as pairs of a term and its text."""
    from vibsim.models import MODELS

    model = MODELS[experiment.model.kind]
    keys = {key for key, _ in experiment.sweep.axes} if experiment.sweep else set()
    sizes = {p.name: data.pretty_unit(p.unit) for p in model.parameters}
    units = {state.name: data.pretty_unit(state.unit) for state in model.states}
    yield "Model", f"{model.title}: {model.equation}"
    yield "Parameters", _listing("model", experiment.model.parameters, sizes, keys)
    yield "Initial values", _listing("initial", experiment.initial, units, keys)
    yield from _grid(experiment, record)
    for spec in experiment.schemes:
        options = ", ".join(f"{key}: {value}" for key, value in spec.options.items())
        yield f"Scheme {spec.name}", f"{spec.kind}" + (f" ({options})" if options else "")
    if experiment.sweep is not None:
        axes = "; ".join(f"{key}: {_range(values)}" for key, values in experiment.sweep.axes)
        yield "Sweep", f"{len(record['case'])} members. {axes}"


def _grid(experiment: Experiment, record: Record) -> Iterator[tuple[str, str]]:
    levels, time = list(experiment.levels), data.unit(record, "dt") or "s"
    ends = [
        words.number(float(experiment.steps(level)), "integer") for level in (levels[0], levels[-1])
    ]
    dt = np.asarray(record["dt"], dtype=np.float64)
    sizes = [words.number(float(value), "step") for value in (dt.max(), dt.min())]
    last = {float(data.times(record, case)[-1]) for case in ((0, len(record["case"]) - 1))}
    extent = " or ".join(words.number(value, "step") for value in sorted(last))
    yield (
        "Time",
        f"0 to {extent} {time}" + (" (differs between members)" if "end" in record else ""),
    )
    run = levels == list(range(levels[0], levels[-1] + 1))
    named = words.levels(levels) if run else ", ".join(map(str, levels))
    spread = f"{ends[0]} to {ends[1]} steps, dt = {sizes[0]} to {sizes[1]} {time}"
    yield (
        "Levels",
        f"{named}: {spread}"
        if len(levels) > 1
        else f"{named}: {ends[0]} steps, dt = {sizes[0]} {time}",
    )
    if "omega_dt" in record:
        product = np.asarray(record["omega_dt"], dtype=np.float64)
        largest = float(product[np.isfinite(product)].max(initial=0.0))
        yield "w dt", f"at most {words.number(largest)} (natural frequency times step)"


def _listing(
    section: str, values: Mapping[str, Any], units: Mapping[str, str], swept: set[str]
) -> str:
    parts = (
        f"{key} swept"
        if f"{section}.{key}" in swept
        else f"{key} = {_plain(value)} {units.get(key, '')}".strip()
        for key, value in values.items()
    )
    return ", ".join(parts)


def _plain(value: Any) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def _range(values: Sequence[Any]) -> str:
    if len(values) <= 8:
        return ", ".join(map(_plain, values))
    return (
        f"{_plain(values[0])}, {_plain(values[1])}, … {_plain(values[-1])} ({len(values)} values)"
    )


def _provenance(provenance: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the versions of all software in one line, then what else is known of where the results came from."""
    found = {**provenance.get("versions", {}), **versions(DRAWING)}
    named = {"python": "Python"}
    yield "Versions", ", ".join(f"{named.get(name, name)} {found[name]}" for name in found)
    yield from flat({k: v for k, v in provenance.items() if k not in {"experiment", "versions"}})


def flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield the entries of a nested mapping with dotted keys."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from flat(value, f"{prefix}{key}.")
        elif isinstance(value, list | tuple):
            yield f"{prefix}{key}", ", ".join(map(str, value))
        else:
            yield f"{prefix}{key}", str(value)
