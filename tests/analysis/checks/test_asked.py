"""How a number that a check asks for is called."""

from __future__ import annotations

from typing import Any

import pytest

from vibsim import Experiment
from vibsim.checks.value_text import what


@pytest.mark.parametrize(
    ("check", "told"),
    [
        ({"value": "at", "quantity": "u", "at": {"t": 2.5}}, "u at t = 2.5"),
        ({"value": "at", "quantity": "v", "at": {"step": 4}}, "v at step 4"),
        ({"value": "end", "quantity": "u"}, "u at the end"),
        ({"value": "max_abs", "quantity": "u"}, "max_abs of u"),
        ({"value": "period"}, "period"),
    ],
)
def test_a_number_is_called_by_what_it_is(check: dict[str, Any], told: str) -> None:
    e = Experiment.from_dict(
        {
            "title": "test",
            "model": {"kind": "spring", "w": 1.0},
            "initial": {"u": 1.0},
            "time": {"end": 10.0},
            "levels": [5, 6, 7],
            "schemes": ["central"],
            "checks": [{**check, "below": 10}],
        }
    )
    measured = e.checks[0].measured
    assert measured.kind == "value"
    assert what(measured) == told
