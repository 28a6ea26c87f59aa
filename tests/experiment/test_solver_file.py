"""The file of an experiment with a solver of the user: what is refused, each with its line, and what it means."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

from vibsim.cli import main
from vibsim.core.errors import InputError
from vibsim.experiment import Experiment
from vibsim.experiment.schema.solver import schema
from vibsim.experiment.solver import SolverExperiment, restore
from vibsim.experiment.solver_reading import from_file


@cache
def validator() -> Draft202012Validator:
    return Draft202012Validator(schema())


TEXT = """\
title: Time stepping of my heat solver
solver:
  command: ./heat --dt {h} --kappa {kappa} --out {output}
  inputs: [heat]
refine: {h: [0.05, 0.1, 0.02]}
quantities: {T: {coordinates: [x, t]}, flux: {}}
checks: [{converges: T, order: 2}, {accurate: flux, relative: 1e-3}]
sweep: {kappa: [1, 2]}
"""
Faults = list[str]


@pytest.fixture
def heat(tmp_path: Path) -> Path:
    (tmp_path / "heat").write_text("a program")
    file = tmp_path / "heat.yaml"
    file.write_text(TEXT)
    return file


def changed(file: Path, *changes: tuple[str, str]) -> Path:
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    file.write_text(text)
    return file


def faults(file: Path, capsys: pytest.CaptureFixture[str]) -> Faults:
    assert main(["check", str(file)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    return [line.removeprefix(f"{file}:") for line in captured.err.splitlines()]


def test_a_file_is_accepted_without_running_anything(
    heat: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(heat)]) == 0
    assert capsys.readouterr().out == f"{heat}: valid (2 members, levels 0, 1, 2)\n"


MINE = "'./my heat' {{}}"
COMMAND = "./heat --dt {h} --kappa {kappa} --out {output}"
REFUSED = [
    (COMMAND, "''", ["3: solver.command: ", "must not be empty"]),
    (COMMAND, "\"{h} ''\"", ["3: solver.command: ", "has no placeholder for the file"]),
    (
        "--dt {h}",
        "--dt {k}",
        ["3: solver.command: ", "unknown placeholder {k}: choose from h, kap"],
    ),
    (
        "coordinates: [x, t]",
        "coordinates: [x, t], exact: sin(pi*y)",
        ["6: quantities.T.exact: sin(pi*y): must be a formula in x, t, kappa", "'y'"],
    ),
    ("flux: {}", "flux: {exact: x}", ["6: quantities.flux.exact: x: must be a formula in kappa"]),
    (
        "flux: {}",
        "flux: {exact: 1/0}",
        ["6: quantities.flux.exact: 1/0: must be", "it divides by zero"],
    ),
    ("flux: {}", "flux: {exact: [1]}", ["6: quantities.flux.exact: ", "must be a formula, or a n"]),
    ("flux: {}", "flux: {noise: -1}", ["6: quantities.flux.noise: -1: must be at least 0"]),
    ("--dt {h}", "", ["3: solver.command: ", "has no placeholder that differs between levels"]),
    ("--out {output}", "", ["3: solver.command: ", "has no placeholder for the file that it wr"]),
    ("--out {output}", "> {output}", ["3: solver.command: ", "no shell reads a command, so >"]),
    ("{kappa} ", "1 ", ["8: sweep.kappa: is not a placeholder of `command:`"]),
    ("--dt {h}", "--dt {h:.3f}", ["3: solver.command: ", "must have a name alone between braces"]),
    ("--dt {h}", "{h} }", ["3: solver.command: ", "must have a name alone between braces"]),
    ("--dt", "'--dt", ["3: solver.command: ", "cannot be split into arguments (No closing quot"]),
    ("inputs: [heat]", "inputs: [haet]", ["4: solver.inputs[0]: haet: there is no such file"]),
    ("inputs: [heat]", "inputs: [.]", ["4: solver.inputs[0]: .: must be a file"]),
    ("inputs: [heat]", "python: 'm:f'", ["2: solver: must have exactly one of command, python"]),
    ("command: " + COMMAND, "python: m", ["3: solver.python: m: must be module:function"]),
    (f"command: {COMMAND}\n", "\n", ["2: solver: must have exactly one of", "has none of them"]),
    ("refine: {h: [0.05, 0.1, 0.02]}", "refine: {}", ["5: refine: must name a step size"]),
    ("0.02", "0.1", ["5: refine.h[2]: 0.1: a step size must not be repeated"]),
    ("0.02", "0", ["5: refine.h[2]: 0: a step size must be greater than 0"]),
    ("0.02", "x", ["5: refine.h[2]: x: must be a number"]),
    ("0.02]", "0.02], n: [1, 2]", ["5: refine.n: must have as many values as h has, 3, has 2"]),
    ("[0.05, 0.1, 0.02]", "1/2**level", ["5: refine.h: 1/2**level: a formula needs `levels`"]),
    (
        "h: [0.05, 0.1, 0.02]",
        "levels: [3, 4], h: 1/2**lvel",
        ["5: refine.h: 1/2**lvel: must be a formula in level (unknown name 'lvel'): did you"],
    ),
    ("h: [0.05", "levels: {from: 4, to: 3}, h: [0.05", ["5: refine.levels.to: 3: must be at"]),
    ("h: [0.05, 0.1, 0.02]", "h: 1, levels: [a]", ["5: refine.h: 1: must be a list"]),
    ("T: {coordinates: [x, t]}", "T: {coordinates: [x, x]}", ["6: quantities.T.coordinates[1]"]),
    ("T: {coordinates: [x, t]}", "T: {coordinates: [x, h]}", ["is the name of a size, too"]),
    ("T: {coordinates", "kappa: {coordinates", ["is the name of a swept parameter, too"]),
    ("T: {coordinates", "level: {coordinates", ["'level' means something else here"]),
    ("flux: {}", "flux: {restrict: mena}", ["6: quantities.flux.restrict: mena: unknown choice"]),
    ("converges: T", "converges: t", ["7: checks[0].converges: t: is none of the quantities"]),
    ("order: 2", "order: 2, at_least: 1", ["7: checks[0].at_least: 1: must not be given together"]),
    ("order: 2", "tolerance: 2", ["7: checks[0].tolerance: 2: unknown key"]),
    (", relative: 1e-3", "", ["7: checks[1]: must have exactly one of relative, absolute"]),
    ("accurate: flux", "stable: true", ["7: checks[1]: ", "must be a mapping with the key conver"]),
    ("order: 2", "expect: {status: FAIL, reason: match}", ["7: checks[0].expect.reason: match"]),
    ("kappa: [1, 2]", "kappa: [1, a]", ["8: sweep.kappa[0]: 1: must be text"]),
    ("kappa: [1, 2]", "kappa: []", ["8: sweep.kappa: []: must not be empty"]),
    ("kappa: [1, 2]", "kappa: {linspace: [0, 1, 5000]}", ["must not have more than 10000 files"]),
    ("sweep:", "resources: {mem_mb: lots}\nsweep:", ["8: resources.mem_mb: lots: must be a whole"]),
    ("title:", "model: {kind: pendulum}\ntitle:", ["1: model: ", "unknown key"]),
]


def test_without_sizes_no_placeholder_is_called_unknown(
    heat: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = faults(changed(heat, ("refine:", "refin:")), capsys)
    assert [line.partition(": ")[2].split(":")[0] for line in found] == ["refine", "refin"]
    assert found[1].endswith("unknown key: did you mean 'refine'?")


@pytest.mark.parametrize(("old", "new", "wanted"), REFUSED, ids=[row[1][:30] for row in REFUSED])
def test_a_fault_is_named_with_its_line(
    heat: Path, old: str, new: str, wanted: Faults, capsys: pytest.CaptureFixture[str]
) -> None:
    found = faults(changed(heat, (old, new)), capsys)
    assert any(all(part in line for part in wanted) for line in found), found


def test_faults_of_all_sections_are_told_at_once(
    heat: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = changed(heat, ("{h}", "{g}"), ("0.02", "-1"), ("flux: {}", "u: {x: 1}"), ("order", "o"))
    keys = {line.split(": ")[1] for line in faults(file, capsys)}
    assert {"solver.command", "refine.h[2]", "quantities.u.x", "checks[0].o"} <= keys


@pytest.mark.parametrize(
    ("sizes", "fault"),
    [
        ("1/2**level, levels: [a]", "5: refine.levels[0]: a: must be a whole number"),
        ("[0.1, .inf]", "5: refine.h[1]: .inf: must be a finite number"),
    ],
)
def test_nothing_more_is_said_of_faulty_sizes(
    heat: Path, sizes: str, fault: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert faults(changed(heat, ("[0.05, 0.1, 0.02]", sizes)), capsys) == [fault]


def test_signs_of_a_shell_may_be_quoted_arguments(heat: Path) -> None:
    assert (
        main(["check", str(changed(heat, ("{kappa}", '{kappa} \'|\' a>b \\; "a \\" > b"')))]) == 0
    )


def test_files_that_are_to_be_there_must_be(heat: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = TEXT.replace(f"command: {COMMAND}", "files: run_{h}_{kappa}.nc")
    heat.write_text(text.replace("  inputs: [heat]\n", ""))
    found = faults(heat, capsys)
    assert len(found) == 6
    assert found[0].startswith("3: solver.files: ")
    assert "run_0.02_1.nc: there is no such file" in "\n".join(found)
    heat.write_text(text)
    assert any("belong to a command" in line for line in faults(heat, capsys))
    heat.write_text(text.replace("_{kappa}.nc", "_{kappa}").replace("  inputs: [heat]\n", ""))
    assert any("must end with .csv or .nc" in line for line in faults(heat, capsys))
    # the same file twice would be two levels that are equal
    text = TEXT.replace(f"command: {COMMAND}", "files: run{level}_{kappa}.csv")
    text = text.replace("  inputs: [heat]\n", "").replace("h: [", "levels: [1, 2, 3], h: [")
    heat.write_text(text.replace("{level}", "").replace("_{kappa}", "{h}{kappa}"))
    assert any("there is no such file" in line for line in faults(heat, capsys))


def test_a_module_that_is_nowhere_is_refused(
    heat: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = TEXT.replace(f"command: {COMMAND}", "python: no_such_module_here:solve")
    heat.write_text(text)
    (told,) = faults(heat, capsys)
    assert told.startswith("3: solver.python: no_such_module_here:solve: cannot be found: ")
    (heat.parent / "no_such_module_here.py").write_text("raise SystemExit('imported')")
    # found, and not imported
    assert "has no function solve" in faults(heat, capsys)[0]
    # a package beside the file, without and with the module
    heat.write_text(text.replace("no_such_module_here", "slabs.inner"))
    (heat.parent / "slabs").mkdir()
    (told,) = faults(heat, capsys)
    assert told.startswith("3: solver.python: slabs.inner:solve: cannot be found: ")
    (heat.parent / "slabs" / "inner").mkdir()
    assert main(["check", str(heat)]) == 0


def test_a_function_and_a_program_beside_the_file_must_be_there(
    heat: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    module = heat.parent / "slab.py"
    heat.write_text(TEXT.replace(f"command: {COMMAND}", "python: slab:slove"))
    module.write_text("from heat import other as given\n\ndef solve(h, kappa):\n    pass\n")
    (told,) = faults(heat, capsys)
    rule = "slab.py has no function slove: did you mean 'solve'?"
    assert told == f"3: solver.python: slab:slove: {rule}"
    module.write_text(module.read_text() + "slove = solve\n")
    for name in ("solve", "given", "slove"):
        heat.write_text(TEXT.replace(f"command: {COMMAND}", f"python: slab:{name}"))
        assert main(["check", str(heat)]) == 0
    heat.write_text(TEXT.replace(f"command: {COMMAND}", "python: slab:solve"))
    fits = "(h, kappa=1.0)", "(h, **more)", "(*, kappa, h)", "(h, kappa, more=0)"
    for arguments in fits:
        module.write_text(f"def solve{arguments}:\n    pass\n")
        assert main(["check", str(heat)]) == 0
    capsys.readouterr()
    for arguments in (
        "(dt, kappa=1.0)",
        "(h)",
        "(h, kappa, more)",
        "(h, kappa, /)",
        "(*, kappa, h, n)",
    ):
        module.write_text(f"def solve{arguments}:\n    pass\n")
        (told,) = faults(heat, capsys)
        assert told.startswith("3: solver.python: slab:solve: is called with h, kappa, but takes (")
    # whoever knows what a decorator makes of it
    module.write_text("@given\ndef solve(dt):\n    pass\n")
    assert main(["check", str(heat)]) == 0
    heat.write_text(TEXT.replace("./heat", "./haet"))
    capsys.readouterr()
    assert faults(heat, capsys)[0].endswith(": ./haet: there is no such file")


def test_levels_are_counted_from_the_coarsest(heat: Path) -> None:
    found = from_file(heat)
    assert [found.sizes_of(level) for level in found.levels] == [
        {"h": 0.1},
        {"h": 0.05},
        {"h": 0.02},
    ]
    file = changed(
        heat, ("h: [0.05, 0.1, 0.02]", "levels: {from: 2, to: 4}, h: 1/2**level, n: 3*2**level")
    )
    found = from_file(file)
    assert found.sizes_of(0) == {"h": 0.25, "n": 12}
    assert found.words(2, 0) == {"h": "0.0625", "n": "48", "kappa": "1", "level": "4"}


def test_numbers_are_handed_over_as_they_are_written(heat: Path) -> None:
    def parameters(written: str) -> list[Any]:
        found = from_file(changed(heat, ("kappa: [1, 2]", f"kappa: {written}")))
        return [found.parameters_of(member)["kappa"] for member in range(found.members)]

    for written, wanted in {
        "[1, 2]": [1, 2],
        "[1.0, 2]": [1.0, 2.0],
        "[1/4, 1]": [0.25, 1.0],
        "{range: [1, 3, 1]}": [1, 2, 3],
        "{linspace: [1, 3, 3]}": [1.0, 2.0, 3.0],
        "[upwind, central difference]": ["upwind", "central difference"],
    }.items():
        found = parameters(written)
        assert found == wanted
        assert list(map(type, found)) == list(map(type, wanted)), written


def test_a_value_is_one_argument_whatever_is_in_it(heat: Path) -> None:
    (heat.parent / "my heat").write_text("a program")
    values = "['a b', '$(touch x); \"q', '{h} *']"
    found = from_file(
        changed(
            heat,
            ("kappa: [1, 2]", f"kappa: {values}"),
            (COMMAND, f'"{COMMAND.replace("./heat", MINE)}"'),
        )
    )
    more = {"output": "/tmp/o u t.nc", "threads": "1"}
    for member, value in enumerate(["a b", '$(touch x); "q', "{h} *"]):
        words = ["./my heat", "{}", "--dt", "0.1", "--kappa", value, "--out", "/tmp/o u t.nc"]
        assert found.arguments(0, member, more) == words


def test_an_experiment_comes_back_from_its_content(heat: Path) -> None:
    file = changed(heat, ("order: 2", "at_least: 1, expect: {status: FAIL}"))
    found = from_file(file)
    content = json.loads(json.dumps(found.content))
    back = restore(content, file)
    assert isinstance(back, SolverExperiment)
    assert back == found
    assert back.parameters_of(1) == {"kappa": 2}
    one = found.alone(1)
    assert (one.name, one.members, one.parameters_of(0)) == ("heat_case_1", 1, {"kappa": 2})


def test_the_schema_for_editors_accepts_and_refuses_the_same(heat: Path) -> None:
    Draft202012Validator.check_schema(schema())
    assert validator().is_valid(yaml.safe_load(TEXT))
    for old, new in (
        ("inputs: [heat]", "python: 'm:f'"),
        ("order: 2", "tolerance: 2"),
        ("flux: {}", "flux: {restrict: mena}"),
        ("sweep:", "resources: {mem_mb: lots}\nsweep:"),
    ):
        assert not validator().is_valid(yaml.safe_load(TEXT.replace(old, new))), new


def test_an_experiment_of_vibsim_is_not_made_of_it(heat: Path) -> None:
    with pytest.raises(InputError, match=r"heat\.yaml:2: solver: belongs to an experiment with a"):
        Experiment.from_yaml(heat)
