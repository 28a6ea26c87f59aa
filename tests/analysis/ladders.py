"""Ladders with known truth: error = c1 a(t) h^p + c2 b(t) h^q + noise, at several levels."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.roundoff_floor import norm_of_floor
from vibsim.convergence import differences
from vibsim.convergence.ladder_facts import LadderFacts
from vibsim.core.vocabulary import ORDER_TOLERANCE

Floats = NDArray[np.float64]

T = np.linspace(0.0, 20.0, 65)
SPACING = np.array([T[1]])


@dataclass(frozen=True)
class Truth:
    """A ladder that was made, and what is true of it."""

    fields: list[Floats]
    """Per level, shape (t,)."""
    exact: Floats
    levels: tuple[int, ...]
    floor: Floats
    """Predicted round-off per level, at one point."""
    order: float
    """Order of the dominant term on the finest clean levels; NaN where two terms are of one size."""
    orders: tuple[float, float]
    """Orders of the two terms."""
    clean: int
    """Number of levels before the noise."""


def facts_of(
    fields: list[Floats],
    levels: tuple[int, ...],
    *,
    order: float = 2.0,
    norm: str = "l2",
    floor: Floats | float = 1e-15,
    exact: Floats | None = None,
    tolerance: float = 0.1,
    **more: Any,
) -> LadderFacts:
    """Return the facts about one ladder: arrays of shape (1, ...)."""
    d = [(coarse - fine)[None] for coarse, fine in itertools.pairwise(fields)]
    size = np.max(np.abs(fields[-1]))
    floors = np.broadcast_to(np.asarray(floor, dtype=float), (1, len(levels)))

    def measure(values: list[Floats]) -> Floats:
        return np.stack([differences.norm(v.reshape(1, -1), norm, SPACING) for v in values], -1)

    rows = d if exact is None else [*d, (fields[-1] - exact)[None]]
    cosines = np.zeros((1, len(levels), len(levels)))
    if rows:
        cosines[:, : len(rows), : len(rows)] = differences.cosines(rows, norm)
    return facts_with(
        levels=levels,
        difference=measure(d) if d else np.empty((1, 0)),
        cosines=cosines,
        floor=norm_of_floor(floors, norm, len(T), SPACING),
        expected=np.array([order]),
        omega_dt=T[-1] * 2.0 ** -np.array([levels], dtype=float),
        relative_floor=floors[:, 0] / (size or 1.0),
        tolerance=tolerance,
        size=norm_of_floor(np.array([size]), norm, len(T), SPACING),
        **({} if exact is None else {"error": measure([exact - fields[-1]])[:, 0]}),
        **more,
    )


def facts_with(**known: Any) -> LadderFacts:
    """Return the facts about a ladder; what is not given is what says nothing."""
    expected, n = known["expected"], len(known["levels"])
    shape = expected.shape
    unknown, no = np.full(shape, np.nan), np.zeros(shape, dtype=bool)
    neutral = {
        "tolerance": ORDER_TOLERANCE,
        "ceiling": known["floor"][..., -1],
        "error": unknown,
        "blur": np.zeros((*shape, n)),
        "scale": np.full(shape, np.inf),
        "promised": expected,
        "special": expected,
        "combined": lambda rows, first, weights: np.full(np.count_nonzero(rows), np.nan),
        "numbers": no,
        "failed": np.zeros((*shape, n), dtype=bool),
        "applicable": ~no,
        "stability_limit": np.full(shape, np.inf),
        "span": np.full(shape, np.inf),
        "steps": np.nan,
        "moved": np.ones(shape),
        "straight": no,
        "left_to_the_mesh": unknown,
        "corner": unknown,
        "near_a_point": no,
        "unseen": no,
        "jumps": no,
        "decay": np.zeros(shape),
        "growth": np.full((*shape, n), np.nan),
    }
    return LadderFacts(**{**neutral, **known})


def shape_in_time(rng: np.random.Generator) -> Floats:
    """Return a random smooth error function with zero crossings, growing, decaying or steady, of norm 1."""
    waves = sum(
        rng.normal() * np.sin(rng.uniform(0.3, 3.0) * T + rng.uniform(0, 6.3)) for _ in range(3)
    )
    field = np.asarray(waves) * (T / T[-1]) ** rng.choice([0.0, 1.0, 2.0])
    return field / differences.norm(field[None], "l2", SPACING)[0]


def random_truth(rng: np.random.Generator) -> Truth:
    """Make a ladder: random orders, sizes, floors and shapes in time.

    Those of as many levels have the same levels, so that they can be judged together.
    """
    count = int(rng.integers(3, 8))
    start = 3 + 5 * count % 6
    levels = tuple(range(start, start + count))
    p = float(rng.integers(1, 5))
    q = p + float(rng.integers(1, 3))
    first = shape_in_time(rng)
    kind = rng.choice(["own", "same", "opposite"], p=[0.7, 0.15, 0.15])
    second = {"own": shape_in_time(rng), "same": first, "opposite": -first}[str(kind)]
    noisy = rng.random() < 0.5
    growth = float(rng.choice([0.0, 0.5, 1.5]))
    h = 2.0 ** -np.array(levels, dtype=float)
    dominant = 10.0 ** rng.uniform(-4, 0)
    noise = np.zeros(count)
    clean = count
    if noisy:
        # the noise equals the first term at some level of the ladder, or two beyond it
        at = float(rng.uniform(0, count + 2))
        h_at = 2.0 ** -(start + at)
        noise = dominant * (h_at / h[0]) ** p * (h / h_at) ** -growth
        clean = int(np.sum(noise < 0.01 * dominant * (h / h[0]) ** p))
    ratio = 10.0 ** rng.uniform(-4, 1.5)
    fine = h[max(clean, 1) - 1]
    sizes = dominant * ((h / h[0]) ** p), dominant * (fine / h[0]) ** p * ratio * (h / fine) ** q
    exact = np.cos(T)
    fields = [
        exact - sizes[0][i] * first - sizes[1][i] * second
        - noise[i] * rng.normal(size=len(T)) / np.sqrt(T[-1])
        for i in range(count)
    ]  # fmt: skip
    order = p if ratio < 0.1 else q if ratio > 10 else float("nan")
    # what is predicted is an order of magnitude
    predicted = np.maximum(noise / np.sqrt(T[-1]) * 10.0 ** rng.uniform(-0.5, 1.5), 2e-16)
    return Truth(fields, exact, levels, predicted, order, (p, q), clean)
