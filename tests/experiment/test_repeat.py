"""Equations that are written once for many coordinates: the same as if each were written out."""

import pytest

from vibsim import Experiment, InputError
from vibsim.experiment.experiment import canonical


def content(model, **changes):
    return {
        "title": "t",
        "model": {"kind": "system", **model},
        "time": {"end": 1.0},
        "levels": [4, 5, 6],
        "schemes": ["rk4"],
        **changes,
    }


CHAIN = {
    "repeat": {"i": [1, 3]},
    "coordinates": ["q{i}"],
    "force": {"q{i}": "k*(q{i+1} - 2*q{i} + q{ i - 1 })"},
    "mass": {"q{i}": "1 + {i}/2", "q2": "3"},
    "potential": ["k*(q{i} - q{i-1})**2/2", "k*q3**2/2"],
    "outputs": {"stretch{i}": "q{i} - q{i-1}"},
    "parameters": {"k": 2.0, "q0": 0.0, "q4": 0.0},
}
WRITTEN = {
    "coordinates": ["q1", "q2", "q3"],
    "force": {
        "q1": "k*(q2 - 2*q1 + q0)",
        "q2": "k*(q3 - 2*q2 + q1)",
        "q3": "k*(q4 - 2*q3 + q2)",
    },
    "mass": {"q1": "1 + 1/2", "q2": "3", "q3": "1 + 3/2"},
    "potential": ["k*(q1 - q0)**2/2", "k*(q2 - q1)**2/2", "k*(q3 - q2)**2/2", "k*q3**2/2"],
    "outputs": {"stretch1": "q1 - q0", "stretch2": "q2 - q1", "stretch3": "q3 - q2"},
    "parameters": {"k": 2.0, "q0": 0.0, "q4": 0.0},
}


def test_a_chain_is_what_it_is_written_out():
    short = Experiment.from_dict(content(CHAIN, initial={"q{i}": "{i}/4", "vq2": 1}))
    long = Experiment.from_dict(
        content(WRITTEN, initial={"q1": 0.25, "q2": 0.5, "q3": 0.75, "vq2": 1})
    )
    assert canonical(short) == canonical(long)


def test_two_indices_make_a_lattice():
    model = {
        "repeat": {"i": [0, 1], "j": [0, 2]},
        "coordinates": ["u{i}_{j}"],
        "acceleration": {"u{i}_{j}": "-u{i}_{j}", "u0_0": "-2*u0_0"},
    }
    found = Experiment.from_dict(content(model)).model
    assert found.coordinates == ("u0_0", "u0_1", "u0_2", "u1_0", "u1_1", "u1_2")
    assert found.formulas["acceleration.u0_0"] == "-2*u0_0"
    assert found.formulas["acceleration.u1_2"] == "-u1_2"


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"repeat": {"i": [1]}}, ["model.repeat.i: ", "must be [first, last]"]),
        ({"repeat": {"i": [3, 1]}}, ["model.repeat.i: ", "must be [first, last]"]),
        ({"repeat": 3}, ["model.repeat: ", "must be a mapping of indices"]),
        ({"repeat": {"i": [1, 2000]}}, ["must not have more than 1000 values together, has 2000"]),
        ({"repeat": {"i": [0, 3]}}, ["'{i-1}' becomes -1"]),
        (
            {"force": {"q{i}": "-q{j}"}},
            ["model.force.q{i}: -q{j}: '{j}' holds an index that the key does not have"],
        ),
        ({"force": {"q{i}": "-q{i*2}"}}, ["braces must hold an index"]),
        ({"repeat": {"i": [1, 65]}}, ["must not have more than 64 entries, has 65"]),
        (
            {"parameters": {"k": 2.0, "q0": 0.0}},
            ["model.force.q3: k*(q4 - 2*q3 + q2): unknown name 'q4'"],
        ),
    ],
)
def test_what_cannot_be_repeated_is_refused(changes, told):
    with pytest.raises(InputError) as caught:
        Experiment.from_dict(content({**CHAIN, **changes}))
    for words in told:
        assert words in str(caught.value)


def test_of_a_faulty_index_nothing_else_is_told():
    chain = content({**CHAIN, "repeat": {"i": 8}}, initial={"q{i}": "sin({i})"})
    with pytest.raises(InputError) as caught:
        Experiment.from_dict(chain)
    (fault,) = caught.value.faults
    assert (fault.key, fault.hint) == ("model.repeat.i", "e.g. [1, 64]")


def test_braces_without_repeat_are_no_formula():
    with pytest.raises(InputError, match="is not allowed in a formula"):
        Experiment.from_dict(content({"acceleration": "-u{i}"}))


FAULTY = """\
title: t
model:
  kind: system
  repeat: {i: [1, 12]}
  coordinates: ["q{i}"]
  acceleration:
    q{i}: p{i+1} - 2*q{i} + q{i-1}
  potential:
    - (q{i} - q{i-1})**2/2 + alpa*q{i}
    - (q14 - q12)**2/2
  parameters: {q0: 0, q13: 0}
time: {end: 1}
levels: [4, 5, 6]
schemes: [rk4]
"""


def test_a_fault_of_a_repeated_formula_is_told_once_with_its_line(tmp_path):
    path = tmp_path / "chain.yaml"
    path.write_text(FAULTY)
    with pytest.raises(InputError) as caught:
        Experiment.from_yaml(path)
    told = [(fault.line, fault.key, fault.rule[:18]) for fault in caught.value.faults]
    assert told == [
        (7, "model.acceleration.q1", "unknown name 'p2' "),
        (9, "model.potential[0]", "unknown name 'alpa"),
        (10, "model.potential[1]", "unknown name 'q14'"),
    ]
    # the character that is named is one of what is written out
    assert caught.value.faults[0].value == "p2 - 2*q1 + q0"


SHORT = {
    "repeat": {"n": 3, "i": {"x_i": {"force": "k*(x_(i+1) - 2*x_i + x_( i - 1 )) - vx_i + f*i"}}},
    "outputs": {"stretch_i": "x_i - x_(i-1) - i"},
    "potential": ["k*(x_i - x_(i-1))**2/2", "k*x_3**2/2"],
    "parameters": {"k": 2.0, "f": 0.5},
}
LONG = {
    "repeat": {"i": [1, 3]},
    "coordinates": ["x_{i}"],
    "force": {"x_{i}": "k*(x_{i+1} - 2*x_{i} + x_{i-1}) - vx_{i} + f*{i}"},
    "outputs": {"stretch_{i}": "x_{i} - x_{i-1} - {i}"},
    "potential": ["k*(x_{i} - x_{i-1})**2/2", "k*x_3**2/2"],
    "parameters": {"x_4": 0.0, "x_0": 0.0, "k": 2.0, "f": 0.5},
}


def test_a_short_chain_is_the_long_one_between_walls():
    short = Experiment.from_dict(content(SHORT, initial={"x_i": "sin(pi*i/4)", "vx_2": 1}))
    long = Experiment.from_dict(content(LONG, initial={"x_{i}": "sin(pi*{i}/4)", "vx_2": 1}))
    assert canonical(short) == canonical(long)


def test_beyond_the_ends_of_a_chain_stands_what_is_given():
    ends = {"coordinates": {"x_4": {"force": "-x_4"}}}
    parameters = {**SHORT["parameters"], "x_0": 0.25}
    model = Experiment.from_dict(content({**SHORT, **ends, "parameters": parameters})).model
    assert model.coordinates == ("x_1", "x_2", "x_3", "x_4")
    assert model.parameters == {"parameters.k": 2.0, "parameters.f": 0.5, "parameters.x_0": 0.25}


@pytest.mark.parametrize(
    ("changes", "line", "told"),
    [
        ("n: many", 5, "model.repeat.n: many: must be a whole number from 1 to 64"),
        ("n: 65", 5, "model.repeat.n: 65: must be a whole number from 1 to 64"),
        ("n: 3, m: 4", 5, "model.repeat.m: 4: must be [first, last]"),
    ],
)
def test_a_fault_of_a_chain_has_its_line(changes, line, told, tmp_path):
    path = tmp_path / "chain.yaml"
    head = "title: t\nmodel:\n  kind: system\n  repeat: {\n"
    tail = (
        "\n    ,i: {\n  x_i: {force: -x_i}}}\ntime: {end: 1}\nlevels: [4, 5, 6]\nschemes: [rk4]\n"
    )
    path.write_text(f"{head}    {changes}{tail}")
    with pytest.raises(InputError) as caught:
        Experiment.from_yaml(path)
    fault = caught.value.faults[0]
    assert (fault.line, told in str(fault)) == (line, True), str(caught.value)


@pytest.mark.parametrize(
    ("chain", "key", "told"),
    [
        ({"x": {"force": "-x_(i+1)"}}, "model.repeat.i.x", "must hold the index i behind _: e.g. x_i"),
        ({"x_i": {"force": "x_i-1 - x_i"}}, "model.repeat.i.x_i.force", "write _(i-1), or spaces"),
        ({"x_i": {"force": "-x_i", "potential": "0"}}, "model.repeat.i.x_i.potential", "not a formula of"),
    ],
)  # fmt: skip
def test_a_slip_in_a_chain_is_one_fault(chain, key, told):
    with pytest.raises(InputError) as caught:
        Experiment.from_dict(
            content({"repeat": {"n": 3, "i": chain}, "outputs": {"far": "x_1 - x_3"}})
        )
    (fault,) = caught.value.faults
    assert (fault.key, told in str(fault)) == (key, True), str(fault)


def test_a_list_of_coordinates_beside_a_chain_is_one_fault():
    beside = {"coordinates": ["y"], "acceleration": {"y": "-y"}}
    with pytest.raises(InputError) as caught:
        Experiment.from_dict(content({**SHORT, **beside}, initial={"x_i": "1", "y": 1}))
    (fault,) = caught.value.faults
    assert fault.key == "model.coordinates"
    assert "e.g. {y: {acceleration: -y}}" in str(fault)


def test_an_unknown_name_in_a_chain_is_told_where_it_stands(tmp_path):
    path = tmp_path / "chain.yaml"
    path.write_text(
        "title: t\nmodel:\n  kind: system\n  repeat:\n    n: 4\n    i:\n      x_i: {force: -y_i}\n"
        "initial: {x_i: i*q}\ntime: {end: 1}\nlevels: [4, 5, 6]\nschemes: [rk4]\n"
    )
    with pytest.raises(InputError) as caught:
        Experiment.from_yaml(path)
    told = [(fault.line, fault.key) for fault in caught.value.faults]
    assert told == [(7, "model.repeat.i.x_i.force"), (8, "initial.x_i")]
