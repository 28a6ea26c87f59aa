"""A table of a model in a kernel: looked up at a place, between its points by `vibsim.models.table`.

The table is one array that all members share. It stands among the parameters of a member, behind its numbers, so that
formulas reach it; no number of it is in the text of a kernel. A place lies between points of its own for every member,
which vector instructions cannot fetch together: such models are not stepped in blocks.
"""

from __future__ import annotations

import math
from typing import Any

from vibsim.models.table import BENDS, HEADER, HEIGHTS


def looked_up(rows: Any, x: float) -> tuple[float, float]:
    """Return height and second derivative at the place x, which lies within the table.

    Parameters
    ----------
    rows
        `vibsim.models.table.Table.rows`; behind its ends the last pieces go on.
    """
    spacing = float(rows[HEADER, 1])
    way = (x - float(rows[HEADER, 0])) / spacing
    i = min(max(math.floor(way), 0), rows.shape[1] - 2)
    w = way - i
    h_0, h_1 = float(rows[HEIGHTS, i]), float(rows[HEIGHTS, i + 1])
    q_0, q_1 = float(rows[BENDS, i]), float(rows[BENDS, i + 1])
    line = (1.0 - w) * h_0 + w * h_1
    bow = w * (1.0 - w) * ((2.0 - w) * q_0 + (1.0 + w) * q_1)
    return line - spacing * spacing / 6.0 * bow, (1.0 - w) * q_0 + w * q_1
