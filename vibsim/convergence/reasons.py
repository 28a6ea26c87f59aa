"""Reasons and statuses of verdicts as arrays and files hold them: by their positions in the lists of the vocabulary."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vibsim.core.array_types import Codes, Flags
from vibsim.core.vocabulary import REASON_NAMES, REASONS, STATUSES

PASS, FAIL, INCONCLUSIVE = map(STATUSES.index, ("PASS", "FAIL", "INCONCLUSIVE"))
STATUS_OF = np.array([STATUSES.index(status) for status in REASONS.values()], dtype=np.int8)
"""The status that each of `REASON_NAMES` belongs to."""
code = REASON_NAMES.index
"""The position of a reason."""


def is_one_of(codes: Codes, *reasons: str) -> Flags:
    """Say where a reason is one of some."""
    return np.isin(codes, [code(reason) for reason in reasons])


def is_open(codes: Codes) -> Flags:
    """Say where a reason is that of a verdict which decides nothing."""
    return np.asarray(STATUS_OF[codes] == INCONCLUSIVE)


def first_reason(cases: Sequence[tuple[Flags, str | Codes]], otherwise: str) -> Codes:
    """Return the reason of the first case that applies to each result; a case may have a reason for each of them."""
    codes = [code(reason) if isinstance(reason, str) else reason for _, reason in cases]
    return np.select([where for where, _ in cases], codes, code(otherwise))
