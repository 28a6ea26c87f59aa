"""What further levels of an experiment cost, by the estimate of its plan, in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from vibsim.experiment.cost import load_of

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

LONG = 120.0
"""Seconds above which times are told in minutes, and sixty times that in hours."""


def cost_in_words(experiment: Experiment, levels: Sequence[int]) -> str:
    """Return what the levels cost together: steps of all schemes and members, seconds of one core, and memory.

    The memory is that of the largest job.
    """
    loads = [load_of(experiment, level) for level in levels]
    members = experiment.members
    steps = sum(load.schemes * load.steps * members for load in loads)
    seconds = sum(load.seconds(members) for load in loads)
    memory = max(load.memory(min(members, load.shard)) for load in loads)
    return f"{_steps(steps)} steps, {_time(seconds)} of one core, {_size(memory)} of memory"


def _steps(number: int) -> str:
    return f"{number}" if number < 100_000 else f"{number:.2g}"


def _time(seconds: float) -> str:
    if seconds < 0.1:
        return "less than 0.1 s"
    if seconds < LONG:
        return f"{seconds:.2g} s"
    if seconds < LONG * 60:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.0f} h"


def _size(number: int) -> str:
    return f"{number / 1e6:.0f} MB" if number < 1e9 else f"{number / 1e9:.1f} GB"
