"""The part of a phase error that is there from the start, which says where a wrong order of a phase comes from."""

from __future__ import annotations

import numpy as np

from vibsim.comparison.order_evidence import judgement
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.convergence.differences import largest, safe_ratio
from vibsim.core.record import Variable, attributes
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.models.shared.phase_amplitude_names import AMPLITUDE, PHASE


def at_start(q: Comparison) -> dict[str, Variable]:
    """Return the part of a phase error that is there from the first step on; nothing of any other quantity."""
    if not q.name.endswith(PHASE) or not q.differences:
        return {}
    first = judgement(q, TYPICAL_NORM).first
    levels = np.array(q.block.grid.levels[:-1])
    # of the coarsest pair that the order rests on: furthest from round-off
    pair = np.where(first < 0, len(levels) - 1, np.searchsorted(levels, first))
    share = np.stack([safe_ratio(np.abs(d[..., 0]), largest(d)) for d in q.differences], axis=-1)
    chosen = np.take_along_axis(share, pair[..., None], axis=-1)[..., 0]
    attrs = attributes(f"{q.long_name}: what is there from the start over the largest", "1")
    return {f"{q.name}_at_start": Variable(("scheme", "case"), chosen, attrs)}


def is_told(name: str) -> bool:
    """Tell whether a variable of the convergence Record is one that `vibsim.checks.words.phase_amplitude` reads."""
    return name.endswith((f"{PHASE}_order", f"{AMPLITUDE}_order", f"{PHASE}_at_start"))
