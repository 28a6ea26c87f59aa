"""``vibsim show``: the verdicts of an experiment, and its solution drawn down the screen."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from vibsim.cli import outcome_text, settings, terminal
from vibsim.cli.chosen_plans import one_plan_of
from vibsim.cli.jobs.common import chosen_results, refusal
from vibsim.cli.terminal import clean
from vibsim.core.errors import VibsimError, nearest
from vibsim.plan import Plan
from vibsim.store import read_json

if TYPE_CHECKING:
    from vibsim.cli.line_plot import Series
    from vibsim.core.array_types import Floats
    from vibsim.core.record import Record

_OUTDATED = "note: these results were made before the experiment or vibsim changed; run it again for new ones"
_OVER_TIME = ("scheme", "case", "t")


def show(options: Namespace) -> int:
    """Draw the finest level that is there, and show the verdicts below it, where they come last on the screen."""
    if options.what.endswith(".nc"):
        _draw(_read(Path(options.what), options.case or 0), options, options.what)
        return 0
    plan = one_plan_of(options.what)
    results = chosen_results(options)
    case = options.case or 0
    if not 0 <= case < plan.cases:
        raise refusal("--case", case, f"must be from 0 to {plan.cases - 1}")
    levels = [level.level for level in plan.levels]
    if options.level is not None and options.level not in levels:
        raise refusal("--level", options.level, f"must be one of {', '.join(map(str, levels))}")
    made = [level for level in levels if _is_there(plan, results, level, case)]
    if not made:
        raise VibsimError(f"{plan.key}: there are no results yet: vibsim run {options.what}")
    if not options.no_plot:
        level = made[-1] if options.level is None else options.level
        _draw(_of_level(plan, results, level, case), options, f"{plan.key}, level {level}")
    if len(made) < len(levels):
        one = len(made) == 1
        there = f"level{'' if one else 's'} {settings.shown(made)} {'is' if one else 'are'} there"
        print(f"{there}, of levels {settings.shown(levels)}; the others are not made yet")
    _verdicts(plan, results)
    return 0


def _verdicts(plan: Plan, results: Path) -> None:
    """Print every verdict of the experiment as it is now."""
    path = results / plan.summary
    if not path.exists():
        print(f"{plan.key}: there are no verdicts yet")
        return
    summary = read_json(path, name=plan.key)
    if summary.get("digest") != plan.analysis:
        print(_OUTDATED)
    print(*outcome_text.in_full([summary], terminal.columns()), sep="\n")
    page = results / plan.page
    if page.is_file():
        print(f"report: {page}")


def _path(plan: Plan, level: int, case: int) -> tuple[str, int]:
    """Return the file of a member at a level, and the first member in it."""
    shards = plan.level(level).shards
    shard = next(shard for shard in shards if shard.start <= case < shard.stop)
    return shard.path, shard.start


def _is_there(plan: Plan, results: Path, level: int, case: int) -> bool:
    return (results / _path(plan, level, case)[0]).is_file()


def _of_level(plan: Plan, results: Path, level: int, case: int) -> Record:
    path, first = _path(plan, level, case)
    return _read(results / path, case - first)


def _read(path: Path, place: int) -> Record:
    """Return one member of a level file, by its place in it."""
    from vibsim import store

    try:
        store.check(path)
        with store.open_level([(path, None)]) as level:
            if not 0 <= place < level.cases:
                raise refusal("--case", place, f"{path}: must be from 0 to {level.cases - 1}")
            return level.read(place, place + 1)
    except KeyError:
        # a level of a solver of the user need not have members
        return store.read(path)


def _draw(record: Record, options: Namespace, title: str) -> None:
    """Print the plot of one quantity of one scheme."""
    from vibsim.cli.line_plot import draw, legend

    names = [name for name, row in record.variables.items() if row.dims == _OVER_TIME]
    if not names:
        print(f"{title}: it has no series over time that could be drawn\n")
        return
    schemes = record.words("scheme")
    quantity = _chosen("--quantity", options.quantity, names)
    scheme = schemes.index(_chosen("--scheme", options.scheme, schemes))
    series = _series(record, quantity, scheme)
    drawing = draw(series, terminal.columns(), options.rows, options.start)
    print(f"{title}{_member(record)}, scheme {schemes[scheme]}: {legend(series)}")
    print(*drawing.lines, sep="\n")
    if not drawing.shown:
        print(f"  nothing from t = {options.start:g} on: the last time is {series.t[-1]:g}")
    elif drawing.shown[-1] + drawing.shown.step < len(series.t):
        last = f"{series.t[drawing.shown[-1]]:.5g}"
        print(f"  to t = {last} of {series.t[-1]:.5g}; see more with --from {last} or --rows N")
    print()


def _member(record: Record) -> str:
    """Name the member of a sweep with its swept values; empty without a sweep."""
    swept = []
    for name, row in record.coords.items():
        if "sweep_key" in row.attrs:
            value = record.words(name)[0] if row.values.dtype.kind in "SU" else f"{row.values[0]:g}"
            swept.append(clean(f"{row.attrs['sweep_key']} = {value}"))
    return f", member {record['case'][0]} ({', '.join(swept)})" if swept else ""


def _chosen(option: str, wanted: str | None, names: Sequence[str]) -> str:
    if wanted is None:
        return names[0]
    if wanted not in names:
        raise refusal(option, wanted, "is not in this file", nearest(wanted, names))
    return wanted


def _series(record: Record, quantity: str, scheme: int) -> Series:
    from vibsim.cli.line_plot import Series

    row = record.variable(quantity)
    name = f"{quantity}_exact"
    exact: Floats | None = record[name][0] if name in record else None
    # members that end at times of their own have these as fractions of them
    times = record["t"] * (float(record["end"][0]) if "end" in record.coords else 1.0)
    unit = str(row.attrs.get("units", ""))
    return Series(quantity, unit, times, row.values[scheme, 0], exact, _period(record, scheme))


def _period(record: Record, scheme: int) -> float:
    """Return the exact period, else the measured one, else that of small oscillations; NaN without any."""
    frequency = _number(record, "natural_frequency", scheme)
    found = [_number(record, name, scheme) for name in ("exact_period", "period")]
    found.append(2 * math.pi / frequency if frequency > 0 else math.nan)
    return next((period for period in found if math.isfinite(period) and period > 0), math.nan)


def _number(record: Record, name: str, scheme: int) -> float:
    """Return a number of the member; NaN where the file has none, or one for each level."""
    dims = record.variable(name).dims if name in record else ()
    if dims == _OVER_TIME[:2]:
        return float(record[name][scheme, 0])
    return float(record[name][0]) if dims == _OVER_TIME[1:2] else math.nan
