"""The common grid is found from whole numbers of steps, whatever was stored."""

from __future__ import annotations

import numpy as np
import pytest

from vibsim.core.errors import VibsimError
from vibsim.core.record import Record, Variable
from vibsim.observe.common_grid import common_grid, take


def level_record(level: int, steps: int, every: int, end: np.ndarray | None = None) -> Record:
    number = np.arange(0, steps + 1, every)
    whole = 20.0 if end is None else 1.0
    coords = {"t": Variable(("t",), number * (whole / steps))}
    if end is not None:
        coords["end"] = Variable(("case",), end)
    values = np.broadcast_to(number / steps, (1, 1, len(number)))
    attrs = {"level": level, "steps": steps, "every": every}
    return Record(coords, {"u": Variable(("scheme", "case", "t"), values)}, attrs)


@pytest.mark.parametrize(
    ("stored", "points"),
    [
        ({6: (64, 1), 7: (128, 1), 8: (256, 1)}, 65),
        ({6: (64, 1), 7: (128, 2), 8: (256, 4)}, 65),
        ({6: (64, 4), 7: (128, 4), 9: (512, 2)}, 17),
        ({3: (24, 3), 4: (48, 3), 5: (96, 2)}, 9),
        ({3: (24, 4), 4: (48, 3), 6: (192, 8)}, 3),
    ],
)
def test_common_points_are_the_same_times_at_every_level(
    stored: dict[int, tuple[int, int]], points: int
) -> None:
    records = {level: level_record(level, *sizes) for level, sizes in stored.items()}
    grid = common_grid(records)
    assert len(grid.t) == points
    assert grid.end_included
    for level, record in records.items():
        assert take(grid, record, "u")[0, 0] == pytest.approx(grid.t / 20.0, abs=1e-15)
        dt = grid.dt[grid.levels.index(level)]
        assert dt == pytest.approx([20.0 / stored[level][0]], rel=1e-14)
    assert grid.spacing == pytest.approx([grid.t[1]])


def test_end_is_left_out_where_the_stored_samples_do_not_reach_it() -> None:
    records = {3: level_record(3, 8, 3), 4: level_record(4, 16, 6)}
    grid = common_grid(records)
    assert list(grid.t) == pytest.approx([0.0, 7.5, 15.0])
    assert not grid.end_included
    assert grid.spacing == pytest.approx([7.5])


def test_each_member_has_its_step_where_the_end_differs() -> None:
    end = np.array([1.0, 3.0])
    grid = common_grid({2: level_record(2, 4, 1, end), 3: level_record(3, 8, 1, end)})
    assert grid.dt == pytest.approx(np.array([[0.25, 0.75], [0.125, 0.375]]))
    assert grid.spacing == pytest.approx([0.25, 0.75])


def test_levels_without_common_times_and_no_level_are_refused() -> None:
    with pytest.raises(VibsimError, match="fewer than two"):
        common_grid({3: level_record(3, 8, 8), 4: level_record(4, 18, 7)})
    with pytest.raises(VibsimError, match=r"at least one level.*vibsim\.best\(experiment\)"):
        common_grid({})
