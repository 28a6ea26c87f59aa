"""What a level of an experiment asks of a job: its counts, as `vibsim.experiment.cost` takes them."""

from __future__ import annotations

import math

from vibsim.experiment.cost import COUPLED, EVENTFUL, Load, work
from vibsim.experiment.data import ExperimentSpec
from vibsim.experiment.stored_samples import stride
from vibsim.experiment.stored_series import extrema_kept, is_bounded, stored_series
from vibsim.models import Model, has_solution
from vibsim.schemes import SCHEMES
from vibsim.schemes.adaptive import seconds


def _alone(model: Model) -> float | None:
    """Return what a step takes of a model whose members are stepped one by one (`vibsim.experiment.cost.work`)."""
    if model.events is not None:
        return EVENTFUL
    return COUPLED if model.coordinates > 1 or model.lookup is not None else None


def load_of(experiment: ExperimentSpec, level: int) -> Load:
    """Return what one member of `experiment` costs at `level`."""
    model, steps = experiment.model.definition, experiment.steps(level)
    lean = is_bounded(experiment)
    trajectories = len(experiment.schemes) * experiment.members
    every = stride(experiment.samples, experiment.steps(experiment.levels[0]), steps, trajectories)
    kinds = [SCHEMES[experiment.schemes[i].kind] for i in experiment.ladder]
    works = [work(kind.force_evaluations, kind.explicit, _alone(model)) for kind in kinds]
    return Load(
        schemes=len(experiment.schemes),
        steps=steps,
        samples=steps // every + 1,
        series=len(stored_series(experiment)),
        exact=len(model.states) if has_solution(model) and not lean else 0,
        work=sum(explicit for explicit, _ in works),
        iterated=sum(iterated for _, iterated in works),
        extrema=0 if lean else extrema_kept(steps, trajectories),
        d2t=experiment.own_velocity or not lean,
        own=_own_seconds(experiment),
    )


def _own_seconds(experiment: ExperimentSpec) -> float:
    """Return the seconds that schemes which choose their own steps take of a member that is not swept."""
    model = experiment.model.definition
    turns = experiment.time.end * float(model.natural_frequency(experiment.model.parameters))
    return sum(
        seconds(scheme.kind, float(scheme.options["tolerance"]), turns / (2.0 * math.pi))
        for scheme in experiment.schemes
        if SCHEMES[scheme.kind].adaptive
    )
