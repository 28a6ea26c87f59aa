"""What theory predicts of the schemes of an experiment on its members, from w dt: growth, frequency, phase error.

The theory is that of ``u'' + w^2 u = 0``. It depends on w dt alone, so it is worked out once for every value that
occurs, however many members have it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vibsim import plan, theory
from vibsim.apriori.formal_orders import limit_of
from vibsim.core.array_types import Floats, Integers
from vibsim.observe.member_block import MemberBlock
from vibsim.schemes import SCHEMES, Options, Stepper

Function = Callable[[Stepper, Floats], Any]


def is_simple(block: MemberBlock) -> bool:
    """Tell whether the model is the one that the theory is of: linear, without damping and forcing."""
    return block.model.linear and block.model.conservative


def steppers(block: MemberBlock, scheme: int) -> list[tuple[Options, Integers | slice]]:
    """Return the options of one scheme, and the members that have them; empty for one that chooses its own steps."""
    if block.adaptive[scheme]:
        return []
    groups = plan.option_groups(block.experiment, scheme, block.columns)
    return [(o, where if len(groups) > 1 else slice(None)) for o, where in groups]


def of_steps(block: MemberBlock, level: int, function: Function) -> Floats:
    """Return `function` of the arithmetic of every scheme and of w dt, shape (scheme, case); NaN for adaptive ones.

    Parameters
    ----------
    level
        A level of the ladder.
    """
    found = np.full(block.shape, np.nan)
    p = _step(block, level)
    for i, scheme in enumerate(block.experiment.schemes):
        for options, where in steppers(block, i):
            values, back = np.unique(p[where], return_inverse=True)
            stepper = SCHEMES[scheme.kind].stepper(options)
            found[i, where] = np.asarray(function(stepper, values), dtype=float)[back]
    return found


def dominant_growth(block: MemberBlock, level: int) -> Floats:
    """Return the factor of the amplitude per natural period, shape (scheme, case); of small oscillations of any model.

    Of the root that a long run is left with, here and below: `vibsim.theory.dominant`.
    """
    return of_steps(block, level, lambda stepper, p: theory.dominant(stepper, p)[0])


def growth_per_period(block: MemberBlock, level: int) -> Floats:
    """Return the same, NaN where the model is another than that of the theory."""
    return dominant_growth(block, level) if is_simple(block) else np.full(block.shape, np.nan)


def frequency(block: MemberBlock, level: int) -> Floats:
    """Return the angular frequency of the computed motion [rad per unit of time], shape (scheme, case)."""
    if not is_simple(block):
        return np.full(block.shape, np.nan)
    return natural_frequency(block) * (_angle(block, level) / _step(block, level))


def phase_error(block: MemberBlock, level: int) -> Floats:
    """Return the time by which peaks come early, per period, shape (scheme, case); minus infinity without any."""
    if not is_simple(block):
        return np.full(block.shape, np.nan)
    angle = _angle(block, level)
    with np.errstate(divide="ignore"):
        fraction = (angle - _step(block, level)) / angle
    return np.asarray(fraction * (2.0 * np.pi / natural_frequency(block)))


def _angle(block: MemberBlock, level: int) -> Floats:
    return of_steps(block, level, lambda stepper, p: theory.dominant(stepper, p)[1])


def _step(block: MemberBlock, level: int) -> Floats:
    """Return w dt, of several coordinates that of their fastest oscillation, shape (case,)."""
    return block.fastest[:, block.grid.levels.index(level)]


def natural_frequency(block: MemberBlock) -> Floats:
    """Return w, shape (case,)."""
    return np.asarray(block.finest["natural_frequency"], dtype=np.float64)


def limits(block: MemberBlock) -> Floats:
    """Return the largest stable w dt, shape (scheme, case): 0 where every step grows, NaN for adaptive schemes."""
    found = np.full(block.shape, np.nan)
    for i, scheme in enumerate(block.experiment.schemes):
        for options, where in steppers(block, i):
            found[i, where] = limit_of(SCHEMES[scheme.kind], options)
    return found


def exact_degrees(block: MemberBlock) -> Floats:
    """Return the highest degree of polynomials that each scheme reproduces on the model, shape (scheme, case)."""
    found = np.full(block.shape, np.nan)
    for i, scheme in enumerate(block.experiment.schemes):
        for options, where in steppers(block, i):
            stepper = SCHEMES[scheme.kind].stepper_for(block.model, options)
            found[i, where] = theory.exact_degree(stepper, block.model)
    return found
