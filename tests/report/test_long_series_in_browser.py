"""Moving along a long series in a real browser: all panels go together, the other plots of the page stay."""

from __future__ import annotations

import browser
import numpy as np
import pytest
import samples

from vibsim import report

pytestmark = pytest.mark.slow

PERIOD = 2 * np.pi
ACT = """
const svg = document.querySelector("g[data-axis=long]").ownerSVGElement;
const other = [...document.querySelectorAll("g[data-axis=time]")].map((e) => e.ownerSVGElement).find((e) => e !== svg);
const panels = [...svg.querySelectorAll("g[data-axis]")];
const ticks = (node) => [...node.querySelectorAll("[data-ticks=x] text")]
  .map((e) => Number(e.textContent.replace("−", "-")));
const strip = panels.find((e) => e.dataset.axis === "overview"), series = panels.filter((e) => e !== strip);
const box = (node) => node.dataset.box.split(" ").map(Number);
const [left, , wide] = box(series[0]), [, stripTop] = box(strip);
// the window, as the strip marks it
const view = () => {
  const [low, high] = strip.dataset.x.split(" ").map(Number), mark = strip.querySelector("rect[fill-opacity='0.15']");
  if (!mark) return null;
  const [x, width] = ["x", "width"].map((name) => Number(mark.getAttribute(name)));
  return [x, x + width].map((at) => low + ((at - left) / wide) * (high - low));
};
const starts = () => series
  .map((e) => Number(e.querySelector("[data-curve] path").getAttribute("d").slice(1).split(" ")[0]));
const fire = (type, x, y = 60) => {
  const {x: clientX, y: clientY} = new DOMPoint(x, y).matrixTransform(svg.getScreenCTM());
  svg.dispatchEvent(new PointerEvent(type, {clientX, clientY, bubbles: true, cancelable: true}));
};
const press = (key, more = {}) =>
  svg.dispatchEvent(new KeyboardEvent("keydown", {key, bubbles: true, cancelable: true, ...more}));
const drag = (from, to, y) => ["down", "move", "up"].forEach((type, i) => fire(`pointer${type}`, i ? to : from, y));

const calm = ticks(other);
found.first = view(); found.starts = starts();
drag(left + wide / 2, left + wide / 4); found.dragged = view(); found.together = starts();
drag(left + wide / 4, left + wide / 2); found.back = view();
drag(left + wide / 2, left + wide, 60); found.kept = view();
drag(left + wide / 2, left + wide / 2, stripTop + 5); found.centred = view();
drag(left + wide / 2, left + 0.75 * wide, stripTop + 5); found.slid = view();
press("ArrowRight", {shiftKey: true}); found.key = view();
found.ticks = ticks(series.at(-1));
press("0"); found.whole = view();
found.calm = JSON.stringify(ticks(other)) === JSON.stringify(calm);
found.button = document.querySelector("button.zoomed").hidden;
found.hint = svg.nextElementSibling.textContent;
"""


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    directory = tmp_path_factory.mktemp("page")
    exp = samples.experiment(
        model={"kind": "spring"}, initial={"u": 1.0}, levels=[0, 1, 2], schemes=["central"],
        time={"periods": 40, "steps_per_period": 20}, checks=[{"converges": "u", "order": 2}],
    )  # fmt: skip
    record = samples.record(exp)
    report.write(samples.plan(exp), record, samples.summary(exp, record), directory)
    return browser.run(directory / "report.html", ACT, tmp_path_factory.mktemp("browser"))


def test_nothing_fails_and_the_page_says_what_moves(found):
    assert found["errors"] == []
    assert found["hint"].startswith("Drag to move along the time")


def test_four_periods_are_shown_at_first(found):
    assert found["first"] == pytest.approx([0.0, 4 * PERIOD], abs=0.4)


def test_a_drag_moves_all_panels_and_stops_at_the_ends(found):
    assert found["dragged"] == pytest.approx([PERIOD, 5 * PERIOD], abs=0.5)
    moved = [a - b for a, b in zip(found["starts"], found["together"], strict=True)]
    assert moved == pytest.approx([422.5 / 4] * 3, abs=0.5)
    assert found["back"] == pytest.approx(found["first"], abs=0.1)
    assert found["kept"] == pytest.approx(found["first"], abs=0.1)


def test_the_strip_leads_to_any_time_and_slides_the_window(found):
    assert found["centred"] == pytest.approx([18 * PERIOD, 22 * PERIOD], abs=0.3)
    assert found["slid"] == pytest.approx([28 * PERIOD, 32 * PERIOD], abs=0.3)


def test_keys_move_on_and_show_all_of_it(found):
    assert found["key"] == pytest.approx([28.4 * PERIOD, 32.4 * PERIOD], abs=0.3)
    assert min(found["ticks"]) >= 28 * PERIOD
    assert max(found["ticks"]) <= 33 * PERIOD
    assert found["whole"] is None


def test_the_other_plots_of_the_page_stay_as_they_were(found):
    assert found["calm"]
    assert found["button"]
