"""What pages read: the record of an experiment, and in it the ladder of one quantity of one member.

Slices are selected by dimension name, so the same call reads variables that lack a dimension (an exact solution does
not depend on the scheme).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.roundoff_floor import norm_of_floor
from vibsim.checks.number_units import unit_of
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import MEMBER, OF_LEVEL, TYPICAL_NORM
from vibsim.models import Model
from vibsim.report import words
from vibsim.report.style import MANY, finite, label
from vibsim.report.types import Experiment, ValueCheck
from vibsim.simulation.scaled import has_time_unit

ABOVE_FLOOR = 3.0  # a difference above this multiple of the predicted floor is not round-off
_STEM_LENGTH = 40  # most characters of a scheme's name in a file name


@dataclass(frozen=True)
class Member:
    """One scheme and one member of the sweep, with the names that a page shows."""

    scheme: int
    case: int
    scheme_name: str
    case_name: str = ""  # empty without a sweep
    role: str = ""  # why it is shown: ``worst``, ``typical``, or empty

    @property
    def place(self) -> tuple[int, int]:
        """Its position in arrays of the shape (scheme, case)."""
        return self.scheme, self.case

    @property
    def title(self) -> str:
        """Name of the scheme and, in a sweep, of the member, as a page shows them."""
        return f"{self.scheme_name}, {self.case_words}" if self.case_name else self.scheme_name

    @property
    def case_words(self) -> str:
        """Name of the member, as a page shows it; empty without a sweep."""
        return words.swept(self.case_name)

    @property
    def stem(self) -> str:
        """ASCII name for files, unique by the scheme's number, within the 255 bytes of file systems."""
        name = self.scheme_name[:_STEM_LENGTH]
        plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
        return f"{self.scheme}_{plain}_{self.role}" if self.role else f"{self.scheme}_{plain}"


@dataclass(frozen=True)
class Results(Record):
    """The record of an experiment, with its members, its slices and its units as pages show them."""

    experiment: Experiment = field(kw_only=True)

    @classmethod
    def of(cls, experiment: Experiment, record: Record) -> Results:
        """Return a record of an experiment as its results, without copying the arrays."""
        return cls(record.coords, record.variables, record.attrs, experiment=experiment)

    @property
    def model(self) -> Model:
        """The model of the experiment."""
        return self.experiment.model.definition

    @property
    def name_of_exact(self) -> str:
        """``exact`` for a solution in closed form, ``reference`` for one that was computed."""
        return "reference" if self.model.exact is None else "exact"

    @property
    def levels(self) -> list[int]:
        """The levels, the coarsest first."""
        return self._whole("level")

    @property
    def pairs(self) -> list[int]:
        """The coarser level of each pair of successive levels."""
        return self._whole("pair")

    @property
    def triples(self) -> list[int]:
        """The coarsest level of each triple of successive levels."""
        return self._whole("triple")

    def _whole(self, dim: str) -> list[int]:
        return [int(value) for value in self[dim]] if dim in self else []

    @property
    def steps(self) -> list[int]:
        """The number of steps of every level."""
        return self._whole("steps")

    @property
    def schemes(self) -> list[str]:
        """The names of the schemes."""
        return self.words("scheme")

    @property
    def count(self) -> int:
        """The number of members."""
        return len(self["case"])

    @property
    def is_lean(self) -> bool:
        """Whether no series over time are stored (see `vibsim.experiment.storage`)."""
        return self.attrs.get("storage") == "lean"

    @property
    def is_crowded(self) -> bool:
        """Whether there are more schemes than colours, so that all panels share one legend."""
        return len(self.schemes) > MANY

    # slices

    def pick(self, name: str, norm: str = TYPICAL_NORM, **index: int) -> NDArray[Any]:
        """Return a variable at given positions of its dimensions, and in one `norm` if it has several.

        Positions of dimensions that it lacks are ignored.
        """
        variable = self.variable(name)
        if "norm" in variable.dims:
            index["norm"] = self.words("norm").index(norm)
        return np.asarray(
            variable.values[tuple(index.get(dim, slice(None)) for dim in variable.dims)]
        )

    def at(self, name: str, member: Member, norm: str = TYPICAL_NORM, **index: int) -> Floats:
        """Return a variable of one member as floats (see `pick`)."""
        values = self.pick(name, norm, scheme=member.scheme, case=member.case, **index)
        return np.asarray(values, dtype=np.float64)

    def optional(
        self, name: str, dims: tuple[str, ...], norm: str = TYPICAL_NORM, **index: int
    ) -> Floats:
        """Return the slice of an optional variable (see `pick`); NaN of shape `dims` if the record lacks it.

        Not every model has an exact solution or an exact period.
        """
        if name in self:
            return np.asarray(self.pick(name, norm, **index), dtype=np.float64)
        return np.full([self.sizes[dim] for dim in dims], np.nan)

    def flags(self, name: str) -> NDArray[Any]:
        """Return a flag variable as words, in the same shape."""
        meanings, values = self.meanings(name), self[name]
        codes, inverse = np.unique(values, return_inverse=True)
        texts = np.array([meanings[int(code)] for code in codes], dtype=object)
        return np.asarray(texts[inverse.reshape(values.shape)])

    # times and frequencies

    def times(self, case: int) -> Floats:
        """Return the common times of a member, shape (t,); `t` is stored as a fraction of the end if ends differ."""
        t = np.asarray(self["t"], dtype=np.float64)
        return t * float(self.pick("end", case=case)) if "end" in self else t

    def dt(self, case: int) -> Floats:
        """Return dt of a member on every level, shape (level,)."""
        return np.asarray(self.pick("dt", case=case), dtype=np.float64)

    @property
    def ends(self) -> Floats:
        """The end time of every member, shape (case,)."""
        ends = self.pick("dt", level=0) * float(self.steps[0])
        return np.broadcast_to(ends, self.count)

    @property
    def exact_periods(self) -> Floats:
        """The exact period of every member, shape (case,); NaN if it has none."""
        return self.optional("exact_period", ("case",))

    def natural_frequency(self, case: int) -> float:
        """Return the natural frequency w of a member; NaN if it has none."""
        return float(np.ravel(self.optional("natural_frequency", ("case",), case=case))[0])

    @property
    def omega_dt(self) -> Floats:
        """The product w dt of every member and level, shape (case, level); NaN if the record lacks it."""
        shape = (self.count, len(self.levels))
        return np.broadcast_to(self.optional("omega_dt", ("case", "level")), shape)

    def phase_error(self, origin: str) -> Floats:
        """Return the phase error per period over the period, of ``theory`` or ``measured``, shape OF_LEVEL."""
        # dt has the shape (level, case) or (level,)
        frequency = self.omega_dt / (2.0 * np.pi) / np.asarray(self["dt"], dtype=np.float64).T
        return self.optional(f"{origin}_phase_error", OF_LEVEL) * frequency

    # units

    def unit(self, name: str) -> str:
        """Return the unit of a variable, with Unicode exponents; empty if it has none."""
        return pretty_unit(str(self.variable(name).attrs.get("units", "")) if name in self else "")

    def unit_of_number(self, check: ValueCheck) -> str:
        """Return the unit of the number of a check; empty if it has none."""
        return pretty_unit(unit_of(self.experiment, self, check))

    @property
    def time_unit(self) -> str:
        """The unit of time, even if `t` is stored as a fraction of the end; empty if time has no unit."""
        return "s" if has_time_unit(self) else ""

    @property
    def radians_unit(self) -> str:
        """The unit of an angular frequency; empty if time has no unit."""
        return f"rad {pretty_unit(f'{self.time_unit}-1')}" if self.time_unit else ""

    def norm_unit(self, quantity: str, norm: str = TYPICAL_NORM) -> str:
        """Return the unit of a norm over time: l1 adds a factor of time, l2 its root."""
        time = self.time_unit
        extra = {"l1": time, "l2": f"√{time}" if time else ""}.get(norm, "")
        # a single level has errors but no differences
        base = self.unit(f"{quantity}_difference_norm") or self.unit(f"{quantity}_error_norm")
        return f"{base} {extra}".strip()

    def time_text(self, value: float) -> str:
        """Write a time, such as a step, with its unit."""
        return f"{words.number(float(value), 'step')} {self.time_unit}".rstrip()

    @property
    def time_label(self) -> str:
        """The label of a time axis."""
        return label("t", self.time_unit)

    # members

    @property
    def swept(self) -> list[str]:
        """The names of the swept coordinates, in the order of the experiment file."""
        return [name for name, variable in self.coords.items() if "sweep_key" in variable.attrs]

    def swept_label(self, name: str) -> tuple[str, str]:
        """Return the dotted key of a swept coordinate and its unit."""
        return str(self.coords[name].attrs["sweep_key"]), self.unit(name)

    def case_name(self, case: int, only: str | None = None) -> str:
        """Name a member by its swept values, or by that of the key `only`; empty without a sweep.

        If a path comes back to its values, the name says on which way the member lies.
        """
        parts = []
        for name in self.swept:
            (key, unit), value = self.swept_label(name), self.pick(name, case=case).item()
            text = f"{value:.6g}" if isinstance(value, float) else str(value)
            if only in (None, key):
                parts.append(f"{key} = {text} {unit}".strip())
        return ", ".join(parts) + (self._way(case) if only is None else "")

    def _way(self, case: int) -> str:
        """Say on which way a member lies if others have its swept values; empty otherwise."""
        columns = [self.pick(name) for name in self.swept]
        same = [column == column[case] for column in columns]
        path = next((x for x in columns if x.dtype.kind == "f" and np.unique(x[:2]).size > 1), None)
        if path is None or np.all(same, axis=0).sum() < 2:
            return ""
        after = max(case, 1)  # the first member goes where the next one goes
        return f" on the way {'up' if path[after] > path[after - 1] else 'down'}"

    @property
    def all_members(self) -> list[Member]:
        """All pairs of scheme and member, ordered by scheme, then by member."""
        by_case = [self.of_case(case) for case in range(self.count)]
        return [member for of_scheme in zip(*by_case, strict=True) for member in of_scheme]

    def of_case(self, case: int, role: str = "") -> list[Member]:
        """Return one member of the sweep with each scheme."""
        name = self.case_name(case)
        return [Member(s, case, scheme, name, role) for s, scheme in enumerate(self.schemes)]

    def of_result(self, result: Mapping[str, Any]) -> Member:
        """Return the member and scheme of a result in a summary."""
        scheme = self.schemes.index(result["scheme"])
        return self.of_case(self.place("case", result["case"]))[scheme]

    def case_position(self, case: int) -> int | None:
        """Return the position of a member, given its global index; None if the record lacks it."""
        matches = np.flatnonzero(self["case"] == case)
        return int(matches[0]) if matches.size else None

    def of_several(self, scheme: int) -> str:
        """Return ``, scheme`` as the end of a title; empty if there is only one scheme."""
        return f", {self.schemes[scheme]}" if len(self.schemes) > 1 else ""

    # orders of all members

    def formal_orders(self, quantity: str) -> Floats:
        """Return the formal order of every scheme and member, shape (scheme, case): swept options may change it."""
        variable = self.variable(f"{quantity}_formal_order")
        orders = np.asarray(variable.values, dtype=np.float64)
        by_case = orders if "case" in variable.dims else orders[:, None]
        return np.broadcast_to(by_case, (len(self.schemes), self.count))

    def basis_of_order(self, quantity: str) -> str:
        """Return ``promised`` for an order of theory, ``expected`` for a part of an error whose order checks state."""
        is_promised = self.variable(f"{quantity}_formal_order").attrs["promised"]
        return "promised" if is_promised else "expected"

    def promised_text(self, quantity: str, scheme: int) -> str:
        """Write the formal order of a quantity, or the word of `basis_of_order` if it differs between members."""
        orders = np.unique(self.formal_orders(quantity)[scheme])
        if orders.size != 1:
            return self.basis_of_order(quantity)
        return f"{orders[0]:g}".replace("inf", "∞")

    def orders(self, quantity: str, norm: str = TYPICAL_NORM) -> list[Floats]:
        """Return the order of every scheme and member, stated or estimated, and the ends of its interval."""
        # a large sweep has orders only for the quantities of checks
        ends = ("", "_low", "_high")
        return [self.optional(f"{quantity}_order{end}", MEMBER, norm) for end in ends]

    def stated_orders(self, quantity: str, norm: str = TYPICAL_NORM) -> list[Floats]:
        """Return the same `orders`, but NaN where the verdict is undecided."""
        undecided = self.is_undecided(quantity)
        return [np.where(undecided, np.nan, part) for part in self.orders(quantity, norm)]

    def is_undecided(self, quantity: str) -> Flags:
        """Return where the verdict is INCONCLUSIVE, shape (scheme, case): an order is at most an estimate there."""
        name = f"{quantity}_status"
        if name not in self:
            return np.zeros((len(self.schemes), self.count), np.bool_)
        return np.asarray(self.flags(name) == "INCONCLUSIVE")


@dataclass(frozen=True)
class Ladder:
    """The levels of one quantity of one member."""

    record: Results
    quantity: str
    member: Member

    @property
    def scheme(self) -> int:
        """The position of the scheme."""
        return self.member.scheme

    @property
    def case(self) -> int:
        """The position of the member."""
        return self.member.case

    @property
    def title(self) -> str:
        """Name of the scheme and, in a sweep, of the member, as a page shows them."""
        return self.member.title

    @property
    def stem(self) -> str:
        """Part of the names of its pictures, unique on a page."""
        return f"{self.quantity}_{self.member.stem}"

    @property
    def letter(self) -> str:
        """The letter of the quantity."""
        return words.symbol(self.quantity)

    @property
    def name(self) -> str:
        """The quantity in words."""
        return words.name(self.quantity)

    def of(self, quantity: str) -> Ladder:
        """Return the ladder of another quantity of the same member."""
        return Ladder(self.record, quantity, self.member)

    def with_member(self, member: Member) -> Ladder:
        """Return the ladder of the same quantity of another member."""
        return Ladder(self.record, self.quantity, member)

    def __contains__(self, field: str) -> bool:
        return f"{self.quantity}_{field}" in self.record

    def has(self, field: str, norm: str = TYPICAL_NORM) -> bool:
        """Return whether a variable of the quantity is stored and has a finite value."""
        return field in self and bool(np.isfinite(self.at(field, norm)).any())

    def at(self, field: str, norm: str = TYPICAL_NORM, **index: int) -> Floats:
        """Return a variable of the quantity, such as its ``difference``, as floats (see `Results.pick`)."""
        return self.record.at(f"{self.quantity}_{field}", self.member, norm, **index)

    def optional(self, field: str, dims: tuple[str, ...], norm: str = TYPICAL_NORM) -> Floats:
        """Return the same, or NaN of shape `dims` if the record lacks it."""
        name, place = f"{self.quantity}_{field}", self.member
        return self.record.optional(name, dims, norm, scheme=place.scheme, case=place.case)

    def unit(self, field: str = "finest") -> str:
        """Return the unit of a variable of the quantity; empty if it has none."""
        return self.record.unit(f"{self.quantity}_{field}")

    def norm_unit(self, norm: str = TYPICAL_NORM) -> str:
        """Return the unit of a norm over time."""
        return self.record.norm_unit(self.quantity, norm)

    @property
    def t(self) -> Floats:
        """The common times, shape (t,)."""
        return self.record.times(self.member.case)

    @property
    def dt(self) -> Floats:
        """The step of every level, shape (level,)."""
        return self.record.dt(self.member.case)

    @property
    def exact(self) -> Floats:
        """The exact solution at the common times, shape (t,); NaN if it has none."""
        return self.optional("exact", ("t",))

    @property
    def finest(self) -> Floats:
        """The finest level at the common times, shape (t,)."""
        return self.at("finest")

    def on_level(self, level: int) -> Floats:
        """Return a level, given by position, shape (t,): the finest one plus the differences down to it."""
        values = self.finest
        for pair in range(level, len(self.record.pairs)):
            values = values + self.at("difference", pair=pair)
        return values

    @property
    def formal_order(self) -> float:
        """The formal order of the scheme."""
        return float(self.at("formal_order"))

    @property
    def rescaling_order(self) -> float:
        """The order by which levels are rescaled: the formal one, or 0 (no rescaling) if that is not finite."""
        return self.formal_order if math.isfinite(self.formal_order) else 0.0

    @property
    def basis_of_order(self) -> str:
        """What the formal order is (see `Results.basis_of_order`)."""
        return self.record.basis_of_order(self.quantity)

    def stated_order(self, norm: str = TYPICAL_NORM) -> list[float]:
        """Return the stated order and the ends of its interval; NaN if no order is stated."""
        stated = self.record.stated_orders(self.quantity, norm)
        return [float(part[self.member.place]) for part in stated]

    @property
    def is_undecided(self) -> bool:
        """Whether the verdict is INCONCLUSIVE."""
        return bool(self.record.is_undecided(self.quantity)[self.member.place])

    @property
    def window(self) -> tuple[int, int]:
        """The first and the last level that the stated or estimated order rests on; -1 if there is none."""
        first, last = (int(self.at(f"window_{end}")) for end in ("first", "last"))
        return first, last

    @property
    def sound_pairs(self) -> list[bool]:
        """For each pair of successive levels, whether its difference is above round-off.

        The window of the verdict decides if there is one, because it ends where round-off begins; else the predicted
        floor.
        """
        last = self.window[1]
        if last >= 0:
            return [finer <= last for finer in self.record.levels[1:]]
        floor, differences = self.floor(), self.at("difference_norm")
        return [
            bool(d > ABOVE_FLOOR * max(floor[i], floor[i + 1])) for i, d in enumerate(differences)
        ]

    @property
    def sound_triples(self) -> list[bool]:
        """For each triple of successive levels, whether both differences are above round-off."""
        above = self.sound_pairs
        return [all(above[i : i + 2]) for i in range(len(self.record.triples))]

    @property
    def coincidence(self) -> float:
        """The distance of the two finest rescaled differences above round-off, relative to the finer one, or NaN."""
        if "coincidence" not in self:
            return math.nan
        sound = self.at("coincidence")[self.sound_triples]
        return float(sound[-1]) if sound.size else math.nan

    def floor(self, norm: str = TYPICAL_NORM) -> Floats:
        """Return the norm over time of noise of the predicted round-off size, shape (level,)."""
        floor = self.at("floor")
        if "t" in self.record:
            return norm_of_floor(floor, norm, self.t.size, np.diff(self.t[:2]))
        return norm_of_floor(floor, norm, self.record.steps[0] + 1, self.dt[:1])


def pretty_unit(text: str) -> str:
    """Write a unit such as ``rad s-1`` with Unicode exponents."""
    parts = [(part, part.rstrip("-0123456789")) for part in text.split()]
    raised = [base + part[len(base) :].translate(words.RAISE) for part, base in parts]
    return "" if text in {"", "1"} else " ".join(raised).replace("sqrt(s)", "√s")


def bin_of(borders: Floats, values: Floats) -> NDArray[np.intp]:
    """Return the interval between ascending borders that holds each value; the outermost for values beyond them."""
    return np.clip(np.searchsorted(borders, values, side="right") - 1, 0, borders.size - 2)


def largest(values: Floats) -> float:
    """Return the largest finite absolute value; 0 if there is none."""
    return float(np.abs(finite(values)).max(initial=0.0))
