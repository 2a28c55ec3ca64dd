"""Sobol's indices of margins: of a function whose indices are known, through a study's file."""

import math

import numpy as np
import pytest
import xarray as xr

from compressor.cases.swept import design
from compressor.studies.claims.findings import sensitivity
from compressor.studies.claims.study import ClaimsError

KEYS = ("rod_mass_kg", "static", "dynamic")


def ishigami(points):
    """Ishigami and Homma's function with a = 7 and b = 0.1, scaled below 1."""
    x, y, z = (2.0 * np.pi * column - np.pi for column in points.T)
    return (np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)) / 20.0


@pytest.fixture
def study():
    points = np.array(design("saltelli", 512, 3, 1))
    margin = np.full((len(points), 2), 0.5)
    margin[:, 0] = ishigami(points)
    coordinates = {
        name: ("machine", column, {"case_key": name})
        for name, column in zip(KEYS, points.T, strict=True)
    }
    return xr.Dataset(
        {
            "margin": (("machine", "claim"), margin),
            "status": ("machine", np.full(len(points), "ok", object)),
        },
        coordinates | {"claim": [3, 1], "machine": np.arange(len(points))},
    )


def test_the_indices_of_ishigami_s_function(study):
    """By Saltelli's closed forms: first order .3139, .4424, 0; total .5576, .4424, .2437."""
    found = sensitivity(study)
    assert found["assumption"].values.tolist() == [*KEYS]
    one = found.sel(claim=3)
    for name, exact in (
        ("first_order", (0.3139, 0.4424, 0.0)), ("total_order", (0.5576, 0.4424, 0.2437)),
    ):  # fmt: skip
        assert one[name].values == pytest.approx(exact, abs=0.05)
        assert (one[f"{name}_low"].values <= np.array(exact) + 1e-3).all()
        assert (one[f"{name}_high"].values >= np.array(exact) - 1e-3).all()
    assert np.isnan(found["total_order"].sel(claim=1)).all()
    assert (found["machines"].item(), found["unknown"].item()) == (512 * 5, 0)


def test_the_order_of_columns_is_no_matter(study):
    other = study.drop_vars("static").assign_coords(static=study["static"])
    a, b = (sensitivity(one)["total_order"].sel(claim=3) for one in (study, other))
    assert b.sel(assumption=a["assumption"].values).values == pytest.approx(a.values)


def test_intervals_are_the_same_each_time(study):
    np.random.seed(7)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    assert sensitivity(study).identical(sensitivity(study))
    assert (np.random.get_state()[1] == before).all()  # noqa: NPY002


def test_what_decides_nothing_has_no_share(study):
    points = np.stack([study[name].values for name in KEYS], axis=1)
    study["margin"][:, 0] = points[:, 1] - 0.5
    one = sensitivity(study).sel(claim=3)
    assert one["total_order"].values[[0, 2]].tolist() == [0.0, 0.0]
    assert one["total_order_high"].values[[0, 2]].tolist() == [0.0, 0.0]
    assert one["first_order"].values[1] == pytest.approx(1.0, abs=0.05)


def test_a_machine_without_margins_is_told(study):
    study["margin"][7, :] = math.nan
    found = sensitivity(study)
    assert found["unknown"].item() == 1
    assert found["total_order"].sel(claim=3).values[1] == pytest.approx(0.4424, abs=0.06)


def test_only_the_design_s_points_are_one(study):
    assert sensitivity(study.isel(machine=slice(0, -1))) is None
    study["status"][3] = ""
    with pytest.raises(ClaimsError, match="not finished"):
        sensitivity(study)
