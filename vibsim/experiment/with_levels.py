"""An experiment with a tolerance, once its levels are chosen."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from vibsim.experiment.data import AnyExperiment
from vibsim.experiment.faults import Report
from vibsim.experiment.rules import size_limits
from vibsim.experiment.rules.check_places import Ladder, kinds_of
from vibsim.experiment.rules.checks import finish_checks
from vibsim.experiment.rules.published import check_published
from vibsim.experiment.rules.tables import update_tables
from vibsim.experiment.schema.checks import Check, ClaimCheck
from vibsim.experiment.schema.fields import MAX_LEVEL
from vibsim.experiment.sweep.build import SweepAxes
from vibsim.experiment.yaml.parse import Source
from vibsim.models import quantities


def with_levels(experiment: AnyExperiment, levels: Sequence[int]) -> AnyExperiment:
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
    sweep_axes = SweepAxes(experiment.sweep.axes if experiment.sweep else ())
    shape = size_limits.Shape(
        base_steps=time.base_steps,
        levels=tuple(levels),
        schemes=len(experiment.schemes),
        members=experiment.members,
        samples=experiment.samples,
        variables=len(quantities(model)),
        end=sweep_axes.least_end(time),
        own_velocity=experiment.own_velocity,
    )
    report = Report(Source(str(experiment.file or experiment.name), {}))
    size_limits.check(shape, report)
    end = sweep_axes.fixed_end(time)
    ladder = Ladder(model=model, shape=shape, time=time, end=end, **kinds_of(experiment.schemes))
    finish_checks((_as_written(check) for check in experiment.written), ladder, report)
    check_published(experiment.published, (), ladder, report)
    report.raise_any()
    found = experiment.model_copy(update={"levels": tuple(levels)})
    size_limits.check_files(found, report)
    report.raise_any()
    return update_tables(found)


def _as_written(check: Check) -> Check:
    """Return the check of a claim without the id that it has from the claim."""
    if isinstance(check, ClaimCheck):
        return check.model_copy(update={"that": check.that.model_copy(update={"id": ""})})
    return check
