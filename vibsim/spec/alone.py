"""One member of a sweep as an experiment of its own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vibsim.errors import Fault, InputError
from vibsim.models import MODELS
from vibsim.spec.checks import Check, ClaimCheck, ConvergesCheck, ValueCheck
from vibsim.spec.columns import columns
from vibsim.spec.experiment import Experiment, ModelSpec, SchemeSpec, TimeSpec
from vibsim.spec.fields import FrozenDict


def alone(experiment: Experiment, case: int) -> Experiment:
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
    end = swept.get("time.end", float(experiment.natural_end(parameters)))
    return experiment.model_copy(
        update={
            "name": f"{experiment.name}_case_{case}",
            "model": ModelSpec(kind=experiment.model.kind, parameters=parameters),
            "initial": _filled(swept, "initial", experiment.initial),
            "time": TimeSpec.model_validate({**experiment.time.model_dump(), "end": end}),
            "schemes": tuple(_scheme(swept, scheme) for scheme in experiment.schemes),
            "sweep": None,
            "checks": _checks(experiment, case, end),
        }
    )


def _filled(swept: dict[str, Any], section: str, values: Mapping[str, Any]) -> FrozenDict:
    return FrozenDict(
        {name: swept.get(f"{section}.{name}", value) for name, value in values.items()}
    )


def _scheme(swept: dict[str, Any], scheme: SchemeSpec) -> SchemeSpec:
    options = _filled(swept, f"schemes.{scheme.name}", scheme.options)
    return SchemeSpec(name=scheme.name, kind=scheme.kind, options=options)


def _checks(experiment: Experiment, case: int, end: float) -> tuple[Check, ...]:
    scale = end if experiment.end_varies else 1.0
    kept = [_adapted(check, scale) for check in experiment.checks if _concerns(check, case)]
    if kept:
        return tuple(kept)
    position = MODELS[experiment.model.kind].position
    return (ConvergesCheck(id="check_1", converges=position),)


def _concerns(check: Check, case: int) -> bool:
    measured = check.measured
    return isinstance(measured, ConvergesCheck) or measured.at.case in (None, case)


def _adapted(check: Check, scale: float) -> Check:
    """Return the check as it is of the member alone, whose times are no fractions of its end."""
    if isinstance(check, ClaimCheck):
        return check.model_copy(update={"that": _adapted(check.that, scale)})
    if isinstance(check, ValueCheck):
        t = None if check.at.t is None else check.at.t * scale
        at = check.at.model_copy(update={"case": None, "t": t})
        return check.model_copy(update={"at": at})
    return check
