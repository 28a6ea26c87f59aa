"""Whatever is in a file: an experiment, or `InputError`; never another exception."""

from __future__ import annotations

import json
from typing import Any

import pytest
from experiment_files import content
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from torture.fuzz import attempt
from torture.fuzz import experiment as read

from vibsim.experiment import Experiment, sweep_columns

QUIET = settings(
    max_examples=75, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True
)


@given(st.binary(max_size=200))
@QUIET
def test_bytes(data: bytes) -> None:
    read(data)


@given(st.text(alphabet="ab:-[]{},&*!|>'\"%@#?\n\t 01.~<\\\u2028\u0085", max_size=80))
@QUIET
def test_yaml_like_text(text: str) -> None:
    read(text.encode())


WORDS = [
    *("title", "model", "kind", "pendulum", "linear_pendulum", "g", "L", "initial", "theta"),
    *("omega", "time", "end", "base_steps", "base_dt", "periods", "steps_per_period", "levels"),
    *("from", "to", "schemes", "central", "label", "start", "first_order", "sweep", "model.g"),
    *("initial.theta", "time.end", "linspace", "samples", "auto", "every", "checks", "converges"),
    *("order", "scheme", "tolerance", "norm", "expect", "status", "reason", "FAIL", "order_low"),
    *("value", "quantity", "at", "t", "step", "level", "best", "case", "equals", "below", "rtol"),
    *("logspace", "range", "zip", "sample", "method", "n", "seed", "over", "sobol", "random"),
    *("latin_hypercube", "schemes.central.start", "centred", "output", "tolerance", "1e-9"),
    *("claim", "that", "holds", "max", "error_l2", "period", "energy", "id", "2*pi", "1/0", "\0x"),
]
SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 50),
    st.integers(),
    st.floats(),
    st.sampled_from(WORDS),
    st.text(max_size=5),
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(st.one_of(st.sampled_from(WORDS), st.text(max_size=3)), inner, max_size=4),
    ),
    max_leaves=12,
)
SECTIONS = (
    *("title", "source", "model", "initial", "time", "levels", "schemes", "sweep", "samples"),
    *("output", "tolerance"),
)
AT = st.dictionaries(st.sampled_from(["t", "step", "level", "best", "scheme", "case"]), SCALARS)
CHECK = st.dictionaries(
    st.sampled_from(
        ["converges", "value", "claim", "that", "quantity", "at", "below", "equals", "id", "expect"]
    ),
    st.one_of(VALUES, AT, st.sampled_from(WORDS)),
    max_size=5,
)
KEYS = st.one_of(
    st.sampled_from(["model.g", "model.L", "initial.theta", "time.end", "schemes.central.start"]),
    st.sampled_from(["levels", "time.base_dt", "schemes.a.start", "schemes.", "model", "."]),
)
NUMBERS = st.one_of(
    st.floats(0.1, 5.0),
    st.integers(-2, 9),
    st.floats(),
    st.sampled_from(["pi/2", "1/0", "1e400", "centred", "first_order", 0.0, -0.0, 5e-324, 1e308]),
    SCALARS,
)
COUNTS = st.one_of(st.integers(1, 9), st.sampled_from([0, 10**12, 1e12, "3"]), SCALARS)
RULE = st.one_of(
    st.lists(NUMBERS, max_size=4),
    st.fixed_dictionaries({"linspace": st.tuples(NUMBERS, NUMBERS, COUNTS)}),
    st.fixed_dictionaries({"logspace": st.tuples(NUMBERS, NUMBERS, COUNTS)}),
    st.fixed_dictionaries({"range": st.tuples(NUMBERS, NUMBERS, NUMBERS)}),
    st.dictionaries(st.sampled_from(["linspace", "logspace", "range", "n"]), VALUES, max_size=2),
    VALUES,
)
INTERVAL = st.one_of(st.tuples(NUMBERS, NUMBERS), VALUES)
SAMPLE = st.one_of(
    st.fixed_dictionaries(
        {
            "method": st.sampled_from(["sobol", "random", "latin_hypercube"]),
            "n": COUNTS,
            "over": st.dictionaries(KEYS, INTERVAL, max_size=3),
        },
        optional={"seed": COUNTS, "sed": SCALARS},
    ),
    VALUES,
)
SWEEP = st.builds(
    lambda single, more: {**single, **more},
    st.dictionaries(KEYS, RULE, max_size=3),
    st.fixed_dictionaries(
        {},
        optional={
            "zip": st.one_of(st.dictionaries(KEYS, RULE, max_size=3), VALUES),
            "sample": SAMPLE,
        },
    ),
)
POSITIVE = st.floats(0.1, 5.0)
FEW = st.integers(2, 9)
ANY_KEY = st.permutations(["model.g", "model.L", "initial.theta", "initial.omega", "time.end"])


def sound_rule(n: int) -> st.SearchStrategy[Any]:
    """Give n values above 0."""
    line, step = st.tuples(POSITIVE, POSITIVE, st.just(n)), st.tuples(POSITIVE, POSITIVE)
    return st.one_of(
        st.lists(POSITIVE, min_size=n, max_size=n),
        st.fixed_dictionaries({"linspace": line}),
        st.fixed_dictionaries({"logspace": line}),
        step.map(lambda s: {"range": [s[0], s[0] + (n - 1) * s[1], s[1]]}),
    )


@st.composite
def sound_sweeps(draw: st.DrawFn) -> dict[str, Any]:
    """Draw a sweep without fault: some keys alone, some together, some scattered."""
    keys = draw(ANY_KEY)
    first, second = sorted(draw(st.tuples(st.integers(0, 5), st.integers(1, 5))))
    sweep: dict[str, Any] = {key: draw(sound_rule(draw(FEW))) for key in keys[:first]}
    n = draw(FEW)
    if together := {key: draw(sound_rule(n)) for key in keys[first:second]}:
        sweep["zip"] = together
    if over := {key: (1, 1 + draw(POSITIVE)) for key in keys[second:]}:
        method = draw(st.sampled_from(["sobol", "random", "latin_hypercube"]))
        sweep["sample"] = {"method": method, "n": n, "seed": draw(st.integers(0, 99)), "over": over}
    if draw(st.booleans()):
        sweep["schemes.central.start"] = ["first_order", "centred"]
    return {key: sweep[key] for key in draw(st.permutations([*sweep]))}


CHANGES = st.one_of(
    st.dictionaries(st.sampled_from([*SECTIONS, "checks"]), VALUES, max_size=3),
    st.fixed_dictionaries({"checks": st.lists(CHECK, max_size=3)}),
    st.fixed_dictionaries({"sweep": SWEEP}, optional={"checks": st.lists(CHECK, max_size=1)}),
    st.fixed_dictionaries(
        {"tolerance": st.one_of(st.just(1e-6), SCALARS), "levels": st.one_of(st.none(), SCALARS)},
        optional={"checks": st.lists(CHECK, max_size=3), "output": SCALARS},
    ),
)


@pytest.mark.slow
@given(sound_sweeps())
@QUIET
def test_sound_sweeps(sweep: dict[str, Any]) -> None:
    """They are accepted, and every member alone is the member of the grid."""
    experiment = Experiment.from_dict(content(sweep=sweep, levels=[1, 2]))
    attempt(lambda: experiment)
    columns = sweep_columns.columns(experiment, 0, experiment.members)
    case = experiment.members // 2
    alone = experiment.alone(case)
    values = {f"model.{name}": value for name, value in alone.model.parameters.items()}
    values |= {f"initial.{name}": value for name, value in alone.initial.items()}
    values |= {"time.end": alone.time.end}
    values |= {f"schemes.central.{name}": word for name, word in alone.schemes[0].options.items()}
    assert {key: values[key] for key in columns} == {k: c[case] for k, c in columns.items()}


@pytest.mark.slow
@given(sound_sweeps(), st.data())
@QUIET
def test_sweeps_with_one_fault(sweep: dict[str, Any], data: st.DataObject) -> None:
    """One part of the sweep, however deep, is replaced by something else."""
    holder, key = sweep, data.draw(st.sampled_from([*sweep]))
    while isinstance(holder[key], dict) and data.draw(st.booleans()):
        holder = holder[key]
        key = data.draw(st.sampled_from([*holder]))
    holder[key] = data.draw(st.one_of(RULE, SAMPLE, NUMBERS))
    attempt(lambda: Experiment.from_dict(content(sweep=sweep, levels=[1, 2])))


@pytest.mark.slow
@given(CHANGES)
@QUIET
def test_any_dictionary(changes: dict[str, Any]) -> None:
    attempt(lambda: Experiment.from_dict(content(**changes)))


@pytest.mark.slow
@given(CHANGES)
@QUIET
def test_any_yaml(changes: dict[str, Any]) -> None:
    """JSON is YAML, apart from its names for what is not finite."""
    text = json.dumps(content(**changes)).replace("NaN", ".nan").replace("Infinity", ".inf")
    read(text.encode())


@given(st.data())
@QUIET
def test_damaged_file(data: st.DataObject) -> None:
    text = bytearray(json.dumps(content(samples={"every": 2}), indent=1).encode())
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(text) - 1))
        text[place] = data.draw(st.integers(0, 255))
    read(bytes(text))
