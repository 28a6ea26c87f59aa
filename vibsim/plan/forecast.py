"""How long a run takes: what is beside the steps of its levels (`vibsim.experiment.cost`), on one core and on several.

The constants are measured by ``bench/plans.py`` on twenty experiments (docs/benchmarks.md). How many steps a reference
solution takes is known only when two of them agree; a period of the fastest oscillation seldom needs more than
`STEPS_A_PERIOD`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER
from vibsim.experiment.cost import PLAIN_MEMBER_STEPS, LevelCost, analysis_disk
from vibsim.experiment.storage import is_bounded
from vibsim.formula.jumps import held
from vibsim.models import has_solution, tree

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

RUN_SECONDS = 1.5
"""Of the command, of Snakemake and of the index, whatever the number of experiments."""
PAGE_SECONDS = 1.5
"""Of a report."""
SCHEME_SECONDS = 0.06
"""Of a scheme in the analysis and on the page: its theory, its rows and its curves."""
ANALYSIS_SECONDS = (0.7, 0.016e-6, 0.012)
"""Of an analysis: its start; of each byte that it writes; of each quantity at each level."""
BYTE_SECONDS = 20e-9
"""Of a byte of any file that is compressed or sealed, read again, checked and put on record."""
NUMBER_SECONDS = (1.2e-6, 0.05e-6)
"""Of one stored number of the series that follow from the states: in plain Python, and compiled."""
GAP_SECONDS, GAP_BYTES = 1e-6, 300
"""Of an analysis that looks for a pulse of a force between two points of the finest level."""
JUDGED_BYTES = 25 * 10**6
"""Of an analysis that judges orders: the error model, compiled."""
LEVEL_BYTES, FEW_LEVELS, MANY_LEVELS = 25 * 10**6, 4, 7
"""Beside these, of each further level from the first number of levels to the second."""
VARIABLE_BYTES, FEW_SERIES = 2 * 10**6, 12
"""Of each series above so many: buffers of the netCDF library."""
MOST_GAPS = 2**21
"""Of these at a time (`vibsim.observe.thresholds`)."""
LONG_SECONDS = 5.0
"""A reference that takes longer is announced."""

MOST_REFERENCES = 1024
"""Members, of more no reference is computed (`vibsim.simulation.level`)."""
STEPS_A_PERIOD, FEWEST_STEPS, MOST_STEPS = 8, 256, 2048
"""Steps of the last reference: a period, and altogether; those before it have as many together."""
STEP_SECONDS = (0.5e-3, 0.18e-3)
"""Of such a step, and beside it for each coordinate."""
MEMBER_PART = 0.05
"""Part of a step that one more member takes."""
PIECE_SECONDS = 0.008
"""Of the way from a point of a table to the next one, at all steps of it."""
CORNER_SECONDS, CORNERS_A_PERIOD = 0.03, 2
"""Of a corner of the force, which is searched for, and how many a period has of each condition."""
CORNER_MEMBER_PART = 0.2
"""Part of the time of these that one more member takes: each has its own corners."""


def reference_seconds(experiment: Experiment) -> float:
    """Return the seconds of one core that the reference solutions of an experiment take; 0 where it computes none."""
    model = experiment.model.definition
    is_known = model.exact is not None or not has_solution(model) or experiment.chain > 1
    if is_known or experiment.members > MOST_REFERENCES or is_bounded(experiment):
        return 0.0
    frequency = model.highest_frequency or model.natural_frequency
    turns = experiment.time.end * float(frequency(experiment.model.parameters)) / (2.0 * math.pi)
    wanted = STEPS_A_PERIOD * turns if math.isfinite(turns) else 0.0
    steps = FEWEST_STEPS
    while steps < min(wanted, MOST_STEPS):
        steps *= 2
    first, each = STEP_SECONDS
    smooth = 2.0 * steps * (first + each * model.coordinates)
    if model.lookup is not None:
        smooth += PIECE_SECONDS * model.lookup.table.points
    moving = (*(state.name for state in model.states), "t")
    _, switches = held((tree(model, formula) for formula in model.accelerations), moving)
    corners = CORNERS_A_PERIOD * turns * len(switches) if math.isfinite(turns) else 0.0
    others = experiment.members - 1
    cornered = CORNER_SECONDS * corners
    return smooth * (1.0 + MEMBER_PART * others) + cornered * (1.0 + CORNER_MEMBER_PART * others)


def gaps(experiment: Experiment, levels: Sequence[LevelCost]) -> int:
    """Return between how many points of the finest level the force of all members is looked at for a pulse."""
    model = experiment.model.definition
    forces = () if model.loaded is not None else (tree(model, row) for row in model.accelerations)
    is_driven = any("t" in force.names for force in forces)
    return min(experiment.members * levels[-1].steps, MOST_GAPS) if is_driven else 0


def other_memory(experiment: Experiment, levels: Sequence[LevelCost]) -> int:
    """Return the bytes that an analysis holds beside the levels and what it writes."""
    judges = JUDGED_BYTES if len(levels) >= LEVELS_OF_AN_ORDER else 0
    judges += LEVEL_BYTES * max(min(len(levels), MANY_LEVELS) - FEW_LEVELS, 0)
    series = VARIABLE_BYTES * max(levels[0].series - FEW_SERIES, 0)
    return judges + series + GAP_BYTES * gaps(experiment, levels)


def other_seconds(experiment: Experiment, levels: Sequence[LevelCost]) -> float:
    """Return the seconds of one core that series, the comparison of the levels and the page take."""
    plain, compiled = NUMBER_SECONDS
    series = 0.0
    for level in levels:
        samples = experiment.trajectories * level.samples
        series += samples * level.series * (plain if samples <= PLAIN_MEMBER_STEPS else compiled)
    start, of_byte, of_quantity = ANALYSIS_SECONDS
    written = analysis_disk(levels, experiment.members, is_bounded(experiment))
    compared = start + of_byte * written + of_quantity * levels[0].series * len(levels)
    written += sum(level.disk(experiment.members) for level in levels)
    searched = GAP_SECONDS * gaps(experiment, levels)
    page = PAGE_SECONDS + SCHEME_SECONDS * levels[0].schemes
    return series + compared + BYTE_SECONDS * written + searched + page


def notes(seconds: float, kind: str) -> tuple[tuple[int, str], ...]:
    """Return what is said of a reference that takes so long, as a note without a line; nothing of a quick one."""
    if seconds < LONG_SECONDS:
        return ()
    text = f"a reference solution of {kind} is computed once, which takes about {seconds:.0f} s"
    return ((0, f"{text}: its exact solution is not known, and true errors need one"),)
