"""The example that the page on solvers shows is the one that is shipped, and does what the page says."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
import yaml
from jsonschema import Draft202012Validator

from vibsim.cli import main
from vibsim.experiment.schema.solver import schema

ROOT = Path(__file__).resolve().parents[2]
HEAT = ROOT / "examples/heat"


def test_the_page_shows_the_shipped_file() -> None:
    page = (ROOT / "docs/solver.md").read_text()
    shown = re.findall(r"^```yaml\n(.*?)^```", page, re.DOTALL | re.MULTILINE)[0]
    shipped = yaml.safe_load((HEAT / "heat.yaml").read_text())
    assert {**shipped, "source": None} == {**yaml.safe_load(shown), "source": None}
    assert Draft202012Validator(schema()).is_valid(shipped)


@pytest.mark.slow
def test_the_example_converges(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(HEAT, tmp_path / "heat")
    file = tmp_path / "heat/heat.yaml"
    text = file.read_text().replace("to: 6", "to: 5").replace("kappa: [0.05, 0.1]", "kappa: [0.1]")
    file.write_text(text)
    common = ("--results", str(tmp_path / "results"))
    levels = ["--level", "0", "1", "2"]
    assert main(["simulate", str(file), *levels, *common, "--allow-commands"]) == 0
    assert main(["analyse", str(file), *common]) == 0
    summary = yaml.safe_load((tmp_path / "results/adhoc/heat/summary.json").read_text())
    field, flux, accuracy = summary["checks"]
    assert field["results"][0]["facts"]["order"] == pytest.approx(2.0, abs=0.05)
    assert flux["results"][0]["facts"]["order"] == pytest.approx(2.0, abs=0.2)
    assert accuracy["status"] == "PASS"
    assert capsys.readouterr().err == ""
