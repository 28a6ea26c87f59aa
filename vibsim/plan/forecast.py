"""Estimated cost of a run besides its time steps (see `vibsim.experiment.cost`): references, analysis and report.

``bench/plans.py`` measures the constants on twenty experiments (docs/benchmarks.md). Times are seconds of one core. The
number of steps of a reference solution is known only when two successive ones agree; one period of the fastest
oscillation seldom needs more than `STEPS_A_PERIOD` steps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER
from vibsim.experiment.cost import PLAIN_WORK, LevelCost, analysis_disk
from vibsim.experiment.storage import is_bounded, stores_references
from vibsim.formula.jumps import MOST_GAPS, held
from vibsim.models.base import tree, varies_in_time

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

RUN_SECONDS = 1.5
"""The command, Snakemake and the index together, for any number of experiments."""
PAGE_SECONDS = 1.5
"""One report."""
SCHEME_SECONDS = 0.06
"""One scheme in the analysis and the report: its theory, table rows and curves."""
ANALYSIS_SECONDS = (0.7, 0.016e-6, 0.012)
"""Analysis: start; per byte written; per quantity and level."""
BYTE_SECONDS = 20e-9
"""Compressing or sealing one byte of any file, reading it again, checking and recording it."""
NUMBER_SECONDS = (1.2e-6, 0.05e-6)
"""One stored number of a series derived from the states: in plain Python, and compiled."""
GAP_SECONDS, GAP_BYTES = 1e-6, 300
"""Time and memory of the search for a force pulse between two successive points of the finest level."""
JUDGED_BYTES = 25 * 10**6
"""Memory of the compiled error model in an analysis that judges orders."""
LEVEL_BYTES, FEW_LEVELS, MANY_LEVELS = 25 * 10**6, 4, 7
"""Memory of each further level of such an analysis, for level counts between these two."""
VARIABLE_BYTES, FEW_SERIES = 2 * 10**6, 12
"""Memory of the netCDF library's buffers for each series beyond the first `FEW_SERIES`."""
LONG_SECONDS = 5.0
"""A reference solution that takes longer is announced in a note."""

STEPS_A_PERIOD, FEWEST_STEPS, MOST_STEPS = 8, 256, 2048
"""Steps of the last reference solution: per period, and in total; the coarser ones together have as many again."""
STEP_SECONDS = (0.5e-3, 0.18e-3)
"""One such step, and its extra time for each coordinate."""
MEMBER_PART = 0.05
"""Extra time for each further member, as a fraction of the time of one."""
PIECE_SECONDS = 0.008
"""Reference over one interval of a table, with all refinements."""
CORNER_SECONDS, CORNERS_A_PERIOD = 0.03, 2
"""Search for one corner of the force, and the number of corners per period for each condition."""
CORNER_MEMBER_PART = 0.2
"""Extra time of these searches for each further member, as a fraction of the time of one: each has its own corners."""


def reference_seconds(experiment: Experiment) -> float:
    """Return the time of the reference solutions of an experiment [core seconds]; 0 if it computes none."""
    if not stores_references(experiment):
        return 0.0
    model = experiment.model.definition
    frequency = model.highest_frequency or model.natural_frequency
    periods = experiment.time.end * float(frequency(experiment.model.parameters)) / (2.0 * math.pi)
    needed = STEPS_A_PERIOD * periods if math.isfinite(periods) else 0.0
    steps = FEWEST_STEPS
    while steps < min(needed, MOST_STEPS):
        steps *= 2
    per_step, per_coordinate = STEP_SECONDS
    smooth = 2.0 * steps * (per_step + per_coordinate * model.coordinates)
    if model.lookup is not None:
        smooth += PIECE_SECONDS * model.lookup.table.points
    moving = (*(state.name for state in model.states), "t")
    _, switches = held((tree(model, formula) for formula in model.accelerations), moving)
    corners = CORNERS_A_PERIOD * periods * len(switches) if math.isfinite(periods) else 0.0
    others = experiment.members - 1
    search = CORNER_SECONDS * corners
    return smooth * (1.0 + MEMBER_PART * others) + search * (1.0 + CORNER_MEMBER_PART * others)


def gaps(experiment: Experiment, levels: Sequence[LevelCost]) -> int:
    """Return the number of gaps between points of the finest level that are searched at a time for a force pulse."""
    is_driven = varies_in_time(experiment.model.definition)
    return min(experiment.members * levels[-1].steps, MOST_GAPS) if is_driven else 0


def other_memory(experiment: Experiment, levels: Sequence[LevelCost]) -> int:
    """Return the memory of an analysis besides the levels and its results [bytes]."""
    error_model = JUDGED_BYTES if len(levels) >= LEVELS_OF_AN_ORDER else 0
    error_model += LEVEL_BYTES * max(min(len(levels), MANY_LEVELS) - FEW_LEVELS, 0)
    series = VARIABLE_BYTES * max(levels[0].series - FEW_SERIES, 0)
    return error_model + series + GAP_BYTES * gaps(experiment, levels)


def other_seconds(experiment: Experiment, levels: Sequence[LevelCost]) -> float:
    """Return the time of the series, the comparison of the levels and the report [core seconds]."""
    plain, compiled = NUMBER_SECONDS
    series = 0.0
    for level in levels:
        samples = experiment.trajectories * level.samples
        is_plain = samples * level.coordinates <= PLAIN_WORK
        series += samples * level.series * (plain if is_plain else compiled)
    start, per_byte, per_quantity = ANALYSIS_SECONDS
    written = analysis_disk(levels, experiment.members, is_bounded(experiment))
    compared = start + per_byte * written + per_quantity * levels[0].series * len(levels)
    written += sum(level.disk(experiment.members) for level in levels)
    search = GAP_SECONDS * gaps(experiment, levels)
    page = PAGE_SECONDS + SCHEME_SECONDS * levels[0].schemes
    return series + compared + BYTE_SECONDS * written + search + page


def notes(seconds: float, kind: str) -> tuple[tuple[int, str], ...]:
    """Return a note, without a line number, on a reference that takes longer than `LONG_SECONDS`; else no note."""
    if seconds < LONG_SECONDS:
        return ()
    text = f"a reference solution of {kind} is computed once, which takes about {seconds:.0f} s"
    return ((0, f"{text}: its exact solution is not known, and true errors need one"),)
