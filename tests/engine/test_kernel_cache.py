"""Kernels: what may enter one, and what becomes of one that was damaged on disk."""

import dataclasses
import itertools
import subprocess
import sys

import numpy as np
import pytest

from vibsim.core.errors import SimulationError
from vibsim.elementary import ELEMENTARY
from vibsim.engine import LANES, integrate, text
from vibsim.engine.kernel import source
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES

PENDULUM, CENTRAL = MODELS["pendulum"], SCHEMES["central"]

RUN = """
import numpy as np
from vibsim.engine import integrate
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES
scheme = SCHEMES["central"]
runs = integrate(MODELS["pendulum"], scheme, scheme.defaults(), np.ones((1, 4)), np.array([[1.0, 0.0]]),
                 np.array([20.0 / 64]), 64, 1, lane="scalar")
print(repr(float(runs.position[0, -1])))
"""


QUICK = (
    RUN
    + """
import sys
print("vibsim.native.machine" in sys.modules)
"""
)


def run_in(folder):
    environment = {"VIBSIM_CACHE_DIR": str(folder), "PATH": "/usr/bin:/bin", "HOME": str(folder)}
    done = subprocess.run(
        [sys.executable, "-c", RUN], capture_output=True, text=True, check=True, env=environment
    )
    return float(done.stdout)


@pytest.mark.slow
def test_a_kernel_is_compiled_once_and_a_damaged_one_again(tmp_path):
    assert run_in(tmp_path) == pytest.approx(0.9996677748139638, abs=1e-13)
    kept = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.suffix in {".py", ".o"}}
    assert {path.suffix for path in kept} == {".py", ".o"}
    times = {path: path.stat().st_mtime_ns for path in kept}
    run_in(tmp_path)
    assert {path: path.stat().st_mtime_ns for path in kept} == times
    for path, content in kept.items():
        if path.suffix == ".py":  # to be read by people
            continue
        for damage in (content[: len(content) // 2], content[:-1] + bytes([content[-1] ^ 1]), b""):
            path.write_bytes(damage)
            assert run_in(tmp_path) == pytest.approx(0.9996677748139638, abs=1e-13)
            assert path.read_bytes() != damage


@pytest.mark.slow
def test_a_job_that_finds_its_kernel_has_no_compiler_in_its_memory(tmp_path):
    environment = {
        "VIBSIM_CACHE_DIR": str(tmp_path),
        "PATH": "/usr/bin:/bin",
        "HOME": str(tmp_path),
    }
    outputs = [
        subprocess.run(
            [sys.executable, "-c", QUICK],
            capture_output=True,
            text=True,
            check=True,
            env=environment,
        ).stdout.split()
        for _ in range(2)
    ]
    assert [words[-1] for words in outputs] == ["True", "False"]
    assert outputs[0][0] == outputs[1][0]


@pytest.mark.slow
def test_jobs_that_want_one_kernel_at_once_all_get_it(tmp_path):
    environment = {
        "VIBSIM_CACHE_DIR": str(tmp_path),
        "PATH": "/usr/bin:/bin",
        "HOME": str(tmp_path),
    }
    jobs = [
        subprocess.Popen(
            [sys.executable, "-c", RUN], stdout=subprocess.PIPE, text=True, env=environment
        )
        for _ in range(3)
    ]
    values = {job.communicate(timeout=120)[0] for job in jobs}
    assert len(values) == 1
    assert all(job.returncode == 0 for job in jobs)


@pytest.mark.slow
def test_without_a_cache_a_kernel_is_compiled_in_memory(tmp_path):
    blocked = tmp_path / "blocked"
    blocked.touch()
    assert run_in(blocked) == pytest.approx(0.9996677748139638, abs=1e-13)


def test_a_function_that_the_engine_does_not_have_is_named(monkeypatch):
    monkeypatch.setattr("vibsim.engine.formulas.ELEMENTARY", {"sin": ELEMENTARY["sin"]})
    model = dataclasses.replace(PENDULUM, acceleration="-(g/L)*tanh(theta)")
    with pytest.raises(SimulationError, match=r"no function tanh; it has sin"):
        source(model, CENTRAL.stepper(CENTRAL.defaults()))


class Scale:
    factor = 2.0


SCALE = Scale()
TABLEAU = (1.0, 0.5)


def step_with_object(state, t, dt, p, acceleration):
    return (state[0] * SCALE.factor, state[1]), 0.0


def step_with_tuple(state, t, dt, p, acceleration):
    u, d = state
    ahead = d + TABLEAU[0] * (dt * dt) * acceleration(u, 0.0, t, p)
    return (u + ahead, ahead), (d + ahead) * (TABLEAU[1] / dt)


def test_what_is_no_number_cannot_enter_a_kernel():
    stepper = CENTRAL.stepper({**CENTRAL.defaults(), "arithmetic": "increment"})
    with pytest.raises(SimulationError, match="step uses SCALE"):
        source(PENDULUM, dataclasses.replace(stepper, step=step_with_object))


@pytest.mark.parametrize(
    "lane",
    [pytest.param(lane, marks=pytest.mark.slow if lane == "blocks" else ()) for lane in LANES],
)
def test_a_tableau_of_numbers_can(lane):
    options = {**CENTRAL.defaults(), "arithmetic": "increment"}
    stepper = dataclasses.replace(CENTRAL.stepper(options), step=step_with_tuple)
    scheme = dataclasses.replace(CENTRAL, stepper=lambda options: stepper)
    numbers = (np.ones((1, 4)), np.array([[1.0, 0.0]]), np.array([0.1]), 64, 1)
    one, other = (integrate(PENDULUM, s, options, *numbers, lane=lane) for s in (scheme, CENTRAL))
    np.testing.assert_array_equal(one.position, other.position)


@pytest.mark.slow
def test_the_text_of_a_kernel_does_not_depend_on_those_written_before():
    wanted = [
        (MODELS[model], SCHEMES[kind].stepper_for(MODELS[model], SCHEMES[kind].defaults()), *more)
        for model, kind, more in itertools.product(
            ("pendulum", "sliding_box"),
            ("central", "rk4"),
            (("plain",), ("scalar", True, True, True), ("scalar", False), ("blocks",)),
        )
        if "blocks" not in more or model == "pendulum"
    ]
    together = [source(*one) for one in wanted]
    assert len(set(together)) == len(together)
    for one, found in zip(wanted, together, strict=True):
        for kept in (text._source, text._names, text._text):
            kept.cache_clear()
        assert source(*one) == found
