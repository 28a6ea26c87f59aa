"""Whether every member reached the tolerance of its experiment.

The levels were chosen by a pilot of a few members. What holds of all the others is found here, from the solution that
``best.nc`` has, which need not be written for it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.fields import Field
from vibsim.checks.outcome import FAIL, PASS, Outcome
from vibsim.comparison.best_solution import extrapolated
from vibsim.core.errors import VibsimError
from vibsim.core.record import Record, Variable, attributes
from vibsim.core.vocabulary import REASON_NAMES
from vibsim.observe.member_block import MemberBlock

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

_BOUND = "_best_error"
"""What follows the name of a state in the name of its largest bound."""

BOUND = Field("largest bound over time of the error of the extrapolated solution")
_WORDS = "largest bound of the error of the extrapolated solution"


def is_bound(name: str) -> bool:
    """Tell whether a variable of the convergence Record is what `bounds` returned."""
    return name.endswith(_BOUND)


def bounds(block: MemberBlock) -> dict[str, Variable]:
    """Return the largest bound over time of every extrapolated state, shape (scheme, case); infinite without one.

    It is NaN of schemes that choose their own steps, and so have no levels.
    """
    rows = extrapolated(block.experiment, block.records, block.grid)
    bounds = np.stack([row.largest_bounds() for row in rows], axis=1)
    largest = np.full((len(bounds), *block.shape), np.nan)
    largest[:, list(block.experiment.ladder)] = bounds
    return {
        f"{state.name}{_BOUND}": Variable(
            ("scheme", "case"), values, attributes(f"{state.long_name}: {_WORDS}", state.unit)
        )
        for state, values in zip(block.model.states, largest, strict=True)
    }


def largest_bound(
    experiment: Experiment, record: Record
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the largest bound of every scheme and member, and the position of the state that has it."""
    states = experiment.model.definition.states
    table = np.stack([record[f"{state.name}{_BOUND}"] for state in states])
    return np.max(table, axis=0), np.argmax(table, axis=0)


def reached(experiment: Experiment, record: Record) -> Outcome:
    """Compare the largest bound of every scheme and member with the tolerance of the experiment.

    Raises
    ------
    VibsimError
        Where `record`, the convergence Record, was made without the tolerance.
    """
    states = [state.name for state in experiment.model.definition.states]
    missing = [name for name in states if f"{name}{_BOUND}" not in record]
    if missing or experiment.tolerance is None:
        raise VibsimError("the analysis knows of no tolerance: analyse the levels again")
    largest, which = largest_bound(experiment, record)
    status = np.where(largest <= experiment.tolerance, PASS, FAIL).astype(np.int8)
    codes = [REASON_NAMES.index(name) for name in ("match", "mismatch")]
    names, cases = record.words("scheme"), np.asarray(record["case"])
    # what chooses its own steps is no part of the ladder
    schemes = list(experiment.ladder)
    return Outcome(
        schemes=[names[i] for i in schemes],
        scheme_index=schemes,
        cases=cases,
        case_index=np.arange(len(cases)),
        status=status,
        reason=np.where(status == PASS, *codes).astype(np.int8),
        compared=status,
        away=largest - experiment.tolerance,
        facts={
            "error_bound": (BOUND, largest),
            "state": (Field("state with the largest bound", np.int8, tuple(states)), which),
        },
    )
