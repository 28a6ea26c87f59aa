"""What theory predicts of the schemes of an experiment on its members, from w dt: growth, frequency, phase error.

The theory is that of ``u'' + w^2 u = 0``; it is worked out once for every value of w dt that occurs. Arrays have the
shape (scheme, case), with NaN for schemes that choose their own steps, and where the model is another one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vibsim import theory
from vibsim.apriori.formal_orders import limit_of
from vibsim.core.array_types import Floats, Integers
from vibsim.experiment import sweep_columns
from vibsim.observe.member_block import MemberBlock
from vibsim.schemes import Options, Scheme


def is_simple(block: MemberBlock) -> bool:
    """Tell whether the model is the one that the theory is of: linear, without damping and forcing."""
    return block.model.linear and block.model.conservative


def steppers(block: MemberBlock, scheme: int) -> list[tuple[Options, Integers | slice]]:
    """Return the options of one scheme, and the members that have them; empty for one that chooses its own steps."""
    if block.adaptive[scheme]:
        return []
    groups = sweep_columns.option_groups(block.experiment, scheme, block.columns)
    return [(o, where if len(groups) > 1 else slice(None)) for o, where in groups]


def of_schemes(
    block: MemberBlock, function: Callable[[Scheme, Options, Integers | slice], Any]
) -> Floats:
    """Return a function of every scheme, its options and the members that have them."""
    found = np.full(block.shape, np.nan)
    for i, scheme in enumerate(block.experiment.schemes):
        for options, where in steppers(block, i):
            found[i, where] = function(scheme.method, options, where)
    return found


def _dominant(block: MemberBlock, level: int, which: int) -> Floats:
    """Return growth per period (0) or angle per step (1) of the root that a long run is left with."""
    p = _step(block, level)

    def of_root(scheme: Scheme, options: Options, where: Integers | slice) -> Floats:
        values, back = np.unique(p[where], return_inverse=True)
        return np.asarray(theory.dominant(scheme.stepper(options), values)[which], dtype=float)[
            back
        ]

    return of_schemes(block, of_root)


def dominant_growth(block: MemberBlock, level: int) -> Floats:
    """Return the factor of the amplitude per natural period, of small oscillations of any model."""
    return _dominant(block, level, 0)


def growth_per_period(block: MemberBlock, level: int) -> Floats:
    """Return the same where the model is that of the theory."""
    return dominant_growth(block, level) if is_simple(block) else np.full(block.shape, np.nan)


def frequency(block: MemberBlock, level: int) -> Floats:
    """Return the angular frequency of the computed motion [rad per unit of time]."""
    if not is_simple(block):
        return np.full(block.shape, np.nan)
    return natural_frequency(block) * (_dominant(block, level, 1) / _step(block, level))


def phase_error(block: MemberBlock, level: int) -> Floats:
    """Return the time by which peaks come early, per period; minus infinity without any."""
    if not is_simple(block):
        return np.full(block.shape, np.nan)
    angle = _dominant(block, level, 1)
    with np.errstate(divide="ignore"):
        fraction = (angle - _step(block, level)) / angle
    return np.asarray(fraction * (2.0 * np.pi / natural_frequency(block)))


def _step(block: MemberBlock, level: int) -> Floats:
    """Return w dt, of several coordinates that of their fastest oscillation, shape (case,)."""
    return block.fastest[:, block.grid.levels.index(level)]


def natural_frequency(block: MemberBlock) -> Floats:
    """Return w, shape (case,)."""
    return np.asarray(block.finest["natural_frequency"], dtype=np.float64)


def limits(block: MemberBlock) -> Floats:
    """Return the largest stable w dt: 0 where every step grows."""
    return of_schemes(block, lambda scheme, options, where: limit_of(scheme, options))


def exact_degrees(block: MemberBlock) -> Floats:
    """Return the highest degree of polynomials that each scheme reproduces on the model."""
    model = block.model
    return of_schemes(
        block, lambda scheme, o, where: theory.exact_degree(scheme.stepper_for(model, o), model)
    )
