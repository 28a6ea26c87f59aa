"""Sorting and copying the tables of a page, in a real browser, offline and under a strict policy."""

from __future__ import annotations

import csv
import io

import browser
import pytest
import samples

from vibsim import report

pytestmark = pytest.mark.slow

ACT = """
found.copied = [];
Object.defineProperty(navigator, "clipboard", { value: { writeText: (text) => found.copied.push(text) } });
const table = document.querySelector("table[data-table=orders_theta_l2]");
const headers = [...table.tHead.rows[0].cells];
const place = (name) => headers.findIndex((e) => e.textContent.startsWith(name));
const column = (name) => [...table.tBodies[0].rows]
  .map((row) => row.classList.contains("block") ? row.textContent.trim() : row.cells[place(name)].textContent);
const button = (name) => headers[place(name)].querySelector("button");
const sorts = () => headers.map((e) => e.getAttribute("aria-sort"));
found.start = column("level");
button("difference").focus();
found.focused = document.activeElement === button("difference");
button("difference").click(); found.up = [column("level"), column("difference")]; found.sorts = sorts();
button("difference").click(); found.down = column("level"); found.sorted = sorts();
button("steps").click(); found.steps = column("level"); found.one = sorts().filter(Boolean).length;
for (const copy of table.closest("details").querySelectorAll("button.copy")) copy.click();
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    # beyond 1000 steps numbers have a space within them
    exp = samples.swept(4, levels=[8, 9, 10, 11])
    record = samples.record(exp)
    directory = tmp_path_factory.mktemp("page")
    report.write(samples.plan(exp), record, samples.summary(exp, record), directory)
    return directory


@pytest.fixture(scope="module")
def found(folder, tmp_path_factory):
    return browser.run(folder / "report.html", ACT, tmp_path_factory.mktemp("browser"))


def blocks(cells):
    """Return the cells below each heading of a block."""
    made = {}
    for cell in cells:
        if " = " in cell:
            made[cell] = last = []
        else:
            last.append(cell)
    return made


def test_nothing_fails_and_nothing_is_refused(found):
    assert found["errors"] == []


def test_a_header_sorts_the_rows_of_each_block_and_what_is_not_there_comes_last(found):
    assert found["focused"]
    start = blocks(found["start"])
    assert len(start) == 2
    assert all(rows == ["8", "9", "10", "11"] for rows in start.values())
    # the finest level has no difference
    assert all(rows == ["10", "9", "8", "11"] for rows in blocks(found["up"][0]).values())
    assert all(rows[-1] == "–" for rows in blocks(found["up"][1]).values())
    assert blocks(found["down"]) == start
    assert blocks(found["steps"]) == start
    assert found["sorts"].count("ascending") == found["sorted"].count("descending") == 1
    assert found["one"] == 1


def test_the_whole_table_is_copied_as_its_files_have_it(folder, found):
    files = [
        (folder / f"tables/orders_theta_l2.{end}").read_text("utf-8") for end in ("csv", "tex")
    ]
    assert found["copied"] == files
    rows = list(csv.reader(io.StringIO(files[0])))
    assert len(rows) == 9
