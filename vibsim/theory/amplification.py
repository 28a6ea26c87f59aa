"""The step of a scheme on ``u'' + w^2 u = 0`` as a matrix on the state that it carries (the companion form of a
multistep method), exact for twice the precision of floats.

Source: vibration text (B), sections 4.1 and 5.6, where the same is done by hand for two schemes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibsim.schemes.base import Stepper
from vibsim.theory.basis import decimal, unit_steps
from vibsim.theory.doubled import Doubled, doubled, stacked

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Matrices:
    """What `Amplification` is, in twice the precision."""

    matrix: Doubled
    start: Doubled
    velocity: Doubled
    backward: Doubled | None
    """Of a scheme that ends with a one-sided velocity: that velocity times dt from the state, shape (..., s)."""


@dataclass(frozen=True)
class Amplification:
    """One step for each ``p = w dt``, with velocities times dt; s numbers make a state, the position first."""

    matrix: Floats
    """``state^(n+1) = matrix state^n``, shape (..., s, s)."""
    start: Floats
    """``state^1 = start (u_0, v_0 dt)``, shape (..., s, 2)."""
    velocity: Floats
    """The scheme's own velocity, ``v^n dt = velocity . state^n``, shape (..., s)."""


def amplification(stepper: Stepper, p: ArrayLike) -> Amplification:
    """Return the step, the start and the velocity as matrices, every entry rounded once.

    Parameters
    ----------
    p
        ``w dt``, of any shape.
    """
    exact = matrices(stepper, doubled(p))
    return Amplification(exact.matrix.rounded, exact.start.rounded, exact.velocity.rounded)


def step_matrix(stepper: Stepper, p: Doubled) -> Doubled:
    """Return the step alone, `Matrices.matrix`."""
    with np.errstate(all="ignore"):
        units = unit_steps(stepper, p, _zeros(p), _read, with_start=False)
    return _matrix(units.step, p.shape)


def matrices(stepper: Stepper, p: Doubled) -> Matrices:
    """Return the step, the start and the velocities as matrices in twice the precision."""
    with np.errstate(all="ignore"):
        units = unit_steps(stepper, p, _zeros(p), _read)
    return Matrices(
        _matrix(units.step, p.shape),
        _matrix(units.start, p.shape),
        stacked(units.velocity, p.shape),
        None if units.backward is None else stacked(units.backward, p.shape),
    )


def _zeros(p: Doubled) -> Doubled:
    return doubled(np.zeros(p.shape))


def _read(formula: str) -> Doubled:
    return doubled(decimal(formula))


def _matrix(columns: Sequence[Sequence[Any]], shape: tuple[int, ...]) -> Doubled:
    """Return the matrix with these columns, each a list of numbers of a shape."""
    parts = [stacked(row, shape) for row in zip(*columns, strict=True)]
    return Doubled(
        np.stack([part.high for part in parts], axis=-2),
        np.stack([part.low for part in parts], axis=-2),
    )
