"""The ladder as a product: what `best` gives, which ladder a tolerance chooses, and when it is refused."""

from __future__ import annotations

from typing import Any

import ladder_table
import numpy as np
import pytest

from vibsim import ladder
from vibsim.comparison.best_solution import best_record
from vibsim.core.errors import InputError, VibsimError
from vibsim.experiment import Experiment
from vibsim.ladder import Extrapolated, Method, Start, choosing, climb, product, solve
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES
from vibsim.simulation import simulate_record


def experiment(
    arithmetic: str = "compensated", end_velocity: str = "kick", start: str = "centred", **more: Any
) -> Experiment:
    options = {"arithmetic": arithmetic, "end_velocity": end_velocity, "start": start}
    return Experiment.from_dict(
        {
            "title": "t",
            "model": {"kind": "pendulum"},
            "initial": {"theta": 1.0, "omega": 0.0},
            "time": {"end": 20.0},
            "schemes": [{"kind": "central", **options}],
            "output": "best",
        }
        | more
    )


def largest_bound(dataset: Any) -> float:
    return max(float(dataset[f"{state}_error"].max()) for state in ("theta", "omega"))


SWEEPS = {
    "one": None,
    "amplitudes": {"initial.theta": {"linspace": [0.1, 3.1, 7]}},
    "options": {"schemes.central.end_velocity": ["kick", "extrapolate"], "model.g": [1.0, 9.81]},
    "ends": {"time.end": [5.0, 20.0, 40.0]},
}


@pytest.mark.parametrize("name", SWEEPS)
def test_best_is_what_the_workflow_makes(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    sweep = {"sweep": SWEEPS[name]} if SWEEPS[name] else {}
    of = experiment(levels=[6, 7, 9, 10], **sweep)
    records = {level: simulate_record(of, level) for level in of.levels}
    record = best_record(of, records)
    monkeypatch.setattr(product, "POINTS_AT_A_TIME", 150)
    for dataset in (ladder.best(of), ladder.best(of, threads=2)):
        assert set(dataset.data_vars) == set(record.variables)
        for key in (*record.variables, *record.coords):
            np.testing.assert_array_equal(dataset[key].values, record[key])
            assert dict(dataset[key].attrs).keys() == dict(record.variable(key).attrs).keys()


def test_best_takes_other_levels() -> None:
    few = ladder.best(experiment(levels=[6, 7, 8]), levels=[7, 8, 9, 10])
    assert list(few.attrs["levels"]) == [7, 8, 9, 10]
    assert few.sizes["t"] == 129


def test_best_without_levels_reaches_the_tolerance() -> None:
    found = ladder.best(experiment(tolerance=1e-9))
    assert largest_bound(found) <= 1e-9
    assert found["reached"].values.all()
    assert "tolerance" not in found["theta"].attrs


# arrays


@pytest.mark.parametrize("arithmetic", ["compensated", "increment", "three_term"])
@pytest.mark.parametrize("model", ["pendulum", "linear_pendulum", "spring", "oscillator"])
def test_one_member_has_the_bits_of_many(model: str, arithmetic: str) -> None:
    scheme = SCHEMES["central"]
    options = {**scheme.defaults(), "end_velocity": "kick", "arithmetic": arithmetic}
    of = Method(MODELS[model], scheme, options)
    numbers = np.ones((3, max(3, len(MODELS[model].parameters))))
    numbers[:, :3] = [[1.0, 1.0, 1.0], [9.81, 0.7, 1.0], [2.0, 3.0, 1.0]]
    many = Start(
        numbers[:, : max(1, len(MODELS[model].parameters))],
        np.array([[1.0, 0.0], [3.0, 0.2], [0.4, 1.3]]),
        np.array([10.0, 20.0, 300.0]),
        np.sqrt([1.0, 9.81 / 0.7, 2.0 / 3.0]),
    )
    steps = (3 * 2**5, 3 * 2**6, 3 * 2**7, 3 * 2**9)
    together, sampled = solve(of, many, steps), climb(of, many, steps, 1)
    for case in range(3):
        alone = solve(of, many.of(np.array([case])), steps)
        for name in Extrapolated.__dataclass_fields__:
            one = getattr(alone, name)[0, 0]
            np.testing.assert_array_equal(one, getattr(together, name)[0, case])
            np.testing.assert_array_equal(one, getattr(sampled, name)[1, case])


def test_times_that_a_level_does_not_have_are_refused() -> None:
    of = Method(MODELS["pendulum"], SCHEMES["central"], SCHEMES["central"].defaults())
    one = Start(np.ones((1, 4)), np.array([[1.0, 0.0]]), np.array([1.0]), np.ones(1))
    with pytest.raises(ValueError, match="5 equal times"):
        solve(of, one, (16, 32), 5)


# the choice


@pytest.mark.parametrize(
    ("tolerance", "more"),
    [
        (5e-2, {}),
        (1e-4, {}),
        (1e-10, {}),
        (1e-10, {"arithmetic": "increment", "time": {"end": 20.0, "base_steps": 3}}),
        (1e-7, {"sweep": {"initial.theta": [0.5, 2.9], "model.g": [1.0, 9.81]}}),
        (1e-8, {"schemes": [{"kind": "central"}, {"kind": "central", "label": "b", "end_velocity": "kick"}]}),
    ],
)  # fmt: skip
def test_the_chosen_ladder_is_the_cheapest(tolerance: float, more: dict[str, Any]) -> None:
    of = experiment(tolerance=tolerance, **more)
    chosen = ladder.resolve(of)
    first, last = chosen.levels[0], chosen.levels[-1]
    assert chosen.levels == tuple(range(first, last + 1))
    assert largest_bound(ladder.best(chosen)) <= tolerance
    assert chosen == ladder.resolve(of)
    cheaper = [range(first + 1, last + 1)] if last > first + 1 else []
    cheaper += [range(coarse, last) for coarse in range(last - 2, 3, -1)]
    assert cheaper
    for levels in cheaper:
        assert largest_bound(ladder.best(of, levels=tuple(levels))) > tolerance


def test_levels_that_are_given_stay() -> None:
    of = experiment(levels=[6, 7, 8])
    assert ladder.resolve(of) is of


def test_a_member_that_was_not_tried_tells_whether_it_is_reached(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The hard member, at the separatrix, lies between those of the pilot."""
    monkeypatch.setattr(choosing, "pilot", lambda of: np.array([0, 2]))
    of = experiment(tolerance=1e-11, sweep={"initial.omega": [0.0, 1.755165, 0.5]})
    found = ladder.best(of)
    assert found["reached"].values.tolist() == [[1, 0, 1]]


def test_the_pilot_has_the_corners_and_the_extremes() -> None:
    theta = [*np.linspace(0.5, 1.0, 40).tolist(), 3.0, *np.linspace(0.2, 0.4, 40).tolist()]
    of = experiment(
        levels=[6, 7], sweep={"initial.theta": theta, "model.g": {"linspace": [1.0, 9.0, 50]}}
    )
    cases = choosing.pilot(of)
    assert len(cases) == choosing.PILOT
    assert len(set(cases.tolist())) == choosing.PILOT
    assert {0, 49, 50 * 80, 50 * 80 + 49} <= set(cases.tolist())
    # where the largest angle is first
    assert 40 * 50 in cases.tolist()
    np.testing.assert_array_equal(cases, choosing.pilot(of))


# refusals


def test_round_off_forbids_it() -> None:
    with pytest.raises(InputError) as refused:
        ladder.resolve(experiment(arithmetic="three_term", tolerance=1e-12))
    text = str(refused.value)
    assert "tolerance: 1e-12: no ladder reaches it: round-off" in text
    assert "arithmetic: compensated would leave less" in text
    assert "the least bound is" in text
    assert "scheme central, member 0" in text


def test_the_least_bound_can_be_reached() -> None:
    with pytest.raises(InputError) as refused:
        ladder.resolve(experiment(tolerance=1e-15))
    least = float(str(refused.value).split("the least bound is ")[1].split(",")[0])
    chosen = ladder.resolve(experiment(tolerance=1.1 * least))
    assert largest_bound(ladder.best(chosen)) <= 1.1 * least


@pytest.mark.slow
def test_a_start_that_spoils_the_powers_costs_too_much(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choosing, "MOST_STEPS", 2**22)
    with pytest.raises(InputError, match="finer levels take too many steps"):
        ladder.resolve(experiment(start="first_order", tolerance=1e-9))


def test_a_solution_that_does_not_get_better_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """As friction or an impact would, the error goes its own way at every level."""
    honest = choosing.level_at

    def rough(method: Method, start: Start, steps: int, every: int, **more: Any) -> Any:
        u, v = honest(method, start, steps, every, **more)
        return u + 1e-4 * np.sin(steps * np.arange(len(u))[:, None]), v

    monkeypatch.setattr(choosing, "level_at", rough)
    monkeypatch.setattr(choosing, "noise_of", lambda *_, **__: None)
    with pytest.raises(InputError, match="do not approach each other as smooth ones would"):
        ladder.resolve(experiment(tolerance=1e-9))


def test_neither_levels_nor_a_tolerance() -> None:
    bare = experiment(levels=[6, 7]).model_copy(update={"levels": ()})
    with pytest.raises(VibsimError, match="neither levels nor a tolerance"):
        ladder.resolve(bare)


# the page


@pytest.mark.parametrize("place", range(0, len(ladder_table.ROWS), 3))
def test_the_page_tells_what_is_measured(place: int) -> None:
    theta, arithmetic, tolerance = ladder_table.ROWS[place]
    row = ladder_table.rows()[place]
    levels, steps, bound, error = ladder_table.measured(theta, arithmetic, tolerance)
    assert row[:5] == [str(theta), arithmetic, f"{tolerance:.0e}", levels, str(steps)]
    assert float(row[5]) == pytest.approx(bound, rel=0.06)
    # an error at round-off changes with the library that the exact solution comes from
    assert float(row[6]) == pytest.approx(error, rel=0.5)
    assert error <= bound <= tolerance


def test_the_page_has_every_row() -> None:
    assert len(ladder_table.rows()) == len(ladder_table.ROWS)
