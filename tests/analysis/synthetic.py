"""Ladders with known truth, made from a seed: thousands of them, in families that a verdict has to tell apart.

A ladder is ``u_l(t) = u(t) - sum_j c_j h_l^(p_j) e_j(t) - n_l(t)`` with ``h_l = 2^-l``; n is noise. What is true of it
is worked out from what it was made of, never from what the analysis finds:

- a level is *clean* where the noise is below `CLEAN` of the largest term, and the term has the size of its power;
- the *order* is that of the largest term on the finest clean level, where every other one is below `DOMINANT` of it
  there; else there is none, and the two largest terms are kept;
- the ladder is *decidable* where the last two ratios of clean levels are both within the tolerance of the order, or
  where the rescaled differences of three clean levels coincide to `COINCIDES`. Differences of one shape, as those of a
  single number are, coincide whatever they are made of, and are no evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Rng = np.random.Generator

END = 2.0
"""End time; w = 1."""
POINTS = 64
"""Intervals of the common grid at most."""
CLEAN = 0.03
DOMINANT = 0.1
TOLERANCE = 0.1
COINCIDES = 0.01
ONE_SHAPE = 1e-9
EPSILON = float(np.finfo(np.float64).eps)
ROUNDING = EPSILON / 5
"""Noise that storing numbers of size 1 makes."""

COUNTS = (2, 3, 3, 4, 4, 4, 5, 5, 6, 7, 8, 10, 13, 16)
"""Numbers of levels of the groups, in turn."""


@dataclass(frozen=True)
class Ladder:
    """One ladder, and what is true of it."""

    family: str
    errors: Floats
    """Exact less computed, shape (level, t)."""
    order: float
    """The order; NaN where two terms are of one size, or no level is clean."""
    orders: tuple[float, float]
    """Orders of the two largest terms on the finest clean level; equal where there is one term."""
    clean: tuple[int, int]
    """First clean level and the number of clean levels."""
    decidable: bool
    """Whether the evidence suffices to state the order."""


@dataclass(frozen=True)
class Group:
    """Ladders on the same levels, which one experiment holds as its members."""

    levels: tuple[int, ...]
    points: int
    """Intervals of the common grid."""
    known: bool
    """Whether the exact solution is known to the analysis."""
    arithmetic: str
    ladders: tuple[Ladder, ...]


@dataclass(frozen=True)
class Recipe:
    """What a ladder is made of."""

    powers: tuple[float, ...]
    sizes: tuple[float, ...]
    """Norm of every term at the coarsest level."""
    shapes: tuple[Floats, ...]
    """Of unit norm, shape (t,)."""
    noise: Floats
    """Norm of the noise at every level."""
    noise_shape: str = "white"
    factor: Floats | float = 1.0
    """Of the whole error at every level."""
    spoiled: int = 0
    """So many of the coarsest levels are not in the range of the expansion."""


def norm(values: Floats) -> Floats:
    """Return the L2 norm over the last axis, but for a factor."""
    return np.asarray(np.sqrt(np.mean(values**2, axis=-1)))


def groups(seed: int, number: int = 42, size: int = 55) -> Iterator[Group]:
    """Make groups of ladders; the same ones for the same seed."""
    rng = np.random.default_rng(seed)
    names = tuple(FAMILIES)
    for i in range(number):
        count = COUNTS[i % len(COUNTS)]
        start = int(rng.integers(2, 10))
        levels = tuple(range(start, start + count))
        points = min(2**start, POINTS)
        ladders = [
            _ladder(rng, name, FAMILIES[name], levels, points)
            for name in rng.choice(names, size=size)
        ]
        arithmetic = str(rng.choice(["compensated", "increment", "three_term"]))
        yield Group(levels, points, bool(rng.random() < 0.5), arithmetic, tuple(ladders))


def _shape(rng: Rng, points: int) -> Floats:
    """Return a random smooth function of unit norm that vanishes at t = 0."""
    t = np.linspace(0.0, 1.0, points + 1)
    waves = [rng.normal() * np.sin(rng.uniform(1, 15) * t + rng.uniform(0, 6.3)) for _ in range(3)]
    field = np.sum(waves, axis=0) * t ** rng.choice([0.5, 1.0, 2.0])
    return np.asarray(field / norm(field))


def _second(rng: Rng, first: Floats) -> Floats:
    """Return the shape of another term: one of its own, or the same."""
    kind = rng.choice(["own", "same", "opposite"], p=[0.7, 0.15, 0.15])
    return {"own": _shape(rng, len(first) - 1), "same": first, "opposite": -first}[str(kind)]


def _noise(rng: Rng, kind: str, points: int) -> Floats:
    """Return noise of norm 1, which vanishes at t = 0."""
    field = rng.normal(size=points + 1)
    field[0] = 0.0
    if kind == "walk":
        field = np.cumsum(field)
    if kind == "end":
        field[:-1] = 0.0
        return np.asarray(field * np.sqrt(points + 1))
    return np.asarray(field / norm(field))


def _ladder(
    rng: Rng,
    family: str,
    make: Callable[[Rng, Floats, int], Recipe],
    levels: tuple[int, ...],
    points: int,
) -> Ladder:
    h = 2.0 ** -(np.array(levels, dtype=float))
    recipe = make(rng, h, points)
    powers = np.array(recipe.powers)
    sizes = np.array(recipe.sizes) * (h[:, None] / h[0]) ** powers
    smooth = np.einsum("lj,jt->lt", sizes, np.array(recipe.shapes))
    smooth *= np.broadcast_to(np.asarray(recipe.factor, dtype=float), h.shape)[:, None]
    noise = [size * _noise(rng, recipe.noise_shape, points) for size in recipe.noise]
    return _with_truth(family, recipe, sizes, smooth, np.array(noise))


def _with_truth(
    family: str, recipe: Recipe, sizes: Floats, smooth: Floats, noise: Floats
) -> Ladder:
    largest = np.max(sizes, axis=1)
    is_clean = np.hypot(recipe.noise, ROUNDING) <= CLEAN * largest
    is_clean[: recipe.spoiled] = False
    first = recipe.spoiled
    after = np.flatnonzero(~is_clean[first:])
    count = int(after[0]) if len(after) else len(is_clean) - first
    p = q = order = float("nan")
    if count:
        at = sizes[first + count - 1]
        rank = np.argsort(-at)
        p, q = (recipe.powers[i] for i in (rank[0], rank[min(1, len(rank) - 1)]))
        alone = len(at) == 1 or at[rank[1]] < DOMINANT * at[rank[0]]
        order = p if alone else order
    clean = smooth[first : first + count]
    decidable = order == order and _is_decidable(clean, order)
    return Ladder(family, smooth + noise, order, (p, q), (first, count), decidable)


def _is_decidable(clean: Floats, order: float) -> bool:
    d = np.diff(clean, axis=0)
    if len(d) < 2:
        return False
    with np.errstate(divide="ignore", invalid="ignore"):
        local = np.log2(norm(d[:-1]) / norm(d[1:]))
    if len(local) > 1 and np.all(np.abs(local[-2:] - order) <= TOLERANCE):
        return True
    shapes = d[-2] / norm(d[-2]), d[-1] / norm(d[-1])
    rest = norm(d[-2] - 2.0**order * d[-1]) / norm(d[-2])
    return bool(rest <= COINCIDES and norm(shapes[0] - shapes[1]) > ONE_SHAPE)


# the families


def _order(rng: Rng) -> float:
    return float(rng.choice([1, 2, 3, 4, 0.5, 1.5, 6], p=[0.25, 0.35, 0.1, 0.2, 0.03, 0.04, 0.03]))


def _size(rng: Rng) -> float:
    return float(10.0 ** rng.uniform(-4, -0.5))


def _terms(rng: Rng, h: Floats, points: int, p: float, q: float, share: float) -> Recipe:
    """Return two terms, the second of which is `share` of the first at the finest level."""
    size, first = _size(rng), _shape(rng, points)
    second = size * share * (h[-1] / h[0]) ** (p - q)
    largest = max(1.0, second / 0.3)
    sizes = size / largest, second / largest
    return Recipe((p, q), sizes, (first, _second(rng, first)), np.zeros(len(h)))


def _two_term(rng: Rng, h: Floats, points: int) -> Recipe:
    p = _order(rng)
    return _terms(rng, h, points, p, p + float(rng.choice([0.5, 1, 1, 1, 2, 2])), _share(rng))


def _share(rng: Rng) -> float:
    return float(10.0 ** rng.uniform(-4, 1.5))


def _clean_two_term(rng: Rng, h: Floats, points: int) -> Recipe:
    """Return two terms of which the second is small at the coarsest level already."""
    p, step = _order(rng), float(rng.choice([1, 2]))
    share = float(10.0 ** rng.uniform(-3, -1)) * (h[-1] / h[0]) ** step
    return _terms(rng, h, points, p, p + step, share)


def _pure(rng: Rng, h: Floats, points: int) -> Recipe:
    return Recipe((_order(rng),), (_size(rng),), (_shape(rng, points),), np.zeros(len(h)))


def _even(rng: Rng, h: Floats, points: int) -> Recipe:
    p = float(rng.choice([2, 4]))
    r = _terms(rng, h, points, p, p + 2, _share(rng))
    third = r.sizes[1] * 10.0 ** rng.uniform(-2, 0.3)
    return _more(r, (p + 4,), (third,), (_shape(rng, points),))


def _more(
    r: Recipe, powers: tuple[float, ...], sizes: tuple[float, ...], shapes: tuple[Floats, ...]
) -> Recipe:
    return Recipe(r.powers + powers, r.sizes + sizes, r.shapes + shapes, r.noise)


def _three_terms(rng: Rng, h: Floats, points: int) -> Recipe:
    p = float(rng.integers(1, 5))
    r = _terms(rng, h, points, p, p + 1, _share(rng))
    third = r.sizes[1] * 10.0 ** rng.uniform(-2, 0.5)
    return _more(r, (p + 2,), (third,), (_shape(rng, points),))


def _noisy(r: Recipe, noise: Floats, rng: Rng) -> Recipe:
    kind = str(rng.choice(["white", "walk"]))
    return Recipe(r.powers, r.sizes, r.shapes, noise, kind)


def _floor(rng: Rng, h: Floats, points: int, growth: float) -> Recipe:
    """Return two terms over round-off, ``C eps N^growth``."""
    r = _two_term(rng, h, points) if rng.random() < 0.5 else _clean_two_term(rng, h, points)
    noise = EPSILON * 10.0 ** rng.uniform(-0.5, 1.5) * (1 / h) ** growth
    return _noisy(r, noise, rng)


def _unexpected_floor(rng: Rng, h: Floats, points: int) -> Recipe:
    """Return noise of any size, which equals the first term at some level of the ladder, or beyond."""
    r = _two_term(rng, h, points) if rng.random() < 0.5 else _clean_two_term(rng, h, points)
    at = h[0] * 2.0 ** -rng.uniform(0, len(h) + 4)
    growth = float(rng.choice([0, 0.5, 1.0, 1.5]))
    noise = max(r.sizes) * (at / h[0]) ** min(r.powers) * (at / h) ** growth
    return _noisy(r, noise, rng)


def _oscillating(rng: Rng, h: Floats, points: int) -> Recipe:
    """Return coefficients that depend on the phase of the level."""
    r = _clean_two_term(rng, h, points)
    swing = 10.0 ** rng.uniform(-3, 0) * np.cos(
        rng.uniform(0.5, 3.1) * np.arange(len(h)) + rng.uniform(0, 6.3)
    )
    return Recipe(r.powers, r.sizes, r.shapes, r.noise, factor=1 + 0.9 * swing)


def _relative_noise(rng: Rng, h: Floats, points: int) -> Recipe:
    """Return errors that are multiplied by random factors."""
    r = _clean_two_term(rng, h, points)
    factor = 1 + 10.0 ** rng.uniform(-4, -1) * rng.normal(size=len(h))
    return Recipe(r.powers, r.sizes, r.shapes, r.noise, factor=factor)


def _opposite(rng: Rng, h: Floats, points: int) -> Recipe:
    """Return two terms of one shape that cancel at some level in, before or behind the ladder."""
    p, first, size = _order(rng), _shape(rng, points), _size(rng)
    q = p + float(rng.choice([0.5, 1, 1, 2]))
    zero = h[0] * 2.0 ** -rng.uniform(-2, len(h) + 2)
    sizes = np.array([size, size * (h[0] / zero) ** (q - p)])
    sizes *= min(1.0, 0.3 / sizes.max())
    return Recipe((p, q), tuple(sizes), (first, -first), np.zeros(len(h)))


def _early(rng: Rng, h: Floats, points: int, kind: str) -> Recipe:
    """Return coarse levels that blow up, or whose error is as large as the solution."""
    r = _clean_two_term(rng, h, points)
    spoiled = int(rng.integers(1, len(h)))
    missing = np.maximum(spoiled - np.arange(len(h)), 0.0)
    size = max(r.sizes) * 2.0 ** (-r.powers[0] * np.arange(len(h)))
    if kind == "blow_up":
        doublings = 2.0**missing - 1
        factor = np.exp(doublings * min(rng.uniform(0.2, 1.5), 12.0 / doublings[0]))
    else:
        saturated = 10.0 ** rng.uniform(-3, -0.5) * (1 + 0.3 * rng.random(len(h)))
        shrunk = 0.8 * saturated[0] / size[spoiled]
        factor = np.where(missing > 0, saturated / size, shrunk)
        r = Recipe(r.powers, tuple(x * shrunk for x in r.sizes), r.shapes, r.noise)
        factor = factor / shrunk
    return Recipe(r.powers, r.sizes, r.shapes, r.noise, factor=factor, spoiled=spoiled)


def _superconvergent(rng: Rng, h: Floats, points: int) -> Recipe:
    """Return a ladder whose first term vanishes, or nearly."""
    p = float(rng.integers(1, 5))
    share = float(rng.choice([0.0, 10.0 ** rng.uniform(-6, -1)]))
    size = _size(rng)
    lost = share * size * (h[-1] / h[0])
    shapes = tuple(_shape(rng, points) for _ in range(3))
    rest = size * float(10.0 ** rng.uniform(-3, 0))
    return Recipe((p + 1, p + 2, p), (size, rest, lost), shapes, np.zeros(len(h)))


def _emerging(rng: Rng, h: Floats, points: int) -> Recipe:
    """Return a lower power that comes up on the finest levels."""
    p = float(rng.integers(1, 5))
    q = p + float(rng.choice([1, 1, 2, 3]))
    return _terms(rng, h, points, p, q, float(10.0 ** rng.uniform(-0.5, 3)))


def _scalar(rng: Rng, h: Floats, points: int) -> Recipe:
    """Return one number per level: everything but the last value vanishes."""
    end = np.zeros(points + 1)
    end[-1] = np.sqrt(points + 1)
    r = [_two_term, _clean_two_term, _even][int(rng.integers(3))](rng, h, points)
    shapes = tuple(end * rng.choice([-1.0, 1.0]) for _ in r.shapes)
    noise = np.full(len(h), float(10.0 ** rng.uniform(-16, -8)))
    return Recipe(r.powers, r.sizes, shapes, noise, "end")


FAMILIES: dict[str, Callable[[Rng, Floats, int], Recipe]] = {
    "pure": _pure,
    "two_term": _two_term,
    "clean_two_term": _clean_two_term,
    "even": _even,
    "three_terms": _three_terms,
    "floor_n0.5": partial(_floor, growth=0.5),
    "floor_n1": partial(_floor, growth=1.0),
    "floor_n1.5": partial(_floor, growth=1.5),
    "unexpected_floor": _unexpected_floor,
    "oscillating": _oscillating,
    "relative_noise": _relative_noise,
    "opposite": _opposite,
    "blow_up": partial(_early, kind="blow_up"),
    "saturated": partial(_early, kind="saturated"),
    "superconvergent": _superconvergent,
    "emerging": _emerging,
    "scalar": _scalar,
}
"""How the ladders of every family are made: of the steps (as 2^-level) and the number of intervals of the grid."""
