"""The notebooks run from the first cell to the last, and come out as their text says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot
import nbformat
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "examples/notebooks"


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Any:
    matplotlib.use("Agg")
    monkeypatch.chdir(FOLDER)

    def run(name: str) -> dict[str, Any]:
        """Run every cell of a notebook; return the names that it leaves."""
        notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
        nbformat.validate(notebook)
        names: dict[str, Any] = {"drawn": []}
        for i, cell in enumerate(notebook.cells):
            if cell.cell_type == "code":
                assert cell.outputs == []
                exec(compile(cell.source, f"{name}, cell {i + 1}", "exec"), names)
                if matplotlib.pyplot.get_fignums():
                    axes = matplotlib.pyplot.gca()
                    names["drawn"].append((axes.get_xlabel(), axes.get_ylabel()))
                    matplotlib.pyplot.close("all")
        return names

    return run


def test_every_notebook_is_tried() -> None:
    tried = {"from_yaml_to_figure", "judge_scipy"}
    assert {file.stem for file in FOLDER.glob("*.ipynb")} == tried


def test_from_yaml_to_figure(run: Any, capsys: pytest.CaptureFixture[str]) -> None:
    names = run("from_yaml_to_figure")
    assert names["ratios"] == pytest.approx([4.0, 4.0], abs=0.25)
    assert len(names["drawn"]) == 4
    assert {x for x, _ in names["drawn"][:-1]} == {"time [s]"}
    assert names["drawn"][-1] == ("time step [s]", "largest error of theta [rad]")
    assert {line.split()[0] for line in capsys.readouterr().out.splitlines()} == {"PASS"}


def test_judge_scipy(run: Any) -> None:
    names = run("judge_scipy")
    found = [names[name] for name in ("ends", "series", "lines", "fifth")]
    assert [verdict.status for verdict in found] == ["PASS", "PASS", "FAIL", "INCONCLUSIVE"]
    assert names["lines"].reason == "order_low"
    assert names["ends"].order == pytest.approx(3.0, abs=0.05)
    assert names["fifth"].order == pytest.approx(5.0, abs=0.1)
    assert [len(solved.t) - 1 for solved in names["runs"]] == [32, 64, 128, 256]
