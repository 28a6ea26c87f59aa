"""What the checks ``stable``, ``conserves`` and ``equal`` measure.

It stands in ``check_value``, ``check_low``, ``check_high`` and ``check_first`` of the convergence Record
(`vibsim.analysis.measured`), with these meanings:

- ``stable``: growth per period, measured and predicted; w dt, the highest; the level. The reason is ``match`` where it
  is stable, ``unstable``, or ``mismatch`` where it grows otherwise than predicted;
- ``conserves``: the largest error over the energy at the start; rate and k of the drift (`vibsim.analysis.drift`); its
  kind, as a position in `vocabulary.DRIFTS`;
- ``equal``: the largest distance, and what it may be; nothing; the level.

What the pictures of these checks need beside that is told in `vibsim.analysis.shown`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.apart import apart
from vibsim.analysis.compare import Comparison
from vibsim.analysis.drifting import drift_at
from vibsim.analysis.outcome import FAIL, PASS
from vibsim.analysis.part import Part
from vibsim.analysis.shown import by_place, places
from vibsim.analysis.stability import growth_at
from vibsim.vocabulary import REASON_NAMES

if TYPE_CHECKING:
    from vibsim.spec.scheme_checks import ConservesCheck, EqualCheck, StableCheck

Row = Mapping[str, NDArray[Any] | int]
"""Field of a check to its values, shape (scheme, case), but for those of `vibsim.analysis.shown`."""

MATCH, MISMATCH, UNSTABLE = map(REASON_NAMES.index, ("match", "mismatch", "unstable"))


def measure(
    part: Part,
    compared: Mapping[str, Comparison],
    check: StableCheck | ConservesCheck | EqualCheck,
) -> Row:
    """Return what a check measures."""
    if check.kind == "stable":
        return _stable(part, check)
    if check.kind == "conserves":
        return _conserves(part, check)
    return _equal(part, compared, check)


def _stable(part: Part, check: StableCheck) -> Row:
    """Return what a ``stable`` check measures."""
    level = part.grid.levels[-1] if check.level is None else check.level
    found = growth_at(part, level)
    reason = np.where(found.unstable, UNSTABLE, MATCH)
    return {
        "value": found.measured,
        "low": found.predicted,
        "high": np.broadcast_to(part.fastest[:, part.grid.levels.index(level)], part.shape),
        "first": level,
        "culprit": level,
        "reason": np.where(found.contradicted, MISMATCH, reason),
        "status": np.where(found.unstable | found.contradicted, FAIL, PASS),
    }


def _conserves(part: Part, check: ConservesCheck) -> Row:
    """Return what a ``conserves`` check measures."""
    level = part.grid.levels[-1] if check.level is None else check.level
    found = drift_at(part, level, check.about or "")
    return {
        "value": found.largest,
        "low": found.rate,
        "high": found.power,
        "first": found.kind,
        "culprit": level,
        "means": found.means,
        "round_off": found.round_off,
    }


def _equal(part: Part, compared: Mapping[str, Comparison], check: EqualCheck) -> Row:
    """Return what an ``equal`` check measures; of other schemes NaN."""
    level = part.grid.levels[-1] if check.level is None else check.level
    found = apart(part, compared, check)
    value, low = (np.full(part.shape, np.nan) for _ in range(2))
    value[found.scheme], low[found.scheme] = found.largest, found.allowed
    return {
        "value": value,
        "low": low,
        "first": level,
        "culprit": level,
        "distance": by_place(found.over_time, places(part)),
    }
