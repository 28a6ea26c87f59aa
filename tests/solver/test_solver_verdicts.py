"""Verdicts on the levels of a solver: orders, accuracies, what is expected, and which member decides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vibsim.convergence.study.grid_values import GridValues
from vibsim.core.errors import VibsimError
from vibsim.experiment.solver import SolverExperiment
from vibsim.experiment.solver_reading import from_file
from vibsim.solver import analysis, level_output
from vibsim.solver.analysis import CheckResults

H = [1 / 4, 1 / 8, 1 / 16, 1 / 32]
Levels = Callable[[int, float], float]


def experiment(
    folder: Path, checks: str, more: str = "", h: Sequence[float] = H, u: str = "{}"
) -> SolverExperiment:
    file = folder / "study.yaml"
    file.write_text(
        f"title: a study\nsolver: {{command: 'solve {{h}} {{output}} {{a}}'}}\nrefine: {{h: {list(h)}{more}}}\n"
        f"quantities: {{u: {u}}}\nsweep: {{a: [1.0, 2.0]}}\nchecks: {checks}\n"
    )
    return from_file(file)


def judged(found: SolverExperiment, u: Levels) -> list[CheckResults]:
    def read(member: int) -> list[Any]:
        sizes = found.sizes[found.step]
        values = [GridValues(np.float64(u(member, h)), (), {}, "u") for h in sizes]
        return [
            level_output.record(found, i, member, {"u": value}) for i, value in enumerate(values)
        ]

    return analysis.judge_members(found, read)


def second(member: int, h: float) -> float:
    """Return a number of second order: 1 + a h^2, whose error at the finest level is nearly a 1e-3."""
    return 1.0 + (member + 1.0) * h**2 + 0.1 * h**4


@pytest.mark.parametrize(
    ("check", "status", "reason"),
    [
        ("{converges: u}", "PASS", "asymptotic"),
        ("{converges: u, at_least: 2}", "PASS", "asymptotic"),
        ("{converges: u, order: 1}", "FAIL", "order_high"),
        ("{converges: u, order: 4}", "FAIL", "order_low"),
        ("{converges: u, order: 4, expect: {status: FAIL}}", "PASS", "match"),
        ("{converges: u, order: 2, expect: {status: FAIL}}", "FAIL", "mismatch"),
        ("{accurate: u, relative: 2.5e-3}", "PASS", "match"),
        ("{accurate: u, absolute: 2.5e-3}", "PASS", "match"),
        ("{accurate: u, relative: 1.5e-3}", "FAIL", "mismatch"),
        ("{accurate: u, relative: 1.954e-3}", "INCONCLUSIVE", "pre_asymptotic"),
    ],
)
def test_checks_are_decided_by_the_worst_member(
    tmp_path: Path, check: str, status: str, reason: str
) -> None:
    found = experiment(tmp_path, f"[{check}]")
    results = judged(found, second)
    (entry,) = analysis.summarise(found, results)["checks"]
    assert (entry["status"], entry["reason"]) == (status, reason)
    if "accurate" in check:
        worst = entry["results"][0]
        assert worst["case"] == 1
        assert worst["facts"]["error"] == pytest.approx(2 / 1024, rel=0.01)
    assert sum(entry["counts"].values()) == 2
    assert bool(entry["advice"]) == (status != "PASS")


def test_an_accuracy_is_open_where_the_order_is(tmp_path: Path) -> None:
    def three(member: int, h: float) -> float:
        return 1.0 + h**2 + 0.02 * h**3

    few = H[:3]
    (alone,) = judged(experiment(tmp_path, "[{accurate: u, relative: 0.1}]", h=few), three)
    assert alone.results[0].verdict.reason == "pre_asymptotic"
    promised = "[{accurate: u, relative: 0.1}, {converges: u, order: 2}]"
    helped, _ = judged(experiment(tmp_path, promised, h=few), three)
    assert helped.results[0].verdict.reason == "match"
    # an expectation that is meant to fail promises nothing
    trap = "[{accurate: u, relative: 0.1}, {converges: u, order: 2, expect: {status: FAIL}}]"
    left, _ = judged(experiment(tmp_path, trap, h=few), three)
    assert left.results[0].verdict.reason == "pre_asymptotic"


def test_an_accuracy_that_is_open_states_no_bound_that_would_decide_it(tmp_path: Path) -> None:
    """A start of first order in a scheme of second order: the error was "at most 0.0053", and open for 0.1."""
    found = experiment(tmp_path, "[{accurate: u, relative: 0.1}, {converges: u, order: 2}]")
    accurate, _ = judged(found, lambda _, h: 1.0 + 0.1 * h + h * h)
    verdict = accurate.results[0].verdict
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "pre_asymptotic")
    assert "at most" not in verdict.sentence
    assert "The order is not known, so the estimate of the error at h = 0.03125" in verdict.sentence
    assert "Add a finer level" in verdict.advice


def test_exact_values_decide_the_limit_and_the_error(tmp_path: Path) -> None:
    checks = "[{converges: u, order: 2}, {accurate: u, absolute: 1e-3}]"
    # the error of member a = 1, 2 is a/1024 at the finest level
    order, accuracy = judged(experiment(tmp_path, checks, u="{exact: 1}"), second)
    assert (order.status, accuracy.status) == ("PASS", "FAIL")
    assert order.results[0].verdict.is_exact_known
    assert [r.verdict.error for r in accuracy.results] == pytest.approx([2 / 1024, 1 / 1024], 1e-3)
    assert [r.verdict.reason for r in accuracy.results] == ["mismatch", "match"]
    # a formula in the swept number, right for member a = 1 alone
    order, accuracy = judged(experiment(tmp_path, checks, u="{exact: 1 + (a - 1)/100}"), second)
    assert [r.verdict.reason for r in order.results] == ["wrong_limit", "asymptotic"]
    assert [r.verdict.reason for r in accuracy.results] == ["mismatch", "match"]


def test_exact_values_of_a_field_are_a_formula_in_its_coordinates(tmp_path: Path) -> None:
    quantity = "{coordinates: [x, t], exact: a*x + t**2}"
    found = experiment(tmp_path, "[{converges: u, order: 1}]", u=quantity)

    def read(member: int) -> list[Any]:
        records = []
        for i, h in enumerate(H):
            # in another order than the file names them, and with the error a h (1 + t) at each point
            t, x = np.linspace(0.0, 1.0, 2 ** (i + 2) + 1), np.linspace(0.0, 2.0, 2 ** (i + 2) + 1)
            a = member + 1.0
            values = a * x[None, :] + t[:, None] ** 2 + a * h * (1.0 + t[:, None])
            records.append(
                level_output.record(
                    found, i, member, {"u": GridValues(values, ("t", "x"), {"x": x, "t": t}, "u")}
                )
            )
        return records

    (results,) = analysis.judge_members(found, read)
    assert results.status == "PASS"
    t = np.linspace(0.0, 1.0, 5)
    for result in results.results:
        size = np.sqrt(np.mean((1.0 + t) ** 2)) * (result.member + 1.0) / 32
        assert result.verdict.error == pytest.approx(size, rel=1e-12)


@pytest.mark.parametrize(("digits", "status"), [(3, "INCONCLUSIVE"), (9, "PASS")])
def test_numbers_of_tables_are_known_to_the_digits_that_were_printed(
    tmp_path: Path, digits: int, status: str
) -> None:
    found = experiment(tmp_path, "[{converges: u}, {accurate: u, relative: 1e-5}]")
    values = []
    for h in H:
        # 1.000 on each level, or 1.000025000, 1.000012500 and so on
        (tmp_path / "level.csv").write_text(f"u\n{1.0 + 1e-4 * h:.{digits}f}\n")
        values.append(level_output.read(tmp_path / "level.csv", found.quantities))
    results = analysis.judge_members(
        found,
        lambda member: [level_output.record(found, i, member, values[i]) for i in range(len(H))],
    )
    *_, entry = analysis.summarise(found, results)["checks"]
    assert entry["status"] == status


@pytest.mark.parametrize("dim", ["h", "a"])
def test_a_dimension_named_like_a_size_or_a_parameter_is_refused(tmp_path: Path, dim: str) -> None:
    found = experiment(tmp_path, "[{converges: u}]")
    row = GridValues(np.ones(3), (dim,), {dim: np.arange(3.0)}, "u")
    with pytest.raises(VibsimError, match=f"u: its dimension {dim} has the name of a size"):
        level_output.record(found, 0, 0, {"u": row})


def test_stated_noise_hides_no_failure_as_an_order(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)

    def noisy(member: int, h: float) -> float:
        return 1.0 + 1e-4 * float(rng.standard_normal())

    (found,) = judged(experiment(tmp_path, "[{converges: u, order: 2}]"), noisy)
    assert found.status != "PASS"
    (found,) = judged(experiment(tmp_path, "[{converges: u}]", u="{noise: 1e-3}"), noisy)
    assert {result.verdict.reason for result in found.results} == {"exact"}


def test_zero_has_no_relative_error(tmp_path: Path) -> None:
    (found,) = judged(experiment(tmp_path, "[{accurate: u, relative: 0.1}]"), lambda _, h: 0.0)
    assert found.results[0].verdict.reason == "not_applicable"


def test_sizes_that_grow_are_no_step_sizes(tmp_path: Path) -> None:
    """Numbers of cells are placeholders; another step is named where it is refined in another way."""
    cells = experiment(
        tmp_path, "[{converges: u, order: 2}]", ", n: [4, 8, 16, 32], dt: [8, 4, 2, 1]"
    )
    (found,) = judged(cells, second)
    assert found.status == "PASS"
    uneven = experiment(tmp_path, "[{converges: u, order: 2}]", ", dt: [64, 16, 4, 1]")
    (found,) = judged(uneven, second)
    assert "dt is refined with it, not in proportion" in found.results[0].verdict.sentence


def test_a_stored_verdict_comes_back_for_its_page(tmp_path: Path) -> None:
    found = experiment(tmp_path, "[{converges: u, order: 2}, {accurate: u, relative: 1e-3}]")
    results = judged(found, second)
    record, summary = analysis.record(found, results), analysis.summarise(found, results)
    for check, entry, known in zip(found.checks, summary["checks"], results, strict=True):
        back, verdict = analysis.restored(found, record, check, entry), known.results[0].verdict
        for name in ("quantity", "status", "order", "error", "error_bound", "levels", "best"):
            assert getattr(back, name) == getattr(verdict, name), name
        assert back.is_number


def test_levels_without_common_points_are_named(tmp_path: Path) -> None:
    found = experiment(tmp_path, "[{converges: u}]")

    def read(member: int) -> list[Any]:
        shapes = [(3,), (5,), (9,), (3, 3)]
        values = [GridValues(np.zeros(s), tuple("xy"[: len(s)]), {}, "u") for s in shapes]
        return [level_output.record(found, i, 0, {"u": v}) for i, v in enumerate(values)]

    with pytest.raises(VibsimError, match=r"member 0: u: level 3 \(from the coarsest\): has the"):
        analysis.judge_members(found, read)

    def shifted(member: int) -> list[Any]:
        points = [np.linspace(0.0, 1.0, n) for n in (5, 9, 17, 33)]
        points[2] += 0.01
        levels = [GridValues(x, ("x",), {"x": x}, "u") for x in points]
        return [level_output.record(found, i, 0, {"u": v}) for i, v in enumerate(levels)]

    with pytest.raises(VibsimError, match="u: level 2 beside level 0: x: coordinates: the levels"):
        analysis.judge_members(found, shifted)


def test_stored_levels_keep_the_units_of_their_coordinates(tmp_path: Path) -> None:
    """Euler's method for u' = -u/60 s; the coarsest level counts minutes, and the others seconds."""
    found = experiment(tmp_path, "[{converges: u, order: 1}]", u="{coordinates: [t]}")

    def read(member: int) -> list[Any]:
        levels = []
        for i, h in enumerate(found.sizes[found.step]):
            n = round(1.0 / h)
            t, unit = (np.linspace(0.0, 60.0, n + 1), "s") if i else (h * np.arange(n + 1), "min")
            u = (1.0 - h) ** np.arange(n + 1)
            level = GridValues(u, ("t",), {"t": t}, "u", units_of_coords={"t": (unit, "standard")})
            levels.append(level_output.record(found, i, member, {"u": level}))
        return levels

    verdict = analysis.judge_members(found, read)[0].results[0].verdict
    assert verdict.status == "PASS"
    assert len(verdict.coords["t"]) == 5


def test_stored_levels_keep_the_spacing_of_packed_values(tmp_path: Path) -> None:
    """The levels agree because all were rounded to the same integer in the files of the solver."""
    found = experiment(tmp_path, "[{converges: u}]")

    def read(member: int) -> list[Any]:
        level = GridValues(np.array(1.0 / 3.0), (), {}, "u", spacing=0.01)
        count = len(found.sizes[found.step])
        return [level_output.record(found, i, member, {"u": level}) for i in range(count)]

    verdict = analysis.judge_members(found, read)[0].results[0].verdict
    assert verdict.error_bound == pytest.approx(0.005)
