"""Margins: by hand, with errors that are known, and on the paper's claims."""

import math

import numpy as np
import pytest
import xarray as xr

from compressor.analysis.claims import claims
from compressor.analysis.margins import (
    BarredNumber,
    Margin,
    above,
    at_least,
    at_most,
    exceeds,
    least,
    measure,
    peak,
    revolutions,
)


def test_margins_by_hand():
    assert at_least(BarredNumber(3.3, 0.3), 3.0) == pytest.approx((0.1, 0.1))
    assert at_least(BarredNumber(2.4, 0.3), 3.0) == pytest.approx((-0.2, 0.1))
    assert at_most(BarredNumber(0.02, 0.01), 0.05) == pytest.approx((0.6, 0.2))
    assert above(BarredNumber(2.0), 2.0).value < 0.0 == at_least(BarredNumber(2.0), 2.0).value


def test_a_measure_exceeds_another_by_a_part_and_errors_add():
    big, small = BarredNumber(0.2, 0.02), BarredNumber(0.1, 0.01)
    assert exceeds(big, small, 0.05) == pytest.approx((0.05, 0.03))
    assert exceeds(small, big, 0.05) == pytest.approx((-0.15, 0.03))


def test_a_ratio_s_relative_errors_add():
    ratio = BarredNumber(6.0, 0.06).over(BarredNumber(2.0, 0.04))
    assert ratio == pytest.approx((3.0, 3.0 * 0.03))
    assert BarredNumber(1.0).over(BarredNumber(0.0)).value == math.inf


def test_the_least_margin_reaches_as_low_as_any_may_be():
    assert least([Margin(0.1, 0.01), Margin(0.3, 0.05)]) == pytest.approx((0.1, 0.01))
    assert least([Margin(0.1, 0.01), Margin(0.3, 0.5)]) == pytest.approx((0.1, 0.3))
    unknown = least([Margin(0.1, 0.01), Margin(0.3, math.nan)])
    assert unknown.value == 0.1
    assert math.isnan(unknown.error)


def test_a_margin_moves_with_its_measure(paper_runs):
    """Claim 4: peaks that are a tenth higher at 0.3 mm raise its margin there by a tenth."""
    runs = {name: run.copy(deep=True) for name, run in paper_runs.items()}
    for run in runs.values():
        run["peak_acceleration"][...] = 100.0
        run["peak_contact_force"][...] = 100.0
    for name in ("0.2", "0.3"):
        for fault in ("big_end", "small_end", "both"):
            for metric in ("peak_acceleration", "peak_contact_force"):
                runs[f"{fault} {name}"][metric] *= 1.1 if name == "0.2" else 1.21
    assert 1.0 + claims(runs)[3].margin.value == pytest.approx(1.1 / 1.01)


def test_a_chaotic_peak_is_its_mean_over_revolutions():
    """With Student's t of twelve revolutions, 2.201, for the standard error."""
    run = xr.Dataset(
        {"peak_acceleration": 130.0, "peak_acceleration_mean": 120.0, "revolutions": 12.0,
         "peak_acceleration_mean_standard_error": 2.0, "peak_acceleration_error": np.inf},
        attrs={"regime": "chaotic"},
    )  # fmt: skip
    assert peak(run, "peak_acceleration") == pytest.approx((120.0, 4.402), rel=1e-3)
    run.attrs["regime"] = "periodic"
    assert peak(run, "peak_acceleration") == (130.0, math.inf)


def test_the_scatter_of_revolutions_is_a_chaotic_value_s_error():
    """Of 1, 2 and 6 over twelve revolutions: mean 3, standard deviation 2.256."""
    angle = np.linspace(0.0, 26.0 * np.pi, 1301)
    level = np.repeat([50.0, *([1.0, 2.0, 6.0] * 4)], 100)
    run = xr.Dataset(
        {"a": ("time", np.append(level, 6.0)), "crank_angle": ("time", angle)},
        {"time": angle / (2.0 * np.pi)}, attrs={"settle": 1.0, "regime": "chaotic"},
    )  # fmt: skip

    def middle(part):
        return float(part["a"].median())

    assert len([*revolutions(run)]) == 12
    found = measure(run, middle, 0.1)
    assert found == pytest.approx((2.0, 2.201 * 2.256 / math.sqrt(12)), rel=1e-3)
    run.attrs["regime"] = "periodic"
    assert measure(run, middle, 0.1) == (2.0, 0.1)


def test_error_bars_are_carried_through(paper_runs):
    """Claim 4's error is that of the two peaks beside its smallest ratio, or of a larger one."""
    runs = {name: run.copy(deep=True) for name, run in paper_runs.items()}
    for run in runs.values():
        for name in ("peak_acceleration", "peak_contact_force"):
            run[f"{name}_error"] = 0.01 * np.abs(run[name])
    margin = claims(runs)[3].margin
    assert margin.error >= 0.0199 * (1.0 + margin.value)
    for run in runs.values():
        run["peak_acceleration_error"][...] = np.nan
    assert math.isnan(claims(runs)[3].margin.error)


def test_runs_without_bars_have_margins_without_error(paper_runs):
    runs = {name: run.copy(deep=True) for name, run in paper_runs.items()}
    for run in runs.values():
        for series in ("velocity", "acceleration", "contact_force"):
            run[f"{series}_error"][...] = np.nan
    for number in (3, 5, 6, 7):
        claim = claims(runs)[number - 1]
        assert math.isnan(claim.margin.error), number
        assert claim.held in (True, False)
