"""An experiment with a tolerance, once its levels are chosen."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from vibsim.models import quantities
from vibsim.spec import limits
from vibsim.spec.check_places import Ladder, kinds_of
from vibsim.spec.check_rules import finish_checks
from vibsim.spec.checks import Check, ClaimCheck
from vibsim.spec.experiment import Experiment
from vibsim.spec.faults import Report
from vibsim.spec.fields import MAX_LEVEL
from vibsim.spec.published_rules import finish_published
from vibsim.spec.source import Source
from vibsim.spec.sweep import Swept
from vibsim.spec.table_rules import met_again


def with_levels(experiment: Experiment, levels: Sequence[int]) -> Experiment:
    """Return `experiment` with `levels`, held to every rule that levels of a file are held to.

    Raises
    ------
    InputError
        Where what they ask for cannot be run, or a check names a time that they do not store.
    ValueError
        Where they are no levels: none at all, not increasing, or out of range.
    """
    rises = all(low < high for low, high in pairwise(levels))
    if not levels or not rises or not 0 <= levels[0] <= levels[-1] <= MAX_LEVEL:
        raise ValueError(f"{list(levels)} are not levels from 0 to {MAX_LEVEL} in increasing order")
    model, time = experiment.model.definition, experiment.time
    swept = Swept(experiment.sweep.axes if experiment.sweep else ())
    shape = limits.Shape(
        base_steps=time.base_steps,
        levels=tuple(levels),
        schemes=len(experiment.schemes),
        members=experiment.members,
        samples=experiment.samples,
        variables=len(quantities(model)),
        end=swept.least_end(time),
        own_velocity=experiment.own_velocity,
    )
    report = Report(Source(str(experiment.file or experiment.name), {}))
    limits.check(shape, report)
    end = swept.fixed_end(time)
    ladder = Ladder(model=model, shape=shape, time=time, end=end, **kinds_of(experiment.schemes))
    finish_checks((_as_written(check) for check in experiment.written), ladder, report)
    finish_published(experiment.published, (), ladder, report)
    report.raise_any()
    return met_again(experiment.model_copy(update={"levels": tuple(levels)}))


def _as_written(check: Check) -> Check:
    """Return the check of a claim without the id that it has from the claim."""
    if isinstance(check, ClaimCheck):
        return check.model_copy(update={"that": check.that.model_copy(update={"id": ""})})
    return check
