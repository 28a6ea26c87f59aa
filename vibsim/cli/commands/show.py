"""``vibsim show``: print the verdicts of an experiment, and its solution as a text plot."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibsim.cli import level_member, outcome_text, terminal
from vibsim.cli.chosen_plans import one_plan_of
from vibsim.cli.jobs.common import chosen_results
from vibsim.cli.setting_changes import shown
from vibsim.cli.terminal import clean
from vibsim.plan import Plan

if TYPE_CHECKING:
    from vibsim.cli.line_plot import Series
    from vibsim.core.array_types import Floats
    from vibsim.core.record import Record


def show(options: Namespace) -> int:
    """Draw the finest existing level, and print the verdicts below it, where the user sees them last.

    In a terminal both fit on the screen. Of a sweep, and of several schemes, the plot shows what decides the verdict.
    """
    if options.what.endswith(".nc"):
        options.rows = options.rows or terminal.rows()
        _draw(level_member.read(Path(options.what), options.case or 0), options, options.what)
        return 0
    plan = one_plan_of(options.what, options.settings)
    results = chosen_results(options)
    summary = level_member.summary_of(plan, results)
    case, scheme = level_member.decisive(plan, summary)
    case = case if options.case is None else options.case
    options.scheme = options.scheme or scheme
    verdicts = "\n".join(_verdicts(plan, results, summary))
    options.rows = options.rows or terminal.rows(taken=verdicts.count("\n"))
    levels, made = level_member.made(plan, results, case, options.what)
    if options.level is not None:
        level_member.check_level(options.level, levels)
    if not options.no_plot:
        level = made[-1] if options.level is None else options.level
        record = level_member.of_level(plan, results, level, case)
        _draw(record, options, f"{plan.key}, level {level}")
    if len(made) < len(levels):
        is_one = len(made) == 1
        text = f"level{'' if is_one else 's'} {shown(made)} {'is' if is_one else 'are'} there"
        print(f"{text}, of levels {shown(levels)}; the others are not made yet")
    print(verdicts)
    return 0


def _verdicts(plan: Plan, results: Path, summary: Mapping[str, Any] | None) -> Iterator[str]:
    """Yield every verdict, with a note if the experiment has changed since."""
    if summary is None:
        yield f"{plan.key}: there are no verdicts yet"
        return
    if level_member.are_outdated(plan, summary):
        yield level_member.OUTDATED
    yield from outcome_text.in_full([summary], terminal.columns())
    page = results / plan.page
    if page.is_file():
        yield f"report: {page}"


def _draw(record: Record, options: Namespace, title: str) -> None:
    from vibsim.cli.line_plot import draw, legend

    names = level_member.series(record)
    if not names:
        print(f"{title}: it has no series over time that could be drawn\n")
        return
    schemes = record.words("scheme")
    quantity = level_member.chosen("--quantity", options.quantity, names)
    scheme = schemes.index(level_member.chosen("--scheme", options.scheme, schemes))
    series = _series(record, quantity, scheme)
    start = options.start or 0.0
    drawing = draw(series, terminal.columns(), options.rows, start)
    print(f"{title}{_member(record)}, scheme {schemes[scheme]}: {legend(series)}")
    print(*drawing.lines, sep="\n")
    if not drawing.shown:
        print(f"  nothing from t = {start:g} on: the last time is {series.t[-1]:g}")
    elif drawing.shown[-1] + drawing.shown.step < len(series.t):
        last = f"{series.t[drawing.shown[-1]]:.5g}"
        print(f"  to t = {last} of {series.t[-1]:.5g}; see more with --from {last} or --rows N")
    print()


def _member(record: Record) -> str:
    """Return the number of a member and its swept values as text; empty without a sweep."""
    swept = []
    for name, row in record.coords.items():
        if "sweep_key" in row.attrs:
            value = record.words(name)[0] if row.values.dtype.kind in "SU" else f"{row.values[0]:g}"
            swept.append(clean(f"{row.attrs['sweep_key']} = {value}"))
    return f", member {record['case'][0]} ({', '.join(swept)})" if swept else ""


def _series(record: Record, quantity: str, scheme: int) -> Series:
    from vibsim.cli.line_plot import Series

    row = record.variable(quantity)
    name = f"{quantity}_exact"
    exact: Floats | None = record[name][0] if name in record else None
    # where members have different end times, t is the fraction of the end
    times = record["t"] * (float(record["end"][0]) if "end" in record.coords else 1.0)
    unit = str(row.attrs.get("units", ""))
    # only a computed reference has a bound of its error
    word = "reference" if f"{name}_error" in record else "exact"
    period = _period(record, scheme)
    return Series(quantity, unit, times, row.values[scheme, 0], exact, period, word)


def _period(record: Record, scheme: int) -> float:
    """Return the exact period, else the measured one, else that of small oscillations; NaN if there is none."""
    frequency = _number(record, "natural_frequency", scheme)
    periods = [_number(record, name, scheme) for name in ("exact_period", "period")]
    periods.append(2 * math.pi / frequency if frequency > 0 else math.nan)
    return next((period for period in periods if math.isfinite(period) and period > 0), math.nan)


def _number(record: Record, name: str, scheme: int) -> float:
    """Return a scalar of the member; NaN if the file does not have it as one."""
    dims = record.variable(name).dims if name in record else ()
    if dims == ("scheme", "case"):
        return float(record[name][scheme, 0])
    return float(record[name][0]) if dims == ("case",) else math.nan
