"""Linear structures, against formulas of a system, matrix exponentials, and the closed form of the cantilever."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.linalg import expm
from scipy.sparse import coo_array

from vibsim import analyse, verdicts
from vibsim.core.errors import InputError
from vibsim.experiment import Experiment
from vibsim.experiment.tables.content import TableError
from vibsim.experiment.tables.matrix import read
from vibsim.models.shared.matrices import Matrix, all_modes, lowest_modes, mode_motion
from vibsim.simulation import simulate

CANTILEVER = 1.8751040687119611**2
"""The lowest frequency of a beam of unit length, stiffness and mass, from ``cos x cosh x = -1``."""
SCHEMES = ["newmark", "hht", "generalized_alpha", "central"]
TWO: dict[str, Any] = {
    "kind": "structure",
    "mass": [2, 1],
    "stiffness": [[3, -1], [-1, 1]],
    "rayleigh": {"alpha": 0.05, "beta": 0.01},
    "load": {"2": "F*cos(w*t) - sin(0.7*t + 0.2)/4"},
    "parameters": {"F": 0.5, "w": 1.3},
    "observe": {"x": 1, "y": 2},
    "start": {"displacement": [1, -0.2], "velocity": {"1": 0.3}},
}
EQUAL = {"mass": [1, 1], "stiffness": [4, 4]}
REST = {
    "title": "Two masses",
    "time": {"end": 12, "base_steps": 40},
    "levels": [0, 1, 2],
    "schemes": SCHEMES,
}


def beam(elements: int) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness of a cantilever, by Hermite elements of Euler and Bernoulli."""
    h = 1.0 / elements
    k = np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
         [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]]
    ) / h**3  # fmt: skip
    m = np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
         [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]]
    ) * (h / 420)  # fmt: skip
    mass, stiffness = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for e in range(elements):
        part = slice(2 * e, 2 * e + 4)
        mass[part, part] += m
        stiffness[part, part] += k
    return mass[2:, 2:], stiffness[2:, 2:]


def of(model: dict[str, Any], **more: Any) -> Experiment:
    return Experiment.from_dict({**REST, "model": model, **more})


@pytest.mark.parametrize("scheme", ["newmark", "hht", "generalized_alpha"])
def test_a_structure_moves_like_the_same_system_of_formulas(scheme):
    """Another lane steps the system, and its reference is found by collocation."""
    forces = {
        "x": "-3*x + y - (0.05*2 + 0.01*3)*vx + 0.01*vy",
        "y": "x - y - (0.05 + 0.01)*vy + 0.01*vx + 0.5*cos(1.3*t) - sin(0.7*t + 0.2)/4",
    }
    system = {
        "kind": "system", "coordinates": ["x", "y"], "force": forces, "mass": {"x": "2", "y": "1"}
    }  # fmt: skip
    initial = {"x": 1.0, "y": -0.2, "vx": 0.3}
    wanted = simulate(of(system, initial=initial, schemes=[scheme]), 1)
    found = simulate(of(TWO, schemes=[scheme]), 1)
    for name in ("x", "y", "vx", "vy", "x_exact", "vy_exact", "kinetic_energy", "period", "y_max"):
        np.testing.assert_allclose(found[name], wanted[name], rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_every_scheme_has_its_order_against_the_modes(scheme):
    errors = []
    for level in (1, 2):
        data = simulate(of(TWO, schemes=[scheme]), level)
        errors.append(float(abs(data["x"] - data["x_exact"]).max()))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_central_differences_stop_at_their_limit():
    """``w_max dt <= 2``: the period of the faster mode over pi."""
    model = {key: TWO[key] for key in ("kind", "mass", "stiffness")}
    highest = np.sqrt(np.linalg.eigvals(np.diag([0.5, 1.0]) @ np.array(TWO["stiffness"])).max())
    sizes = []
    for factor in (0.99, 1.01):
        end = 400 * factor * 2.0 / float(highest)
        own = of(model, initial={"u1": 1.0}, schemes=["central"],
                 time={"end": end, "base_steps": 400}, levels=[0])  # fmt: skip
        sizes.append(float(abs(simulate(own, 0)["u1"]).max()))
    assert sizes[0] < 20.0 < 1e6 < sizes[1]


@pytest.mark.parametrize(
    ("w", "d", "angular"),
    [(2, 0.1, 3), (2, 0, 2), (2, 2, 1), (2, 30, 0), (0, 0, 0), (0, 0.5, 1), (1, 0, 1 + 1e-7)],
)
def test_the_motion_of_a_mode_is_that_of_the_matrix_exponential(w, d, angular):
    """Undamped, critical, overdamped, rigid, and at resonance."""
    t, push = np.array([0.0, 0.01, 1.0, 3.7, 40.0]), 1.3 * np.exp(0.4j)
    one = [np.array([x], dtype=float) for x in (w, d, 0.3, -0.7)]
    q, v = mode_motion(t, one[0], one[1], (one[2], one[3]), [(np.array([push]), angular)])
    rows = [
        [0, 1, 0, 0],
        [-w * w, -2 * d, push.real, -push.imag],
        [0, 0, 0, -angular],
        [0, 0, angular, 0],
    ]
    wanted = np.array([expm(np.array(rows, dtype=float) * x) @ [0.3, -0.7, 1, 0] for x in t]).T
    for found, row in ((q[0], wanted[0]), (v[0], wanted[1])):
        np.testing.assert_allclose(found, row, rtol=0, atol=1e-11 * np.abs(row).max())


def test_frequencies_of_a_cantilever_are_those_of_the_closed_form():
    """Of fourth order in the length of an element, until the beam is resolved."""
    errors = [all_modes(*beam(n)).frequencies[0] / CANTILEVER - 1.0 for n in (4, 8, 32)]
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.05)
    assert 0.0 < errors[2] < 1e-8
    sparse = lowest_modes(*(Matrix.of(x).sparse for x in beam(32)), count=1)
    assert sparse.frequencies[0] == pytest.approx(CANTILEVER, rel=1e-8)


@pytest.mark.slow
def test_damping_ratios_are_those_of_the_decay():
    """A mode of the ratio z loses ``exp(-2 pi z/sqrt(1 - z^2))`` in a period."""
    model = {**{key: TWO[key] for key in ("kind", "mass", "stiffness", "observe")},
             "damping_ratios": [0.02, 0.05], "start": {"displacement": {"mode": 1}}}  # fmt: skip
    own = of(model, time={"end": 1.0, "base_steps": 2})
    w = float(own.model.definition.natural_frequency({}))
    period = 2.0 * np.pi / (w * np.sqrt(1.0 - 0.02**2))
    data = simulate(of(model, time={"end": period, "base_steps": 4000}, levels=[0]), 0)
    assert float(data["x"][0, 0, -1]) == pytest.approx(np.exp(-w * 0.02 * period), rel=1e-5)


def test_a_damping_matrix_of_zeros_is_no_damping():
    still = {"kind": "structure", **EQUAL, "damping": [[0, 0], [0, 0]]}
    assert of(still, checks=[{"conserves": "energy"}]).model.definition.conservative


def test_a_sweep_of_the_load_has_the_response_of_each_frequency():
    """Undamped from rest: modes decouple in closed form, and members do not depend on each other."""
    sweep = {"model.parameters.w": [0.2, 0.9, 1.3]}
    together = simulate(of(TWO, sweep=sweep), 2)
    alone = simulate(of(TWO), 2)
    np.testing.assert_array_equal(together["x"][:, 2], alone["x"][:, 0])
    assert float(abs(together["x"] - together["x_exact"]).max()) < 0.03
    assert float(abs(together["x"][:, 0] - together["x"][:, 1]).max()) > 0.1


@pytest.mark.parametrize(
    ("changed", "key", "rule"),
    [
        ({"stiffness": [[3, -1], [-2, 1]]}, "model.stiffness", "must be symmetric"),
        ({"stiffness": [[3, -1, 0], [-1, 1, 0]]}, "model.stiffness", "must be square"),
        ({"mass": [1, 1, 1]}, "model.mass", "as many rows"),
        ({"mass": [1, 0]}, "model.mass", "must be positive definite"),
        ({"stiffness": [1, -1]}, "model.stiffness", "negative eigenvalue"),
        ({"mass": "no.mtx"}, "model.mass", "there is no such file"),
        ({"load": {"3": "1"}}, "model.load", "2 degrees of freedom"),
        ({"load": {"u9": "1"}}, "model.load.u9", "2 degrees of freedom"),
        ({"load": {"top": "1"}}, "model.load.top", "or one that `observe` gives it"),
        ({"load": ["1", "1"]}, "model.load", "must be formulas by degree of freedom"),
        ({"load": {"1": "cos(q*t)"}}, "model.load.1", "unknown name"),
        ({"observe": {"x": 7}}, "model.observe.x", "2 degrees of freedom"),
        ({"observe": {"x": {"1": 0}}}, "model.observe.x", "a factor that is not 0"),
        ({"mass": 5}, "model.mass", "must be the name of a file, rows"),
        ({"damping": {"1": 2}}, "model.damping", "must be the name of a file, rows"),
        ({"start": {"velocity": 3}}, "model.start.velocity", "must be the name of a file, a list"),
        ({"damping_ratios": "x"}, "model.damping_ratios", "must be a number"),
        ({"damping_ratios": [0.1, 0.2], **EQUAL}, "model.damping_ratios", "the same frequency"),
        ({"damping_ratios": [0.1], **EQUAL}, "model.damping_ratios", "are 0.1 and 0"),
    ],
)
def test_what_is_no_structure_is_refused(changed, key, rule):
    with pytest.raises(InputError) as error:
        of({**TWO, **changed})
    faults = [fault for fault in error.value.faults if fault.key.startswith(key)]
    assert faults, error.value
    assert rule in faults[0].rule


def test_a_degree_of_freedom_has_the_names_that_it_has_in_results():
    by_number = {"load": {"2": "cos(t)"}, "start": {"displacement": {"1": 0.5, "2": 1}}}
    by_name = {"load": {"x": "cos(t)"}, "start": {"displacement": {"u1": 0.5, "x": 1}}}
    of_another = {**by_name, "load": {"u1": "cos(t)"}}
    digests = [
        of({**TWO, "observe": {"x": 2}, **rows}).model.structure.structure.digest
        for rows in (by_number, by_name, of_another)
    ]
    assert digests[0] == digests[1] != digests[2]


def test_a_pattern_has_no_numbers(tmp_path):
    file = tmp_path / "pattern.mtx"
    file.write_text("%%MatrixMarket matrix coordinate pattern general\n2 2 2\n1 1\n2 2\n")
    with pytest.raises(TableError, match="holds only the pattern of the matrix, without numbers"):
        read(file)


def loaded(folder: Path, *, load: str, text: str, end: float = 3.0) -> Experiment:
    """Return one mass on one spring under a load, beside the table ``push.csv``."""
    (folder / "push.csv").write_text(text)
    file = folder / "push.yaml"
    file.write_text(
        f"title: Push\nmodel: {{kind: structure, stiffness: [1], load: {load}}}\n"
        f"time: {{end: {end}, base_steps: 6}}\nlevels: [4, 5]\nschemes: [newmark]\n"
    )
    return Experiment.from_yaml(file)


@pytest.mark.parametrize(
    ("load", "names"),
    [
        ("{1: {table: push.csv}}", "t,p"),
        ("{shape: [0.5], times: {table: push.csv, t: time, p: force}}", "time;force"),
        ("{shape: [0.5], times: {table: push.csv}}", "time;force"),
    ],
)
def test_a_load_from_a_table_is_straight_between_its_points(tmp_path: Path, load, names):
    """A ramp that stops at t = 1 has a closed form; the points are not equally spaced."""
    rows = "0,0\n1,2\n4,2\n" if "," in names else "0;0\n1;4\n4;4\n"
    own = loaded(tmp_path, load=load, text=f"{names}\n{rows}")
    errors = []
    for level in own.levels:
        data = simulate(own, level)
        t = data["t"]
        late = np.maximum(t - 1.0, 0.0)
        wanted = 2.0 * (t - np.sin(t)) - 2.0 * (late - np.sin(late))
        errors.append(float(abs(data["u1"][0, 0] - wanted).max()))
    assert errors[1] < 1e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(
    ("text", "key", "rule"),
    [
        ("t,p\n0,0\n2,1\n", "table", "the table ends at 2, but the motion lasts to 3"),
        ("t,q,r\n0,0,0\n4,1,1\n", "p", "the table has no column 'p'"),
        ("t,p\n1,0\n4,1\n", "table", "must begin at 0 or below"),
        ("t,p\n0,0\n4,1\n4,2\n", "table", "'t' must increase"),
        ("t,p\n0,0\n", "table", "must have at least 2 points"),
    ],
)
@pytest.mark.parametrize(
    ("load", "place"),
    [("{1: {table: push.csv}}", "1"), ("{shape: [1], times: {table: push.csv}}", "times")],
)
def test_a_table_that_is_no_load_is_refused_with_its_place(tmp_path, load, place, text, key, rule):
    with pytest.raises(InputError) as error:
        loaded(tmp_path, load=load, text=text)
    (fault,) = error.value.faults
    assert fault.key == f"model.load.{place}.{key}"
    assert rule in fault.rule
    assert fault.line == 2


def test_results_depend_on_the_numbers_of_a_load_and_not_on_names(tmp_path: Path):
    """Another name of a column is the same structure, another number is not."""
    digests = [
        loaded(tmp_path, load=load, text=text).model.structure.structure.digest
        for load, text in (
            ("{1: {table: push.csv}}", "t,p\n0,0\n4,1\n"),
            ("{1: {table: push.csv, p: q}}", "p,t,q\n5,0,0\n6,4,1\n"),
            ("{1: {table: push.csv}}", "t,p\n0,0\n4,2\n"),
        )
    ]
    assert digests[0] == digests[1] != digests[2]


def test_a_scheme_for_formulas_is_refused():
    with pytest.raises(InputError, match="stepped together"):
        of(TWO, schemes=["rk4"])


@pytest.mark.parametrize("ending", ["mtx", "npy", "csv"])
def test_matrices_of_every_kind_of_file_are_the_same(tmp_path: Path, ending: str):
    mass, stiffness = beam(3)
    for name, matrix in (("m", mass), ("k", stiffness)):
        file = tmp_path / f"{name}.{ending}"
        if ending == "mtx":
            mmwrite(file, coo_array(matrix), symmetry="symmetric", precision=17)
        elif ending == "npy":
            np.save(file, matrix)
        else:
            rows = [f"{i + 1},{j + 1},{matrix[i, j]!r}" for i, j in np.argwhere(matrix)]
            text = "\n".join(["row,column,value", *rows]).replace("np.float64(", "")
            file.write_text(text.replace(")", ""))
    file = tmp_path / "beam.yaml"
    file.write_text(
        f"title: Beam\nmodel: {{kind: structure, mass: m.{ending}, stiffness: k.{ending}}}\n"
        "time: {end: 1.0}\nlevels: [4]\nschemes: [newmark]\n"
    )
    found = Experiment.from_yaml(file).model.definition.loaded.structure
    np.testing.assert_array_equal(found.mass.dense, mass)
    np.testing.assert_array_equal(found.stiffness.dense, stiffness)


@pytest.mark.parametrize("ending", ["row.csv", "column.csv", "row.npy"])
def test_a_file_with_one_row_or_column_is_a_diagonal(tmp_path: Path, ending: str):
    """As a list in the experiment file is."""
    name = f"m_{ending}"
    if ending == "row.npy":
        np.save(tmp_path / name, [[2.0, 1.0]])
    else:
        (tmp_path / name).write_text("2,1\n" if ending == "row.csv" else "2\n1\n")
    file = tmp_path / "frame.yaml"
    file.write_text(
        f"title: Frame\nmodel: {{kind: structure, mass: {name}, stiffness: [[3, -1], [-1, 1]]}}\n"
        "time: {end: 1.0}\nlevels: [4]\nschemes: [newmark]\n"
    )
    found = Experiment.from_yaml(file).model.definition.loaded.structure
    np.testing.assert_array_equal(found.mass.dense, np.diag([2.0, 1.0]))


@pytest.mark.slow
def test_a_beam_of_a_thousand_degrees_of_freedom_is_of_second_order(tmp_path: Path):
    """From a .mtx pair, in well under a minute; against the frequency of the closed form."""
    begin = time.monotonic()
    for name, matrix in zip(("m", "k"), beam(512), strict=True):
        mmwrite(tmp_path / f"{name}.mtx", coo_array(matrix), symmetry="symmetric", precision=17)
    (tmp_path / "beam.yaml").write_text(
        "title: Beam\nmodel: {kind: structure, mass: m.mtx, stiffness: k.mtx, observe: {tip: 1023}, "
        "start: {displacement: {mode: 1}}}\n"
        "time: {end: 4.0, base_steps: 64}\nlevels: [0, 1, 2]\nschemes: [newmark]\n"
    )
    own = Experiment.from_yaml(tmp_path / "beam.yaml")
    errors = []
    for level in own.levels:
        data = simulate(own, level)
        errors.append(float(abs(data["tip"][0, 0] - np.cos(CANTILEVER * data["t"])).max()))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.05)
    assert time.monotonic() - begin < 60.0


def test_a_node_of_the_shape_of_a_mode_is_at_rest():
    """Its start is the rounding of the others, which differed from the exact one: levels did not belong together."""
    stiffness = 2 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1)
    start = {"displacement": {"mode": 2, "size": 0.005}}
    model = {"kind": "structure", "stiffness": stiffness.tolist(), "start": start}
    end = {
        "value": "end",
        "quantity": "u1",
        "at": {"level": "best"},
        "equals": 0.005 * np.cos(30),
        "atol": 1e-5,
    }
    rest = {"value": "max_abs", "quantity": "u3", "at": {"level": "best"}, "below": 1e-15}
    # the second frequency is 1
    time = {"end": 30, "base_steps": 60}
    own = of(model, time=time, levels=[1, 2, 3, 4], schemes=["newmark"], checks=[end, rest])
    levels = [simulate(own, level) for level in own.levels]
    assert [verdict.status for verdict in verdicts(own, analyse(own, levels))] == ["PASS", "PASS"]


def test_one_degree_of_freedom_is_counted_like_several():
    model = {"kind": "structure", "mass": [2], "stiffness": [[8]], "load": {"1": "1"}}
    own = of(model, initial={"u1": 0.5, "vu1": -0.25})
    data = simulate(own, own.levels[-1])
    t = data["t"]
    exact = 0.125 + 0.375 * np.cos(2 * t) - 0.125 * np.sin(2 * t)
    np.testing.assert_allclose(data["u1_exact"][0, :], exact, atol=1e-12)
