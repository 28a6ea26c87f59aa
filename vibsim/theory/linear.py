"""The step of a scheme on ``u'' + w^2 u = 0`` as a matrix: amplification, and how far it is stable."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibsim.schemes.base import Options, Scheme, Stepper, handed

Floats = NDArray[np.float64]


def amplification(stepper: Stepper, p: float) -> Floats:
    """Return the matrix of a step with ``p = w dt`` on the carried state, in units of time of dt."""
    factors = stepper.scaling(np.array([p])) if stepper.scaling else ()
    extra = tuple(float(factor[0]) for factor in factors)
    square = p * p * (extra[0] if extra else 1.0)
    step = handed(stepper.step, lambda u, v, t, q: -square * u, lambda u, v, t, q: (-square, 0.0))
    start = handed(stepper.start, lambda u, v, t, q: 0.0, lambda u, v, t, q: (0.0, 0.0))
    size = len(start(stepper.variant, 0.0, 0.0, 1.0, extra))
    columns = [step(tuple(row), 0.0, 1.0, extra)[0] for row in np.eye(size).tolist()]
    return np.array(columns).T


def stability_limit(scheme: Scheme, options: Options) -> float:
    """Return the largest stable ``w dt``: infinite for none, 0 where every step grows."""
    stepper = scheme.stepper(options)

    def grows(p: float) -> bool:
        return bool(np.max(np.abs(np.linalg.eigvals(amplification(stepper, p)))) > 1.0 + 1e-7)

    points = [0.05 * k for k in range(1, 200)]
    first = next((p for p in points if grows(p)), None)
    if first is None:
        return np.inf
    low, high = first - 0.05, first
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    return low if low > 0.03 else 0.0
