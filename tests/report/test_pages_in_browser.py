"""Pages in a real browser, on a telephone, a tablet and a desk, light and dark: accessible, and nothing is in the way.

Boxes are compared: another font moves every letter, but no box over another one. One picture is compared with the one
that the README shows, so coarsely that fonts do not matter.
"""

from __future__ import annotations

import html
import importlib.util
import json
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any

import browser
import numpy as np
import pytest
import samples
from PIL import Image

from vibsim import report, store
from vibsim.cli import main

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
HEAT = ROOT / "examples/heat"
WIDTHS = (390, 768, 1400)
HEIGHT = 900
STUDY = "h, y\n0.1, 1.717566086\n0.05, 1.718102854\n0.025, 1.718237082\n0.0125, 1.718270642\n"
PAGES = ("plain", "failed", "swept", "index", "judge", "solver")
FIRST_FIGURE = 620
"""Where the first figure of a report begins at the latest, on a desk [pixel]."""
MOST_SHEETS = 4
"""Sheets of paper that a page takes at most."""
COARSE = (70, 38)
"""Fields of a picture that are compared, of 20 x 20 pixels each."""
ALIKE = 0.85
"""Correlation of pictures that are the same: with letters of one width it is 0.93, without the plots 0.66."""
OUTSIDE = 6.0
"""How far words of a plot may leave it, where the font is another one [pixel]."""

# What the page says of itself in its frame; `axe` is there already.
AUDIT = """
(() => {
const named = (e) => `${e.tagName}#${e.id}.${e.getAttribute("class")} ${e.textContent.trim().slice(0, 40)}`;
const scrolls = (e) => e && e !== document.body && e !== document.documentElement
  && (getComputedStyle(e).overflowX !== "visible" || scrolls(e.parentElement));
const shown = (e) => e.checkVisibility() && e.getClientRects().length > 0 && e.getBoundingClientRect().width > 1;
const inFlow = (e) => shown(e) && ["static", "relative"].includes(getComputedStyle(e).position);
const wide = () => [...document.body.querySelectorAll("*")].filter((e) => !e.closest("svg svg, svg *") && shown(e)
  && !scrolls(e.parentElement) && e.getBoundingClientRect().right > innerWidth + 1).map(named);
const parents = "body, main, header, nav, section, article, figure, dl, .numbers, .hero, .cards, .evidence, .player";
const covered = () => {
  const told = [];
  for (const parent of document.querySelectorAll(parents)) {
    const boxes = [...parent.children].filter(inFlow);
    const covers = (p, q) => Math.min(p.right, q.right) - Math.max(p.left, q.left) > 2
      && Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top) > 2;
    // words that go over several lines have a box in each
    const meet = (a, b) => [...a.getClientRects()].some((p) => [...b.getClientRects()].some((q) => covers(p, q)));
    boxes.forEach((a, i) => told.push(
      ...boxes.slice(i + 1).filter((b) => meet(a, b)).map((b) => `${named(a)} | ${named(b)}`)));
  }
  return told;
};
const cut = () => [...document.querySelectorAll("svg.plot text")].filter(shown).map((e) => {
  const p = e.getBoundingClientRect(), q = e.closest("svg").getBoundingClientRect();
  return [Math.max(q.left - p.left, p.right - q.right, q.top - p.top, p.bottom - q.bottom), named(e)];
}).filter(([by]) => by > OUTSIDE);
const above = (selector) => document.querySelector(selector)?.getBoundingClientRect().top ?? null;
const light = (name) => getComputedStyle(document.body)[name].match(/[0-9.]+/g).slice(0, 3).reduce((a, b) => a + +b, 0);
const violation = (v) => `${v.id}: ${v.help}: ${v.nodes.slice(0, 3).map((n) => n.html.slice(0, 120)).join(" | ")}`;
addEventListener("load", async () => {
  const told = {width: innerWidth, wide: wide(), covered: covered(), cut: cut(),
    colours: [light("color"), light("backgroundColor")],
    tops: {heading: above("h1"), numbers: above(".numbers"), figure: above("svg.plot")}};
  for (const part of document.querySelectorAll("details")) part.open = true;
  told.wide.push(...wide());
  told.covered.push(...covered());
  const found = await axe.run(document, {resultTypes: ["violations"]});
  told.axe = found.violations.map(violation);
  told.rules = found.passes.length;
  parent.postMessage(JSON.stringify(told), "*");
});
})();
"""
HOST = """
<!DOCTYPE html><meta charset="utf-8"><body>
<script>
const found = [], text = TEXT;
addEventListener("message", (event) => {
  found.push(JSON.parse(event.data));
  if (found.length < WIDTHS.length) return;
  const told = document.createElement("pre");
  told.id = "found";
  told.textContent = JSON.stringify(found);
  document.body.append(told);
});
for (const width of WIDTHS) {
  const frame = document.createElement("iframe");
  frame.style = `width: ${width}px; height: HEIGHTpx; border: 0`;
  frame.srcdoc = text;
  document.body.append(frame);
}
</script>
"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Make a page of every kind: reports with and without a sweep or a failure, index, judge and solver."""
    folder = tmp_path_factory.mktemp("pages")
    asked = [{"source": "a text, figure 1", "shows": "over_time", "panels": "level"}]
    failing = [
        {"converges": "theta", "order": 2},
        {"value": "end", "quantity": "theta", "above": 9},
    ]
    # a number with a long name, by which a reader chooses it
    named = {"value": "max_abs_interior", "quantity": "energy_deviation", "at": {"level": 8}}
    of_sweep = [{"converges": "theta", "order": "scheme"}, named | {"below": 9}]
    experiments = {
        "plain": samples.plain(name="plain", figures=asked),
        "failed": samples.several(name="failed", checks=failing),
        "swept": samples.swept(6, name="swept", checks=of_sweep),
    }
    found = {}
    for name, exp in experiments.items():
        record, place = samples.record(exp), folder / "results" / exp.collection / name
        summary = samples.summary(exp, record)
        store.write_json(place / "summary.json", summary, digest="d")
        report.write(samples.plan(exp), record, summary, place)
        found[name] = place / "report.html"
    assert 'class="player"' in found["plain"].read_text()
    report.write_index(folder / "results")
    found["index"] = folder / "results/index.html"
    (folder / "study.csv").write_text(STUDY)
    main(
        [
            "judge",
            str(folder / "study.csv"),
            "--h",
            "h",
            "--order",
            "4",
            "--report",
            str(folder / "judge"),
        ]
    )
    found["judge"] = folder / "judge/report.html"
    shutil.copytree(HEAT, folder / "heat")
    file, common = folder / "heat/heat.yaml", ("--results", str(folder / "results"))
    file.write_text(
        file.read_text().replace("to: 6", "to: 5").replace("kappa: [0.05, 0.1]", "kappa: [0.1]")
    )
    assert main(["simulate", str(file), "--level", "0", "1", "2", *common, "--allow-commands"]) == 0
    assert main(["analyse", str(file), *common]) == 0
    assert main(["report", str(file), *common]) == 0
    found["solver"] = folder / "results/adhoc/heat/report.html"
    return found


def axe() -> str:
    """Return the source of axe-core, which the package bundles; nothing of it but this file is used."""
    found = importlib.util.find_spec("axe_playwright_python")
    assert found is not None
    assert found.submodule_search_locations
    return (Path(found.submodule_search_locations[0]) / "axe.min.js").read_text(encoding="utf-8")


def audited(page: str, *options: str) -> list[dict[str, Any]]:
    """Return what a page says of itself at every width."""
    # the page's own policy lets no other script run
    text = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page)
    audit = AUDIT.replace("OUTSIDE", str(OUTSIDE))
    text = text.replace("</body>", f"<script>{axe()}</script><script>{audit}</script></body>")
    host = HOST.replace("TEXT", json.dumps(text).replace("</", "<\\/"), 1)
    host = host.replace("WIDTHS", json.dumps(WIDTHS)).replace("HEIGHT", str(HEIGHT))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "host.html"
        path.write_text(host, encoding="utf-8")
        options = ("--window-size=1500,1000", "--virtual-time-budget=60000", *options)
        document = browser.dumped(path.as_uri(), Path(folder) / "profile", *options)
    told = re.search(r'<pre id="found">(.*?)</pre>', document, flags=re.DOTALL)
    assert told, "the page told nothing"
    found: list[dict[str, Any]] = json.loads(html.unescape(told[1]))
    assert {row["width"] for row in found} == set(WIDTHS)
    return found


@pytest.mark.parametrize("name", PAGES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_page_is_accessible_and_nothing_sticks_out_or_covers_anything(
    pages: dict[str, Path], name: str, scheme: str
) -> None:
    text = pages[name].read_text(encoding="utf-8")
    for found in audited(text, *["--force-dark-mode"] * (scheme == "dark")):
        assert found["rules"] > 10
        assert {key: found[key] for key in ("axe", "wide", "covered", "cut")} == {
            "axe": [], "wide": [], "covered": [], "cut": [],
        }, found["width"]  # fmt: skip
        ink, paper = found["colours"]
        assert (ink > paper) == (scheme == "dark")
        tops = found["tops"]
        if tops["numbers"] is not None:
            assert 0 <= tops["heading"] < tops["numbers"] < tops["figure"]
            assert found["width"] < max(WIDTHS) or tops["figure"] < FIRST_FIGURE


FAULTS = [
    ("axe", "pale words", '<p style="color: #bbb; background: #fff">pale words</p>'),
    ("covered", "other", '<div class="numbers"><p>one</p><p style="margin-top: -1rem">other</p></div>'),
    ("wide", "paragraph", '<p style="width: 3000px">a wide paragraph</p>'),
    ("cut", "outside", '<svg class="plot" width="50" height="9"><text x="40" y="8">outside</text></svg>'),
]  # fmt: skip
"""Where each is told, its words, and the fault."""


def test_every_fault_of_a_page_is_found(pages: dict[str, Path]) -> None:
    page = pages["index"].read_text(encoding="utf-8")
    faults = "".join(fault for *_, fault in FAULTS)
    for found in audited(page.replace("</main>", f"{faults}</main>")):
        assert [key for key, words, _ in FAULTS if words not in str(found[key])] == []


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_printed_on_a_few_sheets(
    pages: dict[str, Path], name: str, tmp_path: Path
) -> None:
    assert 1 <= browser.printed(pages[name], tmp_path) <= MOST_SHEETS


def test_a_table_is_no_wider_than_the_paper(pages: dict[str, Path], tmp_path: Path) -> None:
    """Chromium makes a whole page smaller for it: its text had 6.6 pt."""
    cells = "<td>a scale of the model</td>" * 3 + f'<td class="long">{"2*pi*speed" * 8}</td>'
    table = f'<div class="scroll"><table id="wide"><tbody><tr>{cells}</tr></tbody></table></div>'
    page = tmp_path / "wide.html"
    page.write_text(
        pages["swept"].read_text("utf-8").replace("</main>", f"{table}</main>"), "utf-8"
    )
    act = """
    const rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules]);
    rules.filter((rule) => rule.media?.mediaText === "print").forEach((rule) => (rule.media.mediaText = "all"));
    document.body.style.width = "688px";
    found.wide = document.querySelector("#wide").getBoundingClientRect().width;
    """
    assert browser.run(page, act, tmp_path)["wide"] <= 688


def test_a_page_that_just_fills_its_sheets_has_no_blank_one_behind(tmp_path: Path) -> None:
    """The height at which another sheet begins is found by halving; what begins behind it is text, not a margin."""
    exp = samples.plain(model={"kind": "pendulum", "g": 9.81, "L": 1.0}, name="filled")
    record = samples.record(exp)
    report.write(samples.plan(exp), record, samples.summary(exp, record), tmp_path / "filled")
    text, page = (tmp_path / "filled/report.html").read_text("utf-8"), tmp_path / "page.html"

    def sheets(height: int) -> list[bool]:
        room = f'<section id="computed"><p style="height: {height}px; margin: 0"></p>'
        page.write_text(text.replace('<section id="computed">', room), "utf-8")
        return browser.sheets(page, tmp_path)

    low, high = 0, 1000  # a sheet is no higher
    fewest = len(sheets(low))
    assert len(sheets(high)) > fewest
    while high - low > 2:
        middle = (low + high) // 2
        low, high = (middle, high) if len(sheets(middle)) == fewest else (low, middle)
    assert all(sheets(high + 3))


def test_an_index_of_many_experiments_is_printed_as_a_list(
    pages: dict[str, Path], tmp_path: Path
) -> None:
    text = pages["index"].read_text("utf-8")
    cards = re.findall(r"<article.*?</article>", text, re.DOTALL)
    passed = next(card for card in cards if "✓ PASS" in card)
    page = tmp_path / "many.html"
    page.write_text(text.replace(passed, 116 * passed), "utf-8")
    assert browser.printed(page, tmp_path) <= MOST_SHEETS


def test_a_page_that_is_too_long_is_seen_in_print(pages: dict[str, Path], tmp_path: Path) -> None:
    longer = '<p style="height: 7000px">much room</p></main>'
    page = tmp_path / "longer.html"
    page.write_text(pages["index"].read_text("utf-8").replace("</main>", longer), "utf-8")
    assert browser.printed(page, tmp_path) > MOST_SHEETS


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the page that the README shows."""
    results = tmp_path_factory.mktemp("pendulum")
    file = str(ROOT / "configs/pendulum_lab/theta_convergence.yaml")
    common = ("--results", str(results))
    assert main(["simulate", file, "--level", "6", "7", "8", "9", *common]) == 0
    assert main(["analyse", file, *common]) == 0
    assert main(["report", file, *common]) == 0
    return results / "pendulum_lab/theta_convergence/report.html"


@pytest.mark.parametrize(
    ("removed", "options", "is_alike"),
    [
        ("", (), True),
        ("", ("--force-dark-mode",), False),
        (r"<style.*?</style>", (), False),
        (r"<svg.*?</svg>", (), False),
    ],
    ids=["as it is", "dark", "without its style", "without its plots"],
)
def test_the_picture_of_the_readme_is_that_of_the_page(
    pendulum: Path, removed: str, options: tuple[str, ...], is_alike: bool, tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    page.write_text(re.sub(removed, "", pendulum.read_text("utf-8"), flags=re.DOTALL), "utf-8")
    with Image.open(ROOT / "docs/images/report.png") as kept:
        pictures = (browser.picture(page, kept.size, tmp_path, *options), kept.convert("L"))
    fields = [np.asarray(one.resize(COARSE, Image.Resampling.BOX), float) for one in pictures]
    likeness = np.corrcoef(*(part.ravel() for part in fields))[0, 1]
    assert (likeness > ALIKE) == is_alike
