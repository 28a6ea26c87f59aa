"""No shipped claim is empty: with another number its verdict turns. And every figure that is asked for is drawn."""

from __future__ import annotations

from pathlib import Path

import pytest
from claim_mutants import simulated, survivors

from vibsim.analysis import analyse_records, summarise, verdicts
from vibsim.experiment import Experiment
from vibsim.report import choice, style
from vibsim.report.data import Results
from vibsim.report.figures import of_source
from vibsim.report.page import player

CONFIGS = Path(__file__).parents[1] / "configs"
PATHS = {
    f"{path.parent.name}/{path.stem}": path
    for path in sorted(CONFIGS.glob("*/*.yaml"))
    if path.parent.name != "scale"
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PATHS)
def test_every_claim_turns_with_its_number_and_every_figure_is_drawn(name: str) -> None:
    experiment = Experiment.from_yaml(PATHS[name])
    levels = simulated(experiment)
    assert survivors(experiment, levels) == []
    if not experiment.figures:
        return
    record = Results.of(experiment, analyse_records(experiment, levels))
    lead = choice.find_lead(record, summarise(experiment, verdicts(experiment, record), record))
    with style.applied():
        found = of_source.pictures(lead)
    has_player = bool(player.element(record))
    assert of_source.undrawn(found, has_player=has_player) == []
    names = [picture.name for _, pictures in found for picture in pictures]
    assert len(names) == len(set(names))


CONTENT = {
    "title": "claims",
    "model": {"kind": "pendulum"},
    "initial": {"theta": 1.0},
    "time": {"end": 20.0},
    "levels": [6, 7, 8, 9],
    "schemes": ["central"],
}


@pytest.mark.usefixtures("without_series")
@pytest.mark.parametrize(
    ("that", "holds", "empty"),
    [
        ({"value": "period", "equals": 6.7, "atol": 0.01}, True, 0),
        ({"value": "period", "equals": 6.7, "rtol": 0.5}, True, 2),
        ({"value": "period", "equals": 7.0, "atol": 0.01}, False, 0),
        ({"value": "period", "below": 7.0}, True, 0),
        ({"value": "period", "below": 100.0}, True, 1),
        ({"value": "period", "above": 0.1}, True, 1),
        ({"value": "period", "above": 7.0}, False, 0),
        ({"converges": "theta", "order": 2}, True, 0),
        ({"converges": "theta", "order": 2, "tolerance": 1.5}, True, 2),
    ],
)
def test_an_empty_claim_is_found(that: dict[str, object], holds: bool, empty: int) -> None:
    claim = {"id": "it", "claim": "so it is", "that": that, "holds": holds, "note": "or is it"}
    experiment = Experiment.from_dict({**CONTENT, "checks": [claim]})
    assert len(survivors(experiment, simulated(experiment))) == empty
