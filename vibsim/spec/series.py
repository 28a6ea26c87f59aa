"""Which quantities an experiment's checks are about, and which are stored as series where storage is bounded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.models import MODELS

if TYPE_CHECKING:
    from vibsim.spec.experiment import Experiment


def asked(experiment: Experiment) -> tuple[str, ...]:
    """Name the quantities that the checks are about."""
    inner = [check.measured for check in experiment.checks]
    named = (check.converges if check.kind == "converges" else check.quantity for check in inner)
    return tuple(dict.fromkeys(name for name in named if name is not None))


def lean_series(experiment: Experiment) -> tuple[str, ...]:
    """Name the quantities that a level stores as series where storage is bounded (`sampling.is_lean`).

    They are the states and the energy deviation, of which every number about an experiment can be worked out, and what
    else a check asks for.
    """
    states = (state.name for state in MODELS[experiment.model.kind].states)
    return tuple(dict.fromkeys([*states, "energy_deviation", *asked(experiment)]))
