"""What a reader can do with the views of a sweep's members, in a real browser, offline and under a strict policy."""

from __future__ import annotations

import math
import re

import browser
import pytest
import samples

from vibsim import report

pytestmark = pytest.mark.slow

SWEEP = {
    "initial.theta": {"linspace": [-2.9, 2.9, 7]},
    "initial.omega": {"linspace": [0.1, 2.9, 6]},
}
ACT = """
const explorer = document.querySelector(".explorer");
const shown = () => [...explorer.querySelectorAll("details")].filter((e) => !e.hidden && e.open);
const [quantity] = explorer.querySelectorAll("select");
const pick = (name) => { quantity.value = name; quantity.dispatchEvent(new Event("change")); };
found.options = [...quantity.options].map((e) => e.value);
found.first = shown().map((e) => e.dataset.name);
pick("error of θ");
found.picked = shown().map((e) => e.dataset.name);
pick("period");
const svg = shown()[0].querySelector("svg");
const told = () => [...svg.querySelectorAll("g.hair text")].map((e) => e.textContent);
const caption = () => shown()[0].querySelector(".member").textContent;
const box = svg.querySelector("g[data-axis=member]").dataset.box.split(" ").map(Number);
const at = (x, y) => new DOMPoint(box[0] + x * box[2], box[1] + y * box[3]).matrixTransform(svg.getScreenCTM());
const fire = (type, x, y) => {
  const { x: clientX, y: clientY } = at(x, y);
  svg.dispatchEvent(new (type === "click" ? MouseEvent : PointerEvent)(type, { clientX, clientY, bubbles: true }));
};
const press = (key) => svg.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
fire("pointermove", 0.02, 0.98); found.low = told();
fire("pointermove", 0.98, 0.02); found.high = told();
fire("pointermove", 0.5, 1.4); found.left = told();
fire("click", 0.02, 0.98); found.caption = caption();
press("ArrowRight"); found.right = told();
press("ArrowUp"); found.up = told(); found.said = caption();
press("Escape"); found.escaped = told();
Object.defineProperty(navigator, "clipboard", { value: { writeText: (text) => { found.copied = text; } } });
shown()[0].querySelector(".member button").click();
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    exp = samples.experiment(sweep=SWEEP, levels=[8, 9, 10, 11])
    record = samples.record(exp)
    directory = tmp_path_factory.mktemp("page")
    report.write(samples.plan(exp), record, samples.summary(exp, record), directory)
    return record, directory / "report.html"


@pytest.fixture(scope="module")
def found(made, tmp_path_factory):
    return browser.run(made[1], ACT, tmp_path_factory.mktemp("browser"))


def member(record, case):
    """Return what is told of a member, by its place: its values, its period, its verdict."""
    period = record.pick("period", scheme=0, case=case, level=-1)
    reason = record.flags("theta_reason")[0, case]
    theta, omega = record["initial_theta"][case], record["initial_omega"][case]
    return theta, omega, period, reason


def agrees(told, expected):
    *numbers, reason = expected
    for text, number in zip(told, numbers, strict=False):
        word = re.split("[=:] ", text)[1].split()[0].replace("−", "-")
        if math.isnan(number):
            assert word == "none"
        else:
            assert float(word) == pytest.approx(float(number), rel=1e-3)
    assert told[3].endswith(f"({reason})")


def test_nothing_fails_and_one_view_is_shown_at_a_time(found):
    assert found["errors"] == []
    assert found["first"] == ["period"]
    assert found["picked"] == ["error of θ"]
    assert {"period", "amplitude", "order of θ", "error of θ"} <= set(found["options"])


def test_the_member_under_the_pointer_is_told(made, found):
    record, _ = made
    # members run through omega first
    agrees(found["low"], member(record, 0))
    agrees(found["high"], member(record, 41))
    assert found["left"] == []


def test_a_click_and_the_keys_give_the_command_of_a_member(made, found):
    record, _ = made
    assert ".venv/bin/vibsim run pendulum_lab/theta@0" in found["caption"]
    agrees(found["right"], member(record, 6))
    agrees(found["up"], member(record, 7))
    assert ".venv/bin/vibsim run pendulum_lab/theta@7" in found["said"]
    assert found["copied"] == ".venv/bin/vibsim run pendulum_lab/theta@7"
    assert found["escaped"] == []


def test_without_scripts_every_view_is_there(made, found):
    text = made[1].read_text(encoding="utf-8")
    views = text.partition('<div class="explorer">')[2].partition("<script")[0]
    assert views.count("<details id=") == views.count("<svg") == len(found["options"])
    assert "hidden" not in views
    assert ".venv/bin/vibsim run pendulum_lab/theta@" in views
