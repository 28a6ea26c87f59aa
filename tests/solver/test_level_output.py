"""What a solver wrote for a level: netCDF, CSV or a dataset, as the experiment wants it, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

from vibsim.convergence.study.grid_values import GridValues
from vibsim.core.errors import VibsimError
from vibsim.experiment.schema.solver import QuantitySection
from vibsim.solver import level_output

X, T = np.linspace(0.0, 1.0, 3), np.array([0.0, 0.5])
FIELD = np.arange(6.0).reshape(3, 2)
WANTED = {"u": QuantitySection(coordinates=("x", "t")), "flux": QuantitySection()}
Read = Callable[[xarray.Dataset], dict[str, GridValues]]


@pytest.fixture(params=["file", "memory"])
def read(request: pytest.FixtureRequest, tmp_path: Path) -> Read:
    """Read a dataset from a netCDF file, or as a function returned it."""

    def by_file(dataset: xarray.Dataset) -> dict[str, GridValues]:
        dataset.to_netcdf(tmp_path / "output")
        return level_output.read(tmp_path / "output", WANTED)

    if request.param == "file":
        return by_file
    return lambda dataset: level_output.from_dataset(dataset, WANTED)


def dataset(**changes: Any) -> xarray.Dataset:
    found = xarray.Dataset(
        {"u": (("x", "t"), FIELD, {"units": "K"}), "flux": 2.5, "other": ("k", [1.0, 2.0])},
        {"x": X, "t": T},
    )
    return found.assign(changes)


def test_quantities_are_read_with_their_coordinates(read: Read) -> None:
    found = read(dataset())
    assert list(found) == ["u", "flux"]
    assert (found["u"].dims, found["flux"].dims) == (("x", "t"), ())
    assert np.array_equal(found["u"].values, FIELD)
    assert np.array_equal(found["u"].coords["x"], X)
    assert found["u"].units == "K"
    assert found["flux"].values == 2.5


def test_the_precision_of_values_is_kept(read: Read) -> None:
    found = read(dataset(u=(("x", "t"), FIELD.astype(np.float32))))
    assert found["u"].epsilon == np.finfo(np.float32).eps
    assert found["u"].values.dtype == np.float64


def test_the_spacing_of_packed_values_is_kept_and_stored(tmp_path: Path) -> None:
    packed = {"flux": {"dtype": "int16", "scale_factor": 0.25, "_FillValue": -1}}
    dataset(flux=2.5).to_netcdf(tmp_path / "output", encoding=packed)
    by_file = level_output.read(tmp_path / "output", WANTED)
    with xarray.open_dataset(tmp_path / "output") as opened:
        by_function = level_output.from_dataset(opened.load(), WANTED)
    for found in (by_file, by_function):
        assert (found["flux"].spacing, found["u"].spacing) == (0.25, 0.0)


def test_a_coordinate_may_lie_along_a_dimension_of_another_name(read: Read) -> None:
    fields = {"u": (("node", "t"), FIELD), "flux": 2.5}
    found = read(xarray.Dataset(fields, {"x": ("node", X), "t": T}))
    assert found["u"].dims == ("x", "t")
    assert np.array_equal(found["u"].coords["x"], X)


@pytest.mark.parametrize(
    ("changes", "rule"),
    [
        ({"u": (("x",), X)}, "u: has the dimensions x, and must have x, t"),
        ({"u": 1.0}, "u: has the dimensions none (a number), and must have x, t"),
        ({"u": (("x", "k"), FIELD)}, "u: has the dimensions x, k, and must have x, t"),
        ({"x": ("x", [0.0, np.nan, 1.0])}, "u: coordinate x must be finite"),
        ({"x": ("x", [0.0, 1.0, 1.0])}, "u: the points of coordinate x must differ"),
        ({"flux": ("k", ["a", "b"])}, "must hold numbers"),
    ],
)
def test_what_is_not_as_wanted_is_named(read: Read, changes: dict[str, Any], rule: str) -> None:
    with pytest.raises(VibsimError) as refused:
        read(dataset(**changes))
    assert rule in str(refused.value)


def test_a_missing_variable_and_a_missing_coordinate_are_named(read: Read) -> None:
    with pytest.raises(VibsimError, match=r"flux: .*no such variable: did you mean 'fluxes'"):
        read(dataset().rename(flux="fluxes"))
    with pytest.raises(VibsimError, match="u: dimension x has no coordinate"):
        read(dataset().drop_vars("x"))


@pytest.mark.parametrize("value", [1.0, {"flux": X}], ids=["number", "array"])
def test_a_function_must_return_a_dataset_or_numbers(value: Any) -> None:
    with pytest.raises(VibsimError, match=r"must return an xarray\.Dataset or a dict of numbers"):
        level_output.from_dataset(value, WANTED)


def test_a_function_may_return_numbers_by_name() -> None:
    found = level_output.from_dataset({"flux": 2.5, "other": 1}, {"flux": WANTED["flux"]})
    assert {name: float(grid.values) for name, grid in found.items()} == {"flux": 2.5}
    with pytest.raises(VibsimError, match="flux: the dataset has no such variable: did you mean"):
        level_output.from_dataset({"fluxes": 2.5}, {"flux": WANTED["flux"]})


def table(folder: Path, text: str, wanted: Any = None) -> dict[str, GridValues]:
    (folder / "output.csv").write_text(text)
    return level_output.read(folder / "output.csv", wanted or WANTED)


def test_a_table_has_a_row_for_each_point_in_any_order(tmp_path: Path) -> None:
    rows = [f"{x},{t},{FIELD[i, j]}" for i, x in enumerate(X) for j, t in enumerate(T)]
    wanted = {"u": WANTED["u"]}
    found = table(tmp_path, "x,t,u\n" + "\n".join(reversed(rows)) + "\n", wanted)["u"]
    assert found.dims == ("x", "t")
    assert np.array_equal(found.values, FIELD)
    assert np.array_equal(found.coords["t"], T)
    for wrong in (rows[1:], [*rows, rows[0]]):
        with pytest.raises(VibsimError, match="for the 3 x 2 points of x, t"):
            table(tmp_path, "x,t,u\n" + "\n".join(wrong) + "\n", wanted)


def test_a_row_alone_is_a_number_and_several_are_a_series(tmp_path: Path) -> None:
    wanted = {"flux": WANTED["flux"]}
    number = table(tmp_path, "flux\n2.5\n", wanted)["flux"]
    assert (number.dims, number.values) == ((), 2.5)
    assert table(tmp_path, "flux;v\n2.5;1\n3.5;1\n", wanted)["flux"].values.tolist() == [2.5, 3.5]
    assert np.isnan(table(tmp_path, "flux\nnan\n", wanted)["flux"].values)


def test_what_may_be_no_table_is_not_shown(tmp_path: Path) -> None:
    """An experiment file of somebody else may name a link to anything."""
    wanted = {"flux": WANTED["flux"]}
    for text in ("BEGIN PRIVATE KEY\nsecret,hidden\n", "flux,x\nsecret,1\n"):
        (tmp_path / "link.csv").write_text(text)
        with pytest.raises(VibsimError) as refused:
            level_output.read(tmp_path / "link.csv", wanted, is_shown=False)
        assert "flux" in str(refused.value)
        assert not {"PRIVATE", "secret", "hidden"} & set(
            str(refused.value).replace(":", "").split()
        )


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("", "must not be empty"),
        ("flux\n", "has no row"),
        ("fluxes\n1\n", "flux: the table has no such column: did you mean 'fluxes'?"),
        ("flux,flux\n1,2\n", "flux: the table has more than one such column"),
        ("flux\nabc\n", ":2: flux: abc: is not a number"),
    ],
)
def test_a_faulty_table_is_refused_with_its_place(tmp_path: Path, text: str, rule: str) -> None:
    with pytest.raises(VibsimError) as refused:
        table(tmp_path, text, {"flux": WANTED["flux"]})
    assert rule in str(refused.value)
