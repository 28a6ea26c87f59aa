"""The sweep as one writes it in an hour: a compiled loop with the library's sine, numpy, netCDF.

``python script_scalar.py MEMBERS INTERVALS FILE``: three-term stepping on levels 8 to 11 up to t = 20, released at
theta_0 from 0.1 to 2.5; differences of levels on INTERVALS common intervals, norms, observed order, period, amplitude.
"""

from __future__ import annotations

import math
import sys
from itertools import pairwise
from typing import Any

import netCDF4
import numpy as np
from numba import njit

LEVELS = (8, 9, 10, 11)
END = 20.0


@njit(error_model="numpy", cache=True)
def solve(theta: Any, steps: int, every: int, samples: Any, period: Any, amplitude: Any) -> None:
    h = END / steps
    for i in range(len(theta)):
        before = theta[i]
        u = before - 0.5 * h * h * math.sin(before)
        samples[i, 0] = before
        first = last = v_before = 0.0
        peaks = 0
        lowest = highest = before
        for n in range(1, steps + 1):
            ahead = 2.0 * u - before - h * h * math.sin(u)
            v = (ahead - before) * (0.5 / h)
            lowest = min(lowest, u)
            highest = max(highest, u)
            if v_before >= 0.0 and v < 0.0:
                last = n * h + (v_before / (v_before - v) - 1.0) * h
                if peaks == 0:
                    first = last
                peaks += 1
            if n % every == 0:
                samples[i, n // every] = u
            v_before = v
            before = u
            u = ahead
        period[i] = (last - first) / (peaks - 1) if peaks > 1 else np.nan
        amplitude[i] = 0.5 * (highest - lowest)


def main() -> None:
    members, intervals = int(sys.argv[1]), int(sys.argv[2])
    theta = np.linspace(0.1, 2.5, members)
    period, amplitude = np.empty((2, len(LEVELS), members))
    values = []
    for k, level in enumerate(LEVELS):
        samples = np.empty((members, intervals + 1))
        solve(theta, 2**level, 2**level // intervals, samples, period[k], amplitude[k])
        values.append(samples)
    norms = []
    for coarse, fine in pairwise(values):
        norms.append(np.sqrt(END / intervals * np.sum((coarse - fine) ** 2, axis=1)))
    difference = np.array(norms)
    order = np.log2(difference[:-1] / difference[1:])
    error = difference * 4.0 / 3.0
    with netCDF4.Dataset(sys.argv[3], "w") as file:
        file.createDimension("case", members)
        for name, rows in (("level", LEVELS), ("pair", LEVELS[:-1]), ("triple", LEVELS[:-2])):
            file.createDimension(name, len(rows))
        for name, dim, value in (
            ("period", "level", period),
            ("amplitude", "level", amplitude),
            ("difference_norm", "pair", difference),
            ("estimated_error_norm", "pair", error),
            ("observed_order", "triple", order),
        ):
            file.createVariable(name, "f8", (dim, "case"))[:] = value


if __name__ == "__main__":
    main()
