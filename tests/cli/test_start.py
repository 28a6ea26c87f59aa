"""A command imports what it needs and nothing that takes long: measured where it ends."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from .conftest import Made
from .test_outcome_text import check, entry

SLOW = {"matplotlib", "snakemake", "xarray", "scipy", "sympy", "jinja2", "pint"}
NUMBERS = {"numpy", "pydantic", "netCDF4", "llvmlite", "yaml"}


@pytest.mark.parametrize(
    ("words", "spared"),
    [
        (["--help"], SLOW | NUMBERS),
        (["run", "--help"], SLOW | NUMBERS),
        (["completion", "words", "--", "run", ""], SLOW | NUMBERS),
        (["list", "checks"], SLOW | NUMBERS),
        (["explain"], SLOW | NUMBERS),
        (["explain", "exact"], SLOW - {"pint"}),
        (["open", "FILE"], SLOW | NUMBERS),
        (["show", "FILE"], SLOW | NUMBERS - {"numpy", "netCDF4"}),
        (["show", "FILE", "--no-plot"], SLOW | NUMBERS - {"numpy"}),
        (["diff", "FILE", "FILE"], SLOW | NUMBERS),
        (["report", "--results", "RESULTS"], SLOW - {"jinja2"} | NUMBERS),
    ],
    ids=lambda words: " ".join(words) if isinstance(words, list) else "",
)
def test_a_command_starts_without_libraries_that_take_long(
    made: Made, words: list[str], spared: set[str]
) -> None:
    program = (
        "import atexit, json, sys\n"
        "from vibsim.cli import main\n"
        "atexit.register(lambda: print(json.dumps(sorted(sys.modules)), file=sys.stderr))\n"
        "main(sys.argv[1:])"
    )
    (made.small / "report.html").touch()
    places = {"FILE": str(made.file), "RESULTS": str(made.results)}
    named = [places.get(word, word) for word in words]
    if "FILE" in words:
        named += ["--results", str(made.results)]
    command = [sys.executable, "-c", program, *named]
    ended = subprocess.run(
        command, capture_output=True, text=True, check=True, env={"PATH": "", **_kept()}
    )
    assert not spared & set(json.loads(ended.stderr.splitlines()[-1]))


def test_a_run_with_nothing_to_do_prints_its_lines_without_numbers_libraries() -> None:
    program = (
        "import json, sys\n"
        "from vibsim.cli import outcome_text\n"
        "from vibsim.cli.run import command\n"
        "print(*outcome_text.in_lines(json.loads(sys.argv[1]), 99))\n"
        "print(json.dumps(sorted(sys.modules)))"
    )
    command = [sys.executable, "-c", program, json.dumps([entry(check())])]
    ended = subprocess.run(command, capture_output=True, text=True, check=True)
    line, modules = ended.stdout.splitlines()
    assert "order 2.002 (2.000 to 2.002)" in line
    assert not (SLOW | NUMBERS) & set(json.loads(modules))


def _kept() -> dict[str, str]:
    """Return the environment by which a plan is found that was made before; there is no browser in it."""
    names = ("HOME", "XDG_CACHE_HOME", "VIBSIM_CACHE_DIR")
    return {name: os.environ[name] for name in names if name in os.environ}
