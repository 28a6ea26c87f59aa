r"""A linear structure ``M u'' + C u' + K u = p(t)``, with matrices from an experiment file or from files beside it.

M is symmetric and positive definite, K and C are symmetric. C is the sum of a given matrix, Rayleigh damping
``alpha M + beta K``, and modal damping ``sum_j 2 zeta_j w_j (M x_j)(M x_j)^T``. A load is a formula in t times a
vector. Everything is dimensionless.

The states are the observed displacements (linear combinations of degrees of freedom) and their velocities. All degrees
of freedom are stepped (`vibsim.simulation.structure`), and the energies are those of the whole structure:
``v^T M v/2`` and ``u^T K u/2``.

The exact solution is the sum of all modes (`vibsim.models.shared.matrices`). It is known if the damping does not couple
modes (``X^T C X`` is diagonal) and every load is a sum of constants and of sines and cosines of ``W t + phase``.

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
from vibsim.formula.algebra import terms_of
from vibsim.models.base import Model, Numbers, Parameter, declared_parameters
from vibsim.models.shared.coordinates import states_of, velocities_of
from vibsim.models.shared.matrices import (
    Matrix,
    Modes,
    all_modes,
    highest_frequency,
    lowest_modes,
    mode_motion,
)

MOST_DOFS = 10_000
"""Largest number of degrees of freedom."""
MOST_MODES = 128
"""Largest number of degrees of freedom for which all modes are computed."""
MOST_OBSERVED = 16
"""Largest number of observed displacements."""
UNCOUPLED = 1e-12
"""Modes count as uncoupled if the off-diagonal entries of ``X^T C X`` are below this fraction of the largest entry."""
ROUNDED = 2.0**-53 / 64.0
"""Relative rounding error of a motion in the lowest mode per unit of ``(w_max/w_min)^2``, because forces of stiff parts
cancel. [measured on beams with 32 to 512 degrees of freedom]"""
TIMES_AT_ONCE = 2**20
"""Size (modes times points of time) of the arrays that are computed at once."""

ALPHA = Parameter(
    "alpha", 0.0, "1", "Rayleigh damping by the mass", minimum=0.0, path="rayleigh.alpha"
)
BETA = Parameter(
    "beta", 0.0, "1", "Rayleigh damping by the stiffness", minimum=0.0, path="rayleigh.beta"
)
RAYLEIGH = (ALPHA, BETA)
LOAD = "load"
"""Prefix of the number of a load, in the key of its formula in `Model.written`."""
HISTORY = "history"
"""Prefix of the number of a load that is a table over time."""
_TABULATED = Name("_history")
"""Placeholder for the formula of a tabulated load; no user can write it."""


@dataclass(frozen=True)
class Structure:
    """The numbers of a structure; equal numbers make equal objects."""

    mass: Matrix
    stiffness: Matrix
    damping: Matrix | None = None
    ratios: tuple[float, ...] = ()
    """Damping ratios of the lowest modes."""
    names: tuple[str, ...] = ()
    """Names of the observed displacements."""
    observed: Floats = field(default_factory=lambda: np.eye(1), compare=False, repr=False)
    """Coefficients of the observed displacements, shape (observed, dof)."""
    start: tuple[Floats, Floats] | None = field(default=None, compare=False, repr=False)
    """Displacement and velocity at t = 0, shape (dof,); None if the initial values of the experiment file give them."""
    shapes: Floats = field(default_factory=lambda: np.empty((0, 1)), compare=False, repr=False)
    """The vector of each load, shape (load, dof)."""
    histories: tuple[tuple[int, Floats], ...] = field(default=(), compare=False, repr=False)
    """Index of each tabulated load, with times and factors, shape (2, point); linear between the points."""
    digest: str = field(init=False)
    """SHA-256 of all numbers."""

    def __post_init__(self) -> None:
        matrices = (self.mass, self.stiffness, self.damping)
        digests = [row.digest if row else "" for row in matrices]
        numbers, tables = zip(*self.histories, strict=True) if self.histories else ((), ())
        digest = hashlib.sha256(repr((digests, self.ratios, self.names, numbers)).encode())
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
        """Whether all modes are computed."""
        return self.dofs <= MOST_MODES

    @property
    def modes(self) -> Modes:
        """All modes if `has_all_modes`, otherwise the three lowest."""
        return _modes(self.mass, self.stiffness)

    @cached_property
    def own_damping(self) -> Any:
        """The matrix C without Rayleigh damping, sparse; None if it is 0."""
        matrix = self.damping.sparse if self.damping is not None else None
        if any(self.ratios):
            from scipy.sparse import csc_array

            modes, count = self.modes, len(self.ratios)
            weighted = self.mass.sparse @ modes.shapes[:, :count]
            factors = 2.0 * np.array(self.ratios) * modes.frequencies[:count]
            modal = csc_array((weighted * factors) @ weighted.T)
            matrix = modal if matrix is None else matrix + modal
        return matrix

    @cached_property
    def decays(self) -> Floats | None:
        """Half the diagonal of ``X^T C X`` without Rayleigh damping, shape (mode,); None if damping couples modes."""
        rates = np.zeros(self.dofs)
        if self.damping is not None:
            modal = self.modes.shapes.T @ (self.damping.sparse @ self.modes.shapes)
            coupling = modal - np.diag(np.diag(modal))
            if np.max(np.abs(coupling)) > UNCOUPLED * np.max(np.abs(modal), initial=0.0):
                return None
            rates += 0.5 * np.diag(modal)
        if self.ratios:
            count = len(self.ratios)
            rates[:count] += np.array(self.ratios) * self.modes.frequencies[:count]
        return rates

    def start_of(self, initial: Floats) -> tuple[Floats, Floats]:
        """Return displacement and velocity at t = 0, shape (dof,), of a member with these initial values of states."""
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
    """The load ``amplitude cos(angular t + phase)``, formulas in the parameters; a constant has frequency 0."""

    amplitude: Expression
    angular: Expression
    phase: Expression


def harmonics(load: Expression) -> tuple[Harmonic, ...] | None:
    """Return a load as a sum of constants, sines and cosines; None if it is not such a sum."""
    rows = []
    for term in terms_of(load):
        row = _harmonic(term)
        if row is None:
            return None
        rows.append(row)
    return tuple(rows)


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
    """A structure with the formulas of its loads."""

    structure: Structure
    loads: tuple[Expression, ...]
    """Formulas in t and the parameters, in the order of `Structure.shapes`."""
    parameters: tuple[Parameter, ...]
    terms: frozenset[str]
    """Names of the parameters of `RAYLEIGH` that are in the equation."""

    @property
    def formulas(self) -> tuple[Expression, ...]:
        """The loads that are formulas, not tables."""
        return tuple(load for load in self.loads if load != _TABULATED)

    @property
    def is_damped(self) -> bool:
        """Whether there is any damping."""
        structure = self.structure
        return bool(self.terms) or structure.damping is not None or any(structure.ratios)

    @property
    def is_driven(self) -> bool:
        """Whether a load varies in time."""
        return any(load == _TABULATED or "t" in load.names for load in self.loads)

    @property
    def rounding(self) -> float:
        """Predicted round-off relative to the solution, for any scheme (order of magnitude)."""
        lowest = float(self.natural_frequency({}))
        if not lowest > 0.0:
            return 0.0
        return ROUNDED * (_highest(self.structure.mass, self.structure.stiffness) / lowest) ** 2

    def named(self, parameters: Numbers, case: int) -> dict[str, float]:
        """Return the parameters of a member by their names in formulas."""
        numbers = {}
        for row in self.parameters:
            value = np.ravel(parameters[row.key])
            numbers[row.name] = float(value[case if len(value) > 1 else 0])
        return numbers

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
        """Every load as a sum of harmonic loads; None if some load is not such a sum."""
        rows = [None if load == _TABULATED else harmonics(load) for load in self.loads]
        known = [row for row in rows if row is not None]
        return tuple(known) if len(known) == len(rows) else None

    @cached_property
    def has_exact(self) -> bool:
        """Whether the exact solution is known."""
        has_modes = self.structure.has_all_modes and self.structure.decays is not None
        return has_modes and self.harmonics is not None

    def exact(self, t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
        """Return the states at times t, shape (..., n_t), by modal superposition; see `vibsim.models.Model.exact`."""
        names = self.structure.names
        columns = [np.ravel(initial[name]) for name in (*names, *velocities_of(names))]
        rows = [np.ravel(parameters[row.key]) for row in self.parameters]
        count = max(map(len, (*columns, *rows, np.atleast_2d(t))))
        times = np.broadcast_to(np.atleast_2d(t), (count, np.shape(t)[-1]))
        states = np.empty((2 * len(names), *times.shape))
        for case in range(count):
            member = np.array([x[case if len(x) > 1 else 0] for x in columns])
            named = self.named(parameters, case)
            size = max(TIMES_AT_ONCE // self.structure.dofs, 1)
            for first in range(0, times.shape[1], size):
                part = slice(first, first + size)
                states[:, case, part] = self._motion(times[case, part], member, named)
        shaped = states if np.ndim(t) > 1 or count > 1 else states[:, 0]
        return dict(zip((*names, *velocities_of(names)), shaped, strict=True))

    def _motion(self, t: Floats, initial: Floats, named: Mapping[str, float]) -> Floats:
        structure = self.structure
        modes, decays = structure.modes, structure.decays
        assert decays is not None
        assert self.harmonics is not None
        w = modes.frequencies
        d = decays + 0.5 * (named["alpha"] + named["beta"] * w * w)
        weighted = structure.mass.sparse @ modes.shapes
        start = tuple(weighted.T @ x for x in structure.start_of(initial))
        modal_loads = structure.shapes @ modes.shapes
        loads: list[tuple[Complexes, float]] = []
        for modal, rows in zip(modal_loads, self.harmonics, strict=True):
            for row in rows:
                amplitude, angular, phase = (
                    float(values(part, named)) for part in (row.amplitude, row.angular, row.phase)
                )
                loads.append((modal * amplitude * on_arrays.complex_exp(1j * phase), angular))
        q, v = mode_motion(t, w, d, (start[0], start[1]), loads)
        shapes = structure.observed @ modes.shapes
        return np.concatenate([shapes @ q, shapes @ v])

    def start(self, parameters: Numbers) -> dict[str, Any]:
        """Return the observed displacements and velocities at t = 0; see `vibsim.models.Model.start`."""
        structure = self.structure
        assert structure.start is not None
        names = structure.names, velocities_of(structure.names)
        return {
            name: float(value)
            for row, state in zip(names, structure.start, strict=True)
            for name, value in zip(row, structure.observed @ state, strict=True)
        }

    def natural_frequency(self, parameters: Numbers) -> Any:
        """Return the lowest natural frequency that is not 0; NaN if there is none."""
        frequencies = self.structure.modes.frequencies
        return frequencies[frequencies > 0.0][0] if np.any(frequencies > 0.0) else np.nan


def written(
    formulas: Mapping[str, str], declared: tuple[str, ...], structure: Structure | None = None
) -> Model:
    """Return the model of a structure, with formulas of its loads by key (``load.0``) and declared parameters.

    Tabulated loads have no formula. Without a structure the model has one degree of freedom, mass 1 and stiffness 1.

    Raises ExpressionError if a formula uses other names than t and parameters.
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
    loaded = Loaded(structure, loads, parameters, terms)
    is_conservative = not loaded.is_damped and not loaded.loads
    accelerations = tuple(Name(f"_acceleration_{i}") for i in range(len(structure.names)))
    left = ["M u''", *(["C u'"] if loaded.is_damped else []), "K u"]
    right = "p(t)" if loaded.is_driven else "p" if loaded.loads else "0"
    return Model(
        kind="structure",
        title="Linear structure",
        source="the experiment file",
        equation=f"{' + '.join(left)} = {right}, {structure.dofs} degrees of freedom",
        states=states_of(structure.names, "displacement"),
        parameters=parameters,
        # placeholders: `vibsim.simulation.structure` steps the whole structure and sums its energies
        acceleration=accelerations[0],
        further_accelerations=accelerations[1:],
        kinetic_energy=Name("_kinetic"),
        potential_energy=Name("_potential"),
        energy_unit="1",
        linear=False,
        conservative=is_conservative,
        superposed=is_conservative,
        natural_frequency=loaded.natural_frequency,
        highest_frequency=lambda _: _highest(structure.mass, structure.stiffness),
        exact=loaded.exact if loaded.has_exact else None,
        start=loaded.start if structure.start is not None else None,
        loaded=loaded,
        written=written,
        optional=tuple(row.name for row in RAYLEIGH),
        variant=partial(_structure, structure, texts, declared),
    )


STRUCTURE = replace(written({}, ()), equation="M u'' + C u' + K u = p(t), with matrices M, C, K")
"""The structure of one degree of freedom, shown with the general equation."""
