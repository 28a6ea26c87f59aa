"""What was computed, in words: model, initial values, times, levels, schemes, sweep."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.core.record import Record
from vibsim.core.vocabulary import HIGHEST
from vibsim.report import data
from vibsim.report.text import words

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.data import Scaling, SchemeSpec, TableSpec
    from vibsim.experiment.schema.sweep import Axis


def setup(experiment: Experiment, record: Record) -> Iterator[tuple[str, str]]:
    """Yield what was computed as pairs of a term and its text."""
    model = experiment.model.definition
    axes = experiment.sweep.axes if experiment.sweep else ()
    keys = {key for axis in axes for key in axis.keys}
    sizes = {p.key: data.pretty_unit(p.unit) for p in model.parameters}
    units = {state.name: data.pretty_unit(state.unit) for state in model.states}
    yield "Model", f"{model.title}: {model.equation}"
    yield from (("Table", _table(name, spec)) for name, spec in experiment.model.tables.items())
    if experiment.units:
        yield "Units of the file", ", ".join(_units(experiment.units))
    if experiment.scaling is not None:
        yield "Scaled", _scaled(experiment.scaling, sizes, units)
        sizes, units = {}, {}
    yield "Parameters", _listing("model", experiment.model.parameters, sizes, keys)
    yield "Initial values", _listing("initial", experiment.initial, units, keys)
    yield from _grid(experiment, record)
    if experiment.tolerance is not None:
        bound = words.number(experiment.tolerance, "step")
        yield "Tolerance", f"the levels were chosen so that the error bound reaches {bound}"
    if experiment.output == "best":
        yield "Output", "best.nc: the solution extrapolated over the levels, with its error bound"
    yield "Schemes", "; ".join(_scheme(spec, keys) for spec in experiment.schemes)
    if axes:
        count = words.number(len(record["case"]), "integer")
        yield "Sweep", f"{count} members. {'; '.join(map(_axis, axes))}"


def _units(units: Mapping[str, str]) -> Iterator[str]:
    for name, text in units.items():
        number, _, base = text.partition(" ")
        yield f"1 {name} = {number} {data.pretty_unit(base)}".rstrip()


def _table(name: str, spec: TableSpec) -> str:
    """Write where a table stands, and whether steps end at its points."""
    told = (
        "no step has one of its points inside"
        if spec.is_met
        else "steps have its points inside, where the force has corners"
    )
    return f"{name} from {spec.file}, columns {spec.place} and {spec.value}; {told}"


def _scaled(scaling: Scaling, sizes: Mapping[str, str], units: Mapping[str, str]) -> str:
    """Write what the file gives, of which everything else on the page is in characteristic units."""
    parts = (
        _listing("model", scaling.parameters, sizes, set()),
        _listing("initial", scaling.initial, units, set()),
        f"end = {_plain(scaling.end)} s",
    )
    return (
        f"the file has {'; '.join(parts)}; "
        "the run is made in the scales of the table below, and every other number is dimensionless"
    )


def _scheme(spec: SchemeSpec, swept: set[str]) -> str:
    """Write a scheme: its name, its kind where that is another word, and its options."""
    options = [
        f"{key} swept" if f"schemes.{spec.name}.{key}" in swept else f"{key}: {_option(value)}"
        for key, value in spec.options.items()
        if value is not False or f"schemes.{spec.name}.{key}" in swept
    ]
    named = spec.kind if spec.name == spec.kind else f"{spec.name}: {spec.kind}"
    return f"{named} ({', '.join(options)})" if options else named


def _option(value: str | float | bool) -> str:
    return "true" if value is True else _plain(value)


def _grid(experiment: Experiment, record: Record) -> Iterator[tuple[str, str]]:
    levels, time = list(experiment.levels), data.time_unit(record, "dt")
    counts = [
        words.number(float(experiment.steps(level)), "integer") for level in (levels[0], levels[-1])
    ]
    dt = np.asarray(record["dt"], dtype=np.float64)
    sizes = [words.number(float(value), "step") for value in (dt.max(), dt.min())]
    ends = data.ends_of(record)
    extent = " … ".join(
        words.number(value, "step") for value in sorted({float(ends.min()), float(ends.max())})
    )
    yield (
        "Time",
        f"0 to {extent} {time}" + (" (differs between members)" if "end" in record else ""),
    )
    run = levels == list(range(levels[0], levels[-1] + 1))
    named = words.levels(levels) if run else ", ".join(map(str, levels))
    spread = f"{counts[0]} to {counts[1]} steps, dt = {sizes[0]} to {sizes[1]} {time}"
    yield (
        "Levels",
        f"{named}: {spread}"
        if len(levels) > 1
        else f"{named}: {counts[0]} steps, dt = {sizes[0]} {time}",
    )
    if "omega_dt" in record:
        which = {"omega_dt": "natural frequency", HIGHEST: "frequency to be resolved"}
        for name in (name for name in which if name in record):
            product = np.asarray(record[name], dtype=np.float64)
            largest = float(product[np.isfinite(product)].max(initial=0.0))
            # a ball in free fall has no frequency
            if largest > 0.0:
                yield "w dt", f"at most {words.number(largest)} ({which[name]} times step)"


def _listing(
    section: str, values: Mapping[str, Any], units: Mapping[str, str], swept: set[str]
) -> str:
    parts = (
        f"{key} swept"
        if f"{section}.{key}" in swept
        else f"{key} = {_plain(value)} {units.get(key, '')}".strip()
        for key, value in values.items()
    )
    return ", ".join(parts)


def _plain(value: Any) -> str:
    # 0.0 in place of -0.0, which a formula may give
    return f"{value + 0.0:.10g}" if isinstance(value, float) else str(value)


def _axis(axis: Axis) -> str:
    """Write an axis of the sweep: its keys with their values, or the points scattered over them."""
    from vibsim.experiment.schema.sweep import Draw

    if isinstance(axis.values, Draw):
        box = ", ".join(
            f"{key} from {_plain(low)} to {_plain(high)}"
            for key, (low, high) in zip(axis.keys, axis.values.over, strict=True)
        )
        return f"{axis.values.n} points ({axis.values.method}, seed {axis.values.seed}): {box}"
    parts = [f"{key}: {_range(values)}" for key, values in zip(axis.keys, axis.values, strict=True)]
    return " together with ".join(parts)


def _range(values: Any) -> str:
    """Write the values of a swept key: as a list, or by the rule that gives them."""
    if not isinstance(values, tuple):
        rule = next(iter(values.model_dump()))
        first, last = map(_plain, values.ends)
        return f"{words.number(values.count, 'integer')} values from {first} to {last} ({rule})"
    if len(values) <= LISTED:
        return ", ".join(map(_plain, values))
    ends = f"{_plain(values[0])}, {_plain(values[1])}, … {_plain(values[-1])}"
    return f"{ends} ({len(values)} values)"


LISTED = 8
"""Most values of a key that are written out."""
