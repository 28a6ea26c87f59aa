"""Whatever is in a file: an experiment, or `InputError`; never another exception."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from spec_files import content

from vibsim.errors import InputError
from vibsim.spec import Experiment, canonical, restore
from vibsim.spec.build import Place, build
from vibsim.spec.faults import Report
from vibsim.spec.source import parse

QUIET = settings(
    max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True
)


def attempt(make: Callable[[], Experiment]) -> None:
    """Require an experiment that survives its normal form, or faults that say something."""
    try:
        experiment = make()
    except InputError as error:
        refused: InputError | None = error
    else:
        refused = None
        content = json.loads(json.dumps(canonical(experiment), allow_nan=False))
        assert restore(content) == experiment
    assert refused is None or all(fault.rule for fault in refused.faults)
    assert refused is None or refused.faults


def read(data: bytes) -> None:
    def make() -> Experiment:
        source = parse(data, "fuzz.yaml")
        return build(source, Place("adhoc", "fuzz"), Report(source))

    attempt(make)


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
SECTIONS = ("title", "source", "model", "initial", "time", "levels", "schemes", "sweep", "samples")
AT = st.dictionaries(st.sampled_from(["t", "step", "level", "best", "scheme", "case"]), SCALARS)
CHECK = st.dictionaries(
    st.sampled_from(
        ["converges", "value", "claim", "that", "quantity", "at", "below", "equals", "id", "expect"]
    ),
    st.one_of(VALUES, AT, st.sampled_from(WORDS)),
    max_size=5,
)
CHANGES = st.one_of(
    st.dictionaries(st.sampled_from([*SECTIONS, "checks"]), VALUES, max_size=3),
    st.fixed_dictionaries({"checks": st.lists(CHECK, max_size=3)}),
    st.fixed_dictionaries(
        {"sweep": st.dictionaries(st.sampled_from(["model.g", "time.end", "levels"]), VALUES)}
    ),
)


@given(CHANGES)
@QUIET
def test_any_dictionary(changes: dict[str, Any]) -> None:
    attempt(lambda: Experiment.from_dict(content(**changes)))


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
