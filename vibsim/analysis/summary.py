"""The content of ``summary.json`` (design, section 4.4): plain data, None where a number does not exist."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.analysis.checks import Verdict
from vibsim.record import Record
from vibsim.vocabulary import FORMAT, jsonable, worst

if TYPE_CHECKING:
    import xarray

    from vibsim.spec import Experiment

WORST = 10
"""Of a sweep, so many results of a check and so many failures are listed."""


def summarise(
    experiment: Experiment, verdicts: Sequence[Verdict], convergence: xarray.Dataset | Record
) -> dict[str, Any]:
    """Return the summary of an experiment.

    Parameters
    ----------
    verdicts, convergence
        What `verdicts` and `analyse` returned for the experiment.

    Returns
    -------
    dict
        Ready for JSON: no NaN, no infinity, no numpy type. With a sweep the `WORST` results of each check and the
        first `WORST` failures are listed; ``counts`` and ``failure_count`` count all of them.
    """
    record = convergence if isinstance(convergence, Record) else Record.from_xarray(convergence)
    most = None if experiment.sweep is None else WORST
    failures = _failures(record)
    plain: dict[str, Any] = jsonable(
        {
            "vibsim_format": FORMAT,
            "collection": experiment.collection,
            "experiment": experiment.name,
            "title": experiment.title,
            "status": worst(verdict.status for verdict in verdicts),
            "checks": [_check(verdict, most) for verdict in verdicts],
            "failures": failures[:most],
            "failure_count": len(failures),
        }
    )
    return plain


def _check(verdict: Verdict, most: int | None) -> dict[str, Any]:
    results = [asdict(result) for result in verdict.results[:most]]
    return {name: getattr(verdict, name) for name in verdict.__dataclass_fields__} | {
        "results": results
    }


def _failures(record: Record) -> list[dict[str, Any]]:
    """List the members that broke down, the earliest first."""
    names, schemes = record.meanings("status"), record.words("scheme")
    rows = [
        {
            "scheme": schemes[s],
            "level": int(record["level"][lv]),
            "case": int(record["case"][c]),
            "t": float(record["failure_time"][s, c, lv]),
            "step": int(record["last_step"][s, c, lv]) + 1,
            "error": names[int(record["status"][s, c, lv])],
        }
        for s, c, lv in np.argwhere(record["status"] != 0)
    ]
    return sorted(rows, key=lambda row: (row["t"], row["scheme"], row["case"], row["level"]))
