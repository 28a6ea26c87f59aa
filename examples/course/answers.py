"""The answer key of the course: ``python examples/course/answers.py [--check] [SHEET ...]``.

Writes ``answers.md`` from ``answers.md.jinja``. Every number of it is measured by a run of the prepared files, after
the edits that stand in the sheets. ``--check`` compares and writes nothing; sheets are 1 to 5, all of them if none is
named.
"""

from __future__ import annotations

import importlib.util
import re
import sys
import tempfile
import textwrap
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import yaml

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.schemes import Scheme

COURSE = Path(__file__).parent
KEY = COURSE / "answers.md"
TEMPLATE = COURSE / "answers.md.jinja"
MARK = "## Sheet "
SHEETS = (1, 2, 3, 4, 5)
SCHEME = "lab_scheme/lab_scheme/scheme.py"


class Edit(NamedTuple):
    """A line of a file to take out, and the one to put in its place."""

    file: str
    old: str
    new: str


class Answer(NamedTuple):
    """What one check of a run said."""

    status: str
    reason: str
    facts: dict[str, Any]
    advice: str

    @property
    def verdict(self) -> str:
        """Status and reason, as a run prints them."""
        return f"{self.status}, `{self.reason}`"

    @property
    def value(self) -> float:
        """The number that a check on a value measured."""
        number: float = self.facts["value"]
        return number


def edits(sheet: int) -> dict[str, Edit]:
    """Return the edits of a sheet by their number, such as ``1.2``."""
    text = (COURSE / f"sheet_{sheet}.md").read_text("utf-8")
    found = re.findall(
        r"\*\*[Ee]dit (\d\.\d)\*\* in `([^`]+)`(?:(?!```).)*```diff\n-([^\n]*)\n\+([^\n]*)\n```",
        text,
        flags=re.DOTALL,
    )
    return {number: Edit(file, old, new) for number, file, old, new in found}


def edited(file: str, *numbers: str) -> str:
    """Return the text of a prepared file after these edits; ValueError where a line to take out is not there once."""
    text = (COURSE / file).read_text("utf-8")
    for number in numbers:
        edit = edits(int(number[0]))[number]
        if edit.file != file:
            continue
        lines = text.splitlines()
        if lines.count(edit.old) != 1:
            raise ValueError(
                f"edit {number}: {edit.old!r} stands {lines.count(edit.old)} times in {file}"
            )
        text = "\n".join(edit.new if line == edit.old else line for line in lines) + "\n"
    return text


@cache
def run(file: str, *numbers: str) -> dict[str, Answer]:
    """Return what the checks of an experiment say after these edits, by their names."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, file)
        path.write_text(edited(file, *numbers), "utf-8")
        if file == "find_the_bug.yaml":
            experiment = _with_scheme(path, Path(folder, "scheme.py"), numbers)
        else:
            experiment = Experiment.from_yaml(path)
        levels = [simulate(experiment, level) for level in experiment.levels]
        found = verdicts(experiment, analyse(experiment, levels))
    return {v.id: Answer(v.status, v.reason, v.results[0].facts, v.advice or "") for v in found}


def leaves_top(level: int) -> float:
    """Return the first stored time at which theta is beyond 4, pushed with omega = 2 (edit 4.3) [s]."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "large_angles.yaml")
        path.write_text(edited(path.name, "4.3"), "utf-8")
        found = simulate(Experiment.from_yaml(path), level)
    return float(found.t[(found.theta[0, 0].values > 4.0).argmax()])


def scheme(path: Path) -> Scheme:
    """Return the scheme that a module offers."""
    spec = importlib.util.spec_from_file_location("lab_scheme_of_the_course", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found: Scheme = module.LAB
    return found


def rendered(sheet: int) -> str:
    """Return the part of the key on one sheet."""
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, autoescape=False)
    environment.globals.update(run=run, leaves_top=leaves_top)
    part = _parts(TEMPLATE.read_text("utf-8"))[sheet]
    return "\n\n".join(map(_filled, environment.from_string(part).render().split("\n\n"))) + "\n\n"


def main(arguments: Sequence[str]) -> int:
    """Write the key, or compare it."""
    sheets = [int(word) for word in arguments if word != "--check"] or list(SHEETS)
    template = _parts(TEMPLATE.read_text("utf-8"))
    now = _parts(KEY.read_text("utf-8") + "\n") if KEY.exists() else template
    wanted = [template[0], *(rendered(i) if i in sheets else now[i] for i in SHEETS)]
    if "--check" in arguments:
        stale = [
            f"sheet {i}" for i, (old, new) in enumerate(zip(now, wanted, strict=True)) if old != new
        ]
        if stale:
            print(
                f"{KEY.name} is not current: {', '.join(stale)}; run python examples/course/answers.py"
            )
        return 1 if stale else 0
    KEY.write_text(MARK.join(wanted).rstrip() + "\n", "utf-8")
    return 0


def _parts(text: str) -> list[str]:
    return text.split(MARK)


def _filled(paragraph: str) -> str:
    """Break the lines anew: numbers are longer or shorter than their names."""
    return textwrap.fill(paragraph.strip(), 120, break_long_words=False, break_on_hyphens=False)


def _with_scheme(path: Path, module: Path, numbers: tuple[str, ...]) -> Experiment:
    """Return the experiment with the scheme after the edits; a student installs it instead."""
    module.write_text(edited(SCHEME, *numbers), "utf-8")
    content = yaml.safe_load(path.read_text("utf-8"))
    parameters = content.pop("model")
    content["schemes"] = [scheme(module)]
    return Experiment(model=parameters.pop("kind"), parameters=parameters, **content)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
