"""What to change in the YAML where a scheme is not stable, does not conserve, or is not equal as a check expects."""

from __future__ import annotations

import math
from decimal import Decimal
from typing import TYPE_CHECKING, get_args

from vibsim.analysis.numbers_in_words import number
from vibsim.spec.scheme_checks import SOLUTIONS, Drift

if TYPE_CHECKING:
    from vibsim.spec.scheme_checks import EqualCheck

BROKEN = "Start `levels:` at a finer level, or shorten `time: end`."
"""Where the calculation met a number that is not finite."""
KNOWN_DRIFTS = get_args(Drift)
"""What `drift:` may be."""


def on_stability(reason: str, level: int, p: float, limit: float, failed: float = math.nan) -> str:
    """Say what to change where a scheme is not as stable as a check expects.

    Parameters
    ----------
    p, limit
        w dt at `level`, and the largest stable one.
    failed
        Time at which `level` met a number that is not finite; NaN where it did not.
    """
    if reason == "match":
        return "Set `stable: true`, or take coarser `levels:` where the scheme has a limit (w dt beyond it)."
    if reason == "mismatch":
        return (
            "Take another `kind:` in `schemes:`, or look for an error in this one: it does not grow as its own theory "
            "says."
        )
    is_beyond = math.isfinite(limit) and p > limit > 0.0
    if not is_beyond and not math.isnan(failed):
        return (
            f"End the time interval (`time: end`) before t = {failed:.4g} if the motion itself escapes there, take "
            "finer `levels:` if it does not, or correct `stable:`."
        )
    if not is_beyond:
        return "Take finer `levels:`, shorten `time: end`, or correct `stable:`."
    first = level + math.ceil(math.log2(p / limit) - 1e-9)
    return f"Take finer `levels:`, from {first} on (w dt within the limit {number(limit)}), or correct `stable:`."


def on_drift(reason: str, drift: str, quantity: str, expected: str) -> str:
    """Say what to change where the energy does not drift as a check expects.

    Parameters
    ----------
    drift, expected
        The kind of drift that was measured, and the one that the check asks for.
    """
    if reason == "not_applicable":
        return f"Name `schemes:` that have {quantity}, or ask for `conserves: energy`."
    if reason == "pre_asymptotic":
        return "Lengthen the run (`time: end`), or store more of it (`samples: all`): it is too short to show a drift."
    if drift in KNOWN_DRIFTS and KNOWN_DRIFTS.index(drift) < KNOWN_DRIFTS.index(expected):
        return f"Set `drift: {drift}`, which was measured: the energy is conserved better than the check asks for."
    other = (
        f"set `drift: {drift}`, which was measured"
        if drift in KNOWN_DRIFTS
        else "leave the check out (`checks:`)"
    )
    return (
        f"Take a scheme that conserves the energy better (`schemes:`), or {other}: finer `levels:` make the error "
        "smaller, but do not change how it grows."
    )


def on_distance(reason: str, check: EqualCheck, distance: float) -> str:
    """Say what to change where two solutions are not as near to each other as a check expects."""
    if reason == "not_applicable" and math.isfinite(distance):
        return f"Give `atol:`, above {_above(distance)} if so much is right."
    if reason == "not_applicable":
        return "Name in `equal:` a scheme or a solution that exists here, or another `quantity:`."
    loose = f"give `atol:` above {_above(distance)} if so much is right"
    if check.second in SOLUTIONS:
        return f"Correct what `equal:` names, take a finer `level:`, or {loose}."
    return f"Correct what `equal:` names or the options of one of the `schemes:`, or {loose}."


def _above(distance: float) -> str:
    """Write a number with two digits that is no smaller than a distance: one that is asked for must suffice."""
    if not 0.0 < distance < math.inf:
        return f"{distance:.2g}"
    near = Decimal(f"{distance:.1e}")
    unit = Decimal(1).scaleb(near.adjusted() - 1)
    return f"{float(near if near >= Decimal(distance) else near + unit):.2g}"
