"""The pages of the reference, written from the code: ``python docs/site/reference.py [PAGE]`` prints them.

Each file of ``docs/reference`` is a heading and a sentence; the site (``conf.py``) puts the rest behind it.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from xarray import Dataset

import vibsim
from vibsim import Experiment, analyse, simulate
from vibsim.analysis import summary_schema
from vibsim.cli import json_schemas
from vibsim.cli.arguments import commands
from vibsim.cli.commands.explain import meanings
from vibsim.cli.commands.listing import checks as listed_checks
from vibsim.cli.commands.theory import theory_rows
from vibsim.cli.list_entry import Row, model_rows, scheme_rows
from vibsim.convergence.study import verdict_schema
from vibsim.core.vocabulary import REASONS
from vibsim.experiment.schema import document, solver
from vibsim.experiment.value_names import VALUES
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
Lines = Iterator[str]
Schema = Mapping[str, Any]


def plain(text: str) -> str:
    """Write `text` so that Markdown changes nothing of it, but for what is marked as code."""
    parts = re.split(r"(`+[^`]+`+)", text)
    parts[::2] = [re.sub(r"([\\*_<\[\]])", r"\\\1", part) for part in parts[::2]]
    return "".join(parts).replace("|", r"\|").replace("\n", " ")


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> Lines:
    """Yield a table, of which the cells are Markdown, with an empty line around it."""
    head = list(head)
    yield from ("", f"| {' | '.join(head)} |", "|---" * len(head) + "|")
    for row in rows:
        yield f"| {' | '.join(row)} |"
    yield ""


def labelled(rows: Iterable[Row]) -> Lines:
    """Yield what a command prints of one entry, as a table."""
    yield from table(("", ""), ((label, plain(text)) for label, text in rows))


def experiments() -> Lines:
    """Yield every shipped experiment: its title, where it stands in a text, and its file."""
    for path in sorted(CONFIGS.glob("*/*.yaml")):
        experiment = Experiment.from_yaml(path)
        source = f" ({experiment.source})" if experiment.source else ""
        yield from (f"## {path.stem}", "", plain(f"{experiment.title}{source}."), "")
        yield f"`vibsim run {path.stem}` (`configs/{path.parent.name}/{path.name}`)"
        lines = path.read_text("utf-8").splitlines()
        written = [line for line in lines if not line.startswith("# yaml-language-server")]
        yield from ("", "```yaml", *written, "```", "")


def models() -> Lines:
    """Yield every model, as ``vibsim list models NAME`` prints it."""
    for kind, model in MODELS.items():
        yield f"## {kind}"
        yield from labelled(model_rows(model))


def schemes() -> Lines:
    """Yield every scheme, as ``vibsim list schemes NAME`` prints it."""
    for kind, scheme in SCHEMES.items():
        yield f"## {kind}"
        yield from labelled(scheme_rows(scheme))


def theory() -> Lines:
    """Yield the theory of every scheme with equal steps, as ``vibsim theory NAME`` prints it."""
    for kind, scheme in SCHEMES.items():
        if not scheme.adaptive:
            yield f"## {kind}"
            yield from labelled(theory_rows(scheme, scheme.defaults(), 4))


def checks() -> Lines:
    """Yield every kind of check with its keys, and every number that a check can ask for."""
    schema = document.schema()
    for name, text in listed_checks():
        if not name.startswith(" "):
            yield f"## {name}"
            sentence, colon, form = text.partition(": {")
            yield f"{plain(sentence[0].upper() + sentence[1:])}{': `{' + form + '`' if colon else '.'}"
            for line in keys(schema, schema["$defs"][f"{name.capitalize()}Check"]):
                yield line.replace("](#", "](experiment-file.md#")
    yield "## Numbers"
    yield "What `value:` may name. A number with no quantity belongs to the motion as a whole."
    rows = (
        (
            f"`{row.name}`",
            _OF[row.of],
            _MEASURED_IN[row.measure],
            ", ".join(f"`{part}`" for part in row.at),
            plain(row.description),
        )
        for row in VALUES.values()
    )
    yield from table(
        ("number", "of which quantities", "measured in", "`at:` takes", "meaning"), rows
    )


_OF = {
    "none": "",
    "series": "any",
    "convergent": "those that `converges` takes",
    "states": "states",
    "stored": "states, outputs",
    "extremal": "states, outputs, energy deviations",
    "deviation": "`energy_deviation`",
    "running": "energy deviations",
}
_MEASURED_IN = {
    "none": "1",
    "count": "a count",
    "quantity": "unit of the quantity",
    "l1": "unit of the quantity times s",
    "l2": "unit of the quantity times the square root of s",
    "time": "s",
    "frequency": "rad/s",
    "position": "unit of the position",
}


def reasons() -> Lines:
    """Yield every reason of a verdict, as ``vibsim explain REASON`` prints it."""
    for word, status in REASONS.items():
        yield f"## {word}"
        yield f"{status}."
        rows = (
            (plain(head), plain(told.meaning), plain(told.needs)) for head, told in meanings(word)
        )
        yield from table(("", "meaning", "needed"), rows)


def command_line() -> Lines:
    """Yield every command with its options."""
    for name, _, text, options in commands():
        yield f"## vibsim {name}"
        yield f"{plain(text)}"
        rows = []
        for names, settings in options:
            metavar = settings.get("metavar") or " | ".join(settings.get("choices", ()))
            if not names[-1].startswith("-"):
                names, metavar = (metavar or names[0],), ""
            repeated = " ..." if settings.get("nargs") in ("*", "+") else ""
            shown = ", ".join(f"{n} {metavar}".strip() + repeated for n in names).replace(
                "|", r"\|"
            )
            needed = " (needed)" if settings.get("required") else ""
            rows.append((f"`{shown}`", plain(settings.get("help", "") + needed)))
        yield from table(("option", "meaning"), rows)


def experiment_file() -> Lines:
    """Yield every key of an experiment file."""
    yield from documented(document.schema(), "## Sections")
    yield "# With a solver of your own"
    yield from documented(solver.schema(), "## Sections of such a file")


def files() -> Lines:
    """Yield the variables of netCDF files, from an experiment that is run for that, and the keys of JSON files."""
    experiment = Experiment.from_dict(
        {
            "title": "Variables",
            "model": {"kind": "pendulum"},
            "initial": {"theta": 1.0},
            "time": {"end": 20.0},
            "levels": [6, 7, 8],
            "schemes": ["central", "rk4"],
            "sweep": {"model.L": [1.0, 1.1]},
            "checks": [{"id": "order", "converges": "theta", "order": "scheme"}],
        }
    )
    levels = [simulate(experiment, level) for level in experiment.levels]
    for title, dataset in (("A level", levels[0]), ("convergence.nc", analyse(experiment, levels))):
        yield f"## {title}"
        yield f"{_RUN} `<q>` is any compared quantity: a state, an energy, or its deviation."
        yield from table(("variable", "dimensions", "unit", "meaning"), _variables(dataset))
    for title, schema in (
        ("summary.json", summary_schema.schema()),
        ("vibsim judge --json", verdict_schema.schema()),
        ("vibsim run --json", json_schemas.run()),
        ("vibsim plan --json", json_schemas.plan()),
    ):
        yield from documented(schema, f"## {title}")


_RUN = "The variables of a pendulum, with the states `theta` and `omega`, swept over `model.L`."


def _variables(dataset: Dataset) -> Iterator[tuple[str, ...]]:
    """Yield the variables; of those that every compared quantity has, those of the first one."""
    compared = [
        str(name).removesuffix("_difference")
        for name in dataset
        if f"{name}".endswith("_difference")
    ]
    first, *others = sorted(compared, key=lambda name: name != "theta") or [""]
    for name, variable in sorted(dataset.variables.items()):
        shown, words = str(name), str(variable.attrs["long_name"])
        of = max((q for q in compared if shown.startswith(f"{q}_")), key=len, default="")
        if of in others and shown.replace(of, first, 1) in dataset:
            continue
        if of == first and any(shown.replace(of, q, 1) in dataset for q in others):
            shown, words = shown.replace(of, "<q>", 1), words.rpartition(": ")[2]
        dims, units = ", ".join(map(str, variable.dims)), str(variable.attrs["units"])
        yield f"`{shown}`", dims, plain(units), plain(words)


def python() -> Lines:
    """Yield the public names, whose docstrings the site reads."""
    for name in sorted(dir(vibsim)):
        thing = getattr(vibsim, name)
        if name.startswith("_"):
            continue
        kind = "class" if isinstance(thing, type) else "function"
        yield from (f"## {name}", "```{eval-rst}", f".. auto{kind}:: vibsim.{name}", "```", "")


def documented(schema: Schema, heading: str) -> Lines:
    """Yield the keys of a JSON Schema, and of its parts but for models and schemes, which have pages."""
    yield heading
    yield plain(schema.get("description", ""))
    yield from keys(schema, schema)
    for name, part in schema.get("$defs", {}).items():
        if link(schema, name) == f"#{name.lower()}" and "properties" in part:
            yield f"### {name}"
            yield plain(part.get("description", ""))
            yield from keys(schema, part)


def keys(schema: Schema, part: Schema) -> Lines:
    """Yield a table of the keys of one part of a JSON Schema."""
    needed = part.get("required", ())
    rows = []
    for key, value in part.get("properties", {}).items():
        default = value.get("default")
        shown = default if isinstance(default, str) else json.dumps(default)
        left_out = f"`{shown}`" if default not in (None, {}, [], "") else ""
        rows.append((f"`{key}`", taken(schema, value), "needed" if key in needed else left_out))
        rows[-1] += (plain(value.get("description", "")),)
    yield from table(("key", "takes", "when left out", "meaning"), rows)


def taken(schema: Schema, value: Schema) -> str:
    """Say what a key takes."""
    if "$ref" in value:
        name = value["$ref"].rpartition("/")[2]
        return f"[{name}]({link(schema, name)})"
    if several := value.get("anyOf") or value.get("oneOf"):
        told = [taken(schema, one) for one in several if one.get("type") != "null"]
        return " or ".join(dict.fromkeys(filter(None, told)))
    if "enum" in value or "const" in value:
        return ", ".join(f"`{word}`" for word in value.get("enum", [value.get("const")]))
    found = value.get("type", "")
    names = [found] if isinstance(found, str) else [name for name in found if name != "null"]
    if names == ["array"]:
        return f"a list of {taken(schema, value.get('items', {})) or 'values'}"
    bounds = {
        "minimum": "from",
        "exclusiveMinimum": "above",
        "maximum": "to",
        "exclusiveMaximum": "below",
    }
    limits = [f"{word} {value[key]:g}" for key, word in bounds.items() if key in value]
    words = {
        "boolean": "true or false",
        "object": "a mapping",
        "string": "text",
        "integer": "a whole number",
        "number": "a number",
    }
    return " ".join([" or ".join(words.get(name, name) for name in names), *limits])


def link(schema: Schema, name: str) -> str:
    """Return where a part of a schema is described."""
    kind = schema["$defs"][name].get("properties", {}).get("kind", {}).get("const")
    if kind in MODELS or kind in SCHEMES:
        return f"{'models' if kind in MODELS else 'schemes'}.md#{kind}"
    if (check := name.removesuffix("Check").lower()) in dict(listed_checks()):
        return f"checks.md#{check}"
    return f"#{name.lower()}"


PAGES: Mapping[str, Callable[[], Lines]] = {
    "experiment-file": experiment_file,
    "experiments": experiments,
    "models": models,
    "schemes": schemes,
    "theory": theory,
    "checks": checks,
    "reasons": reasons,
    "files": files,
    "command-line": command_line,
    "python": python,
}
"""What stands behind each page of ``docs/reference``."""


def page(name: str) -> str:
    """Return one page as Markdown, without its heading."""
    return "\n".join(PAGES[name]()) + "\n"


if __name__ == "__main__":
    for chosen in sys.argv[1:] or PAGES:
        print(page(chosen))
