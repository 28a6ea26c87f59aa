"""What schemes promise to members: order, powers, round-off, stability. It depends on options, which may be swept."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibsim import plan
from vibsim.apriori.initial_motion import BEGINNINGS, beginning_varies, beginnings
from vibsim.apriori.phase_amplitude_orders import is_promised, part_orders
from vibsim.apriori.roundoff_floor import relative_floor
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.models import Model
from vibsim.models.shared.phase_amplitude_names import whole_of
from vibsim.schemes import SCHEMES, Options, Scheme
from vibsim.schemes.base import ORDER_AT_CORNERS, OptionValue, is_on_the_mesh
from vibsim.schemes.orders import Beginning
from vibsim.theory import stability_limit

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

Columns = Mapping[str, NDArray[Any]]
"""Swept values by dotted key, each of shape (case,)."""


def columns_of(record: Record) -> Columns:
    """Return the swept values that a Record holds as coordinates."""
    return {
        str(variable.attrs["sweep_key"]): variable.values
        for variable in record.coords.values()
        if "sweep_key" in variable.attrs
    }


def options_swept(experiment: Experiment) -> bool:
    """Tell whether an option of a scheme differs between members."""
    keys = experiment.sweep.keys if experiment.sweep else ()
    return any(key.startswith("schemes.") for key in keys)


def options_of(experiment: Experiment, columns: Columns, scheme: int, case: int) -> Options:
    """Return the options that one member has of one scheme, by their positions."""
    own = {key: values[case : case + 1] for key, values in columns.items()}
    return plan.option_groups(experiment, scheme, own)[0][0]


def formal_orders(experiment: Experiment, quantity: str, columns: Columns) -> Floats:
    """Return the order that every scheme promises for a quantity, shape (scheme, case).

    It is infinite for what is exact, and NaN for a scheme that chooses its own steps. Of a part of an error it is what
    theory says of it, and that of the position where it says nothing. Where no option is swept there is one case for
    all, here and below, but of parts, which depend on every number of a member, and of schemes whose orders depend on
    how a motion begins.
    """
    if is_promised(experiment, quantity):
        return part_orders(experiment, quantity, columns)
    model, of = experiment.model.definition, whole_of(quantity)

    def promised(beginning: Beginning) -> Floats:
        return _each(
            experiment, columns, lambda s, o: float(s.formal_order(of, model, o, beginning))
        )

    begins = beginnings(experiment, columns)
    if not begins.any():
        return promised(BEGINNINGS[0])
    return np.choose(begins, [promised(b) for b in BEGINNINGS])


def special_orders(experiment: Experiment, quantity: str, columns: Columns) -> Floats:
    """Return the highest order that every scheme has in a special case, shape (scheme, 1 or case).

    A part of an error has one order at a special start, and another at any other one: it may have any. Where events or
    corners decide there is no such case (NaN).
    """
    model = experiment.model.definition
    if model.events is not None or model.lookup is not None:
        return np.full((len(experiment.schemes), 1), np.nan)
    if is_promised(experiment, quantity):
        return np.full((len(experiment.schemes), 1), np.inf)
    return _each(experiment, columns, lambda s, o: s.special_order(o))


def orders_vary(experiment: Experiment, quantity: str) -> bool:
    """Tell whether members have orders of their own."""
    if is_promised(experiment, quantity):
        return experiment.sweep is not None
    return options_swept(experiment) or beginning_varies(experiment)


def even_powers(experiment: Experiment, quantity: str, columns: Columns) -> Flags:
    """Tell whether the error of a quantity has every second power only, shape (scheme, case)."""
    model, of = experiment.model.definition, whole_of(quantity)
    even = _each(experiment, columns, lambda s, o: float(s.has_even_powers(of, model, o)))
    return np.asarray(even != 0)


def has_corners(model: Model) -> bool:
    """Tell whether steps have corners of a force from a table inside."""
    return model.lookup is not None and not model.lookup.is_met


def left_to_the_mesh(experiment: Experiment, columns: Columns) -> Floats:
    """Return the power that is left where it depends on the mesh what a step sees, shape (scheme, case).

    It is 1 where events are left to the mesh, and 2 where steps have corners of the force inside: how much of an error
    belongs to that power is then the accident of where they lie between two points. NaN stands where errors have a
    regular expansion.
    """
    model = experiment.model.definition
    if model.events is None and not has_corners(model):
        return np.full((len(experiment.schemes), 1), np.nan)
    return _each(experiment, columns, lambda s, o: _left(s, o, model))


def _left(scheme: Scheme, options: Options, model: Model) -> float:
    if model.events is not None:
        return 1.0 if is_on_the_mesh(options) else math.nan
    # the error of a scheme of first order is its own
    order = scheme.formal_order(model.position, model, options)
    return ORDER_AT_CORNERS if order >= ORDER_AT_CORNERS else math.nan


def relative_floors(
    experiment: Experiment, steps: tuple[int, ...], columns: Columns, arithmetic: str | None = None
) -> Floats:
    """Return the predicted round-off relative to the solution, shape (scheme, case, level).

    Parameters
    ----------
    steps
        Number of steps of every level.
    arithmetic
        Of schemes that have several; the one that they have where None.
    """

    def floor(scheme: Scheme, options: Options) -> Floats:
        if arithmetic is not None and "arithmetic" in options:
            options = {**options, "arithmetic": arithmetic}
        return relative_floor(scheme, options, steps)

    return _each(experiment, columns, floor)


def stability_limits(experiment: Experiment, columns: Columns) -> Floats:
    """Return the largest stable w dt of every scheme, infinite for none, shape (scheme, case).

    It is infinite too for a scheme that grows at every step (its growth vanishes with dt, and is no instability), and
    for one that chooses its own steps.
    """
    return _each(experiment, columns, _finite_limit)


def _finite_limit(scheme: Scheme, options: Options) -> float:
    limit = limit_of(scheme, options)
    return limit if limit > 0.0 else np.inf


def limit_of(scheme: Scheme, options: Options) -> float:
    """Return the largest stable w dt of a scheme, infinite for none, 0 where every step grows; NaN where it adapts."""
    return math.nan if scheme.adaptive else _limit(scheme, tuple(sorted(options.items())))


@lru_cache(maxsize=1024)
def _limit(scheme: Scheme, options: tuple[tuple[str, OptionValue], ...]) -> float:
    return float(stability_limit(scheme, dict(options)))


def _each(
    experiment: Experiment,
    columns: Columns,
    promise: Callable[[Scheme, Options], ArrayLike],
) -> Floats:
    """Return what every scheme promises with the options that each member has of it."""
    rows = []
    for i, scheme in enumerate(experiment.schemes):
        groups = plan.option_groups(experiment, i, columns)
        values = [np.asarray(promise(SCHEMES[scheme.kind], o), dtype=float) for o, _ in groups]
        count = sum(len(cases) for _, cases in groups) if len(groups) > 1 else 1
        row = np.empty((count, *values[0].shape))
        for value, (_, cases) in zip(values, groups, strict=True):
            row[cases if count > 1 else slice(None)] = value
        rows.append(row)
    return np.stack(np.broadcast_arrays(*rows))
