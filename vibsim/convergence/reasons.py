"""Reasons and statuses of verdicts as integer codes: their indices in the lists of the vocabulary."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vibsim.core.array_types import Codes, Flags
from vibsim.core.vocabulary import REASON_NAMES, REASONS, STATUSES

PASS, FAIL, INCONCLUSIVE = map(STATUSES.index, ("PASS", "FAIL", "INCONCLUSIVE"))
STATUS_OF = np.array([STATUSES.index(status) for status in REASONS.values()], dtype=np.int8)
"""Status of each reason code."""
code = REASON_NAMES.index
"""Return the code of a reason."""


def is_one_of(codes: Codes, *reasons: str) -> Flags:
    """Say which codes are among these reasons."""
    return np.isin(codes, [code(reason) for reason in reasons])


def is_open(codes: Codes) -> Flags:
    """Say which codes are those of INCONCLUSIVE verdicts."""
    return np.asarray(STATUS_OF[codes] == INCONCLUSIVE)


def first_reason(cases: Sequence[tuple[Flags, str | Codes]], otherwise: str) -> Codes:
    """Return the reason of the first case that applies to each ladder; a case may have one reason for each ladder."""
    codes = [code(reason) if isinstance(reason, str) else reason for _, reason in cases]
    return np.select([where for where, _ in cases], codes, code(otherwise))
