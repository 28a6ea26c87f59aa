r"""Models of the form ``u'' + c u' + w^2 (u - r) = 0``: linear, with linear damping or none, and no force in time.

A scheme on such a model is a matrix, whose theory is complete (`vibsim.theory`). Source: vibration text (B), sections 1
and 8.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.formula import ZERO, derivative, put, values
from vibsim.models.base import Model, Numbers, by_name, tree


@dataclass(frozen=True)
class FreeOscillation:
    """Coefficients and initial values of members; every array has shape (case,)."""

    frequency: Floats
    """Angular frequency w; NaN if the spring does not pull back."""
    damping: Floats
    """c/w."""
    position: Floats
    """Initial position relative to the equilibrium r."""
    velocity: Floats
    """Initial velocity over w."""
    equilibrium: Floats
    """The place of rest r."""


@cache
def why_not_free(model: Model) -> str:
    """Return why a model is not of this form, as a predicate ("is nonlinear"); empty if it is."""
    if not model.is_alone:
        return "has several coordinates"
    if model.events is not None or model.lookup is not None:
        return "has a force with corners"
    if not model.linear:
        return "is nonlinear"
    force = tree(model, model.acceleration)
    if "t" in force.names:
        return "has a force that depends on time"
    is_linear = model.damping is not None and model.damping.kind == "linear"
    if model.velocity in force.names and not is_linear:
        return "has a damping that is not linear"
    return ""


def free_oscillation(model: Model, initial: Numbers, parameters: Numbers) -> FreeOscillation:
    """Return coefficients and initial values of members of a model for which `why_not_free` is empty.

    Parameters
    ----------
    initial, parameters
        Numbers or arrays of shape (case,), by the names of the states and by `vibsim.models.base.Parameter.key`.
    """
    named = by_name(model.parameters, parameters)
    force = tree(model, model.acceleration)
    at_rest = put(put(force, model.position, ZERO), model.velocity, ZERO)
    stiffness = -values(derivative(force, model.position), named)
    rate = values(tree(model, model.damping.rate), named) if model.damping is not None else 0.0
    with np.errstate(all="ignore"):
        w = np.sqrt(np.where(stiffness > 0.0, stiffness, np.nan))
        equilibrium = values(at_rest, named) / stiffness
    start = initial[model.position] - equilibrium, initial[model.velocity] / w
    numbers = w, rate / w, *start, equilibrium
    return FreeOscillation(*np.broadcast_arrays(*(np.atleast_1d(x) for x in numbers)))
