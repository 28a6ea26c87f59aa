"""Many members, one thread: the engine against C, numba and numpy by hand."""

from __future__ import annotations

import ctypes
import math
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bench import by_hand, native, ours
from bench.page import Section, table
from bench.timing import interleave, seconds

TITLE = "Many members"
ANSWER = (
    "A step of one of many members takes {0[many.ns]:.2g} ns, {0[many.ratio_stepping]:.2f} times the time of the same "
    "loop in C; numpy takes {0[many.over_numpy]:.1f} times as long."
)
END = 20.0
Runs = dict[str, Callable[[], native.Floats]]

GATHERING = "C, compensated, same sine, gathering the same"
STEPPING = "C, compensated, same sine, stepping alone"
CONTRACTED = "C, compensated, same sine, stepping alone, contracted"
INCREMENT = "C, increment, same sine, stepping alone"
NUMPY = "numpy over members, compensated, numpy's sine"


def run(small: bool) -> Section:
    """Time all of them in turn; those that are ten times slower in fewer rounds."""
    members, level, rounds = (256, 9, 3) if small else (4096, 12, 9)
    theta, steps = np.linspace(0.1, 2.5, members), 2**level
    quick, slow = engine_runs(theta, steps), hand_runs(theta, steps)
    notes: list[str] = []
    reasons: list[list[object]] = []
    with tempfile.TemporaryDirectory() as folder:
        try:
            found, vector, notes = c_runs(Path(folder), theta, steps)
        except native.NotHereError as error:
            reasons = [["C", f"not measured: {error}", None, None]]
        else:
            check({**quick, **found})
            quick |= found | vector
        timed = interleave({name: seconds(go) for name, go in quick.items()}, rounds)
        timed |= interleave({name: seconds(go) for name, go in slow.items()}, max(3, rounds // 3))
    work = members * steps
    stepping, gathering = (timed.get(name, math.nan) for name in (STEPPING, GATHERING))
    rows: list[list[object]] = [
        [name, time / work * 1e9, time / stepping, time / gathering] for name, time in timed.items()
    ]
    caption = (
        f"{members} pendulums, theta_0 from 0.1 to 2.5, level {level} ({steps} steps), one thread, {rounds} rounds "
        f"({max(3, rounds // 3)} of numpy and the library's sine). The engine and strict C end with the same bits. "
        f"{' '.join(notes)}"
    )
    header = ["loop", "ns per member-step", "ratio to C stepping alone", "ratio to C gathering"]
    figures = {
        "many.ratio_gathering": timed["engine, compensated"] / gathering,
        "many.ratio_stepping": timed["engine, compensated, stepping alone"] / stepping,
        "many.ratio_increment": timed["engine, increment, stepping alone"]
        / timed.get(INCREMENT, math.nan),
        "many.over_numpy": timed[NUMPY] / timed["engine, compensated, stepping alone"],
        "many.ns": timed["engine, compensated, stepping alone"] / work * 1e9,
        "many.ns_gathering": timed["engine, compensated"] / work * 1e9,
    }
    return Section(tuple(table(caption, header, [*rows, *reasons])), figures)


def engine_runs(theta: native.Floats, steps: int) -> Runs:
    """Return the engine in the arithmetic of the loops in C, gathering and not."""

    def go(arithmetic: str, gather: bool) -> native.Floats:
        return ours.step(theta, END, steps, arithmetic=arithmetic, gather=gather).position[:, -1]

    return {
        f"engine, {name}{'' if gather else ', stepping alone'}": lambda n=name, g=gather: go(n, g)  # type: ignore[misc]
        for name, gather in (
            ("compensated", True),
            ("compensated", False),
            ("increment", False),
            ("three_term", False),
        )
    }


def hand_runs(theta: native.Floats, steps: int) -> Runs:
    """Return what is slower by far."""
    h = END / steps
    out = np.empty_like(theta)

    def scalar() -> native.Floats:
        by_hand.three_term(theta, 1.0, h, steps, out)
        return out

    return {
        "numba by hand, one by one, three-term, library's sine": scalar,
        NUMPY: lambda: by_hand.over_members(theta, 1.0, h, steps),
        "numpy over members, three-term, numpy's sine": lambda: by_hand.three_term_over_members(
            theta, 1.0, h, steps
        ),
    }


def c_runs(folder: Path, theta: native.Floats, steps: int) -> tuple[Runs, Runs, list[str]]:
    """Return the strict loops in C, those with another sine or contraction, and what is to be said of them."""
    out, many = np.empty_like(theta), np.empty((20, len(theta)))
    h, members = END / steps, len(theta)

    def loop(library: ctypes.CDLL, name: str) -> Callable[[], native.Floats]:
        def go() -> native.Floats:
            native.call(library, name, members, theta, 1.0, 1.0, h, steps, out)
            return out

        return go

    def gathering(library: ctypes.CDLL) -> Callable[[], native.Floats]:
        def go() -> native.Floats:
            native.call(library, "everything", members, theta, 1.0, 1.0, 1.0, h, steps, many)
            return np.asarray(many[0])

        return go

    library, width = faster(folder, loop, gathering)
    contracted = native.build("many", folder, (*native.CONTRACTED, *width))
    strict: Runs = {
        STEPPING: loop(library, "compensated"),
        GATHERING: gathering(library),
        INCREMENT: loop(library, "increment"),
    }
    others: Runs = {
        CONTRACTED: loop(contracted, "compensated"),
        "C, compensated, same sine, gathering the same, contracted": gathering(contracted),
        "C, three-term, libm's sine, one by one": loop(library, "three_term_libm"),
        "numba by hand, members inside, compensated, same sine": numba_loop(theta, steps, False),
        "numba by hand, the same, contracted": numba_loop(theta, steps, True),
    }
    notes = [f"C is built with `{' '.join((*native.STRICT, *width))}`, the faster of two widths."]
    try:
        vector = native.build("many", folder, (*native.LIBMVEC, *width), "mvec")
        others["C, three-term, libmvec's sine"] = loop(vector, "three_term_libmvec")
    except native.NotHereError as error:
        notes.append(f"C with libmvec: not measured: {error}.")
    return strict, others, notes


def numba_loop(theta: native.Floats, steps: int, contract: bool) -> Callable[[], native.Floats]:
    """Return the loop over blocks by hand."""
    out, compiled = np.empty_like(theta), by_hand.simd(contract)

    def go() -> native.Floats:
        compiled(theta, 1.0, END / steps, steps, out)
        return out

    return go


def faster(
    folder: Path,
    loop: Callable[[ctypes.CDLL, str], Callable[[], native.Floats]],
    gathering: Callable[[ctypes.CDLL], Callable[[], native.Floats]],
) -> tuple[ctypes.CDLL, tuple[str, ...]]:
    """Build with the compiler's own vector width and with 512 bits; take what is faster, gathering and not together."""
    widths: dict[tuple[str, ...], ctypes.CDLL] = {}
    for width in ((), ("-mprefer-vector-width=512",)):
        widths[width] = native.build("many", folder, (*native.STRICT, *width))

    def both(library: ctypes.CDLL) -> Callable[[], float]:
        stepping, all_ = loop(library, "compensated"), gathering(library)
        return seconds(lambda: (stepping(), all_()))

    times = interleave({" ".join(width): both(library) for width, library in widths.items()}, 5)
    best = min(widths, key=lambda width: times[" ".join(width)])
    return widths[best], best


def check(runs: Runs) -> None:
    """Refuse to compare different arithmetic."""
    for ours_, theirs in (
        ("engine, compensated", GATHERING),
        ("engine, compensated, stepping alone", STEPPING),
        ("engine, increment, stepping alone", INCREMENT),
    ):
        a, b = runs[ours_]().copy(), runs[theirs]().copy()
        if not np.array_equal(a, b):
            worst = np.max(np.abs(a - b))
            raise RuntimeError(f"not the same arithmetic: {ours_} and {theirs} differ by {worst}")
