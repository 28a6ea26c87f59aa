"""The variables of the convergence Record that hold comparisons."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.formal_orders import is_promised, orders_vary
from vibsim.comparison.local_order import local_order, window_points
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.comparison.rescaled_differences import (
    error_factor,
    local_scale,
    masked_ratio,
    proportionality,
    rescaling,
)
from vibsim.comparison.thresholds import ORDER_WINDOW
from vibsim.convergence.extrapolation.gci import of_order
from vibsim.convergence.thresholds import ORDINARY_ORDER
from vibsim.core.array_types import Floats
from vibsim.core.record import Record, Variable
from vibsim.core.vocabulary import (
    CENTRED,
    MEMBER,
    OF_LEVEL,
    SERIES,
    TYPICAL_NORM,
    is_error_part,
    plain_name,
)
from vibsim.models import ENERGIES
from vibsim.observe.member_block import by_level
from vibsim.observe.oscillation import period_scale

Table = dict[str, Variable]
Add = Callable[..., None]

PROMISED_ORDER = "order that the scheme promises, infinite for what is exact"
LEAST_ORDER = (
    "order that the scheme promises for the position, at least that of a part of its error"
)
"""Long name of the order of a part of an error for which theory makes no promise."""
NORM, KNOWN = "_error_norm", "_error_known"
"""Suffixes of a quantity for the norms of its true error, and for whether one is known."""


def _adder(table: Table, q: Comparison) -> Add:
    """Return a function that adds a variable of the quantity to a table, by default in the unit of the quantity."""

    def add(
        name: str, dims: tuple[str, ...], values: NDArray[Any], words: str, units: str = q.units
    ) -> None:
        if dims[-1] == "t" and q.name.endswith(CENTRED):
            values = np.array(values)
            values[..., q.block.ends()] = np.nan
        words = f"{q.long_name}: {words}"
        table[f"{q.name}_{name}"] = Variable.of(dims, np.ascontiguousarray(values), words, units)

    return add


def numbers(q: Comparison) -> Table:
    """Return the norms, orders and bounds of a quantity.

    Ratios and coincidence are in single precision if storage is bounded.
    """
    table: Table = {}
    add = _adder(table, q)
    block, levels = q.block, len(q.block.grid.levels)
    level_dims, triple_dims = OF_LEVEL, (*MEMBER, "triple", "norm")

    def over_norms(number: Callable[[str], Floats]) -> Floats:
        return np.stack([number(norm) for norm in block.norms], axis=-1)

    words = "true error in a norm over time"
    add("error_norm", (*level_dims, "norm"), over_norms(lambda n: q.in_norm(n).error), words)
    words = "true error of the extrapolation in a norm over time"
    norms = over_norms(lambda n: q.in_norm(n).extrapolation)
    add("richardson_error_norm", (*MEMBER, "norm"), norms, words)
    if block.lean:
        words = "largest error bound of the extrapolation"
        add("richardson_error_max", MEMBER, q.bound_of_length, words)
    add("floor", level_dims, q.floor * np.sqrt(q.width), "predicted round-off")
    is_due = not is_error_part(q.name) or is_promised(block.experiment, q.name)
    words = f"{q.long_name}: {PROMISED_ORDER if is_due else LEAST_ORDER}"
    dims: tuple[str, ...] = MEMBER[:1]
    orders = q.order[:, 0]
    if orders_vary(block.experiment, q.name):
        dims, orders = MEMBER, np.broadcast_to(q.order, block.shape)
    table[f"{q.name}_formal_order"] = Variable.of(dims, orders, words, promised=int(is_due))
    if levels > 1:
        norms = over_norms(lambda n: q.in_norm(n).difference)
        add("difference_norm", (*MEMBER, "pair", "norm"), norms, "difference in a norm over time")
    if levels > 2:
        words = "ratio of successive differences in a norm over time"
        add("ratio_norm", triple_dims, in_precision(q, over_norms(q.ratios)), words, "1")
        add("observed_order", triple_dims, over_norms(q.observed_orders), "observed order", "1")
        words = "relative distance of the rescaled differences"
        add("coincidence", triple_dims[:-1], in_precision(q, q.coincidence), words, "1")
    if levels > 1 and not block.lean:
        words = "grid convergence index of the finest level in a norm over time"
        norms = over_norms(lambda n: _index(q, n, q.in_norm(n).difference[..., -1]))
        add("gci_norm", (*MEMBER, "norm"), norms, words)
    return table


def _index(q: Comparison, norm: str, change: Floats) -> Floats:
    """Return the grid convergence index of a change between the finest two levels, by the order in a norm.

    The change has the shape (scheme, case), or (scheme, case, t).
    """
    levels = q.block.grid.levels
    promised = np.where(np.isfinite(q.order), q.order, ORDINARY_ORDER)
    observed = np.full(q.block.shape, np.nan)
    if len(levels) > 2:
        observed = q.observed_orders(norm)[..., -1]
    if change.ndim > observed.ndim:
        promised, observed = promised[..., None], observed[..., None]
    return of_order(change, levels[-1] - levels[-2], observed, promised)


def in_precision(q: Comparison, values: Floats) -> NDArray[np.floating]:
    """Return ratios and orders in the type that is stored; infinite if they exceed its range."""
    with np.errstate(over="ignore"):
        # single precision has more digits than they need
        return values.astype(np.float32 if q.block.lean else np.float64)


def over_time(q: Comparison) -> Table:
    """Return the series of a quantity: differences, errors, estimates, ratios, extrapolation."""
    table: Table = {}
    add = _adder(table, q)
    value, bound = q.extrapolation
    add("richardson", SERIES, value, "Richardson extrapolation")
    add("richardson_error", SERIES, bound, "error bound of the extrapolation")
    add("finest", SERIES, q.values[-1], "finest level")
    if q.exact is not None:
        if plain_name(q.name) in ENERGIES:
            add("exact", SERIES, np.broadcast_to(q.exact, value.shape), "exact")
        else:
            add("exact", SERIES[1:], q.exact[0], "exact")
    if q.differences:
        _pairs(q, add)
    if len(q.differences) > 1:
        _triples(q, add)
    return table


def _pairs(q: Comparison, add: Add) -> None:
    dims = (*MEMBER, "pair", "t")
    levels, d, p = q.block.grid.levels, q.differences, q.power[..., None]
    unknown = [np.full_like(x, np.nan) for x in d]
    rescaled = [x * rescaling(p, levels[: i + 2]) for i, x in enumerate(d)]
    errors = unknown if q.errors is None else q.errors[:-1]
    # the error need not cross zero where the difference does
    local_size = np.where(np.isfinite(d[-1]), local_scale(d[-1]), np.nan)
    words = "grid convergence index of the finest level"
    add("gci", SERIES, _index(q, TYPICAL_NORM, local_size), words)
    add("difference", dims, np.stack(d, 2), "level minus next level")
    add("rescaled", dims, np.stack(rescaled, 2), "difference, rescaled")
    add("error_estimate", dims, np.stack(estimates(q), 2), "estimated error")
    add("error", dims, np.stack(errors, 2), "true error")


def estimates(q: Comparison) -> list[Floats]:
    """Return the estimated error of each level but the finest, each of shape (scheme, case, t)."""
    levels, p = q.block.grid.levels, q.order[..., None]
    return [x * error_factor(p, levels[i + 1] - levels[i]) for i, x in enumerate(q.differences)]


def _triples(q: Comparison, add: Add) -> None:
    """Add ratios, and the order of each triple as a function of time with its interval, in single precision."""
    grid, dims = q.block.grid, (*MEMBER, "triple", "t")
    counts = window_points(ORDER_WINDOW * period_scale(q.block), grid.spacing, len(grid.t))
    floor = [q.floor[..., i] + q.floor[..., i + 1] for i in range(len(q.differences))]
    ratios, factors, orders = [], [], []
    for i, (a, b) in enumerate(pairwise(q.differences)):
        ratios.append(masked_ratio(a, b, floor[i + 1][..., None]))
        factors.append(proportionality(a, b))
        triple, floors = grid.levels[i : i + 3], (floor[i], floor[i + 1])
        orders.append(local_order(a, b, triple, floors, counts, grid.end_included))
    add("ratio", dims, np.stack(ratios, 2), "ratio of successive differences", "1")
    words = "least-squares factor between successive differences"
    add("proportionality", dims[:-1], by_level(factors), words, "1")
    text = "end of the interval of the order over time"
    ends = {"": "order over time", "_low": f"lower {text}", "_high": f"upper {text}"}
    for k, (end, words) in enumerate(ends.items()):
        values = np.stack([row[k] for row in orders], 2).astype(np.float32)
        add(f"local_order{end}", dims, values, words, "1")


def known_errors(record: Record) -> dict[str, Variable]:
    """Return for each quantity of a convergence Record whether a true error is known at any level.

    This is `<q>_error_known` over ``scheme, case`` for each q with `<q>_error_norm`. Verdicts need no more of norms.
    """
    table, words = {}, "whether a true error is known"
    for name, norms in record.variables.items():
        if norms.dims[:2] == MEMBER and name.endswith(NORM):
            known = np.isfinite(norms.values).any(axis=tuple(range(2, norms.values.ndim)))
            table[name.removesuffix(NORM) + KNOWN] = Variable.of(MEMBER, known, words)
    return table


def has_exact(record: Record, quantity: str, scheme: int, case: int) -> bool:
    """Tell whether a true error of a quantity is known at any level."""
    name = quantity + KNOWN
    known = record.variables if name in record else known_errors(record)
    # parts of an error are measured against the motion itself
    return name not in known or bool(known[name].values[scheme, case])
