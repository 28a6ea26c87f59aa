"""The index and the player in a browser, where one is installed: scripts run under the page's own policy."""

from __future__ import annotations

import os
import re

import browser
import pytest
from test_index import put
from test_player import made

from vibsim import report
from vibsim.report.figures import scenes
from vibsim.report.page import history, player

pytestmark = pytest.mark.slow


def shown(path, *, wait=3000):
    """Return the content of a page after its scripts have run for some virtual milliseconds."""
    profile = path.parent / "profile"
    return browser.dumped(path.as_uri(), profile, f"--virtual-time-budget={wait}")


def test_the_index_tells_dates_and_what_changed_and_can_be_filtered(tmp_path):
    (tmp_path / ".vibsim").mkdir()
    folder, *_ = put(tmp_path, "a", "one")
    put(tmp_path, "adhoc", "two")
    report.write_index(tmp_path)
    put(tmp_path, "a", "one", status="FAIL")
    os.utime(folder / "summary.json", (1.7e9, 1.7e9))
    report.write_index(tmp_path)
    page = shown(tmp_path / "index.html")
    found = dict(re.findall(r'data-key="([^"]*)".*?class="when">([^<]*)<', page, re.DOTALL))
    assert "2023" in found["a/one"]
    assert re.search(r'<ul id="changes">.*a/one</a>: PASS became FAIL</li></ul>', page)
    # what only works with scripts is there
    assert not re.search(r"<(?:label|input)[^>]* hidden", page)
    assert "disabled" not in page.partition("<main>")[2].partition("<script")[0]
    # and without the history the rest works
    (tmp_path / history.FILE).unlink()
    page = shown(tmp_path / "index.html")
    assert not re.search(r"<(?:label|input)[^>]* hidden", page)


FILTER = """
const click = (tag) => document.querySelector(`[data-tag="${tag}"]`).click();
const find = (text) => {
  const field = document.querySelector("input[type=search]");
  field.value = text;
  field.dispatchEvent(new Event("input"));
};
const seen = () => [...document.querySelectorAll("main .card:not([hidden])")].map((card) => card.dataset.key).join(" ");
const told = [];
click("FAIL"); told.push(seen());
click("PASS"); told.push(seen());
click("FAIL"); click("PASS"); find("Two Central"); told.push(seen());
find("nothing of this name"); told.push(seen() + String(document.querySelector("#none").hidden));
find(""); told.push(seen());
for (const box of document.querySelectorAll("main .card input")) box.click();
told.push([...document.querySelectorAll("#compare .card")].map((card) => card.dataset.key).join(" "));
document.title = told.join("|");
"""


def test_filter_search_and_comparison(tmp_path):
    for name, status in (("one", "FAIL"), ("two", "PASS"), ("three", "INCONCLUSIVE")):
        put(tmp_path, "a", name, status=status, title=f"Experiment {name}")
    report.write_index(tmp_path)
    path = tmp_path / "index.html"
    # the page's own policy lets no other script run
    page = re.sub(r"<meta http-equiv=[^>]*>", "", path.read_text())
    path.write_text(page.replace("</body>", f"<script>{FILTER}</script></body>"))
    told = re.search(r"<title>([^<]*)</title>", shown(path))
    assert told is not None
    assert told.group(1).split("|") == [
        "a/one",
        "a/one a/two",
        "a/two",
        "false",
        "a/one a/three a/two",
        "a/three a/two",
    ]


def paths(page):
    """Return what the parts of all motions are drawn as, in the order of the page."""
    moving = re.findall(r'<g class="now">(.*?)</g>', page, re.DOTALL)
    return [re.findall(r'<path [^>]*\bd="([^"]*)"', group) for group in moving]


def labels(page):
    """Return words and place of the labels of all motions; no place where a label is hidden."""
    moving = re.findall(r'<g class="now">(.*?)</g>', page, re.DOTALL)
    return [
        [
            (text, None if 'display="none"' in look else tuple(numbers(look)[-2:]))
            for look, text in re.findall(r"<text class=([^>]*)>([^<]*)</text>", group)
        ]
        for group in moving
    ]


def numbers(text):
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?", text)]


# A browser that is not told the encoding guesses it from as much of the file as it has read.
HEAD = '<!DOCTYPE html><meta charset="utf-8"><title></title>'

GO = """
<script>
const slider = document.querySelector(".player input");
slider.value = FRAME;
slider.dispatchEvent(new Event("input"));
</script>
"""


@pytest.mark.parametrize(
    "name",
    ["dragged", "elastic_pendulum", "vehicle", "sliding_box", "washing_machine", "oscillator"],
)
def test_the_script_draws_what_the_still_picture_draws(tmp_path, name):
    record = made(name)
    lanes = player.lanes(record)
    path, frame = tmp_path / "page.html", 37
    go = GO.replace("FRAME", str(frame))
    path.write_text(f"{HEAD}<body>{player.element(record)}{go}</body>", encoding="utf-8")
    page = shown(path)
    found = paths(page)
    assert len(found) == len(lanes)
    for lane, drawn in zip(lanes, found, strict=True):
        for part, text in zip(lane.scene.parts, drawn, strict=True):
            if part.shape != "track":
                wanted = scenes.path_of(part, frame)
                assert re.sub(r"[-\d. ]+", "", text) == re.sub(r"[-\d. ]+", "", wanted)
                assert numbers(text) == pytest.approx(numbers(wanted), abs=0.25)
    for lane, texts in zip(lanes, labels(page), strict=True):
        labelled = [part for part in lane.scene.parts if part.label]
        for part, (text, place) in zip(labelled, texts, strict=True):
            assert text == part.label
            wanted = scenes.place_of_label(part.shape, scenes.values_of(part, frame))
            assert (place is None) == (wanted is None)
            assert place is None or place == pytest.approx(wanted, abs=0.3)


# Virtual time runs on while a loaded machine draws nothing, so the frames come from timers of the same virtual time.
CLOCK = """
<script>
window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 16);
window.cancelAnimationFrame = clearTimeout;
</script>
"""
KEYS = """
<script>
const figure = document.querySelector(".player"), slider = figure.querySelector("input");
const press = (key) => figure.dispatchEvent(new KeyboardEvent("keydown", {key, bubbles: true, cancelable: true}));
const told = [];
const tell = () => told.push(slider.value);
press("ArrowRight"); press("ArrowRight"); tell();
press("ArrowLeft"); tell();
press("End"); tell();
press("Home"); tell();
press(" ");
const wait = setInterval(() => {
  if (Number(slider.value) === 0) return;
  clearInterval(wait);
  press(" ");
  tell();
  const before = slider.value;
  setTimeout(() => { told.push(String(slider.value === before)); document.title = told.join(" "); }, 500);
}, 50);
</script>
"""


def test_the_player_plays_pauses_and_steps_by_keys(tmp_path):
    record = made()
    text, path = player.element(record), tmp_path / "page.html"
    path.write_text(f"{HEAD}{CLOCK}<body>{text}{KEYS}</body>", encoding="utf-8")
    told = re.search(r"<title>([^<]*)</title>", shown(path, wait=6000))
    assert told is not None
    on, back, last, first, played, is_paused = told.group(1).split()
    frames = player.lanes(record)[0].motion.t.size - 1
    assert (on, back, int(last), first) == ("2", "1", frames, "0")
    assert 0 < int(played) < frames
    assert is_paused == "true"
