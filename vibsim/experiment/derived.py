"""Derive an experiment from another one: a single member of its sweep, or the levels chosen for its tolerance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from vibsim.experiment.data import AnyExperiment, ExperimentSpec, SchemeSpec, Sweep
from vibsim.experiment.faults import Report
from vibsim.experiment.rules import size_limits
from vibsim.experiment.rules.checks import finish_checks
from vibsim.experiment.rules.members import update_tables
from vibsim.experiment.rules.published import check_published
from vibsim.experiment.rules.setting import Setting
from vibsim.experiment.rules.timing import rising_levels
from vibsim.experiment.schema.checks import Check, ClaimCheck, ConvergesCheck, Members, PublishedAt
from vibsim.experiment.schema.document import Levels
from vibsim.experiment.schema.fields import FrozenDict
from vibsim.experiment.schema.figures import LEVEL
from vibsim.experiment.schema.published import PublishedTable, claims
from vibsim.experiment.schema.sweep import as_option
from vibsim.experiment.sweep_columns import Column, columns, members_with
from vibsim.experiment.validation import read_value
from vibsim.experiment.yaml.parse import Source

AnyAt = TypeVar("AnyAt", bound=Members)


def alone(experiment: AnyExperiment, case: int) -> AnyExperiment:
    """Return the experiment of member `case`, without a sweep, named ``<name>_case_<case>``.

    It has the checks that apply to this member or to all; if there are none, the position must converge, as in a file
    without checks.

    Raises `InputError` if there is no such member, or if it starts from the final state of another one.
    """
    experiment.check_member(case, experiment.members)
    if case % experiment.chain:
        rule = "starts where the member before ends"
        hint = f"run the sweep, or @{case - case % experiment.chain}, which starts as the file says"
        raise experiment.refused("sweep.follow", str(case), rule, hint)
    member_values = columns(experiment, case, case + 1)
    swept = {key: column[0].item() for key, column in member_values.items()}
    parameters = _filled(swept, "model", experiment.model.parameters)
    # terms that are 0 only for this member stay in the equation, so all bits stay the same
    model = experiment.model.model_copy(update={"parameters": parameters})
    initial = _filled(swept, "initial", experiment.initial)
    if model.definition.start is not None:
        start = model.definition.start(parameters).items()
        initial = FrozenDict({name: float(value) for name, value in start})
    end = swept.get("time.end", float(experiment.natural_end(parameters)))
    # times that are fractions of the end of a member become times
    unit = end if experiment.end_varies else 1.0
    published = _tables_of_member(experiment, case, unit, member_values)
    matching = [
        check
        for check in experiment.written
        if check.measured.member in (None, case)
        # a reduction over members does not apply to a single one
        and getattr(check.measured, "take", None) is None
        and members_with(member_values, check.measured.swept, 1).all()
    ]
    checks: list[Check] = [_check_of_member(check, unit) for check in matching]
    checks += claims(published)
    positions = model.definition.positions if not checks else ()
    checks += [ConvergesCheck(id=f"check_{i}", converges=u) for i, u in enumerate(positions, 1)]
    # one member needs no panels or figures per member
    figures = tuple(
        row.model_copy(update={"panels": row.panels if row.panels == LEVEL else None, "each": None})
        for row in experiment.figures
    )
    single = experiment.model_copy(
        update={
            "name": f"{experiment.name}_case_{case}",
            "model": model,
            "initial": initial,
            "time": experiment.time.model_copy(update={"end": end}),
            "schemes": tuple(_scheme(swept, scheme) for scheme in experiment.schemes),
            "sweep": None,
            "checks": tuple(checks),
            "published": published,
            "figures": figures,
        }
    )
    return update_tables(single)


def _filled(swept: dict[str, Any], section: str, values: Mapping[str, Any]) -> FrozenDict:
    return FrozenDict((name, swept.get(f"{section}.{name}", x)) for name, x in values.items())


def _scheme(swept: dict[str, Any], scheme: SchemeSpec) -> SchemeSpec:
    values = _filled(swept, f"schemes.{scheme.name}", scheme.options)
    options = {name: as_option(scheme.options[name], value) for name, value in values.items()}
    return scheme.model_copy(update={"options": FrozenDict(options)})


def _tables_of_member(
    experiment: ExperimentSpec, case: int, unit: float, member_values: Mapping[str, Column]
) -> tuple[PublishedTable, ...]:
    """Return the printed tables with only the rows that apply to member `case`."""
    tables = []
    for table in experiment.published:
        matching = (
            row
            for row in table.rows
            if row.at.case in (None, case) and members_with(member_values, row.at.swept, 1).all()
        )
        rows = tuple(row.model_copy(update={"at": _at_of_member(row.at, unit)}) for row in matching)
        if rows:
            tables.append(table.model_copy(update={"rows": rows}))
    return tuple(tables)


def _check_of_member(check: Check, unit: float) -> Check:
    if isinstance(check, ClaimCheck):
        return check.model_copy(update={"that": _check_of_member(check.that, unit)})
    update: dict[str, Any] = {"at": _at_of_member(check.at, unit)}
    if "case" in type(check).model_fields:
        update["case"] = None
    return check.model_copy(update=update)


def _at_of_member(at: AnyAt, unit: float) -> AnyAt:
    if not isinstance(at, PublishedAt):
        return at.without_members()
    return at.without_members(case=None, t=None if at.t is None else at.t * unit)


def with_levels(experiment: AnyExperiment, levels: Sequence[int]) -> AnyExperiment:
    """Return `experiment` with `levels`, which must satisfy all rules for levels of a file.

    Raises `InputError` if they are not valid levels (empty, not increasing, or out of range), exceed a size limit, or
    do not store a time that a check names.
    """
    report = Report(Source(str(experiment.file or experiment.name), {}))
    rising = rising_levels(read_value(("levels",), list(levels), Levels, report), report)
    report.raise_any()
    setting = Setting(
        model=experiment.model.definition,
        time=experiment.time,
        levels=rising,
        schemes=experiment.schemes,
        names=tuple(scheme.name for scheme in experiment.schemes),
        sweep=experiment.sweep or Sweep(axes=()),
        samples=experiment.samples,
    )
    without_id = {"id": ""}  # the check inside a claim gets its id from the claim again
    written = [
        check.model_copy(update={"that": check.that.model_copy(update=without_id)})
        if isinstance(check, ClaimCheck)
        else check
        for check in experiment.written
    ]
    size_limits.check(setting, report)
    finish_checks(written, setting, report)
    check_published(experiment.published, (), setting, report)
    report.raise_any()
    result = experiment.model_copy(update={"levels": setting.levels})
    size_limits.check_costs(result, report)
    report.raise_any()
    return update_tables(result)
