"""Printed tables: their digits, their rows as claims, and what is wrong with them."""

from __future__ import annotations

import json
import math
from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest
from experiment_files import GOOD, build, content, faults_of, file_faults, only_fault, write
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from vibsim.experiment import Experiment, canonical, restore
from vibsim.experiment.schema.document import schema
from vibsim.experiment.schema.published import read_printed, row_id
from vibsim.plan.build import build as build_plan

TABLE: dict[str, Any] = {
    "title": "Relative error of the energy",
    "source": "vibration text, section 6.2",
    "value": "relative_energy_error_d2t",
    "beside": ["relative_energy_error"],
    "rows": [
        {"scheme": "rk4", "level": 7, "printed": "1.120 10^8"},
        {"scheme": "euler", "printed": "9.999e-1", "holds": False, "note": "rounded"},
    ],
}
FIELD: dict[str, Any] = {
    "title": "Three steps",
    "value": "at",
    "quantity": "theta",
    "rows": [{"scheme": "rk4", "at": {"step": 3}, "printed": "0.5"}],
}
SCHEMES = ["rk4", {"kind": "forward_euler", "label": "euler"}, "central"]
FILE = """
published:
  - title: Table
    value: relative_energy_error
    rows:
      - {scheme: central, printed: 1.120e8}
      - {scheme: central, level: 7, printed: 4.930}
      - {scheme: central, level: 8, printed: -300}
      - {scheme: central, level: 8, printed: 1.120 10^8}
"""


def tables(*given: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return {"schemes": SCHEMES, "published": list(given), **changes}


def row(**fields: Any) -> dict[str, Any]:
    """Return an experiment whose one table has a row with `fields`."""
    whole = {"scheme": "rk4", "printed": "1.0"} | fields
    kept = {key: value for key, value in whole.items() if value is not None}
    return tables(TABLE | {"rows": [kept]})


@pytest.mark.parametrize(
    ("text", "number", "unit"),
    [
        ("1.120e8", "1.120e8", "1e5"),
        ("1.120E+8", "1.120e8", "1e5"),
        ("1.120 10^8", "1.120e8", "1e5"),
        ("1.120*10^8", "1.120e8", "1e5"),
        (r"1.120 \cdot 10^{-8}", "1.120e-8", "1e-11"),
        ("1.120 x 10^ -8", "1.120e-8", "1e-11"),
        ("1.120\u00b710^8", "1.120e8", "1e5"),
        ("\u22121.5", "-1.5", "0.1"),
        ("4.93", "4.93", "0.01"),
        ("4.930", "4.93", "0.001"),
        ("9.999e-1", "0.9999", "1e-4"),
        ("17", "17", "1"),
        ("17.", "17", "1"),
        (".5", "0.5", "0.1"),
        ("+0.00", "0", "0.01"),
        ("100", "100", "1"),
    ],
)
def test_digits_say_how_exact_a_number_is(text: str, number: str, unit: str) -> None:
    found = read_printed(text)
    assert found is not None
    assert found.number == float(number)
    assert found.half_unit == float(Decimal(unit) / 2)


@given(st.decimals(allow_nan=False, allow_infinity=False, places=6, min_value=-1e9, max_value=1e9))
def test_a_number_lies_within_half_a_unit_of_its_rounding(value: Decimal) -> None:
    for digits in range(1, 8):
        found = read_printed(f"{value:.{digits}e}")
        assert found is not None
        # each of the two numbers is rounded to a float by half a unit in its last place, and so is half a unit itself
        rounded = 2 * math.ulp(max(abs(float(value)), abs(found.number)))
        assert abs(float(value) - found.number) <= found.half_unit + rounded


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x",
        "1e",
        "1.1.1",
        "1 2",
        "1.120108 10",
        "nan",
        "inf",
        "1e999",
        "1e-400",
        "0x10",
        "9" * 70,
    ],
)
def test_what_is_no_printed_number_is_refused(text: str) -> None:
    assert read_printed(text) is None
    fault = only_fault(**row(printed=text))
    assert fault.key == "published[0].rows[0].printed"
    assert fault.rule.startswith("must be a number as printed")


def test_a_file_keeps_the_digits_that_it_has(tmp_path: Path) -> None:
    """A plain number in YAML loses its zeros; what stands in the file does not."""
    experiment = Experiment.from_yaml(write(tmp_path, GOOD + FILE))
    rows = experiment.published[0].rows
    assert [r.printed for r in rows] == ["1.120e8", "4.930", "-300", "1.120 10^8"]
    assert [r.meaning.half_unit for r in rows] == [5e4, 5e-4, 0.5, 5e4]
    assert [check.measured.equals for check in experiment.checks] == [1.12e8, 4.93, -300, 1.12e8]


def test_every_row_is_a_claim() -> None:
    experiment = build(**tables(TABLE, FIELD, source="the text", checks=[{"converges": "theta"}]))
    first, one, two, three = experiment.checks
    assert first.kind == "converges"
    assert experiment.written == (first,)
    assert [one.id, two.id, three.id] == [row_id(1, 1), row_id(1, 2), row_id(2, 1)]
    assert [c.that.id for c in (one, two, three)] == [one.id, two.id, three.id]
    assert one.that.at.model_dump(exclude_none=True) == {"level": 7, "scheme": "rk4"}
    assert (one.that.value, one.that.equals, one.that.atol) == (TABLE["value"], 1.12e8, 5e4)
    assert (one.source, three.source) == (TABLE["source"], None)
    assert one.claim == "Relative error of the energy: scheme rk4, level 7: 1.120 10^8"
    assert (one.holds, one.note, two.holds, two.note) == (True, None, False, "rounded")
    assert three.that.at.model_dump(exclude_none=True) == {"scheme": "rk4", "step": 3}
    assert three.claim.endswith("scheme rk4, step 3: 0.5")
    assert hash(experiment)


def test_printed_tables_alone_are_enough_to_check() -> None:
    assert [check.kind for check in build(**tables(TABLE)).checks] == ["claim", "claim"]
    assert [check.kind for check in build(**tables()).checks] == ["converges"]
    assert build(published=[]) == build()


def test_the_normal_form_keeps_the_tables() -> None:
    experiment = build(**tables(TABLE, FIELD))
    data = json.loads(json.dumps(canonical(experiment)))
    assert restore(data) == experiment
    assert data["published"][0]["rows"][0]["printed"] == "1.120 10^8"
    assert "published" not in canonical(build())


def test_tables_are_no_part_of_a_simulation() -> None:
    def digests(**changes: Any) -> tuple[list[str], str, str]:
        found = build_plan(build(**tables(TABLE, **changes)))
        return [shard.digest for shard in found.shards], found.analysis, found.extrapolation

    plain, other = digests(output="best"), digests(output="best", published=[FIELD])
    assert plain[0] == other[0]
    assert plain[1] != other[1]
    assert plain[2] == other[2]
    beside = digests(output="best", published=[TABLE | {"beside": []}])
    assert beside[1] != plain[1]


@pytest.mark.parametrize(
    ("changes", "key", "rule", "hint"),
    [
        (tables(TABLE | {"value": "energi"}), "[0].value", "unknown value", "choose from"),
        (tables(TABLE | {"value": 3}), "[0].value", "must be text", ""),
        (tables(TABLE | {"quantity": "theta"}), "[0].quantity", "takes no quantity", ""),
        (tables(FIELD | {"quantity": "teta"}), "[0].quantity", "unknown quantity", "'theta'"),
        (tables(FIELD | {"quantity": None}), "[0].quantity", "required key is missing", "omega"),
        (
            tables(TABLE | {"beside": ["relative_energy_eror"]}),
            "[0].beside[0]",
            "unknown value",
            "relative_energy_error",
        ),
        (
            tables(TABLE | {"beside": ["period", "period"]}),
            "[0].beside[1]",
            "must not be repeated",
            "",
        ),
        (
            tables(FIELD | {"beside": ["running_max"]}),
            "[0].beside[0]",
            "not defined for the quantity",
            "energy_deviation",
        ),
        (tables(TABLE | {"beside": ["predicted_frequency"]}), "[0].beside[0]", "linear models", ""),
        (tables(TABLE | {"value": "predicted_frequency"}), "[0].value", "linear models", ""),
        (tables(TABLE | {"titel": "x"}), "[0].titel", "unknown key", "did you mean 'title'?"),
        (tables(TABLE | {"rows": []}), "[0].rows", "must not be empty", ""),
        (
            tables({k: v for k, v in TABLE.items() if k != "value"}),
            "[0].value",
            "required key is missing",
            "",
        ),
        (row(scheme="rk5"), "[0].rows[0].scheme", "not a scheme", "did you mean 'rk4'?"),
        (row(scheme=None), "[0].rows[0].scheme", "required key is missing", ""),
        (row(printed=None), "[0].rows[0].printed", "required key is missing", ""),
        (row(level=3), "[0].rows[0].level", "not a level", "nearest is 6"),
        (row(level="best"), "[0].rows[0].level", "extrapolated solution", ""),
        (row(at={"step": 3}), "[0].rows[0].at.step", "takes no step", ""),
        (row(at={"case": 1}), "[0].rows[0].at.case", "must be at most 0", ""),
        (row(at={"stp": 1}), "[0].rows[0].at.stp", "unknown key", "did you mean 'step'?"),
        (row(nots="x"), "[0].rows[0].nots", "unknown key", "did you mean 'note'?"),
        (row(holds="no"), "[0].rows[0].holds", "must be true or false", ""),
        (
            tables(FIELD | {"rows": [{"scheme": "rk4", "printed": "1"}]}),
            "[0].rows[0]",
            "at needs t or step",
            "",
        ),
        (
            tables(FIELD | {"rows": [{"scheme": "rk4", "printed": "1", "at": {"t": 21}}]}),
            "[0].rows[0].at.t",
            "must be between 0 and the end 20",
            "",
        ),
        ({"published": {}}, "", "must be a list", ""),
        ({"published": ["x"]}, "[0]", "must be a mapping", ""),
    ],
)
def test_one_fault(changes: dict[str, Any], key: str, rule: str, hint: str) -> None:
    fault = only_fault(**changes)
    assert (fault.key, rule in fault.rule, hint in fault.hint) == (f"published{key}", True, True), (
        fault
    )


def test_rows_and_tables_hide_no_fault_of_each_other(tmp_path: Path) -> None:
    text = GOOD + (
        "checks: [{id: published_1_2, converges: thta}]\n"
        "published:\n"
        "  - title: 3\n"
        "    value: perid\n"
        "    rows:\n"
        "      - {scheme: central, printed: x}\n"
        "      - {scheme: centrl, printed: 1}\n"
        "      - {scheme: central, printed: 1, level: 60}\n"
        "  - {title: x, value: at, quantity: theta, rows: [{scheme: central, printed: 1, at: {step: 1.5}}]}\n"
        "  - {title: x, value: at, quantity: theta, rows: [{scheme: central, printed: 1, at: {step: 999}}]}\n"
    )
    found = [(fault.line, fault.key) for fault in file_faults(tmp_path, text)]
    assert found == [
        (7, "checks[0].converges"),
        (7, "checks[0].id"),
        (9, "published[0].title"),
        (10, "published[0].value"),
        (12, "published[0].rows[0].printed"),
        (13, "published[0].rows[1].scheme"),
        (14, "published[0].rows[2].level"),
        (15, "published[1].rows[0].at.step"),
        (16, "published[2].rows[0].at.step"),
    ]


def test_a_member_alone_has_the_rows_that_speak_of_it() -> None:
    def at(case: int | None, t: float) -> dict[str, Any]:
        return {
            "scheme": "rk4",
            "printed": "1.0",
            "at": {"case": case, "t": t} if case is not None else {"t": t},
        }

    table = FIELD | {"rows": [at(0, 0.5), at(1, 0.5), at(None, 1.0)]}
    other = FIELD | {"rows": [at(0, 0.5)]}
    whole = build(**tables(other, table, sweep={"time.end": [10, 40]}))
    one = whole.alone(1)
    assert [[(r.at.case, r.at.t) for r in t.rows] for t in one.published] == [
        [(None, 20.0), (None, 40.0)]
    ]
    assert [check.id for check in one.checks] == [row_id(1, 1), row_id(1, 2)]
    assert [check.that.at.t for check in one.checks] == [20.0, 40.0]
    assert restore(json.loads(json.dumps(canonical(one)))) == one


def test_levels_that_are_chosen_keep_the_tables() -> None:
    rows = [
        {"scheme": "rk4", "at": {"t": 5}, "printed": "0.5"},
        {"scheme": "rk4", "at": {"t": 0}, "level": "best", "printed": "1"},
    ]
    experiment = build(
        **tables(FIELD | {"rows": rows}, levels=None, tolerance=1e-8, samples="common")
    )
    chosen = experiment.with_levels([3, 4])
    assert (chosen.checks, chosen.published) == (experiment.checks, experiment.published)
    with pytest.raises(
        Exception, match=r"published\[0\].rows\[0\].at.t: .*not a stored sample time"
    ):
        experiment.with_levels([1, 2])
    fault = only_fault(**tables(TABLE, levels=None, tolerance=1e-8))
    assert (fault.key, "cannot be named" in fault.rule) == ("published[0].rows[0].level", True)


def test_the_schema_knows_tables() -> None:
    validator = Draft202012Validator(schema())
    validator.validate(content(**tables(TABLE, FIELD)))
    validator.validate(content(**row(printed=4.93)))
    assert not validator.is_valid(content(**row(nots="x")))
    assert math.isclose(build(**row(printed=4.93)).published[0].rows[0].meaning.half_unit, 0.005)
    assert faults_of(**row(printed=True))
