r"""A linear structure ``M u'' + C u' + K u = p(t)``, with matrices from an experiment file or from files beside it.

M is symmetric and positive definite, K and C symmetric. C is the sum of a matrix of its own, Rayleigh damping
``alpha M + beta K``, and damping ratios of modes, ``sum_j 2 zeta_j w_j (M x_j)(M x_j)'``. Loads are formulas in t, each
times a vector. Everything is dimensionless.

Its states are what is observed: displacements of single degrees of freedom, or sums of them with factors, and their
velocities. All degrees of freedom are stepped (`vibsim.simulation.structure`), and the energies are those of the whole
structure: ``u'' M u''/2`` with the velocity, and ``u' K u/2``.

The exact solution is the sum of all modes (`vibsim.models.shared.matrices`), where the damping does not couple modes
(``X' C X`` is diagonal) and every load is a sum of constants and of sines and cosines of ``W t + phase``.

Source: R. W. Clough and J. Penzien, Dynamics of Structures, chapters 11 to 13.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

from vibsim.core.array_types import Complexes, Floats
from vibsim.elementary import on_arrays
from vibsim.formula import (
    ONE,
    ZERO,
    Binary,
    Call,
    Expression,
    Name,
    Negate,
    derivative,
    parse,
    put,
    values,
)
from vibsim.models.base import Model, Numbers, Parameter, declared_parameters
from vibsim.models.shared.matrices import (
    Matrix,
    Modes,
    all_modes,
    highest_frequency,
    lowest_modes,
    mode_motion,
)
from vibsim.models.system import states_of, terms_of, velocities_of

MOST_DOFS = 10_000
"""Degrees of freedom, at most."""
MOST_MODES = 128
"""Degrees of freedom up to which all modes are found."""
MOST_OBSERVED = 16
"""Displacements that are observed, at most."""
UNCOUPLED = 1e-12
"""Modes are not coupled by damping where the other entries of ``X' C X`` are below this part of the largest one."""
ROUNDED = 2.0**-53 / 64.0
"""Relative error that rounding leaves of a motion in its lowest mode, for each unit of ``(w_max/w_min)^2``: forces of
stiff parts cancel. [measured, of beams of 32 to 512 degrees of freedom]"""
TIMES_AT_ONCE = 2**20
"""Modes times times that are worked on at once."""

ALPHA = Parameter(
    "alpha", 0.0, "1", "Rayleigh damping by the mass", minimum=0.0, path="rayleigh.alpha"
)
BETA = Parameter(
    "beta", 0.0, "1", "Rayleigh damping by the stiffness", minimum=0.0, path="rayleigh.beta"
)
RAYLEIGH = (ALPHA, BETA)
LOAD = "load"
"""Before the number of a load: the key of its formula in `Model.written`."""
HISTORY = "history"
"""Before the number of a load that a table gives over time."""
_TABULATED = Name("_history")
"""The formula of such a load; no user can write it."""


@dataclass(frozen=True)
class Structure:
    """What a file says of a structure in numbers; two of the same numbers are equal."""

    mass: Matrix
    stiffness: Matrix
    damping: Matrix | None = None
    ratios: tuple[float, ...] = ()
    """Damping ratios of the lowest modes."""
    names: tuple[str, ...] = ()
    """Of the observed displacements."""
    observed: Floats = field(default_factory=lambda: np.eye(1), compare=False, repr=False)
    """Factors of all degrees of freedom in each of them, shape (observed, dof)."""
    start: tuple[Floats, Floats] | None = field(default=None, compare=False, repr=False)
    """Displacement and velocity at t = 0, shape (dof,); None where they are the initial values of a file."""
    shapes: Floats = field(default_factory=lambda: np.empty((0, 1)), compare=False, repr=False)
    """The vector of each load, shape (load, dof)."""
    histories: tuple[tuple[int, Floats], ...] = field(default=(), compare=False, repr=False)
    """Numbers of loads that are tables, and their times and factors, shape (2, point), straight between points."""
    digest: str = field(init=False)
    """SHA-256 of all numbers."""

    def __post_init__(self) -> None:
        matrices = (self.mass, self.stiffness, self.damping)
        own = [row.digest if row else "" for row in matrices]
        numbers, tables = zip(*self.histories, strict=True) if self.histories else ((), ())
        digest = hashlib.sha256(repr((own, self.ratios, self.names, numbers)).encode())
        for array in (self.observed, *(self.start or ()), self.shapes, *tables):
            digest.update(repr(array.shape).encode())
            digest.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
        object.__setattr__(self, "digest", f"{digest.hexdigest()}{self.start is None}")

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom."""
        return self.mass.size

    @property
    def has_all_modes(self) -> bool:
        """Whether all modes are found."""
        return self.dofs <= MOST_MODES

    @property
    def modes(self) -> Modes:
        """Every mode, up to `MOST_MODES` degrees of freedom; of more, the three lowest ones."""
        return _modes(self.mass, self.stiffness)

    @cached_property
    def own_damping(self) -> Any:
        """The matrix C without the Rayleigh damping, sparse; None where there is none."""
        found = self.damping.sparse if self.damping is not None else None
        if any(self.ratios):
            from scipy.sparse import csc_array

            modes, count = self.modes, len(self.ratios)
            sides = self.mass.sparse @ modes.shapes[:, :count]
            middle = 2.0 * np.array(self.ratios) * modes.frequencies[:count]
            by_modes = csc_array((sides * middle) @ sides.T)
            found = by_modes if found is None else found + by_modes
        return found

    @cached_property
    def decays(self) -> Floats | None:
        """Half the diagonal of ``X' C X`` without Rayleigh damping, shape (mode,); None where modes are coupled."""
        found = np.zeros(self.dofs)
        if self.damping is not None:
            between = self.modes.shapes.T @ (self.damping.sparse @ self.modes.shapes)
            coupling = between - np.diag(np.diag(between))
            if np.max(np.abs(coupling)) > UNCOUPLED * np.max(np.abs(between), initial=0.0):
                return None
            found += 0.5 * np.diag(between)
        if self.ratios:
            count = len(self.ratios)
            found[:count] += np.array(self.ratios) * self.modes.frequencies[:count]
        return found

    def start_of(self, initial: Floats) -> tuple[Floats, Floats]:
        """Return displacement and velocity at t = 0 of a member with these initial values of all states."""
        count = len(self.names)
        return self.start or (initial[:count], initial[count:])


@cache
def _modes(mass: Matrix, stiffness: Matrix) -> Modes:
    if mass.size <= MOST_MODES:
        return all_modes(mass.dense, stiffness.dense)
    return lowest_modes(mass.sparse, stiffness.sparse, 3)


@cache
def _highest(mass: Matrix, stiffness: Matrix) -> float:
    if mass.size <= MOST_MODES:
        return float(_modes(mass, stiffness).frequencies[-1])
    return highest_frequency(mass.sparse, stiffness.sparse)


@dataclass(frozen=True)
class Harmonic:
    """The load ``amplitude cos(angular t + phase)``, each in the parameters; a constant has the frequency 0."""

    amplitude: Expression
    angular: Expression
    phase: Expression


def harmonics(load: Expression) -> tuple[Harmonic, ...] | None:
    """Return a load as a sum of constants, sines and cosines; None where it is no such sum."""
    found = []
    for term in terms_of(load):
        row = _harmonic(term)
        if row is None:
            return None
        found.append(row)
    return tuple(found)


def _harmonic(term: Expression) -> Harmonic | None:
    if "t" not in term.names:
        return Harmonic(term, ZERO, ZERO)
    match term:
        case Negate(operand):
            inner, factor = _harmonic(operand), parse("-1", ())
        case Binary("*", left, right) if "t" not in left.names:
            inner, factor = _harmonic(right), left
        case Binary("*", left, right) if "t" not in right.names:
            inner, factor = _harmonic(left), right
        case Binary("/", left, right) if "t" not in right.names:
            inner, factor = _harmonic(left), ONE / right
        case Call("cos" | "sin" as name, (angle,)):
            angular = derivative(angle, "t")
            if "t" in angular.names:
                return None
            phase = put(angle, "t", ZERO)
            if name == "sin":
                phase = Binary("-", phase, parse("pi/2", ()))
            return Harmonic(ONE, angular, phase)
        case _:
            return None
    if inner is None:
        return None
    return replace(inner, amplitude=factor * inner.amplitude)


@dataclass(frozen=True)
class Loaded:
    """A structure with the formulas of its loads: what the model is made of."""

    structure: Structure
    loads: tuple[Expression, ...]
    """In t and the parameters, in the order of `Structure.shapes`."""
    parameters: tuple[Parameter, ...]
    terms: frozenset[str]
    """Names of the parameters of `RAYLEIGH` that are in the equation."""

    @property
    def formulas(self) -> tuple[Expression, ...]:
        """The loads that are no tables."""
        return tuple(load for load in self.loads if load != _TABULATED)

    @property
    def is_damped(self) -> bool:
        """Whether anything damps the motion."""
        own = self.structure
        return bool(self.terms) or own.damping is not None or any(own.ratios)

    @property
    def is_driven(self) -> bool:
        """Whether a load varies in time."""
        return any(load == _TABULATED or "t" in load.names for load in self.loads)

    @property
    def rounding(self) -> float:
        """Predicted round-off relative to the solution, whatever the scheme (order of magnitude)."""
        own = self.structure
        lowest = float(self.natural_frequency({}))
        return ROUNDED * (_highest(own.mass, own.stiffness) / lowest) ** 2 if lowest > 0.0 else 0.0

    def named(self, parameters: Numbers, case: int) -> dict[str, float]:
        """Return the parameters of a member by the names that formulas have for them."""
        found = {}
        for row in self.parameters:
            value = np.ravel(parameters[row.key])
            found[row.name] = float(value[case if len(value) > 1 else 0])
        return found

    def forces(self, t: Floats, named: Mapping[str, float]) -> Floats:
        """Return the value of every load at times t, shape (load, time)."""
        numbers, tables = {**named, "t": t}, dict(self.structure.histories)
        rows = [
            np.interp(t, *tables[i])
            if i in tables
            else np.broadcast_to(values(load, numbers), t.shape)
            for i, load in enumerate(self.loads)
        ]
        return np.stack(rows) if rows else np.empty((0, *t.shape))

    @cached_property
    def harmonics(self) -> tuple[tuple[Harmonic, ...], ...] | None:
        """Every load as a sum of harmonic ones; None where one is no such sum."""
        rows = [None if load == _TABULATED else harmonics(load) for load in self.loads]
        known = [row for row in rows if row is not None]
        return tuple(known) if len(known) == len(rows) else None

    @cached_property
    def has_exact(self) -> bool:
        """Whether the exact solution is known."""
        own = self.structure
        return own.has_all_modes and own.decays is not None and self.harmonics is not None

    def exact(self, t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
        """Return the states at times t, shape (..., n_t), by all modes; see `vibsim.models.Model.exact`."""
        own, names = self.structure, self.structure.names
        columns = [np.ravel(initial[name]) for name in (*names, *velocities_of(names))]
        rows = [np.ravel(parameters[row.key]) for row in self.parameters]
        count = max(map(len, (*columns, *rows, np.atleast_2d(t))))
        times_of = np.broadcast_to(np.atleast_2d(t), (count, np.shape(t)[-1]))
        found = np.empty((2 * len(names), *times_of.shape))
        for case in range(count):
            member = np.array([x[case if len(x) > 1 else 0] for x in columns])
            named = self.named(parameters, case)
            size = max(TIMES_AT_ONCE // own.dofs, 1)
            for first in range(0, times_of.shape[1], size):
                part = slice(first, first + size)
                found[:, case, part] = self._motion(times_of[case, part], member, named)
        shaped = found if np.ndim(t) > 1 or count > 1 else found[:, 0]
        return dict(zip((*names, *velocities_of(names)), shaped, strict=True))

    def _motion(self, t: Floats, initial: Floats, named: Mapping[str, float]) -> Floats:
        own = self.structure
        modes, decays = own.modes, own.decays
        assert decays is not None
        assert self.harmonics is not None
        w = modes.frequencies
        d = decays + 0.5 * (named["alpha"] + named["beta"] * w * w)
        weighed = own.mass.sparse @ modes.shapes
        start = tuple(weighed.T @ x for x in own.start_of(initial))
        pushes = own.shapes @ modes.shapes
        loads: list[tuple[Complexes, float]] = []
        for push, rows in zip(pushes, self.harmonics, strict=True):
            for row in rows:
                amplitude, angular, phase = (
                    float(values(part, named)) for part in (row.amplitude, row.angular, row.phase)
                )
                loads.append((push * amplitude * on_arrays.complex_exp(1j * phase), angular))
        q, v = mode_motion(t, w, d, (start[0], start[1]), loads)
        shapes = own.observed @ modes.shapes
        return np.concatenate([shapes @ q, shapes @ v])

    def start(self, parameters: Numbers) -> dict[str, Any]:
        """Return the observed displacements and velocities at t = 0; see `vibsim.models.Model.start`."""
        own = self.structure
        assert own.start is not None
        names = own.names, velocities_of(own.names)
        return {
            name: float(value)
            for row, state in zip(names, own.start, strict=True)
            for name, value in zip(row, own.observed @ state, strict=True)
        }

    def natural_frequency(self, parameters: Numbers) -> Any:
        """Return the lowest natural frequency that is not 0; NaN where there is none."""
        found = self.structure.modes.frequencies
        return found[found > 0.0][0] if np.any(found > 0.0) else np.nan


def written(
    formulas: Mapping[str, str], declared: tuple[str, ...], structure: Structure | None = None
) -> Model:
    """Return the model of a structure under loads, ``load.0`` the formula of the first one, with declared parameters.

    A load that is a table of the structure has no formula. Without a structure it has one degree of freedom, with the
    mass and the stiffness 1.

    ExpressionError where a formula names something else than t and parameters.
    """
    if structure is None:
        one = Matrix.of(np.eye(1))
        structure = Structure(one, one, names=("u1",))
    texts = tuple(formulas.get(f"{LOAD}.{i}", "") for i in range(len(structure.shapes)))
    return _structure(structure, texts, declared, frozenset())


@cache
def _structure(
    structure: Structure, texts: tuple[str, ...], declared: tuple[str, ...], terms: frozenset[str]
) -> Model:
    parameters = (*RAYLEIGH, *declared_parameters(declared))
    known = ("t", *(row.name for row in parameters))
    loads = tuple(parse(text, known) if text else _TABULATED for text in texts)
    own = Loaded(structure, loads, parameters, terms)
    is_conservative = not own.is_damped and not own.loads
    accelerations = tuple(Name(f"_acceleration_{i}") for i in range(len(structure.names)))
    sides = ["M u''", *(["C u'"] if own.is_damped else []), "K u"]
    right = "p(t)" if own.is_driven else "p" if own.loads else "0"
    return Model(
        kind="structure",
        title="Linear structure",
        source="the experiment file",
        equation=f"{' + '.join(sides)} = {right}, {structure.dofs} degrees of freedom",
        states=states_of(structure.names, "displacement"),
        parameters=parameters,
        # of the whole structure, known to those alone who step it
        acceleration=accelerations[0],
        further_accelerations=accelerations[1:],
        kinetic_energy=Name("_kinetic"),
        potential_energy=Name("_potential"),
        energy_unit="1",
        linear=False,
        conservative=is_conservative,
        superposed=is_conservative,
        natural_frequency=own.natural_frequency,
        highest_frequency=lambda _: _highest(structure.mass, structure.stiffness),
        exact=own.exact if own.has_exact else None,
        start=own.start if structure.start is not None else None,
        loaded=own,
        written=written,
        optional=tuple(row.name for row in RAYLEIGH),
        variant=partial(_structure, structure, texts, declared),
    )


STRUCTURE = replace(written({}, ()), equation="M u'' + C u' + K u = p(t), with matrices M, C, K")
"""The structure of one degree of freedom, under the equation of all."""
