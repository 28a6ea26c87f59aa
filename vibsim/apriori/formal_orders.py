"""The orders and powers of dt that schemes promise for each member.

They depend on the options of the scheme, which may be swept, and those of some schemes on how the motion begins
(`vibsim.schemes.orders`).
"""

from __future__ import annotations

import math
from contextlib import suppress
from typing import get_args

import numpy as np

from vibsim import theory
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.core.record import Record
from vibsim.core.vocabulary import PHASE, is_error_part, whole_of
from vibsim.experiment import Experiment
from vibsim.experiment.sweep_columns import Columns, by_options, option_groups, recorded_columns
from vibsim.formula import values
from vibsim.models.base import by_name, components, tree
from vibsim.models.shared.free import free_oscillation, why_not_free
from vibsim.schemes import FIXED_STEP, Options, Scheme
from vibsim.schemes.base import ORDER_AT_CORNERS, is_on_the_mesh
from vibsim.schemes.orders import Beginning, depends_on_velocity, is_autonomous
from vibsim.simulation.members import numbers_of

BALANCED = 1e-12
"""A force that changes the velocity by less than this fraction within a radian counts as zero. [convention]"""
BEGINNINGS: tuple[Beginning, ...] = get_args(Beginning)


def options_swept(experiment: Experiment) -> bool:
    """Tell whether an option of a scheme is swept."""
    return _sweeps(experiment, "schemes.")


def depends_on_beginning(experiment: Experiment) -> bool:
    """Tell whether the order of some scheme depends on how the motion begins: from rest or from balance."""
    model = experiment.model.definition
    if model.events_act or model.lookup is not None or depends_on_velocity(model):
        return False
    if experiment.chain > 1:
        # a member that starts from the end of another one begins in an unknown way
        return False
    if model.loaded is not None:
        # no scheme for structures has special orders
        return False
    # with swept options the orders are not known here
    return options_swept(experiment) or any(
        orders.from_rest is not None or orders.from_balance is not None
        for orders in (s.method.orders(s.options) for s in experiment.schemes)
    )


def beginning_varies(experiment: Experiment) -> bool:
    """Tell whether members may begin in different ways, so that their orders may differ."""
    return depends_on_beginning(experiment) and _sweeps(experiment, "initial.", "model.")


def _sweeps(experiment: Experiment, *sections: str) -> bool:
    """Tell whether a key in one of these sections is swept."""
    keys = experiment.sweep.keys if experiment.sweep else ()
    return any(key.startswith(sections) for key in keys)


def beginnings(experiment: Experiment, columns: Columns) -> Integers:
    """Return the index in `BEGINNINGS` of every member, shape (case,), or (1,) if all members have the same."""
    size = len(next(iter(columns.values()))) if beginning_varies(experiment) else 1
    if not depends_on_beginning(experiment):
        return np.zeros(size, dtype=np.int64)
    model = experiment.model.definition
    columns = {key: column[:size] for key, column in columns.items()}
    parameters, initial = numbers_of(experiment, columns, size)
    fastest = np.max([np.abs(initial[name]) for name in model.velocities], axis=0)
    at_rest = (fastest == 0.0) & is_autonomous(model)
    with np.errstate(all="ignore"):
        frequency = np.asarray(model.natural_frequency(parameters), dtype=float)
        rounding = BALANCED * fastest * np.nan_to_num(frequency)
        numbers = {**by_name(model.parameters, parameters), **initial, "t": np.zeros(1)}
        accelerations = [np.abs(values(tree(model, a), numbers)) for a in model.accelerations]
        is_balanced = np.max(accelerations, axis=0) <= rounding
    index = np.where(at_rest, BEGINNINGS.index("rest"), BEGINNINGS.index("any"))
    index = np.where(is_balanced, BEGINNINGS.index("balance"), index)
    return np.broadcast_to(index, size)


def formal_orders(
    experiment: Experiment, quantity: str, columns: Columns, eventless: Flags | None = None
) -> Floats:
    """Return the order that every scheme promises for a quantity, shape (scheme, case).

    The order is infinite for an exact quantity, and NaN for a scheme that chooses its own steps. The order of an error
    part follows from theory, or is that of the position where theory does not apply. Here and below, the dimension case
    has length 1 if no option is swept, except for error parts, which depend on all parameters of a member, and for
    orders that depend on how the motion begins. `eventless`, shape (scheme, case), marks members that met no event.
    """
    if is_promised(experiment, quantity):
        return part_orders(experiment, quantity, columns)
    model, name = experiment.model.definition, whole_of(quantity)

    def promised(beginning: Beginning, meets_events: bool = True) -> Floats:
        return by_options(
            experiment,
            columns,
            lambda s, o: float(
                s.formal_order(name, model, o, beginning, meets_events=meets_events)
            ),
        )

    if eventless is not None and np.any(eventless):
        return np.where(eventless, promised(BEGINNINGS[0], False), promised(BEGINNINGS[0]))
    begins = beginnings(experiment, columns)
    if not begins.any():
        return promised(BEGINNINGS[0])
    return np.choose(begins, [promised(b) for b in BEGINNINGS])


def orders_in(experiment: Experiment, record: Record, quantity: str) -> Floats:
    """Return the promised orders of a quantity, shape (scheme, 1 or case), as a convergence Record holds them.

    If it does not hold them, they follow from the experiment alone, as if every member of a model with events met one.
    """
    name = f"{quantity}_formal_order"
    if name not in record:
        return formal_orders(experiment, quantity, recorded_columns(record))
    variable = record.variable(name)
    orders = np.asarray(variable.values, dtype=np.float64)
    return orders if "case" in variable.dims else orders[:, None]


def is_promised(experiment: Experiment, quantity: str) -> bool:
    """Tell whether a quantity is an error part whose order follows from theory."""
    return is_error_part(quantity) and not why_not_free(experiment.model.definition)


def part_orders(experiment: Experiment, quantity: str, columns: Columns) -> Floats:
    """Return the order of an error part for which `is_promised` holds, shape (scheme, 1 or case).

    It is infinite where the part is exact, and NaN where nothing oscillates or the scheme chooses its own steps. Where
    a step has no series, it is that of the position.
    """
    model = experiment.model.definition
    size = len(next(iter(columns.values()))) if columns else 1
    parameters, initial = numbers_of(experiment, columns, size)
    motion = free_oscillation(model, initial, parameters)
    orders = np.full((len(experiment.schemes), len(motion.frequency)), np.nan)
    for s, spec in enumerate(experiment.schemes):
        if spec.adaptive:
            continue
        for options, cases in option_groups(experiment, s, columns):
            stepper = spec.method.stepper_for(model, options)
            damping = motion.damping[cases]
            for value in np.unique(damping[np.isfinite(damping)]).tolist():
                subset = cases[damping == value]
                orders[s, subset] = spec.method.formal_order(whole_of(quantity), model, options)
                with suppress(theory.NoSeriesError):
                    both = theory.part_orders(
                        stepper, value, motion.position[subset], motion.velocity[subset]
                    )
                    orders[s, subset] = both[0 if quantity.endswith(PHASE) else 1]
    return orders


def special_orders(experiment: Experiment, quantity: str, columns: Columns) -> Floats:
    """Return the highest order that every scheme can have in a special case, shape (scheme, 1 or case).

    It is infinite for an error part, whose order may be any at a special initial state, and NaN where the mesh or
    corners decide the order.
    """
    model = experiment.model.definition
    if model.lookup is not None:
        return np.full((len(experiment.schemes), 1), np.nan)
    if is_promised(experiment, quantity):
        return np.full((len(experiment.schemes), 1), np.inf)

    def special(scheme: Scheme, options: Options) -> float:
        has_mesh = model.events_act and is_on_the_mesh(options)
        return math.nan if has_mesh else scheme.special_order(options)

    return by_options(experiment, columns, special)


def orders_on_oscillator(experiment: Experiment, quantity: str, columns: Columns) -> Floats:
    """Return the order of every scheme on ``u'' + w^2 u = 0``, shape (scheme, 1 or case); infinite where not computed.

    No scheme has a higher order on models in general. Only positions and velocities of schemes that do not come with
    vibsim are computed: tests compare the promises of the others with theory.
    """
    model = experiment.model.definition
    of_which = components(model, quantity)[0]
    if of_which not in (*model.positions, *model.velocities):
        return np.full((len(experiment.schemes), 1), np.inf)

    def on_oscillator(scheme: Scheme, options: Options) -> float:
        if scheme.adaptive or FIXED_STEP.get(scheme.kind) is scheme:
            return math.inf
        return theory.orders(scheme.stepper(options))[int(of_which in model.velocities)]

    return by_options(experiment, columns, on_oscillator)


def orders_vary(experiment: Experiment, quantity: str) -> bool:
    """Tell whether the orders of a quantity may differ between members."""
    if is_promised(experiment, quantity) or experiment.model.definition.events_act:
        return experiment.sweep is not None
    return options_swept(experiment) or beginning_varies(experiment)


def even_powers(experiment: Experiment, quantity: str, columns: Columns) -> Flags:
    """Tell whether the error expansion of a quantity has only every second power of dt, shape (scheme, case)."""
    model, whole = experiment.model.definition, whole_of(quantity)
    even = by_options(experiment, columns, lambda s, o: float(s.has_even_powers(whole, model, o)))
    return np.asarray(even != 0)


def left_to_the_mesh(experiment: Experiment, columns: Columns, has_corners: Flags) -> Floats:
    """Return the power of dt with a coefficient that depends on the mesh, shape (scheme, 1 or case).

    It is 1 where events are left to the mesh, and 2 where corners of a table lie inside steps (`has_corners`, shape
    (case,)): the coefficient then depends on their positions between two grid points. It is NaN where errors have a
    regular expansion.
    """
    model = experiment.model.definition

    def left(scheme: Scheme, options: Options) -> float:
        if model.events_act:
            return 1.0 if is_on_the_mesh(options) else math.nan
        # the error of a first-order scheme dominates that of the corners
        order = scheme.formal_order(model.position, model, options)
        return ORDER_AT_CORNERS if order >= ORDER_AT_CORNERS else math.nan

    if model.events_act:
        return by_options(experiment, columns, left)
    if not has_corners.any():
        return np.full((len(experiment.schemes), 1), np.nan)
    return np.where(has_corners, by_options(experiment, columns, left), np.nan)
