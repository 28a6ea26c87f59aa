"""Maps over a grid of two swept parameters: verdict, order, error, period, amplitude, each beside its error bar."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibsim.checks.fields import measured
from vibsim.core.record import Record
from vibsim.core.vocabulary import REASONS, SEVERITY, TYPICAL_NORM
from vibsim.report import finest_level, style
from vibsim.report.choice import position, tolerance
from vibsim.report.data import (
    Floats,
    due,
    exact_periods,
    norm_unit,
    of_several,
    pick,
    promised_text,
    whole,
)
from vibsim.report.figures import map_panels, separatrix
from vibsim.report.figures.map_panels import Panel
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Grid
from vibsim.report.text import words

if TYPE_CHECKING:
    from vibsim.experiment import Experiment


def verdicts(
    experiment: Experiment, record: Record, grid: Grid, quantity: str, scheme: int
) -> Picture:
    """Draw verdict, order and error of a quantity with the width of their intervals."""
    name, letter = record.words("scheme")[scheme], words.symbol(quantity)
    allowed = tolerance(experiment, quantity, name)
    promised = promised_text(record, quantity, scheme)
    panels = [_reasons(record, grid, quantity, scheme)]
    if whole(record, "triple"):
        away = finest_level.deviation(record, quantity)[scheme]
        _, low, high = (part[scheme] for part in finest_level.orders(record, quantity))
        text = f"order of {letter} − {promised}"
        order = grid.worst(away, np.abs(away))
        panels.append(
            Panel(
                f"Order against the {due(record, quantity)} one", order, text, "distance", allowed
            )
        )
        panels.append(
            Panel("Error bar of the order", grid.worst(high - low), "width of the interval")
        )
        panels.append(_window(record, grid, quantity, scheme))
    panels += _errors(record, grid, quantity, scheme)
    several = of_several(record, scheme)
    marked = separatrix.separatrix(experiment, grid)
    kinds = {panel.kind for panel in panels}
    return Picture(
        name=f"map_{quantity}_{scheme}",
        title=f"Where does it converge, how fast, how well? {letter}{several}",
        caption=style.sentences(
            f"Pale colours are orders within ± {allowed:g} of the {due(record, quantity)} one, where the scale jumps."
            if "distance" in kinds
            else "",
            "Where estimated over true error is pale, two levels alone tell the error."
            if "factor" in kinds
            else "",
            _notes(panels, grid, marked),
        ),
        alt=f"Maps over two swept parameters: verdict on {words.name(quantity)}, its order and its error{several}",
        figure=map_panels.draw(grid, panels, marked),
    )


def motion(experiment: Experiment, record: Record, grid: Grid, scheme: int) -> Picture | None:
    """Draw period and amplitude with their errors; None where no member has either."""
    where = position(experiment)
    time, size = finest_level.period(record, where), finest_level.amplitude(record, where)
    panels: list[Panel] = []
    if np.isfinite(time.value[scheme]).any():
        panels += _periods(record, grid, time, scheme)
    if np.isfinite(size.value[scheme]).any():
        measure = style.label("amplitude", size.unit)
        panels.append(Panel("Amplitude", grid.worst(size.value[scheme]), measure))
        if np.isfinite(size.error[scheme]).any():
            measure = style.label("estimated error", size.unit)
            panels.append(
                Panel("Error bar of the amplitude", grid.worst(size.error[scheme]), measure)
            )
    if not panels:
        return None
    several = of_several(record, scheme)
    marked = separatrix.separatrix(experiment, grid)
    parts = [
        f"Numbers of level {whole(record, 'level')[-1]}. The error bars come from the two finest levels alone: "
        "where they agree with the true error, they can be trusted where it is not known.",
        _notes(panels, grid, marked),
    ]
    return Picture(
        name=f"map_period_{scheme}",
        title=f"Period and amplitude{several}",
        caption=style.sentences(*parts),
        alt=f"Maps of the period, the exact period, the error of the period and the amplitude{several}",
        figure=map_panels.draw(grid, panels, marked),
    )


SHOWN_ALREADY = ("period", "period_error", "exact_period", "amplitude")
"""Values of checks that have maps of their own."""


def numbers(experiment: Experiment, record: Record, grid: Grid, scheme: int) -> Picture | None:
    """Draw the numbers that checks ask for of every member; None where there are no others than those of `motion`."""
    name, panels = record.words("scheme")[scheme], []
    for check in experiment.checks:
        inner = check.measured
        if inner.kind == "value" and inner.at.case is None and inner.value not in SHOWN_ALREADY:
            values = measured(record, check.id, "value")[scheme]
            if inner.at.scheme in (None, name) and np.isfinite(values).any():
                of = f" of {words.symbol(inner.quantity)}" if inner.quantity else ""
                text = f"{inner.value}{of}".replace("_", " ")
                panels.append(Panel(check.id, grid.worst(values, np.abs(values)), text))
    if not panels:
        return None
    several = of_several(record, scheme)
    marked = separatrix.separatrix(experiment, grid)
    return Picture(
        name=f"map_checks_{scheme}",
        title=f"The numbers that the checks are about{several}",
        caption=style.sentences(
            "Each panel has the name of its check.", _notes(panels, grid, marked)
        ),
        alt=f"Maps of the numbers that checks ask for{several}",
        figure=map_panels.draw(grid, panels, marked),
    )


FEW = 5.0
"""Periods that spread by this factor have a logarithmic scale: those of rotation are much shorter."""


def _periods(record: Record, grid: Grid, time: finest_level.Measured, scheme: int) -> list[Panel]:
    exact = exact_periods(record)
    known = np.isfinite(exact)
    value, label = time.value[scheme], style.label("period", time.unit)
    both = np.concatenate([value[np.isfinite(value)], exact[known]])
    panels = [Panel("Period", grid.worst(value), label, scale=both, spread=FEW)]
    if known.any():
        panels.append(
            Panel(
                "Exact period",
                grid.worst(np.where(known, exact, np.nan)),
                label,
                scale=both,
                spread=FEW,
            )
        )
        relative = finest_level.period_error(record, -1)[scheme]
        panels.append(
            Panel("Relative error of the period", grid.worst(relative), "|period / exact − 1|")
        )
    if np.isfinite(time.error[scheme]).any():
        with np.errstate(invalid="ignore", divide="ignore"):
            relative = time.error[scheme] / value
        panels.append(
            Panel("Error bar of the period", grid.worst(relative), "estimated error / period")
        )
    return panels


def _reasons(record: Record, grid: Grid, quantity: str, scheme: int) -> Panel:
    """Return the map of verdicts: one colour per reason, the worst of a block."""
    name = f"{quantity}_reason"
    reason, meanings = record[name][scheme], record.meanings(name)
    counted = {int(code): int(np.sum(reason == code)) for code in np.unique(reason)}
    ranked = sorted(counted, key=lambda code: (SEVERITY[REASONS[meanings[code]]], -counted[code]))
    place = np.zeros(reason.shape)
    for i, code in enumerate(ranked):
        place[reason == code] = i
    codes = tuple(
        (
            f"{REASONS[meanings[code]]}: {meanings[code]} ({words.number(counted[code], 'integer')})",
            style.REASON_COLOURS[meanings[code]],
        )
        for code in ranked
    )
    return Panel("Verdict", grid.worst(place), "", "code", codes=codes)


def _window(record: Record, grid: Grid, quantity: str, scheme: int) -> Panel:
    """Return the map of the coarsest level that the stated order rests on."""
    first = pick(record, f"{quantity}_window_first", scheme=scheme).astype(np.float64)
    levels = whole(record, "level")
    colours = _shades(len(levels))
    present = [level for level in levels if np.any(first == level)]
    place = np.full(first.shape, np.nan)
    for i, level in enumerate(present):
        place[first == level] = i
    counts = [words.number(int(np.sum(first == level)), "integer") for level in present]
    codes = tuple(
        (f"from level {level} on ({count})", colours[levels.index(level)])
        for level, count in zip(present, counts, strict=True)
    )
    return Panel("Levels that the order rests on", grid.worst(place), "", "code", codes=codes)


def _shades(count: int) -> list[str]:
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["viridis"](x)) for x in np.linspace(1.0, 0.0, count)]


def _errors(record: Record, grid: Grid, quantity: str, scheme: int) -> list[Panel]:
    found = finest_level.error(record, quantity)
    measure = norm_unit(record, quantity, TYPICAL_NORM)
    kind = "true" if found.is_known else "estimated"
    letter, level = words.symbol(quantity), whole(record, "level")[-1]
    text = style.label(f"{kind} error of {letter} ({TYPICAL_NORM})", measure)
    panels = [
        Panel(f"Error on level {level}", grid.worst(style.positive(found.best[scheme])), text)
    ]
    if not np.isfinite(found.estimate[scheme]).any():
        return panels
    with np.errstate(invalid="ignore", divide="ignore"):
        if found.is_known:
            ratio = style.positive(found.estimate[scheme] / found.true[scheme])
            worst = grid.worst(ratio, np.abs(np.log(ratio)))
            return [
                *panels,
                Panel("Can the estimate be trusted?", worst, "estimated / true error", "factor"),
            ]
        width = (found.high - found.low)[scheme] / found.estimate[scheme]
    return [
        *panels,
        Panel("Error bar of the error", grid.worst(style.positive(width)), "relative width"),
    ]


def _notes(panels: list[Panel], grid: Grid, marked: tuple[Floats, Floats]) -> str:
    """Explain what is grey, dotted or gathered in blocks; nothing that is not there."""
    return style.sentences(
        "Grey hatched cells have no such number."
        if any(panel.has_gaps for panel in panels)
        else "",
        "The dotted line is the separatrix, where the exact period is infinite."
        if marked[0].size
        else "",
        grid.note,
    )
