from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest
from thinned import thinned

import vibsim
from vibsim.cli import main
from vibsim.core import private_cache
from vibsim.models import MODELS
from vibsim.plan import build, code_digest
from vibsim.schemes import SCHEMES

PACKAGE = Path(vibsim.__file__).parent
ROOT = PACKAGE.parent


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Return a copy of the package whose sources may be changed, read but never executed."""
    copy = tmp_path_factory.mktemp("copy") / "vibsim"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(code_digest, "PACKAGE", copy)
        forget()
        yield copy
    forget()


def forget() -> None:
    for cached in (
        code_digest.everything,
        code_digest._file,
        code_digest._all_imports,
        code_digest._imports,
        code_digest._reexports,
        build.code_of,
        build._code,
    ):
        cached.cache_clear()


Digests = Callable[[], dict[str, str]]


@pytest.fixture(scope="module")
def digests(package: Path) -> Digests:
    """Return what makes the digests of the code; imports are followed once: a comment at the end changes none."""
    reached = cache(code_digest.reached)

    def made() -> dict[str, str]:
        for cached in (code_digest.everything, build.code_of, build._code):
            cached.cache_clear()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(code_digest, "reached", reached)
            return {
                "pendulum": build.code_of("pendulum", ("central",)),
                "linear": build.code_of("linear_pendulum", ("central",)),
                "analyse": build._code("analyse"),
                "extrapolate": build._code("extrapolate"),
                "report": build._code("report"),
                "everything": code_digest.everything(),
            }

    return made


@pytest.fixture(scope="module")
def before(digests: Digests) -> dict[str, str]:
    return digests()


SIMULATIONS = {"pendulum", "linear"}
ALL = {*SIMULATIONS, "analyse", "extrapolate", "report"}


@pytest.mark.parametrize(
    ("part", "touched"),
    thinned(
        [
            ("core/errors.py", ALL),
            ("core/vocabulary.py", ALL),
            ("core/lazy.py", ALL),
            ("core/record.py", ALL),
            ("core/netcdf.py", ALL),
            ("__init__.py", ALL),
            ("core/private_cache.py", ALL),
            ("experiment/cost.py", ALL),
            ("native/lowering.py", ALL),
            ("elementary/exponential.py", ALL),
            ("elementary/circular.py", ALL),
            ("formula/parser.py", ALL),
            ("formula/render.py", ALL),
            ("models/base.py", ALL),
            # The linear pendulum takes its parameters from the other one.
            ("models/pendulum.py", SIMULATIONS),
            ("models/linear_pendulum.py", {"linear"}),
            ("models/spring.py", set()),
            ("models/circuit.py", set()),
            ("schemes/base.py", ALL),
            ("schemes/central.py", SIMULATIONS),
            ("schemes/newmark.py", set()),
            ("theory/roots.py", {"analyse", "report"}),
            ("experiment/experiment.py", ALL),
            ("experiment/data.py", ALL),
            ("experiment/storage.py", ALL),
            ("experiment/sweep_columns.py", ALL),
            ("experiment/schema/sweep.py", ALL),
            ("experiment/schema/checks.py", ALL),
            ("experiment/tables/file.py", ALL),
            # An experiment file is read before a job has its plan, and what comes out is in the digest.
            *(
                (f"experiment/{name}.py", set())
                for name in (
                    "reading",
                    "derived",
                    "validation",
                    "schema/document",
                    "faults",
                    "units",
                )
            ),
            ("plan/jobs.py", ALL),
            ("plan/digests.py", ALL - {"report"}),
            *(
                (f"plan/{name}.py", set())
                for name in ("build", "cache", "choose", "workflow_names")
            ),
            ("engine/member_loop.py", ALL),
            ("engine/extrema.py", ALL),
            ("simulation/level.py", SIMULATIONS),
            ("simulation/derived.py", SIMULATIONS),
            ("simulation/members.py", ALL),
            ("checks/order.py", {"analyse", "report"}),
            ("checks/order_text.py", {"analyse", "report"}),
            ("comparison/best_solution.py", {"analyse", "extrapolate", "report"}),
            ("ladder/choosing.py", set()),
            ("store/writing.py", {*SIMULATIONS, "analyse", "extrapolate"}),
            ("store/reading.py", ALL),
            ("store/seal.py", ALL),
            ("store/summary.py", {"analyse", "report"}),
            ("report/page/page.py", {"report"}),
            ("report/page/index.py", {"report"}),
            ("report/templates/report.html", {"report"}),
            ("cli/jobs/simulate.py", SIMULATIONS),
            ("cli/jobs/analyse.py", {"analyse"}),
            ("cli/jobs/extrapolate.py", {"extrapolate"}),
            ("cli/jobs/report.py", {"report"}),
            ("cli/jobs/common.py", ALL),
            # of experiments with a solver of the user alone
            *(
                (f"{name}.py", set())
                for name in ("solver/run", "solver/analysis", "experiment/solver", "cli/jobs/solve")
            ),
            ("report/page/solver.py", set()),
            ("cli/run/command.py", set()),
            ("cli/arguments.py", set()),
        ],
        3,
    ),
)
def test_a_changed_module_changes_what_can_run_it(
    package: Path, digests: Digests, before: dict[str, str], part: str, touched: set[str]
) -> None:
    file = package / part
    content = file.read_bytes()
    # as long as before
    file.write_bytes(content[:-1] + b" ")
    after = digests()
    file.write_bytes(content)
    assert {name for name in before if before[name] != after[name]} == {*touched, "everything"}


@pytest.mark.slow
def test_the_analysis_of_a_solver_runs_what_its_digest_covers(tmp_path: Path) -> None:
    file = tmp_path / "files.yaml"
    file.write_text(
        "title: files\nsolver: {files: 'u_{h}.csv'}\nrefine: {h: [0.5, 0.25, 0.125]}\n"
        "quantities: {u: {}}\n"
    )
    for h in (0.5, 0.25, 0.125):
        (tmp_path / f"u_{h}.csv").write_text(f"u\n{1 + h * h}\n")
    common = ("--results", tmp_path / "results")
    assert main(["simulate", str(file), "--level", "0", "1", "2", *map(str, common)]) == 0
    # the code of vibsim is no part of the digest of a level
    assert "vibsim.solver.run" not in covered("analyse")
    found = ran_by("analyse", file, *common)
    assert found <= code_digest.reached("vibsim.cli.jobs.judge_levels")
    assert {"vibsim.solver.analysis", "vibsim.convergence.assessment"} <= found
    page = code_digest.reached("vibsim.report.page.solver") | covered("report")
    assert ran_by("report", file, *common) <= page


def test_another_entry_under_the_same_name_changes_the_simulation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The lists of all schemes and models count by the entries that they give."""
    before = build.code_of("pendulum", ("rk4",))
    swapped = {**SCHEMES, "rk4": SCHEMES["rk2"]}
    monkeypatch.setattr(build.SCHEMES, "built_in", swapped)
    build.code_of.cache_clear()
    assert build.code_of("pendulum", ("rk4",)) != before
    build.code_of.cache_clear()


def test_imports_are_followed_wherever_they_stand(package: Path) -> None:
    (package / "new.py").write_text(
        "from typing import TYPE_CHECKING\n"
        "from vibsim import store\n"
        "from vibsim.experiment import canonical\n"
        "if TYPE_CHECKING:\n    from vibsim.report import write\n"
        "def f():\n    import vibsim.variables\n    from vibsim.models import has_solution\n"
        "    store.write_text()\n"
    )
    (package / "variables.py").write_text("")
    assert code_digest._imports("vibsim.new") == {
        "vibsim",
        "vibsim.models",
        "vibsim.models.base",
        "vibsim.experiment",
        "vibsim.experiment.experiment",
        "vibsim.store",
        "vibsim.store.atomic",
        "vibsim.variables",
    }


@pytest.mark.slow
def test_imports_that_are_kept_are_those_of_the_code_as_it_is(
    package: Path, before: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(tmp_path / "cache"))
    read, changed, asked = code_digest._imports, "vibsim.core.record", list[str]()

    def imports(module: str) -> frozenset[str]:
        asked.append(module)
        return read.__wrapped__(module) if module in (changed, "vibsim.broken") else read(module)

    def reached() -> set[str]:
        asked.clear()
        code_digest.everything.cache_clear()
        code_digest._all_imports.cache_clear()
        return code_digest.reached("vibsim.cli.jobs.simulate")

    monkeypatch.setattr(code_digest, "_imports", imports)
    first = reached()
    assert len(asked) > len(first) > 100
    assert reached() == first
    assert not asked
    folder, key = private_cache.opened("imports"), code_digest.everything()
    assert folder is not None
    for damaged in (b"[1]", b'{"vibsim": 1}', b"{", b"\xff"):
        folder.write(key, damaged)
        assert reached() == first
        assert asked
    # of other code, with a file that nothing uses and nobody can read
    file = package / "core/record.py"
    content = file.read_bytes()
    file.write_bytes(content + b"\nimport vibsim.report.style\n")
    (package / "broken.py").write_text("def half(")
    assert reached() >= {*first, "vibsim.report", "vibsim.report.style"}
    file.write_bytes(content)
    (package / "broken.py").unlink()
    assert reached() == first
    assert not asked


def test_every_lazy_name_is_found_without_running_anything() -> None:
    """A lazy name stands twice: for Python, and for the types; the digests go by the types."""
    for package in ("vibsim", "vibsim.experiment", "vibsim.plan", "vibsim.store"):
        loaded = __import__(package, fromlist=["*"])
        for name in set(loaded.__all__) - {"__version__"}:
            found = getattr(getattr(loaded, name), "__module__", None)
            if found and found.startswith("vibsim."):
                assert found in code_digest._origins(package, name), name


TRACE = """
import json, sys, threading
from pathlib import Path
ran, state, begun = set(), threading.local(), []
def trace(frame, event, argument):
    name = frame.f_code.co_name
    if event == "call" and name == "<module>":
        state.depth = getattr(state, "depth", 0) + 1
    elif event == "return" and name == "<module>":
        state.depth = max(0, getattr(state, "depth", 0) - 1)
    elif event == "call" and begun and not getattr(state, "depth", 0):
        ran.add(frame.f_code.co_filename)
    # A job has its plan when this has compared it.
    if (event, name) in {("return", "check_digest"), ("call", "write_index")}:
        begun.append(name)
threading.setprofile(trace)
sys.setprofile(trace)
from vibsim.cli import main
status = main(sys.argv[1:])
sys.setprofile(None)
from vibsim.plan.code_digest import PACKAGE
files = [Path(file) for file in ran if file.startswith(f"{PACKAGE}/") and file.endswith(".py")]
names = [".".join(("vibsim", *f.relative_to(PACKAGE).with_suffix("").parts)) for f in files]
print(json.dumps([status, bool(begun), [name.removesuffix(".__init__") for name in names]]))
"""


def ran_by(*arguments: object) -> set[str]:
    """Name the modules in which a job really runs a function, once it has its plan."""
    command = [sys.executable, "-c", TRACE, *map(str, arguments)]
    ended = subprocess.run(command, capture_output=True, text=True, check=True)
    status, begun, names = json.loads(ended.stdout.splitlines()[-1])
    assert (status, begun) == (0, True), ended.stderr
    return set(names)


def covered(command: str, model: str = "", schemes: tuple[str, ...] = ()) -> set[str]:
    homes = [code_digest.home(MODELS[model], "vibsim.models")[0]] if model else []
    homes += [code_digest.home(SCHEMES[kind], "vibsim.schemes")[0] for kind in schemes]
    return code_digest.reached(f"vibsim.cli.jobs.{command}", *homes)


EXPERIMENTS = {
    "plain": ("pendulum", ("central",), "initial: {theta: 1.0}"),
    "sweep": (
        "pendulum",
        ("rk4", "dop853"),
        "initial: {theta: 1.0}\nsweep: {initial.theta: [0.5, 1.0]}\nsamples: common",
    ),
    "events": ("bouncing_ball", ("central", "velocity_verlet"), "initial: {h: 1.0}"),
    "damped": (
        "oscillator",
        ("gauss4", "generalized_alpha"),
        "initial: {u: 1.0}\nsweep: {schemes.generalized_alpha.rho_inf: [0.5, 0.8]}",
    ),
    "table": ("vehicle", ("crank_nicolson", "ab3"), "initial: {u: 0.0}\noutput: best"),
}
MODEL = {
    "oscillator": ", damping: {linear: 0.1}, force: sin(t), spring: u",
    "vehicle": ", m: 1.0, b: 0.1, spring: u, speed: 2.0, road: {table: road.csv}",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_job_runs_only_what_its_digest_covers(tmp_path: Path, name: str) -> None:
    model, schemes, rest = EXPERIMENTS[name]
    state = {"pendulum": "theta", "bouncing_ball": "h"}.get(model, "u")
    file = tmp_path / f"{name}.yaml"
    (tmp_path / "road.csv").write_text("x,h\n" + "".join(f"{x},{x % 3}\n" for x in range(50)))
    file.write_text(
        f"title: {name}\nmodel: {{kind: {model}{MODEL.get(model, '')}}}\n{rest}\ntime: {{end: 4.0}}\n"
        f"levels: [5, 6, 7]\nschemes: [{', '.join(schemes)}]\nchecks:\n"
        f"  - {{converges: {state}, order: 1, tolerance: 3}}\n"
    )
    common = ("--results", tmp_path / "results")
    found = ran_by("simulate", file, "--level", 5, 6, 7, *common)
    assert found <= covered("simulate", model, schemes)
    found = ran_by("analyse", file, *common)
    assert found <= covered("analyse") | covered("simulate", model, schemes)
    assert found & covered("analyse")
    if "output" in rest:
        found = ran_by("extrapolate", file, *common)
        assert found <= covered("extrapolate") | covered("simulate", model, schemes)
    before = covered("analyse") | covered("simulate", model, schemes)
    assert ran_by("report", file, *common) <= covered("report") | before
    assert ran_by("report", *common) <= covered("report")


@pytest.mark.slow
def test_a_simulation_runs_only_what_its_digest_covers(tmp_path: Path) -> None:
    file = tmp_path / "plain.yaml"
    file.write_text(
        "title: plain\nmodel: {kind: pendulum}\ninitial: {theta: 1.0}\ntime: {end: 4.0}\n"
        "levels: [5, 6, 7]\nschemes: [central]\n"
    )
    found = ran_by("simulate", file, "--level", 5, "--results", tmp_path / "results")
    assert {
        "vibsim.experiment.storage",
        "vibsim.experiment.sweep_columns",
        "vibsim.store.writing",
    } <= found
    assert found <= covered("simulate", "pendulum", ("central",))
