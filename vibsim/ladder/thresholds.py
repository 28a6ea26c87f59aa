"""Every number of this room that decides something: its value and its meaning; all are sizes that were chosen."""

from __future__ import annotations

# The pilot

PILOT = 16
"""Members that are run."""
SEARCHED = 2**16
"""Up to so many members their extreme values are looked for."""
LEAST_STEPS = 16
"""Steps of the coarsest level that is tried."""
TIMES = 32
"""At so many times at most the pilot looks."""
LONGEST = 12
"""Levels of a ladder at most; more of them only add round-off."""
MOST_STEPS = 2**27
"""Steps that the pilot may take, all its members and levels together."""
PATIENCE = 2
"""After so many levels that do not halve the bound no finer one will."""
PLAIN_STEPS = 2**18
"""Up to so many steps of a level the pilot takes less time in plain Python than a new kernel takes to be compiled."""

# Solving

LEAST_LOOKS = 16
"""The coarsest level is looked at so many times at least, where rounding errors are measured."""
POINTS_AT_A_TIME = 2**18
"""Points of one level that are held at a time."""
