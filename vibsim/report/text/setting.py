"""What was computed, in words: model, initial values, times, levels, schemes, sweep."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from vibsim.core.set_option import set_options
from vibsim.core.vocabulary import HIGHEST
from vibsim.report import data, words
from vibsim.report.data import Results
from vibsim.report.text import structure
from vibsim.report.types import Axis, SchemeSpec

LISTED = 8  # most values of a key in a list
MOST_LISTED = 16  # parameters or initial values in a list
NO_LETTERS: Mapping[str, str] = {}


def not_in_file(settings: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the values that the command line set in place of those of the file."""
    if settings:
        yield "Not as in the file", f"the run had{set_options(settings)}"


def setup(record: Results) -> Iterator[tuple[str, str]]:
    """Yield the setup of a run as pairs of term and text."""
    experiment, model = record.experiment, record.model
    axes = experiment.sweep.axes if experiment.sweep else ()
    keys = {key for axis in axes for key in axis.keys}
    sizes = {p.key: data.pretty_unit(p.unit) for p in model.parameters}
    units = {state.name: data.pretty_unit(state.unit) for state in model.states}
    letters = {p.key: p.name for p in model.parameters}
    yield "Model", model.title
    yield from not_in_file(experiment.settings)
    for name, spec in experiment.model.tables.items():
        corners = "steps contain its points, where the force has corners"
        steps = "no step contains one of its points" if spec.is_met else corners
        yield "Table", f"{name} from {spec.file}, columns {spec.place} and {spec.value}; {steps}"
    if model.loaded is not None and experiment.model.structure is not None:
        yield from structure.rows(experiment.model.structure, model.loaded)
    if experiment.units:
        parts = [(name, *text.partition(" ")) for name, text in experiment.units.items()]
        conversions = [
            f"1 {name} = {number} {data.pretty_unit(base)}" for name, number, _, base in parts
        ]
        yield "Units of the file", ", ".join(text.rstrip() for text in conversions)
    if (scaling := experiment.scaling) is not None:
        # the rest of the page is dimensionless
        parameters = _listing("model", scaling.parameters, sizes)
        initial = _listing("initial", scaling.initial, units)
        note = "the run uses the scales of the table below, and every other number is dimensionless"
        original = f"the file has {parameters}; {initial}; end = {_plain(scaling.end)} s"
        yield "Scaled", f"{original}; {note}"
        sizes, units = {}, {}
    yield "Parameters", _listing("model", experiment.model.parameters, sizes, keys, letters)
    yield "Initial values", _listing("initial", experiment.initial, units, keys)
    yield from _times(record)
    if experiment.tolerance is not None:
        bound = words.number(experiment.tolerance, "step")
        yield "Tolerance", f"the levels were chosen so that the error bound reaches {bound}"
    if experiment.output == "best":
        yield "Output", "best.nc: the solution extrapolated over the levels, with its error bound"
    yield "Schemes", "; ".join(_scheme(spec, keys) for spec in experiment.schemes)
    if axes:
        count = words.number(record.count, "integer")
        yield "Sweep", f"{count} members. {'; '.join(map(_axis, axes))}"
    if experiment.sweep is not None and experiment.sweep.follow:
        last = f"the last state of the one before along {experiment.sweep.follow}"
        yield "Starts", f"each member starts from {last}, at its own level"


def _scheme(spec: SchemeSpec, swept: set[str]) -> str:
    """Write a scheme: its name, its kind if that differs, and its options."""
    options = []
    for key, value in spec.options.items():
        if f"schemes.{spec.name}.{key}" in swept:
            options.append(f"{key} swept")
        elif value is not False:
            options.append(f"{key}: {'true' if value is True else _plain(value)}")
    name = spec.kind if spec.name == spec.kind else f"{spec.name}: {spec.kind}"
    return f"{name} ({', '.join(options)})" if options else name


def _times(record: Results) -> Iterator[tuple[str, str]]:
    levels, time = list(record.experiment.levels), record.time_unit
    counts = [words.number(float(record.experiment.steps(level)), "integer") for level in levels]
    dt, ends = np.asarray(record["dt"], dtype=np.float64), record.ends
    extent = [words.number(x, "step") for x in sorted({float(ends.min()), float(ends.max())})]
    differs = " (differs between members)" if "end" in record else ""
    yield "Time", f"0 to {' … '.join(extent)} {time}{differs}"
    run = levels == list(range(levels[0], levels[-1] + 1))
    listed = words.levels(levels) if run else ", ".join(map(str, levels))
    sizes = [words.number(float(value), "step") for value in (dt.max(), dt.min())]
    # a single level has one number of steps and one step size
    steps, sizes = (pair[: len(levels)] for pair in ([counts[0], counts[-1]], sizes))
    yield "Levels", f"{listed}: {' to '.join(steps)} steps, dt = {' to '.join(sizes)} {time}"
    if "omega_dt" in record:
        last = 0.0
        for name, term, text in (
            ("omega_dt", "w dt", "natural frequency"),
            (HIGHEST, "Highest w dt", "frequency of the fastest oscillation"),
        ):
            largest = data.largest(np.asarray(record[name], np.float64)) if name in record else 0.0
            # a ball in free fall has no frequency; of a single oscillation both frequencies are the same
            if largest > 0.0 and largest != last:
                last = largest
                yield term, f"at most {words.number(largest)} ({text} times step)"


def _listing(
    section: str, values: Mapping[str, Any], units: Mapping[str, str], swept: Collection[str] = (),
    letters: Mapping[str, str] = NO_LETTERS,
) -> str:  # fmt: skip
    """List values by their letters in the equation, with the key if it differs, or by the key alone."""
    parts = list[str]()
    rest = len(values) - MOST_LISTED
    for key, value in values.items():
        if len(parts) == MOST_LISTED and rest > 1:
            return f"{', '.join(parts)}, and {rest} more, as the file below gives them"
        name = letters.get(key, key)
        value_text = (
            "swept" if f"{section}.{key}" in swept else f"= {_plain(value)} {units.get(key, '')}"
        )
        parts.append(
            f"{name} {value_text.strip()}{'' if key in (name, f'parameters.{name}') else f' ({key})'}"
        )
    return ", ".join(parts)


def _plain(value: Any) -> str:
    # writes -0.0, which a formula may give, as 0
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
