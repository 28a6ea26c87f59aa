"""Whether members end at times of their own; read by jobs, whose digests cover this file."""

from __future__ import annotations

from collections.abc import Iterable


def end_varies(swept: Iterable[tuple[str, bool]], by_periods: bool) -> bool:
    """Tell whether the end time differs between members.

    Parameters
    ----------
    swept
        Dotted keys of the sweep, each with whether its values differ.
    by_periods
        Whether the end is a number of natural periods: it then counts as different as soon as a parameter of the
        model is.
    """
    keys = [key for key, differs in swept if differs]
    return "time.end" in keys or (by_periods and any(key.startswith("model.") for key in keys))
