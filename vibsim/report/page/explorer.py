"""The members of a sweep as data of a page: positions in the views, numbers, verdicts, commands.

To limit the size of a page, only some of very many members respond to the pointer: an even subset, and the worst ones.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from shlex import quote
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.array_types import Floats
from vibsim.core.home import called
from vibsim.core.set_option import set_options
from vibsim.report import style, sweep_layout, words
from vibsim.report.data import Results
from vibsim.report.figures.sweeps.view import View
from vibsim.report.sweep_layout import Key
from vibsim.report.types import Experiment

POINTS = 2000  # most points of a view that respond to the pointer


def worst(record: Results, views: Sequence[View]) -> list[tuple[str, str, str]]:
    """Return the marked members: the letters of the quantities, the name of the member, and its command."""
    found: dict[int, dict[str, None]] = {}
    for view in views:
        if view.worst is not None:
            found.setdefault(view.worst, {})[words.symbol(view.quantity)] = None
    start, end = _around(record.experiment)
    rows = []
    for case, letters in found.items():
        command = f"{start}{int(record['case'][case])}{end}"
        rows.append((", ".join(letters), words.swept(record.case_name(case)), command))
    return rows


def _around(experiment: Experiment) -> tuple[str, str]:
    """Return the parts of the command of a member before and after its number."""
    if experiment.chain > 1:
        # members that start from others cannot run alone
        return called(f"vibsim show {quote(experiment.word)} --case "), ""
    start, _, end = quote(f"{experiment.word}@0").rpartition("0")
    return called(f"vibsim run {start}"), end + set_options(experiment.settings)


def content(record: Results, views: Sequence[View]) -> dict[str, Any] | None:
    """Return the data for the script of a page; None without a view."""
    if not views:
        return None
    keys = sweep_layout.keys(record)
    most = POINTS // max(len(view.schemes) for view in views)
    marked = [view.worst for view in views if view.worst is not None]
    cases = listed(keys, record.count, most, marked)
    quantities = dict.fromkeys(view.quantity for view in views)
    return {
        "command": _around(record.experiment),
        "count": record.count,
        "cases": record["case"][cases].tolist(),
        "keys": [
            {"name": key.key, "unit": key.unit, "words": key.words, "values": _numbers(key.values[cases], 6)}
            for key in keys
        ],
        "schemes": record.schemes,
        "verdicts": {name: found for name in quantities if (found := _verdicts(record, name, cases))},
        "views": {view.picture.name: _view(view, cases) for view in views},
    }  # fmt: skip


def listed(keys: Sequence[Key], count: int, most: int, marked: Iterable[int]) -> NDArray[np.intp]:
    """Return the positions of about `most` members at most, and of the marked ones, in ascending order.

    On a grid they form a coarser grid of evenly chosen values of each key.
    """
    if count <= most:
        return np.arange(count)
    room, is_shown = most, np.ones(count, dtype=bool)
    for i, key in enumerate(sorted(keys, key=lambda key: key.distinct.size)):
        # keys of few values leave room for the others
        part = max(int(room ** (1.0 / (len(keys) - i))), 1)
        chosen = key.distinct[style.spaced(key.distinct.size, part)]
        is_shown &= np.isin(key.values, chosen)
        room //= min(part, key.distinct.size)
    if not most / 4 <= is_shown.sum() <= most:
        is_shown = np.isin(np.arange(count), style.spaced(count, most))
    return np.union1d(np.flatnonzero(is_shown), np.fromiter(marked, dtype=np.intp))


def _view(view: View, cases: NDArray[np.intp]) -> dict[str, Any]:
    def of(values: Floats | None) -> list[Any] | None:
        return None if values is None else [_numbers(row[cases], 5) for row in values]

    position = None if view.worst is None else int(np.searchsorted(cases, view.worst))
    return {
        "name": view.name, "unit": view.unit, "quantity": view.quantity,
        "schemes": view.schemes, "panels": view.panels, "values": of(view.values), "places": of(view.places),
        "worst": position,
    }  # fmt: skip


def _verdicts(record: Results, quantity: str, cases: NDArray[np.intp]) -> dict[str, Any] | None:
    """Return the texts of the verdicts on a quantity, and their indices by scheme and member."""
    if f"{quantity}_status" not in record:
        return None
    status, reason = (record.flags(f"{quantity}_{of}")[:, cases] for of in ("status", "reason"))
    texts, place = np.unique((status + " (" + reason + ")").astype(str), return_inverse=True)
    on = words.symbol(quantity)
    return {"on": on, "texts": texts.tolist(), "of": place.reshape(status.shape).tolist()}


def _numbers(values: Any, digits: int) -> list[float | int | None]:
    """Round numbers to significant digits; None for those that are not finite."""
    rounded = (float(f"{value:.{digits}g}") for value in values.tolist())
    return [
        None if not math.isfinite(x) else int(x) if x.is_integer() and abs(x) < 1e6 else x
        for x in rounded
    ]
