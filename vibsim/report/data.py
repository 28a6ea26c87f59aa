"""Slices of a convergence Record for figures and tables.

Slices are selected by dimension name, so the same call reads variables that lack a dimension (an exact solution does
not depend on the scheme).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.roundoff_floor import norm_of_floor
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import MEMBER, OF_LEVEL, TYPICAL_NORM
from vibsim.report import words
from vibsim.report.style import finite, label
from vibsim.simulation.scaled import has_time_unit

ABOVE_FLOOR = 3.0  # a difference above this multiple of the predicted floor is not round-off
_STEM_LENGTH = 40  # most characters of a scheme's name in a file name


@dataclass(frozen=True)
class Member:
    """One scheme and one member of the sweep, with the names that a page shows."""

    scheme: int
    case: int
    scheme_name: str
    case_name: str = ""
    """Empty without a sweep."""
    role: str = ""
    """Why it is shown: ``worst``, ``typical``, or empty."""

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


def pick(record: Record, name: str, norm: str = TYPICAL_NORM, **index: int) -> NDArray[Any]:
    """Return a variable at given positions of its dimensions, and in one `norm` if it has several.

    Positions of dimensions that it lacks are ignored.
    """
    variable = record.variable(name)
    if "norm" in variable.dims:
        index["norm"] = record.words("norm").index(norm)
    return np.asarray(variable.values[tuple(index.get(dim, slice(None)) for dim in variable.dims)])


def at(record: Record, name: str, member: Member, norm: str = TYPICAL_NORM, **index: int) -> Floats:
    """Return a variable of one member as floats (see `pick`)."""
    values = pick(record, name, norm, scheme=member.scheme, case=member.case, **index)
    return np.asarray(values, dtype=np.float64)


def optional(
    record: Record, name: str, dims: tuple[str, ...], norm: str = TYPICAL_NORM, **index: int
) -> Floats:
    """Return the slice of an optional variable (see `pick`); NaN of shape `dims` if the record lacks it.

    Not every model has an exact solution or an exact period.
    """
    if name in record:
        return np.asarray(pick(record, name, norm, **index), dtype=np.float64)
    return np.full([record.sizes[dim] for dim in dims], np.nan)


def exact_series(record: Record, quantity: str, member: Member) -> Floats:
    """Return the exact solution of a member at the common times, shape (t,); NaN if it has none."""
    return optional(record, f"{quantity}_exact", ("t",), scheme=member.scheme, case=member.case)


def exact_periods(record: Record) -> Floats:
    """Return the exact period of every member, shape (case,); NaN if it has none."""
    return optional(record, "exact_period", ("case",))


def natural_frequency(record: Record, case: int) -> float:
    """Return the natural frequency w of a member; NaN if it has none."""
    return float(np.ravel(optional(record, "natural_frequency", ("case",), case=case))[0])


def omega_dt(record: Record) -> Floats:
    """Return w dt of every member and level, shape (case, level); NaN if the record lacks it."""
    shape = (len(record["case"]), len(record["level"]))
    return np.broadcast_to(optional(record, "omega_dt", ("case", "level")), shape)


def phase_error(record: Record, origin: str) -> Floats:
    """Return the phase error per period over the period, of ``theory`` or ``measured``, shape (scheme, case, level)."""
    # dt has the shape (level, case) or (level,)
    frequency = omega_dt(record) / (2.0 * np.pi) / np.asarray(record["dt"], dtype=np.float64).T
    return optional(record, f"{origin}_phase_error", OF_LEVEL) * frequency


def unit(record: Record, name: str) -> str:
    """Return the unit of a variable, with Unicode exponents; empty if it has none."""
    return pretty_unit(str(record.variable(name).attrs.get("units", "")) if name in record else "")


def time_unit(record: Record, name: str = "t") -> str:
    """Return the unit of time, even if `t` is stored as a fraction of the end; empty if time has no unit."""
    return (unit(record, name) or "s") if has_time_unit(record) else ""


def radians_unit(record: Record) -> str:
    """Return the unit of an angular frequency; empty if time has no unit."""
    time = time_unit(record)
    return f"rad {pretty_unit(f'{time}-1')}" if time else ""


def time_text(record: Record, value: float) -> str:
    """Write a time, such as a step, with its unit."""
    return f"{words.number(float(value), 'step')} {time_unit(record, 'dt')}".rstrip()


def time_label(record: Record) -> str:
    """Return the label of a time axis."""
    return label("t", time_unit(record))


def pretty_unit(text: str) -> str:
    """Write a unit such as ``rad s-1`` with Unicode exponents."""
    parts = [(part, part.rstrip("-0123456789")) for part in text.split()]
    raised = [base + part[len(base) :].translate(words.RAISE) for part, base in parts]
    return "" if text in {"", "1"} else " ".join(raised).replace("sqrt(s)", "√s")


def norm_unit(record: Record, quantity: str, norm: str = TYPICAL_NORM) -> str:
    """Return the unit of a norm over time: l1 adds a factor of time, l2 its root."""
    time = time_unit(record)
    extra = {"l1": time, "l2": f"√{time}" if time else ""}.get(norm, "")
    # a single level has errors but no differences
    base = unit(record, f"{quantity}_difference_norm") or unit(record, f"{quantity}_error_norm")
    return f"{base} {extra}".strip()


def times(record: Record, case: int) -> Floats:
    """Return the common times of a member, shape (t,); `t` is stored as a fraction of the end if ends differ."""
    t = np.asarray(record["t"], dtype=np.float64)
    return t * float(pick(record, "end", case=case)) if "end" in record else t


def steps_of(record: Record, case: int) -> Floats:
    """Return dt of a member on every level, shape (level,)."""
    return np.asarray(pick(record, "dt", case=case), dtype=np.float64)


def ends_of(record: Record) -> Floats:
    """Return the end time of every member, shape (case,)."""
    ends = pick(record, "dt", level=0) * float(record["steps"][0])
    return np.broadcast_to(ends, len(record["case"]))


def flags(record: Record, name: str) -> NDArray[Any]:
    """Return a flag variable as words, in the same shape."""
    meanings, values = record.meanings(name), record[name]
    codes, inverse = np.unique(values, return_inverse=True)
    texts = np.array([meanings[int(code)] for code in codes], dtype=object)
    return np.asarray(texts[inverse].reshape(values.shape))


def whole(record: Record, dim: str) -> list[int]:
    """Return an integer coordinate (levels, pairs, triples); empty if the record lacks it."""
    return [int(value) for value in record[dim]] if dim in record else []


def is_lean(record: Record) -> bool:
    """Return whether the record stores no series over time (see `vibsim.experiment.storage`)."""
    return record.attrs.get("storage") == "lean"


def swept(record: Record) -> list[str]:
    """Return the names of the swept coordinates, in the order of the experiment file."""
    return [name for name, variable in record.coords.items() if "sweep_key" in variable.attrs]


def swept_label(record: Record, name: str) -> tuple[str, str]:
    """Return the dotted key of a swept coordinate and its unit."""
    return str(record.coords[name].attrs["sweep_key"]), unit(record, name)


def case_name(record: Record, case: int, only: str | None = None) -> str:
    """Name a member by its swept values, or by that of the key `only`; empty without a sweep.

    If a path comes back to its values, the name says on which way the member lies.
    """
    parts = []
    for name in swept(record):
        (key, key_unit), value = swept_label(record, name), pick(record, name, case=case).item()
        text = f"{value:.6g}" if isinstance(value, float) else str(value)
        if only in (None, key):
            parts.append(f"{key} = {text} {key_unit}".strip())
    return ", ".join(parts) + (_way(record, case) if only is None else "")


def _way(record: Record, case: int) -> str:
    """Say on which way a member lies if others have its swept values; empty otherwise."""
    columns = [pick(record, name) for name in swept(record)]
    same = [column == column[case] for column in columns]
    path = next((x for x in columns if x.dtype.kind == "f" and np.unique(x[:2]).size > 1), None)
    if path is None or np.all(same, axis=0).sum() < 2:
        return ""
    # the first member goes where the next one goes
    after = max(case, 1)
    return f" on the way {'up' if path[after] > path[after - 1] else 'down'}"


def all_members(record: Record) -> list[Member]:
    """Return all pairs of scheme and member, ordered by scheme, then by member."""
    by_case = [of_case(record, case) for case in range(len(record["case"]))]
    return [member for of_scheme in zip(*by_case, strict=True) for member in of_scheme]


def of_case(record: Record, case: int, role: str = "") -> list[Member]:
    """Return one member of the sweep with each scheme."""
    name = case_name(record, case)
    return [Member(s, case, scheme, name, role) for s, scheme in enumerate(record.words("scheme"))]


def of_result(record: Record, result: Mapping[str, Any]) -> Member:
    """Return the member and scheme of a result in a summary."""
    scheme = record.words("scheme").index(result["scheme"])
    return of_case(record, record.place("case", result["case"]))[scheme]


def case_position(record: Record, case: int) -> int | None:
    """Return the position of a member, given its global index; None if the record lacks it."""
    matches = np.flatnonzero(record["case"] == case)
    return int(matches[0]) if matches.size else None


def of_several(record: Record, scheme: int) -> str:
    """Return ``, scheme`` as the end of a title; empty if there is only one scheme."""
    names = record.words("scheme")
    return f", {names[scheme]}" if len(names) > 1 else ""


def formal_order(record: Record, member: Member, quantity: str) -> float:
    """Return the formal order of a member's scheme for a quantity."""
    return float(at(record, f"{quantity}_formal_order", member))


def rescaling_order(record: Record, member: Member, quantity: str) -> float:
    """Return the order by which levels are rescaled: the formal one, or 0 (no rescaling) if that is not finite."""
    order = formal_order(record, member, quantity)
    return order if math.isfinite(order) else 0.0


def formal_orders(record: Record, quantity: str) -> Floats:
    """Return the formal order of every scheme and member, shape (scheme, case): swept options may change it."""
    variable = record.variable(f"{quantity}_formal_order")
    orders = np.asarray(variable.values, dtype=np.float64)
    by_case = orders if "case" in variable.dims else orders[:, None]
    return np.broadcast_to(by_case, (len(record["scheme"]), len(record["case"])))


def basis_of_order(record: Record, quantity: str) -> str:
    """Return ``promised`` for an order of theory, ``expected`` for a part of an error whose order only checks state."""
    is_promised = record.variable(f"{quantity}_formal_order").attrs["promised"]
    return "promised" if is_promised else "expected"


def promised_text(record: Record, quantity: str, scheme: int) -> str:
    """Write the formal order of a quantity, or the word of `basis_of_order` if it differs between members."""
    orders = np.unique(formal_orders(record, quantity)[scheme])
    if orders.size != 1:
        return basis_of_order(record, quantity)
    return f"{orders[0]:g}".replace("inf", "∞")


def orders(record: Record, quantity: str, norm: str = TYPICAL_NORM) -> list[Floats]:
    """Return the order of every scheme and member, stated or estimated, and the ends of its interval."""
    # a large sweep has orders only for the quantities of checks
    return [
        optional(record, f"{quantity}_order{end}", MEMBER, norm) for end in ("", "_low", "_high")
    ]


def stated_orders(record: Record, quantity: str, norm: str = TYPICAL_NORM) -> list[Floats]:
    """Return the same `orders`, but NaN where the verdict is undecided."""
    undecided = is_undecided(record, quantity)
    return [np.where(undecided, np.nan, part) for part in orders(record, quantity, norm)]


def stated_order(
    record: Record, quantity: str, member: Member, norm: str = TYPICAL_NORM
) -> list[float]:
    """Return the stated order of a member and the ends of its interval; NaN if no order is stated."""
    stated = stated_orders(record, quantity, norm)
    return [float(part[member.scheme, member.case]) for part in stated]


def is_undecided(record: Record, quantity: str) -> Flags:
    """Return where the verdict on a quantity is INCONCLUSIVE, shape (scheme, case): an order is at most an estimate."""
    name = f"{quantity}_status"
    if name not in record:
        return np.zeros((len(record["scheme"]), len(record["case"])), np.bool_)
    return np.asarray(flags(record, name) == "INCONCLUSIVE")


def window(record: Record, quantity: str, member: Member) -> tuple[int, int]:
    """Return the first and the last level that the stated or estimated order rests on; -1 if there is none."""
    first, last = (int(at(record, f"{quantity}_window_{end}", member)) for end in ("first", "last"))
    return first, last


def sound_pairs(record: Record, quantity: str, member: Member) -> list[bool]:
    """Return for each pair of successive levels whether its difference is above round-off.

    The window of the verdict decides if there is one, because it ends where round-off begins; else the predicted floor.
    """
    levels, (_, last) = whole(record, "level"), window(record, quantity, member)
    if last >= 0:
        return [finer <= last for finer in levels[1:]]
    floor = floor_norm(record, quantity, member, TYPICAL_NORM)
    differences = at(record, f"{quantity}_difference_norm", member)
    return [bool(d > ABOVE_FLOOR * max(floor[i], floor[i + 1])) for i, d in enumerate(differences)]


def sound_triples(record: Record, quantity: str, member: Member) -> list[bool]:
    """Return for each triple of successive levels whether both differences are above round-off."""
    above = sound_pairs(record, quantity, member)
    return [all(above[i : i + 2]) for i in range(len(whole(record, "triple")))]


def coincidence(record: Record, quantity: str, member: Member) -> float:
    """Return the distance of the two finest rescaled differences above round-off, relative to the finer one, or NaN."""
    name = f"{quantity}_coincidence"
    if name not in record:
        return math.nan
    sound = at(record, name, member)[sound_triples(record, quantity, member)]
    return float(sound[-1]) if sound.size else math.nan


def floor_norm(record: Record, quantity: str, member: Member, norm: str) -> Floats:
    """Return the norm over time of noise of the predicted round-off size, shape (level,)."""
    floor = at(record, f"{quantity}_floor", member)
    if "t" in record:
        t = times(record, member.case)
        return norm_of_floor(floor, norm, t.size, np.diff(t[:2]))
    count = int(record["steps"][0]) + 1
    return norm_of_floor(floor, norm, count, steps_of(record, member.case)[:1])


def state_at(record: Record, name: str, member: Member, level: int) -> Floats:
    """Return a state at a position of level, shape (t,): the finest level plus the differences down to this one."""
    values = at(record, f"{name}_finest", member)
    for pair in range(level, len(whole(record, "pair"))):
        values = values + at(record, f"{name}_difference", member, pair=pair)
    return values


def bin_of(borders: Floats, values: Floats) -> NDArray[np.intp]:
    """Return the interval between ascending borders that holds each value; the outermost for values beyond them."""
    return np.clip(np.searchsorted(borders, values, side="right") - 1, 0, borders.size - 2)


def largest(values: Floats) -> float:
    """Return the largest finite absolute value; 0 if there is none."""
    return float(np.abs(finite(values)).max(initial=0.0))
