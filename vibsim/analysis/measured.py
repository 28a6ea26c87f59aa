"""What the checks of an experiment measured of every scheme and member, as variables of the convergence Record."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis import behaviour_measured, best, by_level, values
from vibsim.analysis.asked import compare
from vibsim.analysis.causes import CAUSES, causes
from vibsim.analysis.compare import Comparison
from vibsim.analysis.evidence import judge_check, order_of
from vibsim.analysis.foresight import UNKNOWN, finest_readable, more_levels
from vibsim.analysis.part import Part
from vibsim.analysis.shown import shown
from vibsim.analysis.verdict import Judgement
from vibsim.record import Variable, attributes
from vibsim.vocabulary import REASON_NAMES, STATUSES

if TYPE_CHECKING:
    from vibsim.spec import Experiment
    from vibsim.spec.checks import ConvergesCheck, ValueCheck

Codes = NDArray[Any]
Floats = NDArray[np.float64]

FIELDS: Mapping[str, tuple[str, type[np.generic], float, str]] = {
    "value": ("order", np.float64, np.nan, "number that each check measured"),
    "low": ("low", np.float64, np.nan, "lower end of the order of each check, or what it allows"),
    "high": (
        "high",
        np.float64,
        np.nan,
        "upper end of the order of each check, or the bound of the error of an extrapolated number",
    ),
    "first": (
        "first",
        np.int16,
        -1,
        "first level that the order rests on, or finer one with the number that is asked for, -1 for none",
    ),
    "last": ("last", np.int16, -1, "last level that the order rests on, -1 for none"),
    "culprit": ("culprit", np.int16, -1, "coarsest level that broke down, -1 for none"),
    "status": ("status", np.int8, 0, "status of each check on an order"),
    "reason": ("reason", np.int8, 0, "reason of each check on an order"),
}
"""Variable ``check_<name>``: the field of a judgement, its type, its value for a number, and its meaning.

Checks of stability, energy and equality have other numbers there: `vibsim.analysis.behaviour_measured`.
"""


def flags(names: tuple[str, ...]) -> dict[str, Any]:
    """Return the attributes of a variable that holds positions in a list of words."""
    return {"flag_values": np.arange(len(names), dtype=np.int8), "flag_meanings": " ".join(names)}


FORESEEN: Mapping[str, str] = {
    "more": "finer levels that each check on an order probably needs, 0 where no finer one mends a number, -1 unknown",
    "readable": "finest level at which each check can read an order, -1 unknown",
    "compensated": "the same in compensated arithmetic",
    "cause": "why the order of each check is another one, as far as it is known",
}
"""Variable ``check_<name>`` of small whole numbers: what would settle a check on an order, or explain it."""

_WORDS = {"status": STATUSES, "reason": REASON_NAMES, "cause": CAUSES}


def measured(part: Part, compared: Mapping[str, Comparison]) -> dict[str, Variable]:
    """Return what every check measured, shape (check, scheme, case), and what its picture needs beside that."""
    checks = part.experiment.checks
    table: dict[str, NDArray[Any]] = {
        name: np.full((len(checks), *part.shape), empty, dtype=kind)
        for name, (_, kind, empty, _) in FIELDS.items()
    }
    table |= {
        name: np.full((len(checks), *part.shape), 0 if name == "cause" else UNKNOWN, dtype=np.int8)
        for name in FORESEEN
    }
    words = {name: row[3] for name, row in FIELDS.items()} | dict(FORESEEN)
    rows: list[tuple[str, behaviour_measured.Row]] = []
    for i, check in enumerate(checks):
        inner = check.measured
        if inner.kind == "converges":
            judged = judge_check(compared[inner.converges], inner)
            for name, (of, *_) in FIELDS.items():
                table[name][i] = getattr(judged, of)
            for name, codes in _foreseen(compared, inner, judged).items():
                table[name][i] = codes
        elif inner.kind == "value":
            at = inner.at
            place = values.Place(part, compared, inner.quantity or "", at.level, at.t, at.step)
            table["value"][i], table["high"][i] = best.value(inner.value, place)
            table["more"][i], table["first"][i], row = _along_levels(
                inner, place, table["value"][i]
            )
            rows.append((inner.kind, row))
        else:
            row = behaviour_measured.measure(part, compared, inner)
            rows.append((inner.kind, row))
            for name in FIELDS.keys() & row.keys():
                table[name][i] = row[name]
    dims = ("check", "scheme", "case")
    if not checks:
        return {}
    found = {
        f"check_{name}": Variable(dims, array, attributes(words[name], "1") | _flags_of(name))
        for name, array in table.items()
    }
    return found | shown(part, rows)


def _along_levels(
    check: ValueCheck, place: values.Place, found: Floats
) -> tuple[Codes, Codes, behaviour_measured.Row]:
    """Return what finer levels do to a number, which of them has it as asked, and the number at every level."""
    levels = place.levels
    fulfilled = compare(check, found)[0]
    is_needed = not (place.part.lean and np.all(fulfilled))
    if is_needed and by_level.has_levels(check.value):
        numbers = by_level.by_level(check.value, place)
    else:
        numbers = np.full((*found.shape, len(levels)), np.nan)
    own = by_level.own_levels(check.value, levels)
    level = place.level if place.level in own else (own or levels)[-1]
    found_at = numbers[..., : len(own)] if own else numbers
    more, first = by_level.prospects(check, found_at, own or levels, int(level), fulfilled)
    # a large sweep has no pictures of single members
    return more, first, {"numbers": np.full(1, np.nan) if place.part.lean else numbers}


def _foreseen(
    compared: Mapping[str, Comparison], check: ConvergesCheck, judged: Judgement
) -> dict[str, Codes]:
    """Return what would settle a check on an order, or explain it."""
    q, norm = compared[check.converges], check.norm
    order = order_of(q, check)
    return {
        "more": more_levels(q, judged, order, check.tolerance),
        "readable": finest_readable(q, judged, norm, order),
        "compensated": finest_readable(q, judged, norm, order, "compensated"),
        "cause": causes(q, compared, judged, norm, order, check.tolerance),
    }


def _flags_of(name: str) -> dict[str, Any]:
    return flags(_WORDS[name]) if name in _WORDS else {}


def definition(experiment: Experiment) -> str:
    """Return what the checks measure, as text: a verdict belongs to the checks that were measured."""
    rows = [check.measured.model_dump(mode="json") for check in experiment.checks]
    return json.dumps(rows, sort_keys=True)
