"""Of which quantities a true error is known, which alone shows that levels approach the wrong solution."""

from __future__ import annotations

import numpy as np

from vibsim.core.record import Record, Variable, attributes
from vibsim.core.vocabulary import MEMBER

NORM = "_error_norm"
KNOWN = "_error_known"


def known_errors(record: Record) -> dict[str, Variable]:
    """Return of each quantity of a convergence Record whether a true error is known at some level.

    It is `<q>_error_known` over ``scheme, case``, of every q with `<q>_error_norm`: all that verdicts need of norms.
    """
    found = {}
    attrs = attributes("whether a true error is known", "1")
    for name, norms in record.variables.items():
        if norms.dims[:2] == MEMBER and name.endswith(NORM):
            known = np.isfinite(norms.values).any(axis=tuple(range(2, norms.values.ndim)))
            found[name.removesuffix(NORM) + KNOWN] = Variable(MEMBER, known, attrs)
    return found


def has_exact(record: Record, quantity: str, scheme: int, case: int) -> bool:
    """Tell whether a true error of a quantity is known at some level."""
    name = quantity + KNOWN
    known = record.variables if name in record else known_errors(record)
    # parts of an error are measured against the motion itself
    return name not in known or bool(known[name].values[scheme, case])
