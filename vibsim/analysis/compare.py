"""One quantity compared between levels, as variables of the convergence Record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis import series
from vibsim.analysis.grid import Grid
from vibsim.analysis.richardson import extrapolate
from vibsim.models import ENERGIES, MODELS
from vibsim.record import Variable, attributes
from vibsim.schemes import SCHEMES
from vibsim.vocabulary import NORMS

if TYPE_CHECKING:
    from vibsim.spec import Experiment

Floats = NDArray[np.float64]
Table = dict[str, Variable]

SERIES = ("scheme", "case", "t")


@dataclass(frozen=True)
class Ladder:
    """One quantity at every level, on the common grid."""

    name: str
    long_name: str
    units: str
    values: list[Floats]
    """Per level, coarse to fine, each of shape (scheme, case, t)."""
    exact: Floats | None
    """Broadcasts against (scheme, case, t)."""
    order: Floats
    """Formal order, shape (scheme,)."""
    floor: Floats
    """Predicted round-off at one point, shape (scheme, case, level)."""


ROUND_OFF_SAFETY = 10.0
"""Factor on the predicted round-off in an error bound: the prediction is an order of magnitude."""


def differences(grid: Grid, q: Ladder) -> Table:
    """Compare successive levels: series, norms, orders."""
    pairs = list(zip(q.values[:-1], q.values[1:], strict=True))
    levels = grid.levels
    p = q.order[:, None, None]
    error = [q.exact - u if q.exact is not None else np.full_like(u, np.nan) for u in q.values]
    errors = np.stack([_norms(grid, e) for e in error], axis=2)
    table: Table = {}

    def add(name: str, dims: tuple[str, ...], values: Floats, words: str, units: str) -> None:
        long_name = f"{q.long_name}: {words}"
        table[f"{q.name}_{name}"] = Variable(dims, values, attributes(long_name, units))

    of_level = ("scheme", "case", "level")
    add("error_norm", (*of_level, "norm"), errors, _IN_NORM.format("true error"), q.units)
    add("floor", of_level, q.floor, "predicted round-off", q.units)
    add("formal_order", ("scheme",), q.order, "order that the scheme promises", "1")
    if not pairs:
        return table
    d = [coarse - fine for coarse, fine in pairs]
    over_time, of_pair = ("scheme", "case", "pair", "t"), ("scheme", "case", "pair", "norm")
    rescaled = [x * series.rescaling(p, levels[: i + 2]) for i, x in enumerate(d)]
    estimate = [x * series.error_factor(p, levels[i + 1] - levels[i]) for i, x in enumerate(d)]
    norms = np.stack([_norms(grid, x) for x in d], axis=2)
    add("difference", over_time, np.stack(d, 2), "level minus next level", q.units)
    add("rescaled", over_time, np.stack(rescaled, 2), "difference, rescaled", q.units)
    add("error_estimate", over_time, np.stack(estimate, 2), "estimated error", q.units)
    add("error", over_time, np.stack(error[:-1], 2), "true error", q.units)
    add("difference_norm", of_pair, norms, _IN_NORM.format("difference"), q.units)
    if len(d) > 1:
        _add_triples(grid, q, d, norms, add)
    return table


_IN_NORM = "{} in a norm over time (times s for l1, times the square root of s for l2)"


def _add_triples(grid: Grid, q: Ladder, d: list[Floats], norms: Floats, add: Any) -> None:
    triples = [grid.levels[i : i + 3] for i in range(len(d) - 1)]
    of_triple = ("scheme", "case", "triple")
    ratio, order, together, factor = [], [], [], []
    norm_ratio = series.safe_ratio(norms[:, :, :-1], norms[:, :, 1:])
    for i, levels in enumerate(triples):
        floor = (q.floor[..., i + 1] + q.floor[..., i + 2])[..., None]
        ratio.append(series.masked_ratio(d[i], d[i + 1], floor))
        order.append(series.order_of_ratio(norm_ratio[:, :, i], levels))
        target = series.target_ratio(q.order, levels)[:, None]
        together.append(series.coincidence(d[i], d[i + 1], target))
        factor.append(series.proportionality(d[i], d[i + 1]))
    words = "ratio of successive differences"
    add("ratio", (*of_triple, "t"), np.stack(ratio, 2), words, "1")
    add("ratio_norm", (*of_triple, "norm"), norm_ratio, f"{words} in a norm over time", "1")
    add("observed_order", (*of_triple, "norm"), np.stack(order, 2), "observed order", "1")
    words = "relative distance of the rescaled differences"
    add("coincidence", of_triple, np.stack(together, 2), words, "1")
    words = "least-squares factor between successive differences"
    add("proportionality", of_triple, np.stack(factor, 2), words, "1")


def _norms(grid: Grid, values: Floats) -> Floats:
    """Return every norm, shape (scheme, case, norm)."""
    rows = [series.norm(values, kind, grid.spacing, grid.end_included) for kind in NORMS]
    return np.stack(rows, axis=-1)


def extrapolated(experiment: Experiment, grid: Grid, q: Ladder) -> Table:
    """Extrapolate to a vanishing step, with bound and true error; the finest and the exact series."""
    model = MODELS[experiment.model.kind]
    even = [SCHEMES[s.kind].even_powers(q.name, model, s.options) for s in experiment.schemes]
    value, bound = extrapolate(q.values, grid.levels, q.order, np.array(even))
    bound = bound + ROUND_OFF_SAFETY * q.floor[..., -1:]
    table: dict[str, tuple[tuple[str, ...], Floats, str]] = {
        f"{q.name}_richardson": (SERIES, value, "Richardson extrapolation"),
        f"{q.name}_richardson_error": (SERIES, bound, "error bound of the extrapolation"),
        f"{q.name}_finest": (SERIES, q.values[-1], "finest level"),
    }
    error = np.full_like(value, np.nan) if q.exact is None else q.exact - value
    words = _IN_NORM.format("true error of the extrapolation")
    dims: tuple[str, ...] = ("scheme", "case", "norm")
    table[f"{q.name}_richardson_error_norm"] = (dims, _norms(grid, error), words)
    if q.exact is not None:
        dims = SERIES if q.exact.shape[0] == value.shape[0] and q.name in ENERGIES else SERIES[1:]
        exact = q.exact if dims == SERIES else q.exact[0]
        table[f"{q.name}_exact"] = (dims, np.array(exact), "exact")
    return {
        name: Variable(dims, values, attributes(f"{q.long_name}: {words}", q.units))
        for name, (dims, values, words) in table.items()
    }
