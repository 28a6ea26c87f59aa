"""Whether every member reached the tolerance of its experiment.

A pilot with a few members chose the levels. This checks all others, by the extrapolated solution (as in ``best.nc``).
"""

from __future__ import annotations

import math

import numpy as np

from vibsim.checks.fields import Field
from vibsim.checks.notation import Notation
from vibsim.checks.outcome import Judged, Outcome, outcome_of
from vibsim.checks.sentences import Description, MemberFacts
from vibsim.convergence.reasons import code
from vibsim.core.array_types import Floats, Integers
from vibsim.core.errors import VibsimError
from vibsim.core.record import Record, Variable
from vibsim.core.vocabulary import MEMBER
from vibsim.experiment import Experiment
from vibsim.observe.member_block import MemberBlock

_BOUND_SUFFIX = "_best_error"
"""Suffix of a state in the name of its largest bound."""

BOUND = Field("largest bound over time of the error of the extrapolated solution")


def is_bound(name: str) -> bool:
    """Tell whether a variable of the convergence Record comes from `bounds`."""
    return name.endswith(_BOUND_SUFFIX)


def bounds(block: MemberBlock) -> dict[str, Variable]:
    """Return the largest bound over time of each extrapolated state, shape (scheme, case); infinite if unknown.

    It is NaN for adaptive schemes, which have no levels.
    """
    # a page, which reads only the words of this module, does not need the engine behind it
    from vibsim.comparison.best_solution import extrapolated

    rows = extrapolated(block.experiment, block.records, block.grid)
    bounds = np.stack([row.largest_bounds() for row in rows], axis=1)
    largest = np.full((len(bounds), *block.shape), np.nan)
    largest[:, list(block.experiment.ladder)] = bounds
    words = "largest bound of the error of the extrapolated solution"
    return {
        f"{state.name}{_BOUND_SUFFIX}": Variable.of(
            MEMBER, values, f"{state.long_name}: {words}", state.unit
        )
        for state, values in zip(block.model.states, largest, strict=True)
    }


def _largest_bound(experiment: Experiment, record: Record) -> tuple[Floats, Integers]:
    """Return the largest bound of each scheme and member, and the index of its state."""
    states = experiment.model.definition.states
    table = np.stack([record[f"{state.name}{_BOUND_SUFFIX}"] for state in states])
    return np.max(table, axis=0), np.argmax(table, axis=0)


def judge(experiment: Experiment, record: Record) -> Outcome:
    """Compare the largest bound of each scheme and member with the tolerance of the experiment.

    VibsimError if the convergence Record was made without the tolerance.
    """
    states = tuple(state.name for state in experiment.model.definition.states)
    if experiment.tolerance is None or any(
        f"{name}{_BOUND_SUFFIX}" not in record for name in states
    ):
        raise VibsimError("the analysis knows of no tolerance: analyse the levels again")
    largest, which = _largest_bound(experiment, record)
    reason = np.where(largest <= experiment.tolerance, code("match"), code("mismatch"))
    facts = {
        "error_bound": (BOUND, largest),
        "state": (Field("state with the largest bound", np.int8, states), which),
    }
    judged = Judged(reason, largest - experiment.tolerance)
    return outcome_of(experiment, record, None, judged, facts)


def rule(experiment: Experiment, notation: Notation) -> str:
    """Say what the error bound should be."""
    return f"at most {notation.number(experiment.tolerance or 0.0)}"


def describe(f: MemberFacts) -> Description:
    """State the error bound of the extrapolated solution, and what to change.

    If it is too large, the pilot did not run this member, and the ladder is too coarse for it.
    """
    experiment, name = f.experiment, f.scheme_name
    levels = experiment.levels
    largest, which = (table[f.scheme, f.case] for table in _largest_bound(experiment, f.record))
    state = f.model.states[which].name
    sentence = "The error of the extrapolated solution is unknown, because its levels do not agree."
    if math.isfinite(largest):
        verb = "is" if f.reason == "match" else "is not"
        sentence = (
            f"The error bound of the extrapolated solution is {f.notation.number(largest, 3)} (of "
            f"{f.notation.quantity(state)}, the largest over time). It {verb} {rule(experiment, f.notation)}."
        )
    swept = experiment.sweep.keys if experiment.sweep else ()
    fixed = experiment.schemes[f.scheme].options.items()
    options = {key: word for key, word in fixed if f"schemes.{name}.{key}" not in swept}
    changes = [
        "put such members in an experiment of their own, so that its pilot tries them",
        f"replace `tolerance:` by finer `levels:` than {levels[0]} to {levels[-1]}",
    ]
    if state in f.model.velocities and options.get("end_velocity", "kick") != "kick":
        changes.insert(0, f"set `end_velocity: kick` for scheme {name}")
    if options.get("arithmetic", "compensated") != "compensated":
        changes.append(f"set `arithmetic: compensated` for scheme {name}")
    text = ", or ".join(changes)
    return Description(sentence, f"{text[0].upper()}{text[1:]}.")
