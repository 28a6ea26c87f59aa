"""Which schemes a check is about."""

from __future__ import annotations

from vibsim.experiment.data import ExperimentSpec
from vibsim.experiment.schema.checks import Check, Measurement, ValueCheck
from vibsim.experiment.schema.scheme_checks import ConservesCheck, EqualCheck
from vibsim.models import centred


def schemes_of(experiment: ExperimentSpec, check: Check) -> tuple[int, ...]:
    """Return the numbers of the schemes that a check, or that inside a claim, is about, increasing.

    They are those that it names. Where it names none, they are those with equal steps; and where it is about what only
    schemes with a velocity of their own have, those.
    """
    inner = check.measured
    named = _named(inner)
    if named is not None:
        return tuple(i for i, scheme in enumerate(experiment.schemes) if scheme.name in named)
    asked = inner.conserves if isinstance(inner, ConservesCheck) else inner.about
    if asked not in centred(experiment.model.definition):
        return experiment.ladder
    return tuple(i for i in experiment.ladder if experiment.schemes[i].own_velocity)


def _named(check: Measurement) -> tuple[str, ...] | None:
    if isinstance(check, ValueCheck):
        return None if check.at.scheme is None else (check.at.scheme,)
    return check.equal if isinstance(check, EqualCheck) else check.schemes
