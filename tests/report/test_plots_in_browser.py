"""What a reader can do with the plots of a page, in a real browser, offline and under a strict policy."""

from __future__ import annotations

import browser
import pytest
import samples

from vibsim import report

pytestmark = pytest.mark.slow

# Places are points of the drawing; the panel over time reaches from 57.02 to 479.52 and from t = 0 to t = 20.
ACT = """
const plot = (name) => document.querySelector(`#${name} svg`);
const first = plot("differences_theta_0_central"), other = plot("solution_theta_0_central");
const step = plot("order_theta_0");
const said = () => document.querySelector("[role=status]").textContent;
const lines = (svg) => [...svg.querySelectorAll("g.hair > path")]
  .map((e) => Number(e.getAttribute("d").slice(1).split(" ")[0]));
const ticks = (svg) => [...svg.querySelectorAll("[data-ticks=x] text")].map((e) => e.textContent);
const words = (svg) => [...svg.querySelectorAll("g.hair text")].map((e) => e.textContent);
const data = (svg) => [...svg.querySelectorAll("[data-curve] path")].map((e) => e.getAttribute("d"));
const visible = (e) => getComputedStyle(e).visibility === "visible";
const fire = (svg, type, x, y = 100, more = {}) => {
  const {x: clientX, y: clientY} = new DOMPoint(x, y).matrixTransform(svg.getScreenCTM());
  const kind = {wheel: WheelEvent, dblclick: MouseEvent}[type] || PointerEvent;
  return svg.dispatchEvent(new kind(type, {clientX, clientY, bubbles: true, cancelable: true, ...more}));
};
const press = (svg, key, more = {}) =>
  svg.dispatchEvent(new KeyboardEvent("keydown", {key, bubbles: true, cancelable: true, ...more}));

const frames = (svg) => [...svg.querySelectorAll("g[data-axis] > path")].map((e) => e.getAttribute("d")).join();
const drawn = [data(first), data(other)], labels = ticks(first), framed = frames(first);
fire(first, "pointermove", 57.02 + 422.5 / 4);
found.lines = lines(first); found.linked = lines(other); found.words = words(first);
fire(first, "pointermove", 20);
found.left = lines(first);

fire(first, "pointerdown", 57.02 + 422.5 / 4); fire(first, "pointermove", 57.02 + 422.5 / 2);
found.selected = first.querySelectorAll("rect[fill-opacity='0.15']").length;
fire(first, "pointerup", 57.02 + 422.5 / 2);
found.dragged = [ticks(first), ticks(other)];
found.frames = frames(first) === framed;
found.moved = data(other).some((d, i) => d !== drawn[1][i]);
found.button = document.querySelector("button.zoomed").hidden;
fire(other, "dblclick", 200);
found.reset = [ticks(first), ticks(other)]; found.labels = labels;
found.restored = JSON.stringify([data(first), data(other)]) === JSON.stringify(drawn);

found.scrolls = fire(first, "wheel", 200, 100, {deltaY: -100});
found.unzoomed = ticks(first);
found.taken = !fire(first, "wheel", 200, 100, {deltaY: -100, ctrlKey: true});
found.wheeled = ticks(other);
fire(first, "pointerleave", 0);

first.focus();
found.focused = document.activeElement === first;
press(first, "0"); found.zero = ticks(first);
press(first, "ArrowRight"); found.right = said();
press(first, "ArrowRight"); found.further = said();
press(first, "+"); found.plus = ticks(other);
press(first, "ArrowRight", {shiftKey: true}); found.panned = ticks(other);
press(first, "Escape"); found.escaped = lines(first); found.silent = said();
press(first, "Escape"); found.whole = ticks(other);

step.focus();
press(step, "ArrowRight"); press(step, "ArrowRight"); found.step = said();

const entry = first.querySelector("g[data-entry=level-6][role=button]");
const ofLevel = [...document.querySelectorAll("g[data-key=level-6]")];
entry.dispatchEvent(new MouseEvent("click", {bubbles: true}));
found.plots = new Set(ofLevel.map((e) => e.ownerSVGElement)).size;
found.off = ofLevel.filter(visible).length; found.pressed = entry.getAttribute("aria-pressed");
found.others = [...document.querySelectorAll("g[data-key=level-7]")].filter(visible).length;
fire(first, "pointermove", 200); found.without = words(first);
press(entry, "Enter");
found.on = ofLevel.filter(visible).length === ofLevel.length; found.again = entry.getAttribute("aria-pressed");
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    directory = tmp_path_factory.mktemp("page")
    exp = samples.plain()
    record = samples.record(exp)
    report.write(samples.plan(exp), record, samples.summary(exp, record), directory)
    return directory / "report.html"


@pytest.fixture(scope="module")
def found(page, tmp_path_factory):
    return browser.run(page, ACT, tmp_path_factory.mktemp("browser"))


def number(text):
    """Return the number behind ``=``."""
    return float(text.partition("=")[2].split(",")[0].replace("−", "-"))


def test_nothing_fails_and_nothing_is_refused(found):
    assert found["errors"] == []


def test_one_line_follows_the_pointer_through_all_plots_over_time(found):
    place = 57.02 + 422.5 / 4
    assert len(found["lines"]) == 4
    assert len(found["linked"]) == 2
    assert found["lines"] + found["linked"] == pytest.approx([place] * 6, abs=0.5)
    assert number(found["words"][0]) == pytest.approx(5.0, abs=0.03)
    assert any(word.startswith("4 (θ₇ − θ₈): ") for word in found["words"])
    assert found["left"] == []


def test_a_drag_zooms_all_plots_over_time_and_a_double_click_resets_them(found):
    assert found["selected"] == 4
    assert found["dragged"] == [["5", "6", "7", "8", "9", "10"]] * 2
    assert found["moved"]
    assert found["frames"]
    assert found["button"] is False
    assert found["reset"] == [found["labels"]] * 2
    assert found["restored"]


def test_the_wheel_scrolls_the_page_unless_it_is_meant_for_the_plot(found):
    assert found["scrolls"]
    assert found["unzoomed"] == found["labels"]
    assert found["taken"]
    assert found["wheeled"] != found["labels"]


def test_the_keyboard_does_all_of_it_and_values_are_said(found):
    assert found["focused"]
    assert found["zero"] == found["whole"] == found["labels"]
    assert number(found["further"]) - number(found["right"]) == pytest.approx(0.2, abs=0.01)
    assert "16 (θ₈ − θ₉): " in found["right"]
    assert found["plus"] != found["labels"]
    assert found["panned"] != found["plus"]
    assert found["escaped"] == []
    assert found["silent"] == ""


def test_a_plot_against_the_step_is_read_at_its_points(found):
    assert number(found["step"]) == pytest.approx(20.0 / 2**8, rel=1e-3)
    assert "central: " in found["step"]
    assert "true error" in found["step"]


def test_a_legend_entry_switches_its_level_off_in_every_plot_and_on_again(found):
    assert found["plots"] > 2
    assert found["off"] == 0
    assert found["pressed"] == "false"
    assert found["others"] > 2
    assert not any(word.startswith("θ₆") for word in found["without"])
    assert found["on"]
    assert found["again"] == "true"


def test_a_plot_against_the_step_without_points_is_left_alone(page, tmp_path):
    """A page whose errors are all round-off had a script error for each key in such a plot."""
    before, name, after = page.read_text("utf-8").partition('<figure id="order_theta_0">')
    plot, end, rest = after.partition("</figure>")
    empty = tmp_path / "empty.html"
    empty.write_text(
        before + name + plot.replace("data-curve=", "data-none=") + end + rest, "utf-8"
    )
    act = """
    const step = document.querySelector("#order_theta_0 svg");
    step.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowRight", bubbles: true}));
    found.live = step.classList.contains("live");
    found.others = document.querySelectorAll("svg.live").length;
    """
    found = browser.run(empty, act, tmp_path)
    assert (found["errors"], found["live"]) == ([], False)
    assert found["others"]
