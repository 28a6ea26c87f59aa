"""Every number of this room that decides something: its value, its meaning, and where it comes from.

The origin stands in brackets: *derived* from the arithmetic, or a *convention*, a size that was chosen.
"""

from __future__ import annotations

# Corners of the force

ON_A_POINT = 1e-6
"""Part of a step within which a corner is at its end. [convention]"""
FAR, NEAR = 1.0 / 16.0, 1.0 / 128.0
"""Distances from the corner at which both formulas are compared, over the largest value of the quantity.
[convention]"""
HALVINGS = 40
"""Halvings of a step that find the place of a corner. [convention]"""
MOST_SMOOTH = 8
"""A jump of a higher derivative than this one is none. [convention]"""

# The start

BALANCED = 1e-12
"""A force that makes so little of the velocity within a radian is rounding. [convention]"""

# Storing

STORED = 1.0 / 7.0
"""Root mean square of the error that storing leaves of numbers from 1/2 to 1: half a spacing over root 12. [derived]"""
