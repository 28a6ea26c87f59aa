"""The catalogue of the two source texts: ``python workflow/catalogue.py [--check]``.

It consists of the page ``docs/catalogue.md`` and, for the index of results, the experiments of each section. Both come
from ``docs/catalogue.yaml``, which lists what the texts describe and where they are wrong, and from the claims of the
shipped experiments. They contain no measured numbers.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from vibsim.experiment import Experiment, citation
from vibsim.report.page.sources import CONFIRMED, CORRECTED, CORRECTION, OPEN
from vibsim.report.text import assertions

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "catalogue.md"
SECTIONS = ROOT / "vibsim" / "report" / "templates" / "sections.json"
"""The sections of the texts, for the index of results (`vibsim.report.page.sources`)."""
TEXTS = ("pendulum lecture", "vibration text")
PROVIDED = "PROVIDED"
EXERCISES = "Exercises"
MOST_CHECKS = 1
"""Number of checks of an experiment that are listed."""
REQUIRED = {"things": ("shown_by", "see", "open"), "errata": ("shown_by", "not_run")}
"""Keys of which an entry of each list must have at least one."""
HEAD = """# The two source texts, section by section

What the pendulum lecture and the vibration text describe, and which experiment shows it. To find an equation, a
figure or an exercise, search this page for `(42)`, `figure 6` or `exercise 12`.
`.venv/bin/vibsim run NAME` runs an experiment, and `make catalogue` runs all of them. The page of an experiment has the
measured numbers, and `results/index.html` has those of every statement whose experiment has run.

| badge | meaning |
|---|---|
| CONFIRMED | an experiment shows it: the check that is named behind it decides, or else all checks of the experiment |
| CORRECTED | the text is wrong, or lacks a condition. `Correct:` and italics are right, `Shown to be false:` is not |
| OPEN | something is missing, and the row says what |
| PROVIDED | a command or a page does what the text asks for; nothing is measured |

`python workflow/catalogue.py` writes this page from [catalogue.yaml](catalogue.yaml) and the experiment files.
Numbers 1 to {things} count what the texts describe, E1 to E{errata} the places where they are wrong, seem to be, or
leave a condition out. Rows without a number come from the files of experiments. Figures are also in
[a list of their own](figures.md), and [the exercises](exercises.md) have a page with their answers.
"""


@dataclass(frozen=True)
class Row:
    """A line of the page."""

    source: str
    number: str
    says: str
    shown: str
    badge: str
    told: str
    """The true statement, what is missing, or what decides."""
    see: str = ""
    """A command, or a page of the documentation."""


def experiments() -> dict[str, Experiment]:
    """Return the shipped experiments by ``collection/name``."""
    paths = sorted((ROOT / "configs").glob("*/*.yaml"))
    return {f"{path.parent.name}/{path.stem}": Experiment.from_yaml(path) for path in paths}


def data() -> dict[str, Any]:
    """Return the content of ``docs/catalogue.yaml``."""
    content: dict[str, Any] = yaml.safe_load((ROOT / "docs/catalogue.yaml").read_text("utf-8"))
    return content


def faults(listed: dict[str, Any], known: dict[str, Experiment]) -> list[str]:
    """Return the faults of the lists: names that do not exist, and statements that their checks contradict."""
    checks = {f"{name}#{c.id}": c for name, experiment in known.items() for c in experiment.checks}
    refuted = {name: c for name, c in checks.items() if c.kind == "claim" and not c.holds}
    messages, named = [], set()
    entries = [(kind, *row) for kind in REQUIRED for row in listed[kind].items()]
    for kind, number, content in entries:
        where = f"{kind}, {number}"
        shown = content.get("shown_by", [])
        unknown = [name for name in shown if name not in (checks if "#" in name else known)]
        messages += [f"{where}: {name} does not exist" for name in unknown]
        if not set(REQUIRED[kind]) & set(content):
            messages.append(f"{where}: has none of {', '.join(REQUIRED[kind])}")
        if kind == "errata":
            named.update(shown)
            if ("truth" in content) == ("confirmed" in content):
                messages.append(f"{where}: has not one of truth, confirmed")
            if "confirmed" in content:
                messages += [f"{where}: {name} refutes it" for name in shown if name in refuted]
        else:
            messages += [f"{where}: {name} refutes it" for name in shown if name in refuted]
    for name, claim in refuted.items():
        if not str(claim.source).startswith(TEXTS):
            messages.append(f"{name}: a statement of no text is refuted: say what is true")
        elif name not in named:
            messages.append(f"{name}: a text is refuted, and no erratum names the check")
    return messages


def rows(listed: dict[str, Any], known: dict[str, Experiment]) -> Iterator[Row]:
    """Yield the rows of the two lists, and a row for every claim on the texts."""
    for number, thing in listed["things"].items():
        measured = CONFIRMED if thing.get("shown_by") else PROVIDED
        badge = OPEN if "open" in thing else measured
        shown = ", ".join(_places(thing))
        told, see = (thing.get(key, "") for key in ("open", "see"))
        told = told or _decided_by(thing.get("shown_by", ()), known)
        yield Row(thing["source"], str(number), thing["says"], shown, badge, told, see)
    for number, row in listed["errata"].items():
        badge, told = CONFIRMED, row.get("confirmed")
        if told is None:
            badge, told = CORRECTED, f"Correct: {row['truth']}"
        if "not_run" in row:
            told += f". Not run: {row['not_run']}"
        shown = ", ".join(_places(row))
        yield Row(row["source"], f"E{number}", row["says"], shown, badge, told)
    for name, experiment in known.items():
        for check in experiment.checks:
            if check.kind != "claim" or not check.source:
                continue
            source = check.source.removeprefix(CORRECTION)
            if not source.startswith(TEXTS):
                continue
            decides = assertions.measured(check.that)
            badge, told = CONFIRMED, decides
            if not check.holds:
                badge, told = CORRECTED, f"Correct: {check.note}. Shown to be false: {decides}"
            elif source != check.source:
                badge, told = CORRECTED, f"Correct: {decides}"
            is_ours = badge == CORRECTED and check.holds
            says = f"*{check.claim.replace('*', '&ast;')}*" if is_ours else check.claim
            yield Row(source, "", says, _link(f"{name}#{check.id}"), badge, told)


def unnamed(named: Sequence[Row], known: dict[str, Experiment]) -> Iterator[Row]:
    """Yield a row for every experiment on the texts that no row in `named` shows."""
    shown = " ".join(row.shown for row in named)
    for name, experiment in known.items():
        if str(experiment.source).startswith(TEXTS) and _link(name) not in shown:
            yield Row(
                str(experiment.source),
                "",
                experiment.title,
                _link(name),
                CONFIRMED,
                _decided_by([name], known),
            )


def _decided_by(places: Sequence[str], known: dict[str, Experiment]) -> str:
    """Return what the deciding checks at `places` measure; of many checks of an experiment, the first ones."""
    texts = []
    for place in places:
        name, _, id_ = place.partition("#")
        checks = [check for check in known[name].checks if id_ in ("", check.id)]
        deciding = (check.that if check.kind == "claim" else check for check in checks)
        measured = [assertions.measured(check) for check in deciding]
        shown = measured[:MOST_CHECKS] if len(measured) > MOST_CHECKS + 1 else measured
        more = len(measured) - len(shown)
        texts.append("; ".join([*shown, f"and {more} more checks"] if more else shown))
    return ". ".join(dict.fromkeys(texts))


def _places(row: dict[str, Any]) -> Iterator[str]:
    yield from map(_link, row.get("shown_by", ()))
    see = row.get("see")
    if see:
        yield f"`{see}`" if see.startswith("vibsim ") else f"[{see}]({see.removeprefix('docs/')})"


def _link(name: str) -> str:
    experiment, _, check = name.partition("#")
    link = f"[{experiment.partition('/')[2]}](../configs/{experiment}.yaml)"
    return f"{link} `{check}`" if check else link


def _heading(row: Row) -> tuple[str, list[str]]:
    """Return the text and the sections to which a row belongs."""
    cited = citation.fields(row.source)
    assert cited is not None
    text, section = cited["text"], cited["section"]
    if text not in TEXTS:
        raise ValueError(f"{row.source}: no text of these: {', '.join(TEXTS)}")
    return text, citation.numbers(section) if section else [EXERCISES]


def _place(row: Row) -> str:
    """Return equation, figure and exercise of a row."""
    cited = citation.fields(row.source)
    assert cited is not None
    return citation.place(cited)


def _order(section: str) -> tuple[bool, list[int]]:
    return section == EXERCISES, [int(part) for part in re.findall(r"\d+", section)]


def _line(row: Row) -> str:
    cells = (row.number, _place(row), row.says, row.shown, row.badge, row.told)
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"


def _every_row(listed: dict[str, Any], known: dict[str, Experiment]) -> list[Row]:
    named = list(rows(listed, known))
    return [*named, *unnamed(named, known)]


def sections(listed: dict[str, Any], known: dict[str, Experiment]) -> str:
    """Return the sections and exercises of both texts, each with its experiments, as JSON."""
    entries: dict[tuple[str, str], dict[str, Any]] = {}
    for text, titles in listed["sections"].items():
        for number, title in titles.items():
            ends = listed["equations"][text].get(number)
            equations = [f"({i})" for i in range(ends[0], ends[1] + 1)] if ends else []
            entries[text, number] = _section(text, f"section {number}", title, equations)
        for number in range(1, 24) if text == "vibration text" else ():
            entries[text, f"exercise {number}"] = _section(text, f"exercise {number}", "", [])
    for row in _every_row(listed, known):
        text, under = _heading(row)
        cited = citation.fields(row.source)
        assert cited is not None
        exercise = re.match(r"\d+", cited["exercise"] or "")
        keys = [number for number in under if number != EXERCISES]
        for key in (*keys, *([f"exercise {exercise[0]}"] if exercise else [])):
            names = re.findall(r"\(\.\./configs/([\w/]+)\.yaml\)", row.shown)
            entries[text, key]["experiments"].update(dict.fromkeys(names))
            if cited["figure"]:
                entries[text, key]["words"].update({f"figure {cited['figure']}": None})
            entries[text, key]["see"].update({row.see: None} if row.see else {})
    content = [
        {key: list(value) if isinstance(value, dict) else value for key, value in entry.items()}
        for entry in entries.values()
    ]
    return "".join(("[\n", ",\n".join(map(json.dumps, content)), "\n]\n"))


def _section(text: str, place: str, title: str, words: Sequence[str]) -> dict[str, Any]:
    """Return the entry of a section, still without experiments; its dictionaries serve as ordered sets."""
    names: dict[str, Any] = {"text": text, "place": place, "title": title}
    return {**names, "words": dict.fromkeys(words), "experiments": {}, "see": {}}


def page(listed: dict[str, Any], known: dict[str, Experiment]) -> str:
    """Return the page."""
    by_text: dict[str, dict[str, list[Row]]] = {text: {} for text in TEXTS}
    for row in _every_row(listed, known):
        text, sections = _heading(row)
        for section in sections:
            by_text[text].setdefault(section, []).append(row)
    lines = [HEAD.format(things=len(listed["things"]), errata=len(listed["errata"]))]
    for text, parts in by_text.items():
        titles = listed["sections"][text]
        sections = sorted({*parts, *titles}, key=_order)
        lines.append(f"## {text.capitalize()}\n")
        lines.append(f"Sections: {', '.join(_jump(section, titles) for section in sections)}\n")
        for section in sections:
            lines.append(f"### {_title(section, titles)}\n")
            if section not in parts:
                below = [s for s in sections if s.startswith(f"{section}.")]
                ends = " to ".join(_jump(end, titles) for end in (below[0], below[-1]))
                lines.append(f"Shown in sections {ends}.\n")
                continue
            lines.append(
                "| no. | place | what it says | shown by | badge | decided by, or what is right |"
            )
            lines.append("|---|---|---|---|---|---|")
            ordered = (
                sorted(parts[section], key=_exercise) if section == EXERCISES else parts[section]
            )
            lines += [*map(_line, ordered), ""]
    return "\n".join(lines)


def _title(section: str, titles: dict[str, str]) -> str:
    return (
        "Exercises (sections 9 and 11)" if section == EXERCISES else f"{section} {titles[section]}"
    )


def _jump(section: str, titles: dict[str, str]) -> str:
    """Return a link to the heading of a section."""
    anchor = re.sub(r"[^\w -]", "", _title(section, titles)).lower().replace(" ", "-")
    return f"[{section}](#{anchor})"


def _exercise(row: Row) -> list[int]:
    return [int(part) for part in re.findall(r"\d+", _place(row))][:1]


def main(arguments: list[str], path: Path = PAGE) -> int:
    """Write both files, or with ``--check`` report whether they are current; return 1 if not, or if a list is wrong."""
    listed, known = data(), experiments()
    wrong = faults(listed, known)
    if wrong:
        print(*wrong, sep="\n")
        return 1
    texts = {path: page(listed, known), SECTIONS: sections(listed, known)}
    if "--check" not in arguments:
        for file, text in texts.items():
            file.write_text(text, encoding="utf-8")
        return 0
    stale = [f.name for f, text in texts.items() if not f.is_file() or f.read_text("utf-8") != text]
    print(*(f"{name} is not current" for name in stale) if stale else ["the catalogue is current"])
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
