"""Points scattered over a box: random, of a Sobol sequence, or of a latin hypercube; each from its seed."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.experiment.schema.axes import Draw

Floats = NDArray[np.float64]
_PER_COUNT = 4
"""Numbers that Philox gives at each value of its counter."""


def scatter(draw: Draw, start: int, stop: int) -> list[Floats]:
    """Return points number start..stop-1, the values of one key after the other, each of shape (stop - start,)."""
    keys = len(draw.over)
    if draw.method == "random":
        unit = _random(draw.seed, keys, start, stop)
    elif draw.method == "sobol":
        unit = _sobol(draw.seed, keys, start, stop)
    else:
        unit = _latin_hypercube(draw.seed, keys, draw.n)[start:stop]
    return [low + (high - low) * unit[:, i] for i, (low, high) in enumerate(draw.over)]


def _random(seed: int, keys: int, start: int, stop: int) -> Floats:
    """Return numbers in [0, 1), shape (stop - start, keys), found from their positions alone.

    Source: J. K. Salmon et al., Parallel random numbers: as easy as 1, 2, 3 (2011).
    """
    stream = np.random.Philox(key=seed)
    skipped, rest = divmod(start * keys, _PER_COUNT)
    stream.advance(skipped)
    bits = stream.random_raw(rest + (stop - start) * keys)[rest:]
    return np.asarray((bits >> np.uint64(11)) * 2.0**-53).reshape(stop - start, keys)


def _sobol(seed: int, keys: int, start: int, stop: int) -> Floats:
    """Return points of the scrambled Sobol sequence, shape (stop - start, keys)."""
    from scipy.stats import qmc

    engine: Any = qmc.Sobol(keys, scramble=True, rng=seed)
    if start:
        engine.fast_forward(start)
        return np.asarray(engine.random(stop - start))
    # asked for the first one alone, it does not warn of numbers that are no power of two
    first = engine.random(1)
    return np.concatenate([first, engine.random(stop - 1)]) if stop > 1 else first[:stop]


@lru_cache(maxsize=2)
def _latin_hypercube(seed: int, keys: int, n: int) -> Floats:
    """Return every point of a latin hypercube, shape (n, keys): none is known without the others."""
    from scipy.stats import qmc

    points: Any = qmc.LatinHypercube(keys, rng=seed).random(n)
    return np.asarray(points)
