"""The experiment as a YAML file to copy, without defaults; and changes of it that would settle a check."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from vibsim.models.shared.crossings import is_crossing, written
from vibsim.report.text import structure
from vibsim.report.types import Check, Experiment, Measurement, SchemeSpec
from vibsim.schemes.base import LOW_STARTS

WIDTH = 100  # most characters of a line
LONG = 160  # words; a page shows longer files without their checks
DEFAULTS: Mapping[str, Any] = {
    "tolerance": 0.1, "norm": "l2", "expect": {"status": "PASS", "reason": None}, "holds": True,
}  # fmt: skip
"""Defaults of checks, which are left out."""
_PLAIN = re.compile(r"[A-Za-z][\w .,()/%^+*=-]*(?<! )")
_WORDS = re.compile(r"(?i)true|false|yes|no|on|off|null|y|n|\d.*|[-+.].*")


def shown(experiment: Experiment) -> str:
    """Return the file as a page shows it; a long one without the checks, which the page lists anyway."""
    full = text(experiment)
    if len(full.split()) <= LONG:
        return full
    head = "\n".join(_head(experiment))
    return f"{head}\n# checks: {len(experiment.checks)}, which the page lists"


def text(experiment: Experiment) -> str:
    """Return the experiment as YAML, with all numbers in the units of the run."""
    checks = _listed("checks", [_check(check) for check in experiment.checks])
    figures = [figure.model_dump(exclude_defaults=True) for figure in experiment.figures]
    return "\n".join([*_head(experiment), *checks, *_listed("figures", figures)])


def _head(experiment: Experiment) -> list[str]:
    """Return the lines of all sections except checks and figures."""
    lines = [f"title: {_value(experiment.title)}"]
    lines += [f"source: {_value(experiment.source)}"] if experiment.source else []
    model, scaling = experiment.model, experiment.scaling
    section: dict[str, Any] = {"kind": model.kind}
    if model.coordinates:
        section["coordinates"] = list(model.coordinates)
    for key, value in (scaling or model).parameters.items():
        _put(section, key.split("."), value)
    for key, formula in model.formulas.items():
        if key not in section and not is_crossing(key) and model.structure is None:
            _put(section, key.split("."), formula)
    for key in ("kinetic", "potential"):
        terms = section.get(key)
        if isinstance(terms, dict):
            section[key] = [terms[str(i)] for i in range(len(terms))]
    section |= written(model.formulas)
    section |= {
        name: {"table": spec.file}
        | ({"at": model.formulas[name]} if name in model.formulas else {})
        for name, spec in model.tables.items()
    }
    if model.structure is not None:
        section |= structure.as_written(model.structure, model.formulas)
    lines.append(f"model: {_value(section)}")
    # otherwise the section `model` gives the start of the motion
    if model.structure is None or model.structure.is_free:
        lines.append(f"initial: {_value((scaling or experiment).initial)}")
    time = experiment.time.model_dump(exclude_none=True)
    if time.get("periods") is not None:
        steps = time["base_steps"] / time["periods"]
        frequency = {"frequency": f"model.{time['frequency']}"} if "frequency" in time else {}
        time = {"periods": time["periods"], "steps_per_period": steps, **frequency}
    elif time.get("steps_per_point") is not None:
        time = {"steps_per_point": time["steps_per_point"]}
    elif time["base_steps"] == 1:
        del time["base_steps"]
    if scaling is not None:
        time = time | {"end": scaling.end}
        lines.append("scaled: true")
    lines += [f"time: {_value(time)}", f"levels: {_value(_levels(experiment.levels))}"]
    lines += schemes(experiment)
    if experiment.sweep:
        axes = experiment.sweep.model_dump(mode="json")["axes"]
        lines += ["sweep:", *(f"  {line}" for axis in axes for line in _axis(axis))]
        lines += [f"  follow: {experiment.sweep.follow}"] if experiment.sweep.follow else []
    if (samples := experiment.samples) != "auto":
        lines.append(
            f"samples: {samples if isinstance(samples, str) else _value({'every': samples})}"
        )
    if experiment.output != "verdict":
        lines.append(f"output: {experiment.output}")
    if experiment.published:
        lines.append("# and the printed numbers, which the page lists")
    if experiment.tolerance is not None:
        lines.append(f"tolerance: {_value(experiment.tolerance)}")
    return lines


def schemes(experiment: Experiment, name: str = "", **changed: Any) -> list[str]:
    """Return the lines of the schemes, with the options `changed` of the scheme `name`, even if they are defaults."""
    rows = [_scheme(spec, changed if spec.name == name else {}) for spec in experiment.schemes]
    return _listed("schemes", rows)


def _put(section: dict[str, Any], keys: Sequence[str], value: Any) -> None:
    for key in keys[:-1]:
        section = section.setdefault(key, {})
    section[keys[-1]] = value


def _levels(levels: Sequence[int]) -> Any:
    is_run = list(levels) == list(range(levels[0], levels[-1] + 1)) and len(levels) > 2
    return {"from": levels[0], "to": levels[-1]} if is_run else list(levels)


def _scheme(spec: SchemeSpec, changed: Mapping[str, Any]) -> Any:
    defaults = {option.name: option.default for option in spec.method.options}
    options: dict[str, Any] = {"label": spec.name} if spec.name != spec.kind else {}
    options |= {k: v for k, v in spec.options.items() if defaults.get(k, ...) != v}
    options |= changed
    return {"kind": spec.kind, **options} if options else spec.kind


def _axis(axis: Mapping[str, Any]) -> list[str]:
    keys, values = axis["keys"], axis["values"]
    if not isinstance(values, list):
        return [f"{', '.join(keys)}: {_value(values)}"]
    rows = [f"{key}: {_value(value)}" for key, value in zip(keys, values, strict=True)]
    return rows if len(rows) == 1 else ["zip:", *(f"  {row}" for row in rows)]


def _check(check: Check) -> dict[str, Any]:
    fields = check.model_dump(mode="json")
    if check.kind == "claim":
        fields["that"] = _check(check.that)
        fields["that"].pop("id", None)
    if isinstance(fields.get("at"), dict):
        fields["at"] = {k: v for k, v in fields["at"].items() if v is not None}
    return {k: v for k, v in fields.items() if v not in (None, {}, DEFAULTS.get(k))}


def _listed(name: str, rows: Sequence[Any]) -> list[str]:
    """Write a section that is a list, in one line if it fits."""
    if not rows:
        return []
    short = f"{name}: {_value(list(rows))}"
    return [short] if len(short) <= WIDTH else [f"{name}:", *(f"  - {_value(row)}" for row in rows)]


def _value(value: Any) -> str:
    """Write a value in the flow style of YAML, which differs from JSON only in its quotes."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {_value(item)}' for key, item in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, str):
        is_plain = _PLAIN.fullmatch(value) and not _WORDS.fullmatch(value) and "," not in value
        return value if is_plain else json.dumps(value, ensure_ascii=False)
    return json.dumps(value)


MOST_LEVELS = 6  # most finer levels that are proposed; else another problem is a better choice
WINDOW = 3  # levels coarser than the finest readable one that show an order


def change(experiment: Experiment, measured: Measurement | None, check: Mapping[str, Any]) -> str:
    """Return lines of YAML that would settle a check; empty if no fact suggests any."""
    if check["status"] == "PASS" or measured is None or experiment.tolerance is not None:
        return ""
    result = check["results"][0]
    facts, reason = result["facts"], result["reason"]
    spec = next((spec for spec in experiment.schemes if spec.name == result["scheme"]), None)
    if reason == "order_low" and spec is not None and spec.options.get("start") in LOW_STARTS:
        return "\n".join(schemes(experiment, spec.name, start="centred"))
    levels = list(experiment.levels)
    if levels != list(range(levels[0], levels[-1] + 1)):
        return ""
    # in a check of a value this fact is a code, not a count
    more = (facts.get("levels_needed") or 0) if measured.kind == "converges" else 0
    ends = next(_ends(levels, reason, facts, more), None)
    return "" if ends is None else f"levels: {{from: {ends[0]}, to: {ends[1]}}}"


def _ends(
    levels: list[int], reason: str | None, facts: Mapping[str, Any], more: int
) -> Iterator[tuple[int, int]]:
    """Yield pairs of coarsest and finest level that would settle the check."""
    if 0 < more <= MOST_LEVELS:
        yield levels[0], levels[-1] + more
    needed = facts.get("level_needed") or -1
    if levels[-1] < needed <= levels[-1] + MOST_LEVELS:
        yield levels[0], needed
    readable = facts.get("readable_level") or -1
    if reason == "round_off" and WINDOW - 1 <= readable < levels[-1]:
        yield max(readable - WINDOW, 0), readable
