"""The numbers that a ``value`` check can test. The analysis computes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

AtPart = Literal["t", "step", "event", "level", "scheme", "case"]
Take = Literal[
    "largest", "smallest", "mean", "where", "where_largest", "where_smallest", "monotone"
]
"""How the numbers of all members are reduced to the one that is checked."""
IN_WORDS: Mapping[str, str] = {
    "largest": "largest",
    "smallest": "smallest",
    "mean": "mean",
    "where_largest": "place of the largest",
    "where_smallest": "place of the smallest",
    "monotone": "direction of the",
}
"""First words of the name of a reduced number; `where` has become `where_largest` before it is named."""
OF_ONE_MEMBER = (None, "largest", "smallest")  # reductions that pick the number of one member
OF_THE_SAME_KIND = (*OF_ONE_MEMBER, "mean")
"""Reductions with the unit of a member's number. The others give swept values or directions."""
CASES = "cases"  # what a number is taken over that needs no swept key: all members
MOST_EVENTS = 512  # largest number of event times stored per scheme and member


@dataclass(frozen=True)
class Value:
    """A number that can be checked."""

    name: str
    description: str
    of: Literal[
        "series", "convergent", "states", "stored", "extremal", "deviation", "running", "none"
    ]
    """The quantities that it is defined for.

    ``series``: all; ``convergent``: those compared between levels; ``states``: the states; ``stored``: states and
    outputs; ``extremal``: states and energy deviations, whose extrema over every step are stored; ``deviation``: the
    energy deviation, stored with and without its last point; ``running``: the energy deviations, whose running maximum
    is stored; ``none``: it belongs to the motion as a whole.
    """
    measure: Literal["none", "count", "quantity", "l1", "l2", "time", "frequency", "position"]
    """Its unit: none; a count; the unit of the quantity, times that of time (``l1``) or its square root (``l2``);
    the unit of time, of angle over time, or of the position."""
    at: tuple[AtPart, ...] = ("level", "scheme", "case")  # the keys of ``at:`` that it accepts
    finer_levels: int = 0  # number of finer levels that it needs besides its own level
    best: bool = False
    """Whether it is defined at ``level: best``, as the limit of the numbers of all levels or for the extrapolated
    solution."""
    needs_time: bool = False  # whether ``t`` or ``step`` must be given
    needs_exact: Literal["solution", "period"] | None = None  # exact result of the model
    needs_linear: bool = False  # whether it follows from theory for undamped linear models
    fixed_step: bool = False  # whether it is undefined for adaptive schemes
    needs_potential: bool = False  # whether all forces of the position need a known potential
    needs_rational: bool = False
    """Whether the acceleration must be computable in rational arithmetic (`vibsim.theory.degrees`)."""
    needs_events: bool = False  # whether it exists only for models with events
    needs_force: bool = False  # whether it refers to periods of a force that ``time:`` names
    is_sample: bool = False  # whether it is a sample of a series, and has the name of that
    is_count_of_work: bool = False  # whether it measures work, which grows with the level
    survives_failure: bool = False
    """Whether it can be valid although the run failed later. Values from theory do not depend on the run."""
    measured_by: Literal["", "parabola", "points", "roots"] = ""
    """Its source of error besides the time steps: a peak interpolated by a parabola, extrema over grid points, or the
    recurrence of the steps, whose round-off is eps/(w dt)^2 (peaks if the scheme has no such recurrence)."""
    is_angle: bool = False  # whether it is defined modulo whole turns
    has_own_size: bool = False  # whether its round-off is relative to itself
    rests_on_run: bool = False
    """Whether a longer run makes its limit more accurate: transients and other spectral lines disturb it less."""

    def has_limit(self, level: int | str | None) -> bool:
        """Tell whether at `level` it is the limit of the numbers of all levels, not of the extrapolated solution."""
        return level == "best" and self.best and self.of != "convergent"

    @property
    def sees_several_levels(self) -> bool:
        """Whether it needs more than one level: finer ones, or the whole ladder."""
        return self.finer_levels > 0 or (self.of == "convergent" and "level" not in self.at)

    @property
    def depends_on_level(self) -> bool:
        """Whether it differs between levels, or needs the whole ladder."""
        return "level" in self.at or self.sees_several_levels

    def own_levels(self, levels: Sequence[int]) -> tuple[int, ...]:
        """Return the levels at which it exists; a number computed from several levels belongs to the coarsest one."""
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
"""Fields of `Value` for words of the fourth column of `_TABLE`; any other word is a field set to True."""
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
"""All values by name, as `vibsim list checks` prints them."""
