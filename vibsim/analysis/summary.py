"""The content of ``summary.json``: every check with its verdict, as plain data; None stands for a missing number."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.analysis.check_verdicts import Verdict
from vibsim.checks.verdict_text import Wording
from vibsim.core.record import Record
from vibsim.core.vocabulary import FORMAT, jsonable, worst
from vibsim.experiment import citation
from vibsim.experiment.sweep_columns import recorded_columns

if TYPE_CHECKING:
    import xarray

    from vibsim.experiment import Experiment
    from vibsim.experiment.data import ReadExperiment

WORST = 10
"""Number of results of a check, and of failures, that the summary of a sweep lists."""


def summarise(
    experiment: Experiment, verdicts: Sequence[Verdict], convergence: xarray.Dataset | Record
) -> dict[str, Any]:
    """Return the summary of an experiment.

    Parameters
    ----------
    verdicts, convergence
        The results of `verdicts` and `analyse` for the experiment.

    Returns
    -------
    dict
        Ready for JSON: no NaN, no infinity, no numpy type. For a sweep it lists the `WORST` results of each check and
        the first `WORST` failures, each with the swept ``values`` and the ``command`` that runs its member alone;
        ``counts`` and ``failure_count`` count all of them, and ``where`` locates them in the sweep. ``settings`` are
        those of the command line, if any.
    """
    record = convergence if isinstance(convergence, Record) else Record.from_xarray(convergence)
    most = None if experiment.sweep is None else WORST
    plain: dict[str, Any] = jsonable(
        {
            **heading(experiment, worst(verdict.status for verdict in verdicts)),
            "checks": [_check(experiment, record, verdict, most) for verdict in verdicts],
            "failures": _failures(experiment, record, most),
            "failure_count": int(np.count_nonzero(record["status"])),
        }
    )
    return plain


def heading(experiment: ReadExperiment, status: str) -> dict[str, Any]:
    """Return the fields of a summary that describe the whole experiment; they are the same for a user's own solver."""
    settings = {"settings": list(experiment.settings)} if experiment.settings else {}
    return {
        "vibsim_format": FORMAT,
        "collection": experiment.collection,
        "experiment": experiment.name,
        **settings,
        "title": experiment.title,
        "source": citation.fields(experiment.source),
        "status": status,
    }


def _check(
    experiment: Experiment, record: Record, verdict: Verdict, most: int | None
) -> dict[str, Any]:
    check = next((check for check in experiment.checks if check.id == verdict.id), None)
    wording = Wording(experiment, record, check)
    rows = [
        vars(row) | {"sentence": wording.sentence(row)} | _member(experiment, record, row.case)
        for row in verdict.results.worst(most)
    ]
    return {**vars(verdict), "results": rows, "source": citation.fields(verdict.source)}


def _member(experiment: Experiment, record: Record, case: int) -> dict[str, Any]:
    """Return the swept values of a member, and the command that runs it alone if that is possible."""
    if experiment.sweep is None:
        return {}
    at = record.place("case", case)
    fields = {"values": {key: values[at] for key, values in recorded_columns(record).items()}}
    if case % experiment.chain:
        return fields
    return fields | {"command": experiment.command_of(case)}


def _failures(experiment: Experiment, record: Record, most: int | None) -> list[dict[str, Any]]:
    """Return the runs that broke down, the earliest first: all, or the first `most`."""
    failed, names, schemes = (
        record["status"] != 0,
        record.meanings("status"),
        record.words("scheme"),
    )
    if most is not None and np.count_nonzero(failed) > most:
        times = np.nan_to_num(record["failure_time"], nan=np.inf)
        failed &= times <= np.partition(times[failed], most - 1)[most - 1]
    rows = [
        {
            "scheme": schemes[s],
            "level": int(record["level"][lv]),
            "case": int(record["case"][c]),
            "t": float(record["failure_time"][s, c, lv]),
            "step": _step(record, s, c, lv),
            "error": names[int(record["status"][s, c, lv])],
        }
        for s, c, lv in np.argwhere(failed)
    ]
    rows.sort(key=lambda row: (row["t"], row["scheme"], row["case"], row["level"]))
    return [row | _member(experiment, record, row["case"]) for row in rows[:most]]


def _step(record: Record, scheme: int, case: int, level: int) -> int:
    """Return the step at which a run failed."""
    if "last_step" in record:
        return int(record["last_step"][scheme, case, level]) + 1
    return round(float(record["failure_time"][scheme, case, level]) / record.step(level, case))
