"""What was gathered over every step, as variables of shape (scheme, case)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.record import Variable, attributes
from vibsim.engine import EventTimes, Extrema, Gathered
from vibsim.models import Model, State
from vibsim.simulation.members import Members

Floats = NDArray[np.float64]
Rows = dict[str, tuple[NDArray[Any], dict[str, Any]]]
"""Name of a variable to its values and attributes."""

STATUS = ("ok", "non_finite")
"""Meaning of the variable ``status``."""


def gathered(
    model: Model,
    run: Gathered,
    last_step: NDArray[np.int64],
    group: Members,
    steps: int,
    *,
    with_d2t: bool,
) -> dict[str, Variable]:
    """Return what was gathered over every step.

    Parameters
    ----------
    run, last_step
        Arrays of shape (scheme, case) or (scheme, case, state, 2).
    with_d2t
        Whether the energy by ``[D_2t u]`` has a place in the file.
    """
    rows = _extremes(model, run) | _peaks(model, run) | _outcomes(last_step, group.end, steps)
    if with_d2t:
        words = "largest absolute deviation of the energy with [D_2t u] as velocity, over every inner step"
        attrs = attributes(words, model.energy_unit)
        rows["energy_deviation_d2t_max_abs"] = run.deviation_d2t, attrs
    return {
        name: Variable(("scheme", "case"), values, attrs) for name, (values, attrs) in rows.items()
    }


def extrema(model: Model, found: Extrema) -> dict[str, Variable]:
    """Return the local extrema of the position, and how many there are (vibration text, section 3.5)."""
    dims, unit = ("scheme", "case", "extremum"), model.states[0].unit
    parabola = "on the parabola through three points"
    table = {}
    for kind in ("peak", "trough"):
        rows = {
            f"{kind}_time": (f"time of the {kind}s, {parabola}", "s"),
            kind: (f"height of the {kind}s, {parabola}", unit),
            f"{kind}_time_grid": (f"time of the {kind}s at grid points", "s"),
            f"{kind}_grid": (f"height of the {kind}s at grid points", unit),
        }
        for name, (words, units) in rows.items():
            table[name] = Variable(dims, getattr(found, name), attributes(words, units))
        words = f"number of {kind}s, those that are not kept among them"
        counted = getattr(found, f"{kind}_count")
        table[f"{kind}_count"] = Variable(dims[:2], counted, attributes(words, "1"))
    return table


def event_times(found: EventTimes) -> dict[str, Variable]:
    """Return the number of events, when they were, and from when on members were at rest."""
    rows = {
        "event_count": ("number of events, where the motion is not smooth", "1"),
        "first_event_time": ("time of the first event", "s"),
        "last_event_time": ("time of the last event", "s"),
        "rest_time": ("time from which the member was at rest to the end", "s"),
    }
    return {
        name: Variable(("scheme", "case"), getattr(found, name), attributes(long_name, units))
        for name, (long_name, units) in rows.items()
    }


def of_own_steps(run: Gathered) -> dict[str, Variable]:
    """Return what adaptive schemes did of their own; NaN where steps are fixed."""
    words = "of an adaptive scheme, whatever the level"
    rows = {
        "accepted_steps": (run.accepted_steps, f"accepted steps {words}"),
        "force_evaluations_total": (
            run.force_evaluations,
            f"evaluations of the acceleration {words}, with those for its dense output",
        ),
    }
    return {
        name: Variable(("scheme", "case"), values, attributes(long_name, "1"))
        for name, (values, long_name) in rows.items()
    }


def _extremes(model: Model, run: Gathered) -> Rows:
    energy = model.energy_unit
    words = "largest absolute energy deviation over every step"
    rows: Rows = {}
    for k, state in enumerate(model.states):
        rows[f"{state.name}_min"] = run.ranges[..., k, 0], _over_steps("least", state)
        rows[f"{state.name}_max"] = run.ranges[..., k, 1], _over_steps("largest", state)
        for i, name in enumerate(("l1", "l2")):
            rows[f"{state.name}_{name}"] = run.norms[..., k, i], _norm_of(name, state)
    rows["energy_deviation_max_abs"] = run.deviation, attributes(words, energy)
    rows["energy_deviation_max_abs_interior"] = (
        run.deviation_interior,
        attributes(f"{words} but the last point", energy),
    )
    return rows


def _over_steps(word: str, state: State) -> dict[str, Any]:
    return attributes(f"{word} {state.long_name} over every step", state.unit)


def _norm_of(name: str, state: State) -> dict[str, Any]:
    # units of half a second are none that udunits knows
    time = {"l1": "s", "l2": "the square root of s"}[name]
    words = f"{name} norm of the {state.long_name} over every step (times {time})"
    return attributes(words, state.unit)


def _peaks(model: Model, run: Gathered) -> Rows:
    unit = model.states[0].unit
    height = "half the height between the last peak and the last trough, interpolated"
    mean = "mean period over every step"
    turn = "time of a turn for a member that goes over the top"
    return {
        "amplitude": (
            0.5 * np.abs(run.last_peak - run.last_trough),
            attributes(height, unit),
        ),
        "first_peak": (
            run.first_peak,
            attributes("height of the first peak, interpolated", unit),
        ),
        "last_peak": (run.last_peak, attributes("height of the last peak, interpolated", unit)),
        "period": (run.period, attributes(f"{mean}, interpolated ({turn})", "s")),
        "period_grid": (
            run.period_grid,
            attributes(f"{mean}, between peaks at grid points", "s"),
        ),
        "period_count": (run.period_count, attributes("number of periods in the mean", "1")),
    }


def _outcomes(last_step: NDArray[np.int64], end: Floats, steps: int) -> Rows:
    flags = {
        "flag_values": np.arange(len(STATUS), dtype=np.int8),
        "flag_meanings": " ".join(STATUS),
    }
    failed = last_step < steps
    return {
        "status": (
            failed.astype(np.int8),
            {**attributes("what became of the member", "1"), **flags},
        ),
        "last_step": (last_step, attributes("last step with finite values", "1")),
        "failure_time": (
            np.where(failed, (last_step + 1) * end / steps, np.nan),
            attributes("time of the first value that is not finite or too large", "s"),
        ),
    }
