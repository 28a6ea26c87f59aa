"""The benchmarks: what they promise about themselves. Nothing here measures a time."""

from __future__ import annotations

import importlib
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from bench import by_hand, many_members, ours, page, peers, run, targets, traced  # noqa: E402


def pins(name: str) -> dict[str, str]:
    """Return what requirements/<name>.txt pins, each package with its version and hashes."""
    logical = (ROOT / "requirements" / f"{name}.txt").read_text().replace("\\\n", " ")
    return {line.partition("==")[0]: line for line in logical.splitlines()}


# --- the set of peers -----------------------------------------------------------------------------


def test_peers_are_pinned_and_hashed() -> None:
    lines = pins("peers").values()
    assert len(lines) > 10
    for line in lines:
        assert re.fullmatch(r"[a-z0-9._-]+==[^= ]+( +--hash=sha256:[0-9a-f]{64})+", line), line


def test_peers_have_the_versions_of_a_run() -> None:
    found, ours_ = pins("peers"), pins("dev")
    shared = found.keys() & ours_.keys()
    assert {"numpy", "numba", "scipy"} <= shared
    assert {name: found[name] for name in shared} == {name: ours_[name] for name in shared}


def test_a_run_needs_no_peer() -> None:
    makefile = (ROOT / "Makefile").read_text()
    assert "peers" not in makefile
    assert not {"heyoka", "diffrax", "jax", "numbalsoda"} & {*pins("run"), *pins("dev")}


# --- the same arithmetic --------------------------------------------------------------------------


def test_traced_sine_is_the_engine_sine() -> None:
    from vibsim.elementary import ELEMENTARY

    sine, x = traced.fast_sine(), np.linspace(-40.0, 40.0, 4001) + 1e-3
    assert [sine(value) for value in x] == [ELEMENTARY["sin"].full(value) for value in x.tolist()]


@pytest.mark.slow
def test_loops_in_c_and_by_hand_give_the_bits_of_the_engine(tmp_path: Path) -> None:
    theta, steps = np.linspace(0.1, 2.5, 64), 64
    expected = ours.step(theta, 20.0, steps, lane="plain").position[:, -1]
    out = np.empty_like(theta)
    by_hand.simd(contract=False)(theta, 1.0, 20.0 / steps, steps, out)
    assert np.array_equal(out, expected)
    strict, _, _ = many_members.c_runs(tmp_path, theta, steps)
    for name in (many_members.STEPPING, many_members.GATHERING):
        assert np.array_equal(strict[name](), expected), name


def test_numpy_over_members_is_the_same_scheme() -> None:
    theta, steps = np.linspace(0.1, 2.5, 64), 64
    expected = ours.step(theta, 20.0, steps, lane="plain").position[:, -1]
    # the sines differ by a unit in the last place, which 64 steps magnify
    for go in (by_hand.over_members, by_hand.three_term_over_members):
        np.testing.assert_allclose(go(theta, 1.0, 20.0 / steps, steps), expected, atol=1e-12)


# --- tuning ---------------------------------------------------------------------------------------


class Pretended:
    """Stands for a process: the error is the setting, at least `floor`."""

    def __init__(self, floor: float) -> None:
        self.floor = floor
        self.last: dict[str, Any] = {}

    def ask(self, **request: Any) -> dict[str, Any]:
        self.last = request
        return {"error": max(request["setting"], self.floor)}


@pytest.mark.parametrize(("floor", "setting"), [(0.0, 1e-10), (5e-10, 1e-10)])
def test_loosest_setting_that_reaches_the_error(floor: float, setting: float) -> None:
    one = peers.Contestant("m", "n", (1e-8, 1e-9, 1e-10, 1e-11), measured_on=20)
    process = Pretended(floor)
    found = peers._tune(process, one, peers.Problem("", 1.0, 1e-10, tuned_on=4))  # type: ignore[arg-type]
    assert found == (setting, max(setting, floor))
    # what is timed is what was found, on the members that are timed
    assert (process.last["setting"], process.last["members"]) == (setting, 20)


# --- the page -------------------------------------------------------------------------------------


def entry(**others: Any) -> dict[str, Any]:
    return {"title": "Part", "machine": "here", "lines": ["text"], "figures": {}, **others}


def test_page_has_what_was_measured_and_begins_each_part_with_its_answer() -> None:
    known = run.stored()
    text = run.PAGE.read_text()
    assert text == run.page(known)
    for name in run.PARTS:
        part = importlib.import_module(f"bench.{name}")
        answer = part.ANSWER.format(known[name]["figures"])
        assert f"## {part.TITLE}\n\n{answer}\n" in text


def test_page_says_what_failed_and_keeps_the_rest() -> None:
    text = run.page({"jobs": entry(failed="no\nluck"), "storage": entry(lines=["kept"])})
    assert "Failed: no luck" in text
    assert "kept" in text


def test_failing_part_stops_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    module = importlib.import_module("bench.storage")

    def fail(small: bool) -> page.Section:
        raise RuntimeError("full")

    monkeypatch.setattr(module, "run", fail)
    found = run.measure("storage", small=True)
    assert found["failed"] == "RuntimeError: full"
    assert found["title"] == module.TITLE


def test_group_that_fails_leaves_the_others() -> None:
    section = page.gather({"bad": lambda: 1 / 0, "good": lambda: (["line"], {"figure": 1.0})})  # type: ignore[dict-item]
    assert "line" in section.lines
    assert section.figures == {"figure": 1.0}
    assert section.problems == ("bad: ZeroDivisionError: division by zero",)


def test_target_is_reached_missed_or_not_measured() -> None:
    most = next(one for one in targets.TARGETS if not one.at_least)
    least = next(one for one in targets.TARGETS if one.at_least)

    def reached(**figures: float) -> str:
        return "\n".join(targets.lines(figures))

    for one, good, bad in ((most, 0.9, 1.1), (least, 1.1, 0.9)):
        row = next(
            r for r in reached(**{one.figure: good * one.limit}).splitlines() if one.what in r
        )
        assert "| yes |" in row
        row = next(
            r for r in reached(**{one.figure: bad * one.limit}).splitlines() if one.what in r
        )
        assert "| **no** |" in row
    assert "not measured" in reached()


def test_every_target_names_a_figure_that_some_part_measures() -> None:
    sources = "".join(
        path.read_text() for path in (ROOT / "bench").glob("*.py") if path.name != "targets.py"
    )
    patterns = re.findall(r'"([a-z_]+\.[a-z_.{}0-9]+)"', sources)
    known = [re.escape(text).replace(r"\{", "{").replace(r"\}", "}") for text in patterns]
    expressions = [re.sub(r"\{\w+\}", r"\\w+", text) for text in known]
    missing = [
        one.figure
        for one in targets.TARGETS
        if not any(re.fullmatch(text, one.figure) for text in expressions)
    ]
    assert missing == []


def test_tables_write_numbers_text_and_nothing() -> None:
    rows = [["a|b", 1234.5, None], ["c", 0.00123456, "text"]]
    assert page.table("caption", ["what", "x", "y"], rows) == [
        *("caption", "", "| what | x | y |", "|---|---:|---:|", "| a/b | 1234 |  |"),
        *("| c | 0.00123 | text |", ""),
    ]
