r"""A reference solution to about twelve digits, for models whose exact solution is not known.

Collocation (`vibsim.simulation.reference.collocation`) with the step halved until two solutions agree. Smooth forces
take equal steps; forces with corners or jumps are smooth in between, and each of these pieces has its own equal steps
(`vibsim.simulation.reference.piecewise_collocation`). The solver shares no arithmetic with the schemes and their
kernels: formulas are evaluated by numpy. The difference of the last two solutions bounds the error of the last one.

The jobs of an experiment's levels share references through the private cache. An entry is named by the digest of
everything that its numbers depend on; a damaged or missing entry is computed again.
"""

from __future__ import annotations

import hashlib
import io
import platform
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cache, lru_cache, partial
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core import private_cache
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.formula import to_statements
from vibsim.models.base import Model, tree, varies_in_time
from vibsim.plan.code_digest import of_folder
from vibsim.plan.versions import versions
from vibsim.simulation.members import Members
from vibsim.simulation.reference.collocation import Pieces, Solved, of_members, solve
from vibsim.simulation.reference.one_sided_forces import Sides, pulses_of_force, sides
from vibsim.simulation.reference.piecewise_collocation import ENDLESS, SLIDING, walk_pieces

METHOD = "collocation at 12 Gauss points of a step, halved until two solutions agree"
PIECEWISE = f"{METHOD}; a step ends at every corner of the force"
FEWEST_STEPS, MOST_STEPS = 8, 2**11
"""Range of the number of steps over the whole interval; with corners, of the steps that a smooth motion would have."""
COMPARED_TIMES = 5 * 64
"""Number of equally spaced times, beside t = 0, at which two solutions are compared: four of five are inside a step,
where the order of its polynomial is lower than at the end."""
ACCURATE = 1e-12
"""Largest bound of the error of an accepted solution, relative to its largest value."""
BEST_AGREEMENT = 2e-14
"""Relative difference below which halving the step gains nothing."""
SLOW = 32.0
"""A smooth, resolved motion gains far more than this factor by halving the step; one that does not is given up."""
RESOLVED = 1e-3
"""Relative difference below which steps count as resolving the motion."""
LOOKS = 8
"""Number of equal parts of a step, between whose ends the force must not have a pulse."""
ROUNDING_BOUND = 16.0 * 2.0**-52
"""Relative bound of the rounding errors, apart from a part that grows with the root of the number of steps."""

Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class Chosen:
    """The accepted solutions."""

    parts: tuple[tuple[Integers, Solved | Pieces], ...]
    """Indices of members, and their solution."""
    bounds: Floats
    """Bounds of the errors, NaN without a solution, shape (state, case)."""


def method(model: Model) -> str:
    """Return a description of how the reference of a model is computed."""
    return PIECEWISE if sides(model, {}).switches else METHOD


def reference(
    model: Model, group: Members, fraction: Floats
) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Return the states at fractions of the end time, shape (case, time), and bounds of their errors, shape (case,).

    NaN if the accuracy is not reached: for motions that are too sensitive, that are not smooth between the corners of
    their force, or that a force holds at a jump.
    """
    names = [state.name for state in model.states]
    parameters = (group.parameters[row.key] for row in model.parameters)
    columns = (*(group.initial[name] for name in names), group.end, *parameters)
    numbers = tuple(np.ascontiguousarray(column, dtype=float).tobytes() for column in columns)
    chosen = choose(model, numbers)
    series = np.full((len(names), len(group.end), len(fraction)), np.nan)
    for members, solved in chosen.parts:
        series[:, members] = solved.at(fraction)
    return dict(zip(names, series, strict=True)), dict(zip(names, chosen.bounds, strict=True))


@lru_cache(maxsize=8)
def choose(model: Model, numbers: tuple[bytes, ...]) -> Chosen:
    """Return the accepted solutions, computed or from the cache.

    Parameters
    ----------
    numbers
        The initial values, the end times and the parameters of all members, in the order of the model.
    """
    arrays = cached(digest_of(model, numbers), lambda: _arrays(computed(model, numbers)))
    count = sum(name.startswith("members_") for name in arrays)
    parts = []
    for i in range(count):
        kind = Pieces if f"begin_{i}" in arrays else Solved
        solved = kind(**{field.name: arrays[f"{field.name}_{i}"] for field in fields(kind)})
        parts.append((arrays[f"members_{i}"], solved))
    return Chosen(tuple(parts), arrays["bounds"])


def _arrays(chosen: Chosen) -> Arrays:
    """Return the arrays of solutions by name."""
    arrays: dict[str, NDArray[Any]] = {"bounds": chosen.bounds}
    for i, (members, solved) in enumerate(chosen.parts):
        arrays[f"members_{i}"] = members
        arrays |= {f"{row.name}_{i}": getattr(solved, row.name) for row in fields(solved)}
    return arrays


def cached(digest: str, compute: Callable[[], Arrays]) -> Arrays:
    """Return the arrays of an entry of the cache, or compute and store them."""

    def dump(arrays: Arrays) -> bytes | None:
        # no copy of arrays that are too large to be stored
        if sum(array.nbytes for array in arrays.values()) > private_cache.MOST_OF_ENTRY:
            return None
        buffer = io.BytesIO()
        np.savez(buffer, allow_pickle=False, **arrays)
        return buffer.getvalue()

    def load(content: bytes) -> Arrays:
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            return dict(arrays)

    return private_cache.cached("references", digest, compute, dump, load)


def digest_of(model: Model, numbers: tuple[bytes, ...]) -> str:
    """Return the digest of everything that a reference depends on, with `numbers` as for `choose`."""
    names = [row.name for row in model.states], [row.name for row in model.parameters]
    formulas = dict(
        zip(model.velocities, map(partial(tree, model), model.accelerations), strict=True)
    )
    parts = [*_surroundings(), *numbers]
    if model.lookup is not None:
        formulas["place"] = tree(model, model.lookup.place)
        parts.append(model.lookup.table.digest.encode())
    parts.append(repr((names, to_statements(formulas))).encode())
    digest = hashlib.sha256()
    for part in parts:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.hexdigest()


@cache
def _surroundings() -> tuple[bytes, ...]:
    """Return the code that computes references, and the versions of libraries with the features of the processor."""
    # numpy selects its functions by these features
    features = import_module("numpy._core._multiarray_umath").__cpu_features__
    available = sorted(name for name, has in features.items() if has)
    libraries = sorted(versions(("numpy", "scipy")).items())
    code = "".join(of_folder(f"vibsim.{room}") for room in ("formula", "models", "simulation"))
    return code.encode(), repr((libraries, platform.machine(), available)).encode()


def computed(model: Model, numbers: tuple[bytes, ...]) -> Chosen:
    """Compute the solutions; see `choose`."""
    states = len(model.states)
    columns = [np.frombuffer(column) for column in numbers]
    start, end, parameters = np.array(columns[:states]), columns[states], columns[states + 1 :]
    names = [row.name for row in model.parameters]
    held = sides(model, dict(zip(names, parameters, strict=True)))
    with np.errstate(all="ignore"):
        return _accepted(_Refined(held, start, end))


@dataclass
class _Refined:
    """A sequence of solutions of members, each with half the step of the previous one."""

    held: Sides
    start: Floats
    end: Floats
    plan: Floats | None = None
    """Pieces of the previous solution (`walk_pieces`)."""
    slid: Flags | None = None
    """Members that a force held at a jump in the previous solution, shape (case,)."""

    def next(self, steps: int) -> tuple[Solved | Pieces, Flags]:
        """Return the next solution, and which members to give up."""
        none = np.zeros(len(self.end), dtype=bool)
        if not self.held.switches:
            force = self.held.force(np.empty((0, len(self.end))))
            return solve(force, self.start, self.end, steps), none
        solution, self.plan, why = walk_pieces(
            self.held, self.start, self.end, self.end / steps, self.plan
        )
        before, self.slid = self.slid, why == SLIDING
        # steps that are too long may slide once by mistake
        return solution, (why == ENDLESS) | (none if before is None else self.slid & before)

    def missed(self, solution: Solved | Pieces, members: Flags) -> Floats:
        """Return the duration of a pulse of the force in time that the steps of `members` miss, shape (case,).

        Two solutions may agree without it. 0 if there is none, and for other members.
        """
        model, missed = self.held.model, np.zeros(len(members))
        if not (members.any() and varies_in_time(model)):
            return missed
        solved = of_members(solution, members)
        begin, length = solved.begin.T, solved.length.T
        t = (begin[..., None] + length[..., None] * (np.arange(LOOKS) / LOOKS)).reshape(
            len(begin), -1
        )
        t = np.append(t, np.full((len(t), 1), np.nan), axis=1)
        parameters = {name: x[members] for name, x in self.held.parameters.items()}
        states = np.moveaxis(np.concatenate([solved.position, solved.velocity], axis=1), 0, -1)
        states = np.repeat(states, LOOKS, axis=-1)
        pulses = pulses_of_force(model, parameters, states, t, smooth=True)
        missed[members] = np.nan_to_num(pulses.width)
        return missed

    def keep(self, members: Flags) -> None:
        """Continue with these members only."""
        self.held, self.start = self.held.of(members), self.start[:, members]
        self.end = self.end[members]
        self.plan = None if self.plan is None else self.plan[..., members]
        self.slid = None if self.slid is None else self.slid[members]


def _accepted(refined: _Refined) -> Chosen:
    """Refine until two solutions agree, separately for each member."""
    bounds = np.full((len(refined.start), len(refined.end)), np.nan)
    times = np.arange(COMPARED_TIMES + 1) / COMPARED_TIMES
    left, accepted = np.arange(len(refined.end)), []
    before, gap, slow = None, np.full(len(left), np.inf), np.zeros(len(left), dtype=np.int64)
    steps = FEWEST_STEPS
    while steps <= MOST_STEPS and len(left):
        solved, is_given_up = refined.next(steps)
        now, goes_on = solved.at(times), ~is_given_up
        if before is not None:
            size = np.max(np.abs(now), axis=-1)
            error = np.max(np.abs(now - before), axis=-1)
            relative = np.max(error / np.where(size > 0.0, size, 1.0), axis=0)
            gain = gap / relative
            slow = np.where((gain < SLOW) & (relative < RESOLVED), slow + 1, 0)
            n_steps = np.sum(np.isfinite(solved.length), axis=0, dtype=float)
            rounding = ROUNDING_BOUND * (1.0 + 0.25 * n_steps**0.5)
            settled = relative <= np.maximum(rounding, BEST_AGREEMENT)
            is_accepted = settled | ((relative <= ACCURATE) & (gain < SLOW))
            missed = refined.missed(solved, is_accepted)
            is_accepted &= missed == 0.0
            # give up if no steps will be short enough for the pulse
            goes_on &= ~((missed > 0.0) & (missed * MOST_STEPS < refined.end))
            if is_accepted.any():
                accepted.append((left[is_accepted], of_members(solved, is_accepted)))
                bounds[:, left[is_accepted]] = (error + rounding * size)[:, is_accepted]
            goes_on &= ~is_accepted & (slow < 2)
            gap = relative
        refined.keep(goes_on)
        before, left, gap, slow = now[:, goes_on], left[goes_on], gap[goes_on], slow[goes_on]
        steps *= 2
    return Chosen(tuple(accepted), bounds)
