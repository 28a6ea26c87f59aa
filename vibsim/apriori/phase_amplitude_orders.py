"""The orders of phase and amplitude that theory promises to members, from the steps and the starts of their schemes.

Of a model that `vibsim.models.shared.free` describes; nothing is known of any other one. Where the position has a
promise for sound options only, that of its parts is of the scheme as it runs: a first-order start has a phase of first
order.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibsim import plan, theory
from vibsim.core.array_types import Floats
from vibsim.models.shared.free import free_oscillation, why_not_free
from vibsim.models.shared.phase_amplitude_names import PHASE, is_error_part
from vibsim.schemes import SCHEMES
from vibsim.simulation.members import numbers_of

if TYPE_CHECKING:
    from vibsim.apriori.formal_orders import Columns
    from vibsim.experiment import Experiment


def is_promised(experiment: Experiment, quantity: str) -> bool:
    """Tell whether theory knows the order of a quantity as that of a part of an error."""
    return is_error_part(quantity) and not why_not_free(experiment.model.definition)


def part_orders(experiment: Experiment, quantity: str, columns: Columns) -> Floats:
    """Return the order of a part for which `is_promised` holds, shape (scheme, 1 or case).

    It is infinite where the part is exact, and NaN where nothing oscillates or a scheme chooses its own steps.
    """
    model = experiment.model.definition
    size = len(next(iter(columns.values()))) if columns else 1
    parameters, initial = numbers_of(experiment, columns, size)
    motion = free_oscillation(model, initial, parameters)
    found = np.full((len(experiment.schemes), len(motion.frequency)), np.nan)
    for s, spec in enumerate(experiment.schemes):
        if SCHEMES[spec.kind].adaptive:
            continue
        for options, cases in plan.option_groups(experiment, s, columns):
            stepper = SCHEMES[spec.kind].stepper_for(model, options)
            damping = motion.damping[cases]
            # worked out once for each damping
            for value in np.unique(damping[np.isfinite(damping)]).tolist():
                own = cases[damping == value]
                both = theory.part_orders(
                    stepper, value, motion.position[own], motion.velocity[own]
                )
                found[s, own] = both[0 if quantity.endswith(PHASE) else 1]
    return found
