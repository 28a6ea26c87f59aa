"""Work against precision: the error of each scheme and level, with its steps and evaluations of the force.

The error is the largest error of the position over the common times. The reference is the exact solution or, if that is
unknown, the extrapolation with the smallest bound of all schemes; errors below that bound are meaningless. Run times
are measured by `bench.work_precision`.

An adaptive scheme has a tolerance instead of levels: its single point is stored at the finest level.

Source: E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, section II.10 (diagrams of
error against work); vibration text (B), section 5 and exercise 4.
"""

from __future__ import annotations

import numpy as np

from vibsim.comparison.comparison_variables import Table
from vibsim.comparison.quantity_comparison import Compared, Comparison
from vibsim.core.array_types import Floats
from vibsim.core.record import Variable
from vibsim.core.vocabulary import OF_LEVEL
from vibsim.observe import oscillation
from vibsim.observe.member_block import MemberBlock, by_level


def work_precision(block: MemberBlock, compared: Compared) -> Table:
    """Return the data of a work-precision diagram.

    Parameters
    ----------
    compared
        The comparisons of `block`, including that of the position.

    Returns
    -------
    dict
        ``work_steps``, ``work_force_evaluations`` and ``work_error``, shape (scheme, case, level), and
        ``work_reference_error``, shape (case,): 0 if the exact solution is known, else the bound of the reference.
    """
    position, levels = compared[block.model.position], block.grid.levels
    reference, bound = reference_of(position)
    errors = by_level([np.max(np.abs(u - reference), axis=-1) for u in position.values])
    steps = by_level([oscillation.steps_taken(block, level) for level in levels])
    forces = by_level([oscillation.force_evaluations(block, level) for level in levels])
    is_exact = position.exact is not None
    words = "the exact solution" if is_exact else "the best extrapolation"
    reference_name = {"reference": "exact" if is_exact else "Richardson"}
    forces_text = "evaluations of the acceleration, of an implicit scheme per iteration"
    error_text = f"largest distance of the {position.long_name} from {words}"
    table = {}
    for name, values, text, units, attributes in (
        ("work_steps", steps, "steps that were taken", "1", {}),
        ("work_force_evaluations", forces, forces_text, "1", {}),
        ("work_error", errors, error_text, position.units, reference_name),
    ):
        values[block.adaptive, :, :-1] = np.nan
        long_name = f"{text}; of an adaptive scheme once, at the finest level"
        table[name] = Variable.of(OF_LEVEL, values, long_name, units, **attributes)
    bounds = Variable.of(("case",), bound, f"largest error bound of {words}", position.units)
    return table | {"work_reference_error": bounds}


def reference_of(position: Comparison) -> tuple[Floats, Floats]:
    """Return the reference of errors, shape (case, t) or (1, t), and the bound of its error, shape (case,)."""
    cases = position.block.shape[1]
    if position.exact is not None:
        return position.exact[0], np.zeros(cases)
    value, bound = position.extrapolation
    usable = np.isfinite(bound[..., -1]) & ~position.block.adaptive[:, None]
    bounds = np.where(usable, bound[..., -1], np.inf)
    best, case = np.argmin(bounds, axis=0), np.arange(cases)
    smallest = bounds[best, case]
    known = np.isfinite(smallest)
    reference = np.where(known[:, None], value[best, case], np.nan)
    return reference, np.where(known, smallest, np.nan)
