"""``vibsim new``: a file that is accepted as it is, passes, and is completed by editors wherever it lies."""

from __future__ import annotations

import json
import os
from pathlib import Path

import jsonschema
import pytest
import yaml
from thinned import thinned

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.cli import main
from vibsim.cli.commands.new import SCHEMA
from vibsim.core.home import home
from vibsim.models import MODELS

Capture = pytest.CaptureFixture[str]
LINE = "# yaml-language-server: $schema="


@pytest.mark.parametrize("kind", thinned(MODELS, 4))
def test_a_new_file_of_every_model_passes_as_it_is(kind: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    assert main(["new", str(file), "--model", kind]) == 0
    experiment = Experiment.from_yaml(file)
    assert experiment.model.kind == kind
    found = verdicts(
        experiment,
        analyse(experiment, [simulate(experiment, level) for level in experiment.levels]),
    )
    assert {verdict.status for verdict in found} == {"PASS"}
    text = file.read_text()
    assert max(map(len, text.splitlines())) <= 120
    for field in MODELS[kind].formulas:
        assert field.description in text


def test_the_commands_that_it_names_work_where_the_user_is(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def named() -> str:
        file.unlink(missing_ok=True)
        assert main(["new", str(file)]) == 0
        return capsys.readouterr().out

    file, program = tmp_path / "mine.yaml", home() / ".venv/bin/vibsim"
    monkeypatch.chdir(home())
    assert f"check it: .venv/bin/vibsim check {file}\n" in named()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", os.defpath)
    assert f"run it:   {program} run {file}\n" in named()
    # that of an activated environment
    monkeypatch.setenv("PATH", str(program.parent))
    assert f"run it:   vibsim run {file}\n" in named()


@pytest.mark.parametrize("kind", ["pendulum", "oscillator", "elastic_pendulum"])
def test_what_is_commented_out_is_accepted_too(kind: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    assert main(["new", str(file), "--model", kind]) == 0
    text = file.read_text()
    assert "# sweep:\n#   " in text
    file.write_text(text.replace("# sweep:\n#   ", "sweep:\n  "))
    assert Experiment.from_yaml(file).members > 1


@pytest.mark.slow
def test_the_schema_line_works_anywhere(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    assert main(["new", str(file)]) == 0
    line = file.read_text().splitlines()[0]
    assert line == f"{LINE}{SCHEMA}"
    schema = json.loads((file.parent / SCHEMA).read_text())
    content = yaml.safe_load(file.read_text())
    jsonschema.validate(content, schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({**content, "levls": [1]}, schema)


def test_within_the_checkout_the_line_names_the_schema_that_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "configs/mine").mkdir(parents=True)
    (tmp_path / "Snakefile").touch()
    monkeypatch.setattr("vibsim.cli.commands.new.home", lambda: tmp_path)
    monkeypatch.chdir(tmp_path / "configs/mine")
    assert main(["new", "mine.yaml"]) == 0
    shipped = f"{LINE}../../workflow/schemas/experiment.schema.json"
    assert Path("mine.yaml").read_text().splitlines()[0] == shipped
    assert not Path(SCHEMA).exists()


def test_a_shipped_experiment_comes_with_its_tables(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    assert main(["new", str(file), "--like", "bumpy_road"]) == 0
    shipped = home() / "configs/vibration_text"
    lines = file.read_text().splitlines()
    assert lines[0] == f"{LINE}{SCHEMA}"
    assert lines[1:] == (shipped / "bumpy_road.yaml").read_text().splitlines()[1:]
    assert (tmp_path / "bumpy_road.csv").read_bytes() == (shipped / "bumpy_road.csv").read_bytes()
    assert main(["check", str(file)]) == 0


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["taken.yaml"], "exists already, and is not overwritten"),
        (["dangling.yaml"], "exists already, and is not overwritten"),
        (["other.yaml", "--like", "bumpy_road"], "bumpy_road.csv: exists already"),
        (["Mine.yaml"], "a name of a to z"),
        (["mine.json"], "end in .yaml"),
        (["none/mine.yaml"], "there is no folder none"),
        (["mine.yaml", "--model", "pendulm"], "did you mean 'pendulum'?"),
        (["mine.yaml", "--like", "vehicel"], "did you mean 'vehicle'?"),
        (["mine.yaml", "--like", "pendulum_lab"], "must be one experiment"),
        (["mine.yaml", "--like", "period_against_amplitude@1"], "not one member of it"),
        (["mine.yaml", "--like", str(home() / "examples/heat/heat.yaml")], "copy its folder"),
        (["mine.yaml", "--like", "vehicle", "--model", "spring"], "together with --model"),
    ],
)
def test_what_cannot_be_written_is_refused_and_leaves_nothing(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: Capture,
    arguments: list[str],
    told: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken.yaml").write_text("mine")
    (tmp_path / "bumpy_road.csv").write_text("mine")
    (tmp_path / "dangling.yaml").symlink_to("nowhere")
    before = sorted(tmp_path.iterdir())
    assert main(["new", *arguments]) == 2
    assert told in capsys.readouterr().err
    assert sorted(tmp_path.iterdir()) == before
    assert (tmp_path / "taken.yaml").read_text() == "mine"


@pytest.mark.slow
def test_a_schema_of_somebody_else_is_left_alone_and_one_of_vibsim_renewed(
    tmp_path: Path, capsys: Capture
) -> None:
    assert main(["new", str(tmp_path / "one.yaml")]) == 0
    schema = tmp_path / SCHEMA
    current = schema.read_text()
    schema.write_text(json.dumps({**json.loads(current), "properties": {}}))
    assert main(["new", str(tmp_path / "two.yaml")]) == 0
    assert schema.read_text() == current
    for other in ("{}", "[1]", "not JSON"):
        schema.write_text(other)
        assert main(["new", str(tmp_path / "three.yaml")]) == 2
        assert "is not a schema of vibsim" in capsys.readouterr().err
        assert schema.read_text() == other
        assert not (tmp_path / "three.yaml").exists()
