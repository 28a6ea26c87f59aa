"""Models and schemes of packages that are installed beside vibsim: the example, and packages that are at fault."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import netCDF4
import numpy as np
import pytest
import yaml

from vibsim import Experiment, analyse, simulate, theory, verdicts
from vibsim.cli import main
from vibsim.core import registry
from vibsim.core.errors import InputError
from vibsim.engine import integrate
from vibsim.models import MODELS
from vibsim.models.acceptance import fault_of
from vibsim.plan import Choice, build, code_digest, load
from vibsim.schemes import SCHEMES

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples" / "vibsim_cart"
Place = Callable[..., Path]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install the example, without network, into a folder of its own."""
    folder = tmp_path_factory.mktemp("packages")
    # building leaves files in the folder of the source
    source = shutil.copytree(EXAMPLE, folder / "source")
    options = ["--no-index", "--no-deps", "--no-build-isolation", "--disable-pip-version-check"]
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        *options,
        "--target",
        folder / "site",
        source,
    ]
    subprocess.run(command, check=True, capture_output=True)
    return folder / "site"


def forget() -> None:
    for cached in (registry.offers, build.code_of, code_digest.everything):
        cached.cache_clear()
    for known in (MODELS, SCHEMES):
        known._loaded.clear()
    for name in [
        name for name in sys.modules if name.partition(".")[0] in ("vibsim_cart", "other")
    ]:
        del sys.modules[name]


@pytest.fixture
def installed(site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Have a copy of the installed example, which may be changed, in this process; return its folder."""
    here = shutil.copytree(site, tmp_path / "site")
    monkeypatch.syspath_prepend(here)
    forget()
    yield here
    monkeypatch.undo()
    forget()


def example(**changes: object) -> Experiment:
    content = yaml.safe_load((EXAMPLE / "cart.yaml").read_text())
    return Experiment.from_dict({**content, **changes})


def vibsim(site: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "vibsim", *map(str, arguments)]
    environment = {**os.environ, "PYTHONPATH": str(site)}
    return subprocess.run(command, env=environment, text=True, capture_output=True, check=False)


@pytest.mark.slow
def test_the_example_runs_and_an_edit_of_its_code_makes_results_again(
    site: Path, tmp_path: Path
) -> None:
    here = shutil.copytree(site, tmp_path / "site")
    file = shutil.copy(EXAMPLE / "cart.yaml", tmp_path)
    results = ("--results", tmp_path / "results", "--cores", 2)
    ended = vibsim(here, "run", file, *results)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    with netCDF4.Dataset(tmp_path / "results/adhoc/cart/level_05.nc") as made:
        assert '"vibsim-cart": "1.0"' in str(made.__dict__).replace('\\"', '"')
    summary = json.loads((tmp_path / "results/adhoc/cart/summary.json").read_text())
    assert [check["status"] for check in summary["checks"]] == ["PASS", "PASS", "PASS"]
    assert "nothing to do" in vibsim(here, "run", file, *results).stdout

    scheme = here / "vibsim_cart" / "scheme.py"
    text = scheme.read_text()
    scheme.write_text(text.replace('"2/3"', '"1/2"').replace('("1/4", "3/4")', '("0", "1")'))
    rest = (*results, "--dry-run", "--json")
    jobs = [
        row["job"].split()[0] for row in json.loads(vibsim(here, "run", file, *rest).stdout)["jobs"]
    ]
    assert jobs == [*["simulate"] * 5, "analyse", "report", "index"]

    shutil.rmtree(here)
    refused = vibsim(here, "run", file, *results)
    assert refused.returncode == 2
    assert "cart.yaml:3: model.kind: cart_pendulum: unknown model" in refused.stderr
    assert "cart.yaml:7: schemes[0]: ralston: unknown scheme" in refused.stderr


@pytest.mark.slow
def test_commands_list_what_is_installed(
    installed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["list", "models"]) == main(["list", "schemes"]) == 0
    told = capsys.readouterr().out
    assert "\ncart_pendulum      Pendulum on a cart: theta'' = " in told
    assert "\nralston                   2      explicit  no          2    " in told
    assert main(["list", "schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    content = yaml.safe_load((EXAMPLE / "cart.yaml").read_text())
    jsonschema.validate(content, schema)
    is_valid = jsonschema.Draft202012Validator(schema).is_valid
    for wrong in ({"model": {"kind": "cart_pendulum", "M": -1.0}}, {"schemes": ["ralstn"]}):
        assert not is_valid({**content, **wrong})
    shipped = json.loads((ROOT / "workflow/schemas/experiment.schema.json").read_text())
    assert not jsonschema.Draft202012Validator(shipped).is_valid(content)


def test_without_packages_the_printed_schema_is_that_which_is_shipped(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["list", "schema"]) == 0
    shipped = ROOT / "workflow/schemas/experiment.schema.json"
    assert capsys.readouterr().out == shipped.read_text("utf-8")


@pytest.mark.slow
def test_keys_bounds_and_units_are_those_of_the_package(installed: Path) -> None:
    wrong = {"kind": "cart_pendulum", "M": "0 kg", "L": "1 kg", "mass": 1.0}
    with pytest.raises(InputError) as refused:
        example(
            model=wrong, initial={"u": 1.0}, schemes=[{"kind": "ralston", "alpha": 2}, "central"]
        )
    found = {fault.key: fault.rule for fault in refused.value.faults}
    assert found.keys() == {
        *("model.M", "model.L", "model.mass", "initial.u", "schemes[0].alpha", "schemes[1]"),
    }
    assert found["model.M"] == "must be greater than 0"
    assert "kg" in found["model.L"]


def test_every_quantity_converges_as_the_package_promises(installed: Path) -> None:
    quantities = ["theta", "omega", "x", "kinetic_energy", "potential_energy"]
    checks = [{"id": name, "converges": name, "order": "scheme"} for name in quantities]
    experiment = example(checks=checks, schemes=["ralston"])
    levels = [simulate(experiment, level) for level in experiment.levels]
    found = verdicts(experiment, analyse(experiment, levels))
    passed = ("PASS", "asymptotic")
    assert {v.id: (v.status, v.reason) for v in found} == dict.fromkeys(quantities, passed)


@pytest.mark.slow
def test_the_energy_of_the_model_belongs_to_its_acceleration(installed: Path) -> None:
    experiment = example(levels=[12], schemes=["gauss4"], checks=[{"converges": "theta"}])
    data = simulate(experiment, 12)
    assert abs(data.energy_deviation).max() < 1e-12 * data.energy.max()


@pytest.mark.slow
def test_its_scheme_has_its_theory_and_the_same_bits_in_every_lane(installed: Path) -> None:
    model, scheme = MODELS["cart_pendulum"], SCHEMES["ralston"]
    stepper = scheme.stepper({})
    growth, _ = theory.dominant(stepper, 0.1)
    per_period = (1.0 + 0.1**4 / 4.0) ** (np.pi / 0.1)
    assert growth == pytest.approx(per_period, rel=1e-12)
    assert theory.stability_limit(scheme, {}) == 0.0
    parameters = np.tile([9.81, 1.0, 1.0, 2.0], (9, 1))
    initial = np.stack([np.linspace(0.1, 2.0, 9), np.zeros(9)], axis=-1)
    states = [
        integrate(model, scheme, {}, parameters, initial, np.full(9, 0.01), 50, 1, lane=lane).states
        for lane in ("plain", "scalar", "blocks")
    ]
    assert states[0].tobytes() == states[1].tobytes() == states[2].tobytes()


def test_a_plan_that_is_kept_is_that_of_the_code(
    installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    file = Path(shutil.copy(EXAMPLE / "cart.yaml", tmp_path))
    both, model, neither = (
        tmp_path / "both.yaml",
        tmp_path / "model.yaml",
        tmp_path / "neither.yaml",
    )
    text = (
        file.read_text().replace(", schemes: [ralston]}", "}").replace("  - {stable: true}\n", "")
    )
    both.write_text(text)
    model.write_text(text.replace("[ralston, rk4]", "[rk4]"))
    neither.write_text(
        text.replace("[ralston, rk4]", "[rk4]")
        .replace("{kind: cart_pendulum, m: 1 kg, M: 2 kg}", "{kind: pendulum}")
        .replace("  - {converges: x, order: 2}\n", "")
    )

    def digests() -> list[tuple[str, ...]]:
        plans = [load(Choice("adhoc", one), cached=True) for one in (both, model, neither)]
        return [(*(batch.digest for batch in plan.batches), plan.analysis) for plan in plans]

    before = digests()
    assert digests() == before
    assert [len(load(Choice("adhoc", one)).packages) for one in (both, model, neither)] == [2, 1, 0]
    (installed / "vibsim_cart" / "numbers.txt").write_text("data count as well")
    forget()
    after = digests()
    assert [all(map(str.__ne__, a, b)) for a, b in zip(before, after, strict=True)] == [
        True,
        True,
        False,
    ]
    assert after[2] == before[2]
    # what Python makes is no part of the code
    shutil.rmtree(installed / "vibsim_cart" / "__pycache__", ignore_errors=True)
    (installed / "vibsim_cart" / "numbers.txt").unlink()
    forget()
    assert digests() == before


FAULTY = {
    "missing module": ("models", "mine", "nowhere:X", "cannot be imported: ModuleNotFoundError"),
    "missing name": ("models", "mine", "other:Y", "cannot be imported: AttributeError"),
    "error": ("models", "mine", "other.broken:X", "cannot be imported: ZeroDivisionError"),
    "exit": ("schemes", "mine", "other.leaving:X", "cannot be imported: SystemExit"),
    "no model": ("models", "mine", "other:SCHEME", "is no vibsim.models.Model"),
    "no scheme": ("schemes", "mine", "other:MODEL", "is no vibsim.schemes.Scheme"),
    "another name": ("models", "mine", "other:MODEL", "its kind is 'theirs'"),
    "taken": ("schemes", "rk4", "other:SCHEME", "vibsim has one of this name already"),
    "no frequency": ("models", "mine", "other:STILL", "its natural_frequency gives no number"),
    "no exact motion": ("models", "mine", "other:WRONG", "its exact(t, initial, parameters)"),
    "no velocity": ("schemes", "mine", "other:ALONE", "its step must return the next state, as"),
    "unusable": ("schemes", "mine", "other:UNUSABLE", "cannot be used: KeyError"),
}


@pytest.fixture
def offered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Place]:
    """Return what installs a package with one entry point."""
    package = tmp_path / "other"
    package.mkdir()
    (package / "__init__.py").write_text(
        "from dataclasses import replace\n"
        "from vibsim.models import MODELS\n"
        "from vibsim.schemes import SCHEMES\n"
        "MODEL = replace(MODELS['spring'], kind='theirs')\n"
        "SCHEME = replace(SCHEMES['rk2'], kind='mine')\n"
        "STILL = replace(MODEL, kind='mine', natural_frequency=lambda p: p['k'])\n"
        "WRONG = replace(MODEL, kind='mine', exact=lambda t, initial, parameters: {'u': t})\n"
        "STEPPER = SCHEME.stepper({})\n"
        "STEPPER = replace(STEPPER, step=lambda state, t, dt, p: state)\n"
        "ALONE = replace(SCHEME, stepper=lambda options: STEPPER)\n"
        "UNUSABLE = replace(SCHEME, stepper=lambda options: options['missing'])\n"
    )
    (package / "broken.py").write_text("1/0\n")
    (package / "leaving.py").write_text("raise SystemExit(0)\n")

    def install(group: str, name: str, value: str, package: str = "other-package") -> Path:
        folder = tmp_path / f"{package.replace('-', '_')}-0.1.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 0.1\n")
        (folder / "entry_points.txt").write_text(f"[vibsim.{group}]\n{name} = {value}\n")
        return folder

    monkeypatch.syspath_prepend(tmp_path)
    forget()
    yield install
    monkeypatch.undo()
    forget()


@pytest.mark.parametrize(("group", "name", "value", "rule"), FAULTY.values(), ids=FAULTY)
def test_a_package_at_fault_is_named_with_its_entry_point(
    offered: Place, capsys: pytest.CaptureFixture[str], group: str, name: str, value: str, rule: str
) -> None:
    offered(group, name, value)
    assert main(["list", group]) == 2
    listed, told = capsys.readouterr()
    place = f"package other-package 0.1: entry point '{name}' of vibsim.{group}: {value}: "
    assert told.startswith(place + rule)
    # what can be had is listed all the same
    kinds = {line.split()[0] for line in listed.splitlines()}
    assert {"models": {"spring", "duffing"}, "schemes": {"rk4", "lsoda"}}[group] <= kinds
    assert "mine" not in kinds


def test_an_exact_motion_may_be_known_for_some_initial_values_alone() -> None:
    def from_rest(t: Any, initial: Any, parameters: Any) -> Any:
        raise ValueError("known from rest alone")

    assert fault_of(replace(MODELS["spring"], kind="mine", exact=from_rest)) == ""


DAMPED = {"acceleration": "-w**2*u - 0.1*v", "conservative": False}


@pytest.mark.parametrize(
    ("changes", "rule"),
    [
        ({"acceleration": "-w**2*u**3", "conservative": False}, "not linear in u"),
        ({"acceleration": "-w**2*u*sign(u - 2)", "conservative": False}, "not linear in u"),
        ({"acceleration": "-w**2*u*1.001"}, "kinetic_energy + potential_energy changes"),
        ({**DAMPED, "dissipation": "0.11*v**2"}, "driving minus dissipation"),
        ({**DAMPED, "dissipation": "0.1*v**2"}, ""),
        (DAMPED, ""),
        # no formula can be worked out for states near 1
        ({"linear": False, "acceleration": "-sqrt(u - 5)", "potential_energy": "sqrt(u - 5)"}, ""),
    ],
)
def test_a_model_that_contradicts_itself_is_refused(changes: dict[str, Any], rule: str) -> None:
    fault = fault_of(replace(MODELS["spring"], kind="mine", exact=None, **changes))
    assert rule in fault
    assert bool(fault) == bool(rule)


def test_a_linear_model_of_two_coordinates_is_refused() -> None:
    spring = MODELS["spring"]
    names = ("x", "y", "v", "w_y")
    states = tuple(replace(spring.states[0], name=name) for name in names)
    plane = replace(
        spring,
        kind="mine",
        states=states,
        acceleration="-w**2*x",
        further_accelerations=("-w**2*y",),
        kinetic_energy="(v**2 + w_y**2)/2",
        potential_energy="w**2*(x**2 + y**2)/2",
        exact=None,
        exact_period=None,
    )
    assert "write linear=False" in fault_of(plane)
    assert fault_of(replace(plane, linear=False)) == ""


def test_two_packages_with_one_name_are_both_named(
    offered: Place, capsys: pytest.CaptureFixture[str]
) -> None:
    offered("schemes", "mine", "other:SCHEME")
    offered("schemes", "mine", "other:SCHEME", "twin")
    assert main(["list", "schemes"]) == 2
    told = capsys.readouterr().err
    assert "other-package 0.1" in told
    assert "twin 0.1" in told


def test_a_package_at_fault_stops_no_experiment_that_does_not_use_it(
    offered: Place, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    offered("models", "mine", "other.broken:X")
    text = (ROOT / "configs/pendulum_lab/theta_convergence.yaml").read_text()
    file = tmp_path / "one.yaml"
    file.write_text(text)
    assert main(["check", str(file)]) == 0
    file.write_text(text.replace("kind: pendulum", "kind: mine"))
    capsys.readouterr()
    assert main(["check", str(file)]) == 2
    assert "entry point 'mine' of vibsim.models" in capsys.readouterr().err


def test_a_kind_is_compared_with_names_and_never_imported(
    offered: Place, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    offered("models", "mine", "other:MODEL")
    file = tmp_path / "one.yaml"
    text = (ROOT / "configs/pendulum_lab/theta_convergence.yaml").read_text()
    for kind in ("other.broken:X", "other:MODEL", "other.leaving"):
        file.write_text(text.replace("kind: pendulum", f"kind: '{kind}'"))
        assert main(["check", str(file)]) == 2
        assert "unknown model" in capsys.readouterr().err
    assert not {"other", "other.broken", "other.leaving"} & sys.modules.keys()


def test_nothing_is_looked_up_where_vibsim_has_every_kind(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(group: str) -> dict[str, object]:
        raise AssertionError(group)

    monkeypatch.setattr(registry, "offers", refuse)
    files = sorted(map(str, (ROOT / "configs").glob("*/*.yaml")))[::6]
    assert main(["check", *files]) == 0
    experiment = Experiment.from_yaml(files[0])
    assert build.build(experiment).packages == ()
    assert simulate(experiment, experiment.levels[0]).sizes["t"] > 1
