"""Values from the command line stand in the place of those of a file, and every fault says where it came from."""

from __future__ import annotations

from pathlib import Path

import pytest

from vibsim import analyse, simulate, verdicts
from vibsim.analysis import summarise
from vibsim.core.errors import InputError
from vibsim.experiment import Experiment
from vibsim.experiment.experiment import canonical
from vibsim.experiment.yaml.parse import MAX_DEPTH
from vibsim.plan import Choice, load

TEXT = """\
title: A small pendulum
model: {kind: pendulum, g: 1.0}
initial:
time: {end: 20.0}
levels: [6, 7, 8]
schemes: [central, {kind: rk4}]
sweep:
  model.L: {linspace: [1, 2, 3]}
checks:
  - {converges: theta, order: 2}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "small.yaml"
    path.write_text(TEXT)
    return path


def edited(file: Path, old: str, new: str) -> Experiment:
    assert old in TEXT
    file.write_text(TEXT.replace(old, new))
    return Experiment.from_yaml(file)


PLACES = {
    "number": ("model.g=1.62", "g: 1.0", "g: 1.62"),
    "unit": ("time.end=2 min", "end: 20.0", "end: 2 min"),
    "absent key": ("time.base_steps=3", "end: 20.0", "end: 20.0, base_steps: 3"),
    "absent section": ("tolerance=", "title:", "tolerance:\ntitle:"),
    "empty section": ("initial.theta=1", "initial:", "initial: {theta: 1}"),
    "text": ("title=Another one", "A small pendulum", "Another one"),
    "list": ("levels={from: 5, to: 7}", "[6, 7, 8]", "{from: 5, to: 7}"),
    "entry of a list": ("levels[0]=5", "[6,", "[5,"),
    "plain word": ("schemes[0]=euler_cromer", "[central", "[euler_cromer"),
    "option of a plain word": (
        "schemes[0].start=first_order",
        "[central",
        "[{kind: central, start: first_order}",
    ),
    "scheme by its word": (
        "schemes.central.start=first_order",
        "[central",
        "[{kind: central, start: first_order}",
    ),
    "scheme by its kind": ("schemes.rk4.label=a", "{kind: rk4}", "{kind: rk4, label: a}"),
    "entry of a mapping in a list": ("checks[0].order=1", "order: 2", "order: 1"),
    "check by its default name": ("checks.check_1.order=1", "order: 2", "order: 1"),
    "key with a dot": ("sweep.model.L=[3, 4]", "{linspace: [1, 2, 3]}", "[3, 4]"),
    "within a key with a dot": ("sweep.model.L.linspace[2]=5", "2, 3]", "2, 5]"),
    "new key with a dot": ("sweep.model.g=[3, 4]", "sweep:", "sweep:\n  model.g: [3, 4]"),
}


@pytest.mark.parametrize(("setting", "old", "new"), PLACES.values(), ids=PLACES)
def test_a_setting_is_an_edit_of_the_file(file: Path, setting: str, old: str, new: str) -> None:
    found = Experiment.from_yaml(file, settings=[setting])
    assert found.settings == (setting,)
    other = edited(file, old, new)
    if "new" in setting or "model.g=[" in setting:
        # a new axis of a sweep is the last one
        assert found.sweep is not None
        assert found.sweep.keys == ("model.L", "model.g")
        assert other.sweep is not None
        assert set(found.sweep.axes) == set(other.sweep.axes)
    else:
        assert canonical(found) == canonical(other)
        assert found == other


def test_the_last_of_several_counts_and_an_alias_elsewhere_stays(file: Path) -> None:
    text = TEXT.replace("g: 1.0", "g: &one 1.0, L: *one")
    file.write_text(text.replace("  model.L: {linspace: [1, 2, 3]}", "  model.m: [1, 2]"))
    found = Experiment.from_yaml(file, settings=["model.g=2", "model.g=3"])
    assert found.model.parameters["g"] == 3.0
    assert found.model.parameters["L"] == 1.0
    assert Experiment.from_yaml(file, settings="model.g=2").settings == ("model.g=2",)


FAULTS = {
    "unknown key": ("model.gg=1", "model.gg: 1: unknown key: did you mean 'g'?"),
    "unknown section": ("modell.g=1", "modell: {g: 1}: unknown key: did you mean 'model'?"),
    "value": ("model.g=heavy", "model.g: heavy: "),
    "nested value": ("time={end: -1}", "time.end: -1: must be greater than 0"),
    "missing": ("model={g: 1}", "model.kind: required key is missing"),
    "word": ("schemes[1].kind=rk5", "schemes[1].kind: rk5: unknown scheme: did you mean 'rk4'?"),
    "index": ("schemes[2]=rk4", "schemes has no entry [2]: choose from [0] to [1]"),
    "no list": ("model[0]=1", "model is not a list"),
    "list": ("levels.to=3", "levels is a list: name an entry by its number, e.g. levels[0]"),
    "name in a list": ("schemes.rk5.label=a", "schemes is a list: did you mean 'rk4'?"),
    "check in a list": ("checks.chek_1.order=1", "checks is a list: did you mean 'check_1'?"),
    "no keys": ("model.g.x=3", "model.g is a value and has no keys"),
    "no value": ("model.g", "must be KEY=VALUE, e.g. model.g=1.62"),
    "no key": ("=1", "must be KEY=VALUE"),
    "half a key": ("model..g=1", "must be KEY=VALUE"),
    "YAML": ("levels=[6", "levels: [6: is not valid YAML"),
    "octal": ("model.g=010", "model.g: 010: a number must not begin with 0"),
    "two values": ("model.g=1\nfoo: 2", "must be one value"),
    "twice": ("model={kind: pendulum, g: 1, g: 2}", "duplicate key"),
    "tag": ("model.g=!!int 3", "YAML tags are not allowed"),
    "too deep": ("model.g=" + "[" * (MAX_DEPTH + 1), "must not nest deeper"),
}


@pytest.mark.parametrize(("setting", "told"), FAULTS.values(), ids=FAULTS)
def test_a_fault_names_the_setting_and_no_line(file: Path, setting: str, told: str) -> None:
    with pytest.raises(InputError) as error:
        Experiment.from_yaml(file, settings=["title=Fine", setting])
    (line,) = str(error.value).splitlines()
    shown = " ".join(setting.split())[:50]
    assert line.startswith(f"{file}, --set {shown}")
    assert told in line


def test_a_fault_of_the_file_keeps_its_line_and_every_bad_setting_is_told(file: Path) -> None:
    file.write_text(TEXT.replace("end: 20.0", "end: soon"))
    with pytest.raises(InputError) as error:
        Experiment.from_yaml(file, settings=["model.g=-1e-400x"])
    assert f"{file}:4: time.end: soon" in str(error.value)
    with pytest.raises(InputError) as error:
        Experiment.from_yaml(file, settings=["a", "levels[9]=1"])
    assert len(error.value.faults) == 2


@pytest.mark.slow
def test_the_command_of_a_member_has_the_settings(file: Path) -> None:
    found = Experiment.from_yaml(file, settings=["title=On the moon", "model.g=1.62"])
    convergence = analyse(found, {level: simulate(found, level) for level in found.levels})
    summary = summarise(found, verdicts(found, convergence), convergence)
    assert summary["settings"] == list(found.settings)
    result = summary["checks"][0]["results"][0]
    member = f"small.yaml@{result['case']}"
    assert result["command"] == f"vibsim run {member} --set 'title=On the moon' --set model.g=1.62"
    # the command is that of the member, with the value
    alone = load(Choice("adhoc", file, result["case"], found.settings)).experiment
    assert alone == found.alone(result["case"])
    assert alone.settings == found.settings


def test_settings_hold_for_a_solver_of_the_user_too(tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    file.write_text(
        "title: Own\nsolver: {command: 'solve {h} {output}'}\nrefine: {h: [0.4, 0.2, 0.1]}\n"
        "quantities: {y: {}}\nchecks: [{converges: y, order: 2}]\n"
    )
    plan = load(Choice("adhoc", file, settings=("refine.h=[0.2, 0.1, 0.05]",)))
    assert plan.content["sizes"] == {"h": [0.2, 0.1, 0.05]}
    assert plan.settings == ("refine.h=[0.2, 0.1, 0.05]",)
    with pytest.raises(InputError, match=r"--set refine.h=x: refine.h"):
        load(Choice("adhoc", file, settings=("refine.h=x",)))


@pytest.mark.parametrize(
    ("text", "setting", "key", "rule"),
    [
        ("[6, 7, 8]", "levels[0]=9", "levels[0]", "increasing order"),
        ("[6, 7, 8]", "levels[2]=1", "levels[2]", "increasing order"),
        ("{from: 6, to: 8}", "levels.from=9", "levels.from", "must be at most 'to', which is 8"),
        ("{from: 6, to: 8}", "levels.to=5", "levels.to", "must be at least 'from', which is 6"),
    ],
)
def test_levels_out_of_order_are_the_fault_of_the_setting(
    file: Path, text: str, setting: str, key: str, rule: str
) -> None:
    file.write_text(TEXT.replace("[6, 7, 8]", text))
    with pytest.raises(InputError) as error:
        Experiment.from_yaml(file, settings=[setting])
    (fault,) = error.value.faults
    assert f"--set {setting}" in fault.file
    assert (fault.key, fault.line) == (key, 0)
    assert rule in fault.rule
