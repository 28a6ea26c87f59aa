"""The table of scales and dimensionless numbers, and a page without units for a scaled run."""

from __future__ import annotations

import re

import pytest
import samples

from vibsim import report
from vibsim.report.tables import scales as contents_scales

MODEL = {"kind": "pendulum", "g": "9.8 m/s^2", "L": "4.9 m"}


def rows(experiment):
    found = contents_scales.table(samples.record(experiment))
    assert found is not None
    return {row[0]: row[1:] for row in found.rows}


def test_values_of_one_run():
    found = rows(samples.experiment(model=MODEL))
    scales = ["t_c", "theta_c", "omega_c", "energy_c", "wire_force_c"]
    assert list(found) == [*scales, "theta(0)", "omega(0)"]
    assert found["t_c"] == ("scale of the time", "sqrt(L/g)", pytest.approx(0.5**0.5), "s")


def test_a_scaled_run_has_the_scales_of_its_file():
    plain, scaled = samples.experiment(model=MODEL), samples.experiment(model=MODEL, scaled=True)
    assert rows(plain) == rows(scaled)


def test_ranges_over_a_sweep():
    sweep = {"model.L": [1.0, 4.0], "initial.theta": [0.5, 1.0]}
    found = rows(samples.experiment(sweep=sweep, levels=[6, 7]))
    assert found["t_c"][2:4] == (1.0, 2.0)
    assert found["theta(0)"][2:4] == (0.5, 1.0)


def test_a_model_without_scales_has_no_table():
    model = {"kind": "oscillator", "spring": "u**3"}
    experiment = samples.experiment(model=model, initial={"u": 1.0}, levels=[6, 7])
    assert contents_scales.table(samples.record(experiment)) is None


def page(experiment, folder):
    record = samples.record(experiment)
    report.write(samples.plan(experiment), record, samples.summary(experiment, record), folder)
    return (folder / "report.html").read_text()


@pytest.mark.usefixtures("without_pictures")
def test_the_page_of_a_scaled_run_has_units_in_its_setting_alone(tmp_path):
    text = page(samples.experiment(model=MODEL, scaled=True, units={"rod": "4.9 m"}), tmp_path)
    assert "Scales and dimensionless numbers" in text
    assert "the file has g = 9.8 m s⁻², L = 4.9 m, m = 1 kg" in text
    assert "1 rod = 4.9 m" in text
    shown = re.sub(
        r"<(script|style).*?</\1>", "", text.partition('id="computed"')[0], flags=re.DOTALL
    )
    assert re.findall(r"\[[^\]]*(?:rad|s|J)\]", shown) == []
    assert re.findall(r"\[(?:rad|s|J|rad s⁻¹|rad √s)\]", text) == []
    assert (tmp_path / "tables/scales.csv").is_file()


@pytest.mark.usefixtures("without_pictures")
def test_the_page_of_a_plain_run_has_units(tmp_path):
    text = page(samples.experiment(model=MODEL), tmp_path)
    assert "[s]" in text
    assert "[rad]" in text
