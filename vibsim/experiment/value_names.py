"""The numbers that a ``value`` check can ask for: one row per name, worked out in the analysis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

AtPart = Literal["t", "step", "event", "level", "scheme", "case"]
Take = Literal[
    "largest", "smallest", "mean", "where", "where_largest", "where_smallest", "monotone"
]
"""Which number of all members a check is about."""
OF_ONE_MEMBER = (None, "largest", "smallest")
"""Those that are the number of one member."""
OF_THE_SAME_KIND = (*OF_ONE_MEMBER, "mean")
"""Those that have the unit of a member's number, and digits of their own; others are swept values and directions."""
MOST_EVENTS = 512
"""Events whose times are kept of a scheme and member."""


@dataclass(frozen=True)
class Value:
    """One number that can be checked."""

    name: str
    description: str
    of: Literal[
        "series", "convergent", "states", "stored", "extremal", "deviation", "running", "none"
    ]
    """Which quantities it can be of: every one; those that are compared between levels; the states, of which least and
    largest value are gathered over every step; these and outputs; these and the energy deviations; the energy deviation
    alone, whose last point is gathered apart; the energy deviations, whose largest value so far is gathered; or none
    because the value belongs to the motion as a whole."""
    measure: Literal["none", "count", "quantity", "l1", "l2", "time", "frequency", "position"]
    """What it is measured in: a plain number; one that is counted; the unit of its quantity, times that of the time or
    its root in norms over time; the unit of the time, of an angle over it, or of the position."""
    at: tuple[AtPart, ...] = ("level", "scheme", "case")
    """Which parts of ``at:`` it takes."""
    finer_levels: int = 0
    """How many finer levels a level must have beside it."""
    best: bool = False
    """Whether it also exists at ``level: best``: as the limit of the numbers of all levels, or of the extrapolated
    solution."""
    needs_time: bool = False
    """Whether ``t`` or ``step`` must be given."""
    needs_exact: Literal["solution", "period"] | None = None
    """What the model must know exactly."""
    needs_linear: bool = False
    """Whether it comes from the theory of linear models without damping."""
    fixed_step: bool = False
    """Whether it does not exist of schemes that choose their own steps."""
    needs_potential: bool = False
    """Whether it does not exist where forces of the position have no potential energy that is known."""
    needs_rational: bool = False
    """Whether the acceleration must be worked out in exact numbers (`vibsim.theory.degrees`)."""
    needs_events: bool = False
    """Whether it exists only where the motion of the model is not smooth."""
    needs_force: bool = False
    """Whether it is of whole periods of a force, whose frequency ``time:`` names."""
    is_sample: bool = False
    """Whether it is a sample of a series, and is reported under the name of that."""
    is_count_of_work: bool = False
    """Whether finer levels make it larger, and no more accurate."""
    survives_failure: bool = False
    """Whether it may be sound although the member broke down later; what theory gives no run enters."""
    measured_by: Literal["", "parabola", "points", "roots"] = ""
    """What its error comes from beside that of the steps: a peak interpolated by a parabola, extrema over the points of
    the grid, or the recurrence of the steps, whose round-off is eps/(w dt)^2 (peaks where there is none)."""
    is_angle: bool = False
    """Whether whole turns make no difference."""
    has_own_size: bool = False
    """Whether its round-off is relative to itself."""
    rests_on_run: bool = False
    """Whether a longer run makes its limit more accurate: by what is left of the start, or by other lines."""

    def has_limit(self, level: int | str | None) -> bool:
        """Tell whether it is asked for as the limit of the numbers of the levels, not of the extrapolated solution."""
        return level == "best" and self.best and self.of != "convergent"

    @property
    def sees_several_levels(self) -> bool:
        """Whether it rests on more than one level: on finer ones, or on the whole ladder."""
        return self.finer_levels > 0 or (self.of == "convergent" and "level" not in self.at)

    @property
    def depends_on_level(self) -> bool:
        """Whether it is another one at another level, or rests on the whole ladder."""
        return "level" in self.at or self.sees_several_levels

    def own_levels(self, levels: Sequence[int]) -> tuple[int, ...]:
        """Return the levels that have such a number; one that is made of several belongs to the coarsest of them."""
        return tuple(levels)[: len(levels) - self.finer_levels]


_MARKS: Mapping[str, Mapping[str, Any]] = {
    "numbered": {"at": ("event", "level", "scheme", "case")},
    "anywhere": {"at": ("t", "step", "level", "scheme", "case")},
    "all_levels": {"at": ("scheme", "case")},
    "exact_motion": {"at": ("case",)},
    "mesh": {"at": ("level", "case")},
    "pair": {"finer_levels": 1},
    "triple": {"finer_levels": 2},
    "solution": {"needs_exact": "solution"},
    "period": {"needs_exact": "period"},
    "parabola": {"measured_by": "parabola"},
    "points": {"measured_by": "points"},
    "roots": {"measured_by": "roots"},
}
"""Further fields of `Value`, by the words of the fourth column of the table; any other word is a field that is true."""
_TABLE = """\
end | series | quantity | anywhere best is_sample | value at the last time, or at `t` or `step`
at | series | quantity | anywhere best needs_time is_sample survives_failure | value at the time `t` or after `step` \
steps
min | stored | quantity | best points | smallest value over every step; of an output, over the stored times; at best, \
between them
max | stored | quantity | best points | largest value over every step; of an output, over the stored times; at best, \
between them
max_abs | extremal | quantity | best points | largest absolute value over every step
max_abs_interior | deviation | quantity | | the same without the last point
max_abs_ratio | extremal | none | pair fixed_step | largest absolute value over every step, over that of the next \
finer level
max_abs_interior_ratio | deviation | none | pair fixed_step | the same without the last point
running_max | running | quantity | anywhere | largest absolute value over every step up to `t` or `step`, or the end
relative_running_max | running | none | anywhere | the same, over |E(0)|
period | none | time | best parabola has_own_size | period, from interpolated peaks
period_grid | none | time | | period, from peaks at grid points
exact_period | none | time | exact_motion period survives_failure | period of the exact solution
period_error | none | none | best period parabola | period over the exact period, less one
frequency | none | frequency | best roots has_own_size | angular frequency of the computed motion
error_of_frequency | none | none | best period roots | angular frequency over that of the exact solution, less one
predicted_frequency | none | frequency | needs_linear fixed_step survives_failure | angular frequency by the theory of \
the scheme
phase_error_per_period | none | time | best period roots | time by which the peaks come early, per period; negative \
where they come late
predicted_phase_error | none | time | needs_linear fixed_step survives_failure | the same by the theory of the scheme
phase_error_slope | none | time | period | slope of the time by which a peak comes early over the number of its period
amplitude | none | position | best parabola has_own_size | half the height from the last trough to the last peak
amplitude_error | none | none | best parabola | last amplitude over the first one, less one
steady_amplitude | series | quantity | needs_force best rests_on_run has_own_size | A of the harmonic \
A cos(w t - phase) with the frequency w of the force, over its last period
steady_phase | series | none | needs_force best rests_on_run is_angle | phase of that harmonic [rad], from -pi to pi: \
the lag behind cos(w t)
steady_change | series | none | needs_force | how far that harmonic is from that of the period before, over its \
amplitude
section_period | none | count | needs_force | after how many periods of the force the state is the same again, to \
1e-3, in the second half of the run; 0 where it never is
peak_frequency | series | frequency | best rests_on_run has_own_size | angular frequency of the highest line in the \
spectrum of the stored series
growth_factor | none | none | best parabola has_own_size | last peak over the first peak
growth_per_period | none | none | best roots has_own_size survives_failure | factor by which the amplitude grows in a \
period
predicted_growth_per_period | none | none | needs_linear fixed_step survives_failure | the same by the theory of the \
scheme
relative_energy_error | none | none | best needs_potential | max |E(t) - E(0)| / |E(0)| over every step
relative_energy_error_d2t | none | none | needs_potential | the same with the centred difference of the position as \
velocity, without the end points
event_count | none | count | needs_events | number of events, where the motion is not smooth
event_time | none | time | numbered needs_events best has_own_size | time of the event with the number `event`, from 1
first_event_time | none | time | needs_events best has_own_size | time of the first event
last_event_time | none | time | needs_events best has_own_size | time of the last event
rest_time | none | time | needs_events best has_own_size | time from which the body was at rest to the end, or of its \
stop
accepted_steps | none | count | is_count_of_work | number of steps taken
force_evaluations | none | count | is_count_of_work | number of evaluations of the acceleration; of an implicit scheme \
those of one iteration per step
stability_limit | none | none | all_levels fixed_step survives_failure | largest stable w dt of the scheme, infinite \
where there is none
exact_degree | none | count | all_levels fixed_step needs_rational survives_failure | highest degree up to which the \
scheme reproduces polynomials in t as solutions of the model, 8 at most
error_l1 | convergent | l1 | best solution | L1 norm of the true error
error_l2 | convergent | l2 | best solution | L2 norm of the true error
error_linf | convergent | quantity | best solution | largest true error
error_linf_interior | convergent | quantity | best solution | largest true error without the last point
error_rate | states | none | pair solution fixed_step | log2 of the L2 norm of the true error over that of the next \
finer level, each over its own stored points
second_difference_fraction | none | none | mesh solution needs_linear | [D_tD_t u] over u'' of the exact position at \
the points of the level, least squares
discrete_error | states | quantity | needs_linear fixed_step | largest difference from the exact solution of the \
scheme's own steps
error_estimate_defect | convergent | none | pair solution fixed_step | max |estimate - true error| over max |true error|
observed_order | convergent | none | triple fixed_step | order of a triple of levels, L2 norm
ratio | convergent | none | triple fixed_step | ratio of the differences of a triple, L2 norm
coincidence | convergent | none | triple fixed_step | how well rescaled differences coincide
richardson_error | convergent | quantity | all_levels fixed_step | largest error bound of the extrapolated solution
"""
"""Name, ``of``, ``measure``, further fields (`_MARKS`) and description of every value."""


def _value(line: str) -> Value:
    name, of, measure, marks, description = (cell.strip() for cell in line.split("|", 4))
    fields: dict[str, Any] = {"of": of, "measure": measure}
    for mark in marks.split():
        fields |= _MARKS.get(mark, {mark: True})
    return Value(name, description, **fields)


VALUES: Mapping[str, Value] = MappingProxyType(
    {row.name: row for row in map(_value, _TABLE.splitlines())}
)
"""Every value name with its meaning, as `vibsim list checks` prints it."""
