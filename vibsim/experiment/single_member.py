"""One member of a sweep as an experiment of its own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vibsim.core.errors import Fault, InputError
from vibsim.experiment.data import (
    AnyExperiment,
    ExperimentSpec,
    ModelSpec,
    SchemeSpec,
    TimeSpec,
)
from vibsim.experiment.rules.tables import update_tables
from vibsim.experiment.schema.checks import (
    Check,
    ClaimCheck,
    ConvergesCheck,
    Measurement,
    ValueCheck,
)
from vibsim.experiment.schema.fields import FrozenDict
from vibsim.experiment.schema.options import as_option
from vibsim.experiment.schema.published import PublishedTable, claims
from vibsim.experiment.sweep.columns import columns


def alone(experiment: AnyExperiment, case: int) -> AnyExperiment:
    """Return the experiment of member `case`, without a sweep, named ``<name>_case_<case>``.

    Its checks are those that speak of this member or of every one; without any of them the position must converge, as
    in a file without checks.

    Raises
    ------
    InputError
        Where there is no such member.
    """
    members = experiment.members
    if not 0 <= case < members:
        there = "there is 1 member" if members == 1 else f"there are {members} members"
        name = str(experiment.file or experiment.name)
        rule = f"a case must be from 0 to {members - 1}"
        raise InputError([Fault(name, 0, "", str(case), rule, there)])
    axes = experiment.sweep.axes if experiment.sweep else ()
    swept = {key: column[0].item() for key, column in columns(axes, case, case + 1).items()}
    parameters = _filled(swept, "model", experiment.model.parameters)
    model = ModelSpec(
        kind=experiment.model.kind,
        parameters=parameters,
        formulas=experiment.model.formulas,
        tables=experiment.model.tables,
        # a term that is 0 for this member alone stays, and with it every bit
        terms=experiment.model.terms,
    )
    initial = _filled(swept, "initial", experiment.initial)
    if model.definition.start is not None:
        here = model.definition.start(parameters).items()
        initial = FrozenDict({name: float(value) for name, value in here})
    end = swept.get("time.end", float(experiment.natural_end(parameters)))
    published = _published(experiment, case, end)
    found = experiment.model_copy(
        update={
            "name": f"{experiment.name}_case_{case}",
            "model": model,
            "initial": initial,
            "time": TimeSpec.model_validate({**experiment.time.model_dump(), "end": end}),
            "schemes": tuple(_scheme(swept, scheme) for scheme in experiment.schemes),
            "sweep": None,
            "checks": _checks(experiment, published, case, end),
            "published": published,
        }
    )
    return update_tables(found)


def _filled(swept: dict[str, Any], section: str, values: Mapping[str, Any]) -> FrozenDict:
    return FrozenDict(
        {name: swept.get(f"{section}.{name}", value) for name, value in values.items()}
    )


def _scheme(swept: dict[str, Any], scheme: SchemeSpec) -> SchemeSpec:
    found = _filled(swept, f"schemes.{scheme.name}", scheme.options)
    options = {name: as_option(scheme.options[name], value) for name, value in found.items()}
    return SchemeSpec(name=scheme.name, kind=scheme.kind, options=options)


def _scale(experiment: ExperimentSpec, end: float) -> float:
    """Return the time that the unit of checked times is: the member's end where times are fractions of it."""
    return end if experiment.end_varies else 1.0


def _published(experiment: ExperimentSpec, case: int, end: float) -> tuple[PublishedTable, ...]:
    """Return the rows of printed tables that speak of this member or of every one."""
    scale = _scale(experiment, end)
    tables = []
    for table in experiment.published:
        rows = [row for row in table.rows if row.at.case in (None, case)]
        kept = []
        for row in rows:
            t = None if row.at.t is None else row.at.t * scale
            at = row.at.model_copy(update={"case": None, "t": t})
            kept.append(row.model_copy(update={"at": at}))
        if kept:
            tables.append(table.model_copy(update={"rows": tuple(kept)}))
    return tuple(tables)


def _checks(
    experiment: ExperimentSpec, published: tuple[PublishedTable, ...], case: int, end: float
) -> tuple[Check, ...]:
    scale = _scale(experiment, end)
    kept = [_adapted(check, scale) for check in experiment.written if _concerns(check, case)]
    kept.extend(claims(published, experiment.source))
    if kept:
        return tuple(kept)
    positions = experiment.model.definition.positions
    return tuple(
        ConvergesCheck(id=f"check_{i}", converges=name) for i, name in enumerate(positions, 1)
    )


def case_of(check: Measurement) -> int | None:
    """Return the member that a check speaks of; None for every one."""
    if isinstance(check, ConvergesCheck):
        return None
    return check.at.case if isinstance(check, ValueCheck) else check.case


def _concerns(check: Check, case: int) -> bool:
    return case_of(check.measured) in (None, case)


def _adapted(check: Check, scale: float) -> Check:
    """Return the check as it is of the member alone, whose times are no fractions of its end."""
    if isinstance(check, ClaimCheck):
        return check.model_copy(update={"that": _adapted(check.that, scale)})
    if isinstance(check, ValueCheck):
        t = None if check.at.t is None else check.at.t * scale
        at = check.at.model_copy(update={"case": None, "t": t})
        return check.model_copy(update={"at": at})
    return check if isinstance(check, ConvergesCheck) else check.model_copy(update={"case": None})
