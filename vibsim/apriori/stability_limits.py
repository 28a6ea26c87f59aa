"""The largest stable w dt of the schemes of each member, whose options may be swept."""

from __future__ import annotations

import math

import numpy as np

from vibsim import theory
from vibsim.core.array_types import Floats
from vibsim.experiment import Experiment
from vibsim.experiment.sweep_columns import Columns, by_options
from vibsim.schemes import Options, Scheme


def stability_limits(experiment: Experiment, columns: Columns) -> Floats:
    """Return the largest stable w dt of every scheme, infinite if there is no limit, shape (scheme, case).

    It is also infinite for a scheme that chooses its own steps, and for one that grows at every step: its growth
    vanishes with dt, so it is no instability.
    """
    limits = by_options(experiment, columns, limit_of)
    return np.where(limits > 0.0, limits, np.inf)


def limit_of(scheme: Scheme, options: Options) -> float:
    """Return the largest stable w dt of a scheme: infinite without a limit, 0 if every step grows, NaN if adaptive."""
    return math.nan if scheme.adaptive else theory.stability_limit(scheme, options)
