"""The orders of phase and amplitude that theory promises to members, from the steps and the starts of their schemes.

Of a model that `vibsim.models.shared.free` describes; nothing is known of any other one. Where the position has a
promise for sound options only, that of its parts is of the scheme as it runs: a first-order start has a phase of first
order.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibsim import plan, theory
from vibsim.core.array_types import Floats, Integers
from vibsim.models.shared.free import FreeOscillation, free_oscillation, why_not_free
from vibsim.models.shared.phase_amplitude_names import PHASE, is_error_part
from vibsim.schemes import SCHEMES, Options
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
    motion = _motion(experiment, columns)
    found = np.full((len(experiment.schemes), len(motion.frequency)), np.nan)
    for s, scheme in enumerate(experiment.schemes):
        if SCHEMES[scheme.kind].adaptive:
            continue
        for options, cases in plan.option_groups(experiment, s, columns):
            both = _of_scheme(experiment, scheme.kind, options, motion, cases)
            found[s, cases] = both[0 if quantity.endswith(PHASE) else 1]
    return found


def _motion(experiment: Experiment, columns: Columns) -> FreeOscillation:
    """Return the numbers of the members that swept values belong to; of the one member without any."""
    size = len(next(iter(columns.values()))) if columns else 1
    parameters, initial = numbers_of(experiment, columns, size)
    return free_oscillation(experiment.model.definition, initial, parameters)


def _of_scheme(
    experiment: Experiment,
    kind: str,
    options: Options,
    motion: FreeOscillation,
    where: Integers,
) -> Floats:
    """Return the orders of both parts, shape (2, len(where)), worked out once for each damping."""
    stepper = SCHEMES[kind].stepper_for(experiment.model.definition, options)
    found = np.full((2, len(where)), np.nan)
    damping = motion.damping[where]
    for value in np.unique(damping[np.isfinite(damping)]).tolist():
        own = np.flatnonzero(damping == value)
        start = (x[where[own]] for x in (motion.position, motion.velocity))
        found[:, own] = theory.part_orders(stepper, value, *start)
    return found
