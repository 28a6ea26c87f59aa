"""Predictions of theory for the schemes of an experiment, as functions of w dt: growth, frequency, phase error.

The theory is that of ``u'' + w^2 u = 0``, evaluated once for every value of w dt that occurs. Arrays have the shape
(scheme, case), with NaN for adaptive schemes, and if the model is a different one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vibsim import theory
from vibsim.apriori.stability_limits import limit_of
from vibsim.core.array_types import Floats, Integers
from vibsim.experiment.sweep_columns import option_groups
from vibsim.models.shared.free import free_oscillation
from vibsim.observe.member_block import MemberBlock
from vibsim.schemes import Options, Scheme


def is_simple(block: MemberBlock) -> bool:
    """Tell whether the theory applies to the model: linear, without damping and forcing."""
    return block.model.linear and block.model.conservative


def of_schemes(block: MemberBlock, function: Callable[[Scheme, Options, Integers], Any]) -> Floats:
    """Return the values of a function of scheme, options and the members with these options."""
    result = np.full(block.shape, np.nan)
    for i in np.flatnonzero(~block.adaptive).tolist():
        method = block.experiment.schemes[i].method
        for options, where in option_groups(block.experiment, i, block.columns):
            result[i, where] = function(method, options, where)
    return result


def _dominant(block: MemberBlock, level: int, which: int) -> Floats:
    """Return growth per period (`which` 0) or angle per step (1) of the dominant root."""
    p = _step(block, level)

    def of_root(scheme: Scheme, options: Options, where: Integers) -> Floats:
        values, back = np.unique(p[where], return_inverse=True)
        return theory.dominant(scheme.stepper(options), values)[which][back]

    return of_schemes(block, of_root)


def dominant_growth(block: MemberBlock, level: int) -> Floats:
    """Return the growth factor of the amplitude per natural period, for small oscillations of any model."""
    return _dominant(block, level, 0)


def growth_per_period(block: MemberBlock, level: int) -> Floats:
    """Return `dominant_growth` if the theory applies to the model, otherwise NaN."""
    return dominant_growth(block, level) if is_simple(block) else np.full(block.shape, np.nan)


def frequency(block: MemberBlock, level: int) -> Floats:
    """Return the angular frequency of the computed motion [rad per unit of time]."""
    if not is_simple(block):
        return np.full(block.shape, np.nan)
    return natural_frequency(block) * (_dominant(block, level, 1) / _step(block, level))


def phase_error(block: MemberBlock, level: int) -> Floats:
    """Return the time by which peaks come early, per period; minus infinity without peaks."""
    if not is_simple(block):
        return np.full(block.shape, np.nan)
    angle = _dominant(block, level, 1)
    with np.errstate(divide="ignore"):
        fraction = (angle - _step(block, level)) / angle
    return np.asarray(fraction * (2.0 * np.pi / natural_frequency(block)))


def _step(block: MemberBlock, level: int) -> Floats:
    """Return w dt, with several coordinates for the fastest oscillation, shape (case,)."""
    return block.fastest[:, block.grid.levels.index(level)]


def natural_frequency(block: MemberBlock) -> Floats:
    """Return w, shape (case,)."""
    return np.asarray(block.finest["natural_frequency"], dtype=np.float64)


def equilibrium(block: MemberBlock) -> Floats:
    """Return the place of rest of a model to which the theory applies, 0 if it has none, shape (case,)."""
    motion = free_oscillation(block.model, block.group.initial, block.group.parameters)
    return np.broadcast_to(np.nan_to_num(motion.equilibrium), block.shape[1:])


def limits(block: MemberBlock) -> Floats:
    """Return the largest stable w dt: 0 if every step is unstable."""
    return of_schemes(block, lambda scheme, options, where: limit_of(scheme, options))


def exact_degrees(block: MemberBlock) -> Floats:
    """Return the highest degree of polynomials that each scheme reproduces on the model."""
    model = block.model
    return of_schemes(
        block, lambda scheme, o, where: theory.exact_degree(scheme.stepper_for(model, o), model)
    )
