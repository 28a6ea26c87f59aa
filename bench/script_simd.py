"""The sweep written by hand for speed: the arithmetic, the gathering and the outputs of the pipeline, in one script.

``python script_simd.py MEMBERS INTERVALS FOLDER THREADS``: compensated stepping with members as the inner loop, blocks
of 64, inlined polynomial sine; energies, extrema, peaks and troughs of every step; one file per level with the series
of states and energy deviation on INTERVALS common intervals, one with norms, orders, extrapolation and true errors.
"""

from __future__ import annotations

import math
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
from numba import njit
from scipy.special import ellipj, ellipkm1

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bench.by_hand import sine

LEVELS = (8, 9, 10, 11)
END = 20.0
BLOCK = 64
CHUNK = 16_384
TURN = 2.0 * math.pi

# Rows of one flat array, because a constant distance tells the compiler that they do not overlap.
U, D, U_REST, D_REST, NOW, BEFORE, V, V_BEFORE, ENERGY, BOTTOM = (BLOCK * k for k in range(10))
U_MIN, U_MAX, V_MIN, V_MAX, LARGEST, DEVIATION, HIT = (BLOCK * k for k in range(10, 17))
ROWS = 17

SERIES = ("theta", "omega", "energy_deviation")
PLAIN = (
    *("theta_min", "theta_max", "omega_min", "omega_max", "energy_deviation_max", "first_time"),
    *("last_time", "first_peak", "last_peak", "last_trough", "peaks", "turns", "energy_initial"),
)


@njit(error_model="numpy", inline="always")
def note(w: Any, j: int, out: Any, t: float, h: float) -> None:
    u, v, u_before, v_before = w[NOW + j], w[V + j], w[BEFORE + j], w[V_BEFORE + j]
    if v_before >= 0.0 and v < 0.0:
        share = v_before / (v_before - v)
        out[6] = t + (share - 1.0) * h
        out[8] = u_before + 0.5 * (share * h) * v_before
        if out[10] == 0.0:
            out[5] = out[6]
            out[7] = out[8]
        out[10] += 1.0
    if v_before <= 0.0 and v > 0.0:
        out[9] = u_before + 0.5 * (v_before / (v_before - v) * h) * v_before
    if abs(u - w[BOTTOM + j]) > 0.5 * TURN:
        w[BOTTOM + j] += TURN if u > w[BOTTOM + j] else -TURN
        out[11] += 1.0


@njit(error_model="numpy", nogil=True, cache=True)
def solve(theta: Any, steps: int, every: int, series: Any, plain: Any) -> None:
    h = END / steps
    square, half_over_h = h * h, 0.5 / h
    w = np.empty(ROWS * BLOCK)
    for base in range(0, len(theta), BLOCK):
        width = min(BLOCK, len(theta) - base)
        for j in range(BLOCK):
            u = theta[base + min(j, width - 1)]
            kick = 0.5 * square * (-sine(u))
            ahead = u + kick
            part = ahead - u
            w[U + j], w[D + j], w[D_REST + j] = ahead, kick, 0.0
            w[U_REST + j] = (u - (ahead - part)) + (kick - part)
            half = sine(0.5 * u)
            w[ENERGY + j] = 2.0 * (half * half)
            w[NOW + j] = w[U_MIN + j] = w[U_MAX + j] = u
            w[V + j] = w[V_MIN + j] = w[V_MAX + j] = w[LARGEST + j] = w[BOTTOM + j] = 0.0
        for j in range(width):
            plain[base + j] = np.nan
            plain[base + j, 10] = plain[base + j, 11] = 0.0
            plain[base + j, 12] = w[ENERGY + j]
            series[0, base + j, 0], series[1, base + j, 0] = w[NOW + j], 0.0
            series[2, base + j, 0] = 0.0
        for n in range(1, steps + 1):
            hits = 0
            for j in range(BLOCK):
                u, d = w[U + j], w[D + j]
                kick = square * (-sine(u)) + w[D_REST + j]
                ahead = d + kick
                part = ahead - d
                w[D_REST + j] = (d - (ahead - part)) + (kick - part)
                w[D + j] = ahead
                v = (d + ahead) * half_over_h
                drift = ahead + w[U_REST + j]
                ahead = u + drift
                part = ahead - u
                w[U_REST + j] = (u - (ahead - part)) + (drift - part)
                w[U + j] = ahead
                half = sine(0.5 * u)
                deviation = (0.5 * (v * v) + 2.0 * (half * half)) - w[ENERGY + j]
                size = abs(deviation)
                v_before = w[V + j]
                w[BEFORE + j], w[V_BEFORE + j] = w[NOW + j], v_before
                w[NOW + j], w[V + j], w[DEVIATION + j] = u, v, deviation
                w[U_MIN + j] = u if u < w[U_MIN + j] else w[U_MIN + j]
                w[U_MAX + j] = u if u > w[U_MAX + j] else w[U_MAX + j]
                w[V_MIN + j] = v if v < w[V_MIN + j] else w[V_MIN + j]
                w[V_MAX + j] = v if v > w[V_MAX + j] else w[V_MAX + j]
                w[LARGEST + j] = size if size > w[LARGEST + j] else w[LARGEST + j]
                hit = (
                    ((v_before >= 0.0) & (v < 0.0))
                    | ((v_before <= 0.0) & (v > 0.0))
                    | (abs(u - w[BOTTOM + j]) > 0.5 * TURN)
                )
                hits += 1 if hit else 0
            if hits:
                for j in range(width):
                    note(w, j, plain[base + j], n * h, h)
            if n % every == 0:
                for j in range(width):
                    series[0, base + j, n // every] = w[NOW + j]
                    series[1, base + j, n // every] = w[V + j]
                    series[2, base + j, n // every] = w[DEVIATION + j]
        for j in range(width):
            for k, row in enumerate((U_MIN, U_MAX, V_MIN, V_MAX, LARGEST)):
                plain[base + j, k] = w[row + j]


def exact(theta: Any, t: Any) -> tuple[Any, Any]:
    """Return the motion of pendulums released at rest: ``sin(theta/2) = k cd(t)``."""
    k, rest = np.sin(0.5 * theta)[:, None], np.cos(0.5 * theta)[:, None]
    sn, cn, dn, _ = ellipj(t, k * k)
    return 2.0 * np.arcsin(k * cn / dn), -2.0 * k * rest * sn / dn


def member_numbers(plain: Any) -> dict[str, Any]:
    """Return what one level says of each member."""
    table = dict(zip(PLAIN, plain.T, strict=True))
    gaps = np.where(table["peaks"] > 1, table["peaks"] - 1, np.nan)
    table["period"] = (table.pop("last_time") - table.pop("first_time")) / gaps
    table["amplitude"] = 0.5 * (table["last_peak"] - table["last_trough"])
    return table


def compare(theta: Any, series: list[Any], intervals: int) -> dict[str, Any]:
    """Return norms, orders, extrapolation and true errors of a chunk, by name."""
    truth = (*exact(theta, np.linspace(0.0, END, intervals + 1)), 0.0)
    found: dict[str, Any] = {"exact_period": 4.0 * ellipkm1(np.cos(0.5 * theta) ** 2)}

    def norm(values: Any) -> Any:
        return np.sqrt(END / intervals * np.einsum("it,it->i", values, values))

    for q, name in enumerate(SERIES):
        levels = [rows[q] for rows in series]
        d = [a - b for a, b in pairwise(levels)]
        difference = np.array([norm(x) for x in d])
        first = [u - x / 3.0 for u, x in zip(levels[1:], d, strict=True)]
        best = first[-1] + (first[-1] - first[-2]) / 15.0
        found[f"{name}_difference_norm"] = difference
        found[f"{name}_ratio_norm"] = difference[:-1] / difference[1:]
        found[f"{name}_observed_order"] = np.log2(found[f"{name}_ratio_norm"])
        found[f"{name}_error_norm"] = np.array([norm(truth[q] - u) for u in levels])
        found[f"{name}_richardson_bound"] = np.max(np.abs(first[-1] - first[-2]), axis=1)
        found[f"{name}_richardson_error_norm"] = norm(truth[q] - best)
        found[f"{name}_coincidence"] = np.array(
            [norm(a - 4.0 * b) / norm(a) for a, b in pairwise(d)]
        )
    return found


def chunk(theta: Any, intervals: int) -> tuple[list[Any], list[Any], dict[str, Any]]:
    """Solve and compare some members."""
    series, tables = [], []
    for level in LEVELS:
        rows = np.empty((3, len(theta), intervals + 1))
        plain = np.empty((len(theta), len(PLAIN)))
        solve(theta, 2**level, 2**level // intervals, rows, plain)
        series.append(rows)
        tables.append(member_numbers(plain))
    return series, tables, compare(theta, series, intervals)


def write(file: Any, name: str, first: int, members: int, values: Any, last: str = "") -> None:
    """Write a slice of a variable, which is made when it is first met."""
    if name not in file.variables:
        dims: tuple[str, ...] = ("case",)
        if values.ndim == 2:
            size = values.shape[1] if last else values.shape[0]
            other = last or f"n_{size}"
            if other not in file.dimensions:
                file.createDimension(other, size)
            dims = ("case", other) if last else (other, "case")
        file.createVariable(name, "f8", dims)
    count = values.shape[0] if last else values.shape[-1]
    part = slice(first, first + count)
    file[name][part if last or values.ndim == 1 else (slice(None), part)] = values


def main() -> None:
    members, intervals, threads = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[4])
    folder = Path(sys.argv[3])
    theta = np.linspace(0.1, 2.5, members)
    starts = range(0, members, CHUNK)
    names = [f"level_{level:02d}" for level in LEVELS] + ["convergence"]
    files = [netCDF4.Dataset(folder / f"{name}.nc", "w") for name in names]
    for file in files:
        file.createDimension("case", members)
    with ThreadPoolExecutor(threads) as pool:
        done = pool.map(lambda first: chunk(theta[first : first + CHUNK], intervals), starts)
        for first, (series, tables, found) in zip(starts, done, strict=True):
            for k in range(len(LEVELS)):
                for name, rows in zip(SERIES, series[k], strict=True):
                    write(files[k], name, first, members, rows, "t")
                for name, values in tables[k].items():
                    write(files[k], name, first, members, values)
            for name in ("period", "amplitude", "energy_deviation_max"):
                found[name] = np.array([table[name] for table in tables])
            for name, values in found.items():
                write(files[-1], name, first, members, values)
    for file in files:
        file.close()


if __name__ == "__main__":
    main()
