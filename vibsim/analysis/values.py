"""The numbers that a ``value`` check asks for, worked out for every scheme and member at once.

Names, quantities and places are those of `vibsim.spec.values`. A number that does not exist is NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.series import safe_ratio
from vibsim.record import Record

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Place:
    """Where a value is taken, and what it may be taken from."""

    record: Record
    """Convergence Record, without its verdicts."""
    levels: Mapping[int, Record]
    """Level Records."""
    quantity: str
    """Empty where the value is of none."""
    level: int | str | None
    t: float | None
    step: int | None

    @property
    def missing(self) -> Floats:
        """NaN for every scheme and member, shape (scheme, case)."""
        return np.full((len(self.record["scheme"]), len(self.record["case"])), np.nan)

    def data(self) -> Record | None:
        """Return the level Record that is asked for, by default the finest."""
        level = max(self.levels) if self.level is None else self.level
        return self.levels.get(level) if isinstance(level, int) else None


def value(name: str, place: Place) -> Floats:
    """Return the number `name` at `place`, shape (scheme, case)."""
    found = np.asarray(KNOWN[name](place), dtype=np.float64)
    return np.array(np.broadcast_to(found, place.missing.shape))


def _sample(p: Place) -> Floats:
    """Return the value of a series at a time, by default the last one."""
    if p.level == "best":
        name = f"{p.quantity}_richardson"
        coarsest = p.levels[min(p.levels)]
        return _at_index(
            p, p.record, name, _index(p, p.record["t"], _step_unit(p.record, coarsest))
        )
    data = p.data()
    if data is None:
        return p.missing
    every = int(np.asarray(data.attrs["every"]).item())
    return _at_index(p, data, p.quantity, _index(p, data["t"], every))


def _step_unit(record: Record, coarsest: Record) -> int:
    """Return the distance between common points in steps of the coarsest level."""
    whole = int(np.asarray(coarsest.attrs["steps"]).item())
    last = float(record["t"][-1] / coarsest["t"][-1])
    return round(whole * last / (len(record["t"]) - 1))


def _index(p: Place, t: Floats, every: int) -> int | None:
    """Return the index of the sample that is asked for; None where it was not stored."""
    if p.step is not None:
        index, rest = divmod(p.step, every)
        return index if rest == 0 and index < len(t) else None
    if p.t is None:
        return len(t) - 1
    index = int(np.argmin(np.abs(t - p.t)))
    return index if abs(float(t[index]) - p.t) <= 1e-9 * float(t[-1]) else None


def _at_index(p: Place, record: Record, name: str, index: int | None) -> Floats:
    if index is None or name not in record:
        return p.missing
    return np.asarray(record[name][..., index], dtype=np.float64)


def _gathered(name: str) -> Callable[[Place], Floats]:
    def take(p: Place) -> Floats:
        data = p.data()
        return (
            p.missing if data is None or name not in data else np.asarray(data[name], dtype=float)
        )

    return take


def _of_quantity(which: str) -> Callable[[Place], Floats]:
    """Return what was gathered of the quantity over every step."""

    def take(p: Place) -> Floats:
        return _gathered(f"{p.quantity}_{which}")(p)

    return take


def _max_abs(p: Place) -> Floats:
    """Return the largest absolute value: gathered as such, or from the least and the largest value."""
    data, name = p.data(), f"{p.quantity}_max_abs"
    if data is not None and name in data:
        return _gathered(name)(p)
    low, high = (_of_quantity(which)(p) for which in ("min", "max"))
    return np.asarray(np.maximum(np.abs(low), np.abs(high)))


def _fall(of: Callable[[Place], Floats]) -> Callable[[Place], Floats]:
    """Return how many times smaller a number is at the next finer level; by default the last two are compared."""

    def take(p: Place) -> Floats:
        levels = sorted(p.levels)
        level = levels[max(len(levels) - 2, 0)] if p.level is None else p.level
        if level not in levels[:-1]:
            return p.missing
        finer = levels[levels.index(int(level)) + 1]
        coarse, fine = (of(replace(p, level=which)) for which in (level, finer))
        return safe_ratio(coarse, fine)

    return take


def _quotient(top: str, bottom: str) -> Callable[[Place], Floats]:
    def take(p: Place) -> Floats:
        return safe_ratio(*np.broadcast_arrays(_gathered(top)(p), _gathered(bottom)(p)))

    return take


def _growth_factor(p: Place) -> Floats:
    """Return the last peak over the first: two peaks at least."""
    several = _gathered("period_count")(p) >= 1
    return np.where(several, _quotient("last_peak", "first_peak")(p), np.nan)


def _frequency(p: Place) -> Floats:
    period = _gathered("period")(p)
    return safe_ratio(np.full_like(period, 2 * np.pi), period)


def _period_error(p: Place) -> Floats:
    return _quotient("period", "exact_period")(p) - 1.0


def _relative_energy_error(p: Place) -> Floats:
    data = p.data()
    if data is None:
        return p.missing
    return safe_ratio(data["energy_deviation_max_abs"], np.abs(data["energy"][..., 0]))


def _error(norm: str) -> Callable[[Place], Floats]:
    def take(p: Place) -> Floats:
        which = p.record.words("norm").index(norm)
        if p.level == "best":
            name = f"{p.quantity}_richardson_error_norm"
            return p.record[name][..., which] if name in p.record else p.missing
        return _along(p, "error_norm", "level", which)

    return take


def _along(p: Place, name: str, dim: str, norm: int | None = None) -> Floats:
    """Return a variable of the convergence Record at the level that is asked for, by default the last one."""
    full = f"{p.quantity}_{name}"
    if full not in p.record or dim not in p.record:
        return p.missing
    values = p.record[full] if norm is None else p.record[full][..., norm]
    levels = [int(level) for level in p.record[dim]]
    level = levels[-1] if p.level is None else p.level
    return values[..., levels.index(level)] if level in levels else p.missing


def _of_triple(name: str, norm: str | None) -> Callable[[Place], Floats]:
    def take(p: Place) -> Floats:
        which = None if norm is None else p.record.words("norm").index(norm)
        return _along(p, name, "triple", which)

    return take


def _estimate_defect(p: Place) -> Floats:
    """Return ``max |estimate - true error| / max |true error|``."""
    names = [f"{p.quantity}_{name}" for name in ("error_estimate", "error")]
    if "pair" not in p.record or any(name not in p.record for name in names):
        return p.missing
    pairs = [int(level) for level in p.record["pair"]]
    level = pairs[-1] if p.level is None else p.level
    if level not in pairs:
        return p.missing
    estimate, error = (p.record[name][:, :, pairs.index(level)] for name in names)
    largest = np.max(np.abs(error), axis=-1)
    return safe_ratio(np.max(np.abs(estimate - error), axis=-1), largest)


def _richardson_error(p: Place) -> Floats:
    name = f"{p.quantity}_richardson_error"
    return np.max(p.record[name], axis=-1) if name in p.record else p.missing


KNOWN: Mapping[str, Callable[[Place], Any]] = {
    "end": _sample,
    "at": _sample,
    "min": _of_quantity("min"),
    "max": _of_quantity("max"),
    "max_abs": _max_abs,
    "max_abs_interior": _of_quantity("max_abs_interior"),
    "max_abs_ratio": _fall(_max_abs),
    "max_abs_interior_ratio": _fall(_of_quantity("max_abs_interior")),
    "period": _gathered("period"),
    "period_grid": _gathered("period_grid"),
    "exact_period": _gathered("exact_period"),
    "period_error": _period_error,
    "frequency": _frequency,
    "amplitude": _gathered("amplitude"),
    "growth_factor": _growth_factor,
    "relative_energy_error": _relative_energy_error,
    "error_l1": _error("l1"),
    "error_l2": _error("l2"),
    "error_linf": _error("linf"),
    "error_linf_interior": _error("linf_interior"),
    "error_estimate_defect": _estimate_defect,
    "observed_order": _of_triple("observed_order", "l2"),
    "ratio": _of_triple("ratio_norm", "l2"),
    "coincidence": _of_triple("coincidence", None),
    "richardson_error": _richardson_error,
}
"""How every value name is worked out."""
