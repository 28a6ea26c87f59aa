"""Reading a convergence Record: which slice a figure or table shows.

The functions select by the names of dimensions, so that a variable with fewer of them (an exact solution knows no
scheme) is read by the same call.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.roundoff_floor import norm_of_floor
from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import OF_LEVEL, TYPICAL_NORM
from vibsim.report import words
from vibsim.report.style import finite, label
from vibsim.simulation.scaled import has_time_unit

ABOVE = 3.0  # a difference counts as more than round-off when it exceeds this many times the floor
_LONGEST = 40  # characters of the name of a scheme in the name of a file


@dataclass(frozen=True)
class Member:
    """One scheme and one member of the sweep, with the words that name them."""

    scheme: int
    case: int
    scheme_name: str
    case_name: str = ""
    """Empty without a sweep."""
    role: str = ""
    """Why it is shown: ``worst``, ``typical``, or empty."""

    @property
    def title(self) -> str:
        """Name of the scheme, with the member where there is a sweep, in the words of a page."""
        return f"{self.scheme_name}, {self.case_words}" if self.case_name else self.scheme_name

    @property
    def case_words(self) -> str:
        """Name of the member in the words of a page; empty without a sweep."""
        return words.swept(self.case_name)

    @property
    def stem(self) -> str:
        """A plain name for files, unique by its number; file systems take 255 bytes."""
        name = self.scheme_name[:_LONGEST]
        plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
        return f"{self.scheme}_{plain}_{self.role}" if self.role else f"{self.scheme}_{plain}"


def pick(record: Record, name: str, **index: int) -> NDArray[Any]:
    """Return a variable at given positions of its dimensions; a dimension that it lacks is passed over."""
    variable = record.variable(name)
    return np.asarray(variable.values[tuple(index.get(dim, slice(None)) for dim in variable.dims)])


def at(record: Record, name: str, member: Member, **index: int) -> Floats:
    """Return the floats of a variable for one member (see `pick`)."""
    values = pick(record, name, scheme=member.scheme, case=member.case, **index)
    return np.asarray(values, dtype=np.float64)


def known(record: Record, name: str, dims: tuple[str, ...], **index: int) -> Floats:
    """Return what `pick` gives, of shape `dims`; NaN throughout where the record has no such variable.

    A model need not have an exact solution or an exact period.
    """
    if name in record:
        return np.asarray(pick(record, name, **index), dtype=np.float64)
    return np.full([record.sizes[dim] for dim in dims], np.nan)


def exact_series(record: Record, quantity: str, member: Member) -> Floats:
    """Return the exact solution of a member at the common times, shape (t,); NaN where there is none."""
    return known(record, f"{quantity}_exact", ("t",), scheme=member.scheme, case=member.case)


def exact_periods(record: Record) -> Floats:
    """Return the exact period of every member, shape (case,); NaN where there is none."""
    return known(record, "exact_period", ("case",))


def natural_frequency(record: Record, case: int) -> float:
    """Return the natural frequency w of a member; NaN where there is none."""
    return float(np.ravel(known(record, "natural_frequency", ("case",), case=case))[0])


def omega_dt(record: Record) -> Floats:
    """Return w dt of every member and level, shape (case, level); NaN where the record does not have it."""
    shape = (len(record["case"]), len(record["level"]))
    return np.broadcast_to(known(record, "omega_dt", ("case", "level")), shape)


def phase_error(record: Record, who: str) -> Floats:
    """Return the phase error over a period by ``theory`` or as ``measured``, shape (scheme, case, level)."""
    # dt has the shape (level, case) or (level,)
    periods = omega_dt(record) / (2.0 * np.pi) / np.asarray(record["dt"], dtype=np.float64).T
    return known(record, f"{who}_phase_error", OF_LEVEL) * periods


def unit(record: Record, name: str) -> str:
    """Return the unit of a variable, with Unicode exponents; empty where it has none."""
    return pretty_unit(str(record.variable(name).attrs.get("units", "")) if name in record else "")


def time_unit(record: Record, name: str = "t") -> str:
    """Return the unit of times, also where `t` is a fraction of the end; empty where times have none."""
    return (unit(record, name) or "s") if has_time_unit(record) else ""


def radians_unit(record: Record) -> str:
    """Return the unit of an angular frequency; empty where times have none."""
    time = time_unit(record)
    return f"rad {pretty_unit(f'{time}-1')}" if time else ""


def time_text(record: Record, value: float) -> str:
    """Write a time, such as that of a step, with its unit."""
    return f"{words.number(float(value), 'step')} {time_unit(record, 'dt')}".rstrip()


def time_label(record: Record) -> str:
    """Return the label of an axis of times."""
    return label("t", time_unit(record))


def pretty_unit(text: str) -> str:
    """Write a unit such as ``rad s-1`` with Unicode exponents."""
    parts = [(part, part.rstrip("-0123456789")) for part in text.split()]
    raised = [base + part[len(base) :].translate(words.RAISE) for part, base in parts]
    return "" if text in {"", "1"} else " ".join(raised).replace("sqrt(s)", "√s")


def norm_unit(record: Record, quantity: str, norm: str = TYPICAL_NORM) -> str:
    """Return the unit of a norm over time: l1 and l2 carry the time, or its root, too."""
    time = time_unit(record)
    extra = {"l1": time, "l2": f"√{time}" if time else ""}.get(norm, "")
    # of a single level there are errors only
    own = unit(record, f"{quantity}_difference_norm") or unit(record, f"{quantity}_error_norm")
    return f"{own} {extra}".strip()


def norm_index(record: Record, norm: str = TYPICAL_NORM) -> int:
    """Return the position of a norm."""
    return record.words("norm").index(norm)


def times(record: Record, case: int) -> Floats:
    """Return the common times of a member, shape (t,); where ends differ, `t` is stored as a fraction."""
    t = np.asarray(record["t"], dtype=np.float64)
    return t * float(pick(record, "end", case=case)) if "end" in record else t


def steps_of(record: Record, case: int) -> Floats:
    """Return dt of every level for a member, shape (level,)."""
    return np.asarray(pick(record, "dt", case=case), dtype=np.float64)


def ends_of(record: Record) -> Floats:
    """Return the end time of every member, shape (case,)."""
    ends = pick(record, "dt", level=0) * float(record["steps"][0])
    return np.broadcast_to(ends, len(record["case"]))


def flags(record: Record, name: str) -> NDArray[Any]:
    """Return a flag variable as words, same shape."""
    table, values = record.meanings(name), record[name]
    found, place = np.unique(values, return_inverse=True)
    texts = np.array([table[int(value)] for value in found], dtype=object)
    return np.asarray(texts[place].reshape(values.shape))


def whole(record: Record, dim: str) -> list[int]:
    """Return a coordinate of whole numbers (levels, pairs, triples)."""
    return [int(value) for value in record[dim]] if dim in record else []


def is_lean(record: Record) -> bool:
    """Say whether no series over time are stored (see `vibsim.experiment.storage`)."""
    return record.attrs.get("storage") == "lean"


def swept(record: Record) -> list[str]:
    """Return the names of the swept coordinates, in the order written."""
    return [name for name, variable in record.coords.items() if "sweep_key" in variable.attrs]


def swept_label(record: Record, name: str) -> tuple[str, str]:
    """Return the dotted key of a swept coordinate and its unit."""
    return str(record.coords[name].attrs["sweep_key"]), unit(record, name)


def case_name(record: Record, case: int, of: str | None = None) -> str:
    """Name a member by its swept values, or by that of one key; empty without a sweep.

    Where a path comes back to its values, the name says on which way the member lies.
    """
    parts = []
    for name in swept(record):
        (key, measure), value = swept_label(record, name), pick(record, name, case=case).item()
        text = f"{value:.6g}" if isinstance(value, float) else str(value)
        if of in (None, key):
            parts.append(f"{key} = {text} {measure}".strip())
    return ", ".join(parts) + (_way(record, case) if of is None else "")


def _way(record: Record, case: int) -> str:
    """Say on which way a member lies, where others have its swept values; else nothing."""
    columns = [pick(record, name) for name in swept(record)]
    same = [column == column[case] for column in columns]
    path = next((x for x in columns if x.dtype.kind == "f" and np.unique(x[:2]).size > 1), None)
    if path is None or np.all(same, axis=0).sum() < 2:
        return ""
    # the first member goes where the next one goes
    after = max(case, 1)
    return f" on the way {'up' if path[after] > path[after - 1] else 'down'}"


def everyone(record: Record) -> list[Member]:
    """Return every scheme and member, all members of a scheme together."""
    every = [of_case(record, case) for case in range(len(record["case"]))]
    return [member for of_scheme in zip(*every, strict=True) for member in of_scheme]


def of_case(record: Record, case: int, role: str = "") -> list[Member]:
    """Return one member by every scheme."""
    name = case_name(record, case)
    return [Member(s, case, scheme, name, role) for s, scheme in enumerate(record.words("scheme"))]


def place_of(record: Record, case: int) -> int | None:
    """Return the position of a member by its global index; None where the record does not have it."""
    found = np.flatnonzero(record["case"] == case)
    return int(found[0]) if found.size else None


def of_several(record: Record, scheme: int) -> str:
    """Return the name of a scheme behind a comma, for a title; empty where there is one scheme."""
    names = record.words("scheme")
    return f", {names[scheme]}" if len(names) > 1 else ""


def formal_order(record: Record, member: Member, quantity: str) -> float:
    """Return the order that the scheme of a member promises for a quantity."""
    return float(at(record, f"{quantity}_formal_order", member))


def power(record: Record, member: Member, quantity: str) -> float:
    """Return the order by which levels are rescaled: the promised one, or 0 for none where that is not finite."""
    order = formal_order(record, member, quantity)
    return order if math.isfinite(order) else 0.0


def formal_orders(record: Record, quantity: str) -> Floats:
    """Return the promised order of every scheme and member, shape (scheme, case): options may be swept."""
    variable = record.variable(f"{quantity}_formal_order")
    orders = np.asarray(variable.values, dtype=np.float64)
    by_case = orders if "case" in variable.dims else orders[:, None]
    return np.broadcast_to(by_case, (len(record["scheme"]), len(record["case"])))


def basis_of_order(record: Record, quantity: str) -> str:
    """Say whose an order is: promised by theory, or expected by a check of a part of an error that has no promise."""
    is_promised = record.variable(f"{quantity}_formal_order").attrs["promised"]
    return "promised" if is_promised else "expected"


def promised_text(record: Record, quantity: str, scheme: int) -> str:
    """Write the order that is due to a quantity: a number, or whose it is where it depends on the member."""
    found = np.unique(formal_orders(record, quantity)[scheme])
    if found.size != 1:
        return basis_of_order(record, quantity)
    return f"{found[0]:g}".replace("inf", "∞")


def stated_order(
    record: Record, quantity: str, member: Member, norm: int
) -> tuple[float, float, float]:
    """Return the stated order and the ends of its interval; NaN where there is none."""
    order, low, high = (
        float(at(record, f"{quantity}_order{end}", member, norm=norm))
        for end in ("", "_low", "_high")
    )
    return order, low, high


def window(record: Record, quantity: str, member: Member) -> tuple[int, int]:
    """Return the first and the last level that the stated order rests on; -1 where there is none."""
    first, last = (int(at(record, f"{quantity}_window_{end}", member)) for end in ("first", "last"))
    return first, last


def sound_pairs(record: Record, quantity: str, member: Member) -> list[bool]:
    """Say of every pair of levels whether its difference stands above round-off.

    The verdict's window decides where there is one: it ends where round-off begins. Else the predicted floor does.
    """
    levels, (_, last) = whole(record, "level"), window(record, quantity, member)
    if last >= 0:
        return [finer <= last for finer in levels[1:]]
    floor = floor_norm(record, quantity, member, TYPICAL_NORM)
    differences = at(record, f"{quantity}_difference_norm", member, norm=norm_index(record))
    return [bool(d > ABOVE * max(floor[i], floor[i + 1])) for i, d in enumerate(differences)]


def sound_triples(record: Record, quantity: str, member: Member) -> list[bool]:
    """Say of every triple of levels whether its differences stand above round-off."""
    above = sound_pairs(record, quantity, member)
    return [all(above[i : i + 2]) for i in range(len(whole(record, "triple")))]


def coincidence(record: Record, quantity: str, member: Member) -> float:
    """Return how far the finest two sound rescaled differences are apart, over the finer one; NaN where not known."""
    name = f"{quantity}_coincidence"
    if name not in record:
        return math.nan
    sound = at(record, name, member)[sound_triples(record, quantity, member)]
    return float(sound[-1]) if sound.size else math.nan


def floor_norm(record: Record, quantity: str, member: Member, norm: str) -> Floats:
    """Return the norm over time of noise as large as the predicted round-off, shape (level,)."""
    floor = at(record, f"{quantity}_floor", member)
    if "t" in record:
        t = times(record, member.case)
        return norm_of_floor(floor, norm, t.size, np.diff(t[:2]))
    count = int(record["steps"][0]) + 1
    return norm_of_floor(floor, norm, count, steps_of(record, member.case)[:1])


def of_level(record: Record, name: str, member: Member, level: int) -> Floats:
    """Return a state on a level: the finest one and the differences between it and that level."""
    values = at(record, f"{name}_finest", member)
    for pair in range(level, len(whole(record, "pair"))):
        values = values + at(record, f"{name}_difference", member, pair=pair)
    return values


def largest(values: Floats) -> float:
    """Return the largest absolute value that is finite; 0 where there is none."""
    return float(np.abs(finite(values)).max(initial=0.0))
