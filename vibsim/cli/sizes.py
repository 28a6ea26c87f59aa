"""Numbers with units that people read."""

from __future__ import annotations


def size(number: float) -> str:
    """Return bytes as text: ``1.2 GB``."""
    for unit in ("B", "kB", "MB", "GB"):
        if number < 999.5:
            return f"{number:.3g} {unit}"
        number /= 1000.0
    return f"{number:.3g} TB"


def amount(number: float) -> str:
    """Return a count as text: ``960``, ``1.3e+06``."""
    return f"{number:.0f}" if number < 1e5 else f"{number:.2g}"


def duration(seconds: float) -> str:
    """Return seconds as text: ``0.4 s``, ``3.1 min``, ``2.5 h``."""
    for limit, factor, unit in ((100.0, 1.0, "s"), (6000.0, 60.0, "min"), (172800.0, 3600.0, "h")):
        if seconds < limit:
            return f"{seconds / factor:.1f} {unit}"
    return f"{seconds / 86400.0:.1f} d"
