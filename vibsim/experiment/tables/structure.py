"""Assemble the matrices of a structure from an experiment and its files."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.errors import Fault, InputError
from vibsim.experiment.data import ExperimentSpec, StructureSpec
from vibsim.experiment.tables.content import TableError
from vibsim.experiment.tables.file import read_history
from vibsim.experiment.tables.matrix import read, square, vector
from vibsim.models.shared.matrices import RIGID, Matrix, factored
from vibsim.models.structure import HISTORY, LOAD, MOST_DOFS, MOST_MODES, MOST_OBSERVED, Structure

MATRICES = ("mass", "stiffness", "damping")
STARTS = ("start.displacement", "start.velocity")
SYMMETRIC = 1e-12  # tolerance of symmetry, relative to the largest entry: files are rounded
SAME_FREQUENCY = 1e-9  # relative tolerance of multiple frequencies, whose shapes may be mixed
FLAT = 1e-9  # smallest observed displacement that can scale a mode, relative to its largest entry


@dataclass
class Assembly:
    """The valid numbers of a structure, and the faults of the others."""

    spec: StructureSpec
    folder: Path
    faults: list[tuple[str, str, str]] = field(default_factory=list)
    """Dotted key in the section ``model``, broken rule, and hint."""
    structure: Structure | None = None
    unnamed: int = 0  # degrees of freedom, if too many to observe all of them; else 0
    digests: dict[str, tuple[str, str]] = field(default_factory=dict)
    """SHA-256 of the numbers of each array, and of the bytes of its file (empty without a file), by key."""

    def add(self, key: str, rule: str, hint: str = "") -> None:
        """Record a fault."""
        self.faults.append((key, rule, hint))

    def complete(self, size: int, ratio: float | None) -> None:
        """Fill in defaults: observe every degree of freedom, and give every mode the damping ratio `ratio`, if any."""
        update: dict[str, Any] = {} if ratio is None else {"ratios": (ratio,) * size}
        if not self.spec.observe:
            self.unnamed = size if size > MOST_OBSERVED else 0
            names = tuple(f"u{i}" for i in range(1, size + 1))
            each = (((i, 1.0),) for i in range(1, size + 1))
            update["observe"] = tuple(zip(names, each, strict=True))[:MOST_OBSERVED]
        self.spec = self.spec.model_copy(update=update)

    def matrices(self) -> dict[str, Matrix]:
        """Return the valid matrices."""
        found = {}
        for key in MATRICES:
            if key not in self.spec.arrays:
                continue
            try:
                matrix = square(self._array(key))
                if matrix.size > MOST_DOFS:
                    raise TableError(f"must not have more than {MOST_DOFS} rows, has {matrix.size}")
                size, i, j = matrix.asymmetry
                if size > SYMMETRIC:
                    rule = f"must be symmetric: the entries ({i + 1}, {j + 1}) and ({j + 1}, {i + 1}) differ"
                    raise TableError(f"{rule} by {size:.3g} of the largest one")
            except TableError as error:
                self.add(key, error.rule, error.hint)
            else:
                found[key] = matrix
        return found

    def _array(self, key: str) -> Any:
        """Return the numbers of an array, unchecked."""
        row = self.spec.arrays[key]
        content = ""
        if row.file is not None:
            if Path(row.file).is_absolute():
                raise TableError("must be a path relative to the folder of the experiment file")
            path = self.folder / row.file
            found, content = read_history(path, row.columns) if row.columns else read(path)
        else:
            lengths = {len(line) for line in row.rows if isinstance(line, tuple)}
            if len(lengths) > 1:
                counts = f"{min(lengths)} to {max(lengths)} numbers"
                raise TableError(f"must have rows of one length, has {counts}")
            found = np.array(row.rows, dtype=float)
        self.digests[key] = _digest(found), content
        return found

    def histories(self) -> tuple[tuple[int, Floats], ...]:
        """Return the valid load tables, each with the number of its load."""
        found = []
        for key in self.spec.arrays:
            if key.startswith(f"{HISTORY}."):
                try:
                    found.append((int(key.partition(".")[2]), self._array(key)))
                except TableError as error:
                    self.add(f"{key}.{error.key}", error.rule, error.hint)
        return tuple(found)

    def vector(self, key: str, size: int) -> Floats:
        """Return a vector of length `size`, the number of degrees of freedom; zeros if it is faulty."""
        row, found = self.spec.arrays[key], np.zeros(size)
        if row.entries:
            for dof, value in row.entries:
                if dof > size:
                    self.add(f"{key}.{dof}", f"there are {size} degrees of freedom")
                else:
                    found[dof - 1] = value
            return found
        try:
            given = vector(self._array(key))
            if len(given) != size:
                wanted = f"{size} numbers, as many as degrees of freedom"
                raise TableError(f"must have {wanted}, has {len(given)}")
        except TableError as error:
            self.add(key, error.rule, error.hint)
            return found
        return given

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """Path of each file, and the SHA-256 of its bytes."""
        rows = {key: row.file for key, row in self.spec.arrays.items() if row.file is not None}
        return tuple(dict.fromkeys((file, self.digests[key][1]) for key, file in rows.items()))


def _digest(found: Any) -> str:
    if not isinstance(found, np.ndarray):
        return Matrix.of(found).digest if found.shape[0] == found.shape[1] else ""
    array = np.ascontiguousarray(found, dtype="<f8")
    return hashlib.sha256(repr(array.shape).encode() + array.tobytes()).hexdigest()


def assemble(spec: StructureSpec, folder: Path, ratio: float | None = None) -> Assembly:
    """Read the arrays of `spec`, with paths relative to `folder`, fill in defaults, and assemble the structure.

    `ratio` is the damping ratio of all modes, if there is a single one.
    """
    from scipy.sparse import eye_array

    own = Assembly(spec, folder)
    matrices = own.matrices()
    if "stiffness" in matrices:
        own.complete(matrices["stiffness"].size, ratio)
        spec = own.spec
    if "stiffness" not in matrices or len(matrices) < len(spec.arrays.keys() & set(MATRICES)):
        return own
    stiffness = matrices["stiffness"]
    size = stiffness.size
    mass = matrices.get("mass") or Matrix.of(eye_array(size, format="csr"))
    for key, matrix in matrices.items():
        if matrix.size != size:
            rule = f"must have as many rows as the stiffness matrix, {size}, has {matrix.size}"
            own.add(key, rule)
    if own.faults:
        return own
    if factored(mass.sparse) is None:
        rule = "must be positive definite: some motion has no mass"
        own.add("mass", rule, "leave out degrees of freedom without mass (static condensation)")
        return own
    structure = Structure(mass, stiffness)
    _check_stiffness(structure, own)
    observed = np.zeros((len(spec.observe), size))
    for i, (name, entries) in enumerate(spec.observe):
        if not any(factor for _, factor in entries):
            own.add(f"observe.{name}", "must have a factor that is not 0")
        for dof, factor in entries:
            if dof > size:
                own.add(f"observe.{name}", f"there are {size} degrees of freedom, not {dof}")
            else:
                observed[i, dof - 1] = factor
    if len(spec.ratios) > (len(structure.modes.frequencies) if not own.faults else size):
        rule = f"has ratios of {len(spec.ratios)} modes, the structure has {size}"
        if size > MOST_MODES:
            rule = f"modes are computed for up to {MOST_MODES} degrees of freedom, there are {size}"
        own.add("damping_ratios", rule, "or take rayleigh" if size > MOST_MODES else "")
    elif not own.faults:
        _check_ratios(structure, spec.ratios, own)
    loads = [key for key in spec.arrays if key.startswith(f"{LOAD}.")]
    shapes = np.array([own.vector(key, size) for key in loads]).reshape(len(loads), size)
    histories = own.histories()
    start = [_started(own, key, structure, observed) for key in STARTS]
    damping = matrices.get("damping")
    if own.faults:
        return own
    own.structure = Structure(
        mass=mass,
        stiffness=stiffness,
        damping=damping if damping and damping.entries.size else None,
        ratios=spec.ratios,
        names=tuple(name for name, _ in spec.observe),
        observed=observed,
        start=None if spec.is_free else (start[0], start[1]),
        shapes=shapes,
        histories=histories,
    )
    return own


def _check_ratios(structure: Structure, ratios: Sequence[float], own: Assembly) -> None:
    """Refuse different ratios for modes of the same frequency, whose shapes are not unique."""
    if not any(ratios):
        return
    w = structure.modes.frequencies
    of_modes = np.concatenate([ratios, np.zeros(len(w) - len(ratios))])
    differ = (np.diff(w) <= SAME_FREQUENCY * w[1:]) & (np.diff(of_modes) != 0.0)
    for i in np.flatnonzero(differ).tolist():
        rule = (
            f"modes {i + 1} and {i + 2} have the same frequency, so their ratios must be the same"
        )
        own.add("damping_ratios", f"{rule}, are {of_modes[i]:g} and {of_modes[i + 1]:g}")


def _check_stiffness(structure: Structure, own: Assembly) -> None:
    """Refuse an unstable structure, and a large one with rigid body motions."""
    if structure.has_all_modes:
        if not np.isfinite(structure.modes.frequencies).all():
            rule = "must not have a negative eigenvalue: in that direction it pushes away from rest"
            hint = f"down to -{RIGID:g} of the largest eigenvalue of M^-1 K one counts as rounding"
            own.add("stiffness", rule, hint)
    elif factored(structure.stiffness.sparse) is None:
        rule = f"must be positive definite above {MOST_MODES} degrees of freedom"
        own.add("stiffness", rule, "hold the structure, so that it cannot move as a rigid body")


def _started(own: Assembly, key: str, structure: Structure, observed: Floats) -> Floats:
    """Return the displacement or the velocity at t = 0."""
    if key not in own.spec.arrays:
        return np.zeros(structure.dofs)
    row = own.spec.arrays[key]
    if row.mode is None:
        return own.vector(key, structure.dofs)
    if own.faults:
        return np.zeros(structure.dofs)
    known = structure.modes.shapes
    if row.mode > known.shape[1]:
        own.add(f"{key}.mode", f"{known.shape[1]} modes are found, there is no mode {row.mode}")
        return np.zeros(structure.dofs)
    shape = known[:, row.mode - 1]
    start = float(observed[0] @ shape)
    if abs(start) <= FLAT * float(np.max(np.abs(shape))):
        name = own.spec.observe[0][0]
        own.add(f"{key}.mode", f"{name}, which would measure its size, does not move in it")
        return np.zeros(structure.dofs)
    return shape * (row.size / start)


def with_digests(own: Assembly) -> StructureSpec:
    """Return the assembled specification with the digests of its numbers and its structure attached."""
    spec = own.spec
    assert own.structure is not None
    rows = {
        key: row.model_copy(update={"numbers": own.digests.get(key, ("", ""))[0]})
        for key, row in spec.arrays.items()
    }
    found = spec.model_copy(update={"arrays": type(spec.arrays)(rows)})
    found.hold(own.structure, own.files)
    return found


def attach(experiment: ExperimentSpec) -> None:
    """Read the numbers of a structure that was restored without them.

    Raises `InputError` if a file cannot be read, or its numbers have changed.
    """
    spec = experiment.model.structure
    assert spec is not None
    own = assemble(spec, experiment.folder)
    for key, row in spec.arrays.items():
        if row.file is not None and own.digests.get(key, ("", ""))[0] != row.numbers:
            rule = "has other numbers than when the experiment was read"
            own.add(key, rule, "run the experiment again")
    if own.faults:
        file = str(experiment.file or experiment.name)
        shown = {key: row.file or "" for key, row in spec.arrays.items()}
        raise InputError(
            Fault(file, 0, f"model.{key}", shown.get(key, ""), rule, hint)
            for key, rule, hint in own.faults
        )
    assert own.structure is not None
    spec.hold(own.structure, own.files)
