"""The numbers that a ``value`` check can ask for: one row per name, worked out in the analysis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

AtPart = Literal["t", "step", "level", "scheme", "case"]
Which = Literal[
    "series", "convergent", "states", "stored", "extremal", "deviation", "running", "none"
]
"""Which quantities a value is of: every one; those that are compared between levels; the states, of which least and
largest value are gathered over every step; these and the energy deviations; the energy deviation alone, whose last
point is gathered apart; the energy deviations, whose largest value so far is gathered; or none because the value
belongs to the motion as a whole."""
Exact = Literal["solution", "period"]
Measure = Literal["none", "count", "quantity", "l1", "l2", "time", "frequency", "position"]
"""What a number is measured in: a plain number; one that is counted; the unit of its quantity, times that of the time
or its root in norms over time; the unit of the time, of an angle over it, or of the position."""


@dataclass(frozen=True)
class Value:
    """One number that can be checked."""

    name: str
    description: str
    of: Which
    """Which quantities it can be of."""
    at: tuple[AtPart, ...] = ("level", "scheme", "case")
    """Which parts of ``at:`` it takes."""
    finer_levels: int = 0
    """How many finer levels a level must have beside it."""
    best: bool = False
    """Whether it also exists at ``level: best``: as the limit of the numbers of all levels, or of the extrapolated
    solution."""
    needs_time: bool = False
    """Whether ``t`` or ``step`` must be given."""
    needs_exact: Exact | None = None
    """What the model must know exactly."""
    needs_linear: bool = False
    """Whether it comes from the theory of linear models without damping."""
    fixed_step: bool = False
    """Whether it does not exist of schemes that choose their own steps."""
    needs_rational: bool = False
    """Whether the acceleration must be worked out in exact numbers (`vibsim.theory.degrees`)."""
    needs_events: bool = False
    """Whether it exists only where the motion of the model is not smooth."""
    measure: Measure = "none"
    """What it is measured in."""


_ANYWHERE: tuple[AtPart, ...] = ("t", "step", "level", "scheme", "case")
_NO_LEVEL: tuple[AtPart, ...] = ("scheme", "case")

_SERIES = (
    Value(
        "end",
        "value at the last time, or at `t` or `step`",
        "series",
        _ANYWHERE,
        best=True,
        measure="quantity",
    ),
    Value(
        "at",
        "value at the time `t` or after `step` steps",
        "series",
        _ANYWHERE,
        best=True,
        needs_time=True,
        measure="quantity",
    ),
    Value(
        "min",
        "smallest value over every step; of an output, over the stored times",
        "stored",
        best=True,
        measure="quantity",
    ),
    Value(
        "max",
        "largest value over every step; of an output, over the stored times",
        "stored",
        best=True,
        measure="quantity",
    ),
    Value(
        "max_abs",
        "largest absolute value over every step",
        "extremal",
        best=True,
        measure="quantity",
    ),
    Value("max_abs_interior", "the same without the last point", "deviation", measure="quantity"),
    Value(
        "max_abs_ratio",
        "largest absolute value over every step, over that of the next finer level",
        "extremal",
        finer_levels=1,
        fixed_step=True,
    ),
    Value(
        "max_abs_interior_ratio",
        "the same without the last point",
        "deviation",
        finer_levels=1,
        fixed_step=True,
    ),
    Value(
        "running_max",
        "largest absolute value over every step up to `t` or `step`, or the end",
        "running",
        _ANYWHERE,
        measure="quantity",
    ),
    Value("relative_running_max", "the same, over |E(0)|", "running", _ANYWHERE),
)
_OSCILLATION = (
    Value("period", "period, from interpolated peaks", "none", best=True, measure="time"),
    Value("period_grid", "period, from peaks at grid points", "none", measure="time"),
    Value(
        "exact_period",
        "period of the exact solution",
        "none",
        ("case",),
        needs_exact="period",
        measure="time",
    ),
    Value(
        "period_error",
        "period over the exact period, less one",
        "none",
        needs_exact="period",
        best=True,
    ),
    Value(
        "frequency",
        "angular frequency of the computed motion",
        "none",
        best=True,
        measure="frequency",
    ),
    Value(
        "error_of_frequency",
        "angular frequency over that of the exact solution, less one",
        "none",
        needs_exact="period",
        best=True,
    ),
    Value(
        "predicted_frequency",
        "angular frequency by the theory of the scheme",
        "none",
        needs_linear=True,
        fixed_step=True,
        measure="frequency",
    ),
    Value(
        "phase_error_per_period",
        "time by which the peaks come early, per period; negative where they come late",
        "none",
        needs_exact="period",
        best=True,
        measure="time",
    ),
    Value(
        "predicted_phase_error",
        "the same by the theory of the scheme",
        "none",
        needs_linear=True,
        fixed_step=True,
        measure="time",
    ),
    Value(
        "phase_error_slope",
        "slope of the time by which a peak comes early over the number of its period",
        "none",
        needs_exact="period",
        measure="time",
    ),
    Value(
        "amplitude",
        "half the height from the last trough to the last peak",
        "none",
        best=True,
        measure="position",
    ),
    Value("amplitude_error", "last amplitude over the first one, less one", "none", best=True),
    Value("growth_factor", "last peak over the first peak", "none", best=True),
    Value(
        "growth_per_period", "factor by which the amplitude grows in a period", "none", best=True
    ),
    Value(
        "predicted_growth_per_period",
        "the same by the theory of the scheme",
        "none",
        needs_linear=True,
        fixed_step=True,
    ),
)
_ENERGY = (
    Value("relative_energy_error", "max |E(t) - E(0)| / |E(0)| over every step", "none", best=True),
    Value(
        "relative_energy_error_d2t",
        "the same with the centred difference of the position as velocity, without the end points",
        "none",
    ),
)
_EVENTS = (
    Value(
        "event_count",
        "number of events, where the motion is not smooth",
        "none",
        needs_events=True,
        measure="count",
    ),
    Value("first_event_time", "time of the first event", "none", needs_events=True, measure="time"),
    Value("last_event_time", "time of the last event", "none", needs_events=True, measure="time"),
    Value(
        "rest_time",
        "time from which the body was at rest to the end",
        "none",
        needs_events=True,
        measure="time",
    ),
)
_COST = (
    Value("accepted_steps", "number of steps taken", "none", measure="count"),
    Value(
        "force_evaluations",
        "number of evaluations of the acceleration; of an implicit scheme those of one iteration per step",
        "none",
        measure="count",
    ),
    Value(
        "stability_limit",
        "largest stable w dt of the scheme, infinite where there is none",
        "none",
        _NO_LEVEL,
        fixed_step=True,
    ),
    Value(
        "exact_degree",
        "highest degree up to which the scheme reproduces polynomials in t as solutions of the model, 8 at most",
        "none",
        _NO_LEVEL,
        fixed_step=True,
        needs_rational=True,
        measure="count",
    ),
)
_ERRORS = (
    Value(
        "error_l1",
        "L1 norm of the true error",
        "convergent",
        best=True,
        needs_exact="solution",
        measure="l1",
    ),
    Value(
        "error_l2",
        "L2 norm of the true error",
        "convergent",
        best=True,
        needs_exact="solution",
        measure="l2",
    ),
    Value(
        "error_linf",
        "largest true error",
        "convergent",
        best=True,
        needs_exact="solution",
        measure="quantity",
    ),
    Value(
        "error_linf_interior",
        "largest true error without the last point",
        "convergent",
        best=True,
        needs_exact="solution",
        measure="quantity",
    ),
    Value(
        "error_rate",
        "log2 of the L2 norm of the true error over that of the next finer level, each over its own stored points",
        "states",
        finer_levels=1,
        needs_exact="solution",
        fixed_step=True,
    ),
    Value(
        "second_difference_fraction",
        "[D_tD_t u] over u'' of the exact position at the points of the level, least squares",
        "none",
        ("level", "case"),
        needs_exact="solution",
        needs_linear=True,
    ),
    Value(
        "discrete_error",
        "largest difference from the exact solution of the scheme's own steps",
        "states",
        needs_linear=True,
        fixed_step=True,
        measure="quantity",
    ),
    Value(
        "error_estimate_defect",
        "max |estimate - true error| over max |true error|",
        "convergent",
        finer_levels=1,
        needs_exact="solution",
        fixed_step=True,
    ),
    Value(
        "observed_order",
        "order of a triple of levels, L2 norm",
        "convergent",
        finer_levels=2,
        fixed_step=True,
    ),
    Value(
        "ratio",
        "ratio of the differences of a triple, L2 norm",
        "convergent",
        finer_levels=2,
        fixed_step=True,
    ),
    Value(
        "coincidence",
        "how well rescaled differences coincide",
        "convergent",
        finer_levels=2,
        fixed_step=True,
    ),
    Value(
        "richardson_error",
        "largest error bound of the extrapolated solution",
        "convergent",
        _NO_LEVEL,
        fixed_step=True,
        measure="quantity",
    ),
)
_ROWS = (*_SERIES, *_OSCILLATION, *_ENERGY, *_EVENTS, *_COST, *_ERRORS)

VALUES: Mapping[str, Value] = MappingProxyType({row.name: row for row in _ROWS})
"""Every value name with its meaning, as `vibsim list checks` prints it."""

HAVE_LIMITS = frozenset(row.name for row in _ROWS if row.best and row.of != "convergent")
"""What ``level: best`` takes as the limit of the numbers of all levels; else it is of the extrapolated solution."""
