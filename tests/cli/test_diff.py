"""``vibsim diff``: settings by their names in the file, verdicts, and numbers with the digits that differ."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from vibsim import store
from vibsim.cli import main

from .conftest import Made

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def other(made: Made) -> Path:
    """Return the results of the same experiment with another first step of the centred scheme."""
    earlier = made.folder / "earlier"
    shutil.copytree(made.small, earlier)
    made.change("schemes: [central,", "schemes: [{kind: central, start: first_order},")
    made.change("theta: 1.0", "theta: 1.0, omega: 0.25")
    made.change("A small", "Another")
    made.make()
    return earlier


@pytest.mark.slow
def test_settings_verdicts_and_numbers_of_two_results(
    made: Made, other: Path, capsys: Capture
) -> None:
    capsys.readouterr()
    assert main(["diff", str(other), str(made.small)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[:5] == [
        "settings",
        "  title: A small linear pendulum -> Another linear pendulum",
        "  initial.omega: 0.0 -> 0.25",
        "  schemes.central.start: centred -> first_order",
        "verdicts",
    ]
    assert lines[5] == "  order: PASS (asymptotic) -> INCONCLUSIVE (pre_asymptotic)"
    numbers = lines[lines.index("numbers") + 1 :]
    found = {line.split(":")[0].strip(): line.split(": ")[1] for line in numbers}
    old, new = map(float, found["order.central.order"].split(" -> "))
    assert (round(old), new < 1.5) == (2, True)
    assert "end.value" in found


@pytest.mark.slow
def test_a_folder_may_be_named_by_its_files_and_compared_with_a_name(
    made: Made, other: Path, capsys: Capture
) -> None:
    capsys.readouterr()
    for name in ("summary.json", "convergence.nc"):
        assert made.vibsim("diff", other / name, made.file) == 1
        assert (
            "order: PASS (asymptotic) -> INCONCLUSIVE (pre_asymptotic)" in capsys.readouterr().out
        )
    assert made.vibsim("diff", made.file, made.small) == 0
    assert capsys.readouterr().out == "no difference\n"


def test_two_files_without_results_have_settings_alone(made: Made, capsys: Capture) -> None:
    copy = made.file.with_name("copy.yaml")
    copy.write_text(made.file.read_text().replace("levels: [6, 7, 8]", "levels: [6, 7, 8, 9]"))
    # these are no results of its settings any more
    made.change("end: 20.0", "end: 21.0")
    assert made.vibsim("diff", made.file, copy) == 1
    shown = capsys.readouterr().out
    assert "time.end: 21.0 -> 20.0" in shown
    assert "levels: 6 to 8 -> 6 to 9" in shown
    assert "verdicts\n" not in shown
    for file in (made.file, copy):
        assert (
            f"{file}: there are no verdicts of these settings yet: .venv/bin/vibsim run {file}"
            in shown
        )


def test_numbers_have_the_digits_that_tell_them_apart(made: Made, capsys: Capture) -> None:
    other = made.folder / "other"
    shutil.copytree(made.small, other)
    summary = json.loads((other / "summary.json").read_text())
    facts = summary["checks"][1]["results"][0]["facts"]
    facts["value"] *= 1 + 1e-10
    store.write_json(other / "summary.json", summary, digest=summary["digest"])
    assert main(["diff", str(made.small), str(other)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "numbers"
    (line,) = lines[1:]
    old, new = line.removeprefix("  end.value: ").split(" -> ")
    assert old != new
    assert old[:9] == new[:9]


@pytest.mark.parametrize("name", ["summary.json", "convergence.nc"])
def test_damaged_results_are_named(made: Made, capsys: Capture, name: str) -> None:
    other = made.folder / "other"
    shutil.copytree(made.small, other)
    content = bytearray((other / name).read_bytes())
    content[len(content) // 2] ^= 1
    (other / name).write_bytes(content)
    assert main(["diff", str(made.small), str(other)]) == 1
    captured = capsys.readouterr()
    assert f"{other / name}: " in captured.err
    assert captured.out == ""


def test_unknown_names_and_missing_files_are_refused(made: Made, capsys: Capture) -> None:
    assert made.vibsim("diff", "vehicle", "vehicel") == 2
    assert "did you mean 'vehicle'?" in capsys.readouterr().err
    assert made.vibsim("diff", made.file, made.folder / "none.yaml") == 2
    assert "none.yaml" in capsys.readouterr().err
