"""Data sets: windows hold whole revolutions, labels are those of the case, no machine is split."""

import json

import numpy as np
import pytest
import xarray as xr

from compressor.cases.case import Case
from compressor.store.reader import read_store
from compressor.studies.diagnosis import dataset


@pytest.fixture(scope="module")
def made(worn):
    return dataset.make_data_set(worn, "worn")


def test_every_job_that_can_gives_windows(made):
    """Ten jobs of five machines, each with ten whole revolutions."""
    assert made.sizes["window"] == 2 * 10
    assert [*np.unique(made["key"].values, return_counts=True)[1]] == [2] * 10
    assert made["first_pulse"].values.tolist() == [0, 5] * 10
    assert len({*made["machine"].values.tolist()}) == 5
    assert json.loads(made.attrs["left_out"]) == {"budget_steps": 2, "too_short": 2}
    assert made.attrs["jobs"] == 14


def test_labels_are_those_of_the_case(made, worn):
    stored = read_store(worn)
    for number in range(made.sizes["window"]):
        row = made.isel(window=number)
        case = Case.from_attribute(stored.job(row["key"].item()).attrs["case"])
        assert row["joint"] == case.joint
        assert row["load"] == case.load
        assert row["machine"] == dataset.name_machine(case)
        assert row["speed_rpm"] == case.machine.speed_rpm
        assert row["rod_mass_kg"] == case.machine.rod_mass_kg
        worn_ends = {"none": (0, 0), "both": (0.1, 0.3)}.get(case.joint)
        ends = row["clearance_mm_big_end"].item(), row["clearance_mm_small_end"].item()
        assert ends == (worn_ends or (case.clearance_mm.big_end, 0))
        assert row["regime"] in ("predictable", "periodic", "chaotic", "undecided")


def test_no_machine_is_on_both_sides(made):
    for one in {*made["machine"].values.tolist()}:
        assert len({*made["split"].values[made["machine"].values == one].tolist()}) == 1
    # of three machines one is drawn; of one of its kind none can be
    kinds = made["joint"].values, made["split"].values
    assert {*kinds[1][kinds[0] == "none"].tolist()} == {"train"}
    assert {*kinds[1][kinds[0] == "big_end"].tolist()} == {"train", "test"}


def test_the_split_knows_no_order_and_keeps_shares():
    machines = [f"m{k}" for k in range(100) for _ in range(3)]
    strata = [("none", "both")[k < 40] for k in range(100) for _ in range(3)]
    test = dataset.split_by_machine(machines, strata, 0.3, 5)
    assert test.sum() == 90
    assert sum(t for t, s in zip(test, strata, strict=True) if s == "both") == 36
    order = np.random.default_rng(1).permutation(300)
    again = dataset.split_by_machine(
        [machines[i] for i in order], [strata[i] for i in order], 0.3, 5
    )
    assert np.array_equal(again, test[order])
    assert not np.array_equal(dataset.split_by_machine(machines, strata, 0.3, 6), test)


SOLVE = {"duration_rev": 4, "settle_rev": 1}


@pytest.mark.parametrize(
    ("other", "is_same"),
    [
        ({"load": "gas"}, True), ({"machine": {"speed_rpm": 300}}, True), ({"name": "other"}, True),
        ({"sensor": {"seed": 5}}, True), ({"solve": {**SOLVE, "accuracy": "draft"}}, True),
        ({"clearance_mm": 0.21}, False), ({"machine": {"rod_mass_kg": 5}}, False),
        ({"joint": "big_end"}, False), ({"body": {"mass_kg": 501}}, False),
        ({"friction": False}, False),
    ],
)  # fmt: skip
def test_a_machine_is_what_is_built(other, is_same):
    values = {"joint": "both", "clearance_mm": 0.2, "body": True, "sensor": {"seed": 4}}
    one, two = (Case.from_values(values | {"solve": SOLVE} | more) for more in ({}, other))
    assert (dataset.name_machine(one) == dataset.name_machine(two)) == is_same


def test_what_spoils_a_score_is_warned_of(made):
    warnings = [*dataset.list_warnings(made)]
    assert warnings[0] == "too few machines to test on: both, none"
    assert "sound joints are ideal" in warnings[1]
    clipped = [*dataset.list_warnings(made.assign_attrs(clipped_records=3, clipped_most=0.25))]
    assert clipped[0].startswith("3 records are clipped at sensor.range_m_per_s2, at worst 25 %")
    fixed = json.loads(made.attrs["fixed"]) | {"healthy_clearance_mm": {"big_end": 0.1}}
    assert len([*dataset.list_warnings(made.assign_attrs(fixed=json.dumps(fixed)))]) == 1


def test_the_command(made, worn, tmp_path, compsim):
    place = tmp_path / "inner" / "faults"
    out, err = compsim("dataset", "worn", "-r", str(worn), "-o", str(place))
    assert "big_end  train         2        8\n" in out
    assert "warning: too few machines to test on: both, none\n" in err
    assert "left out: 2 budget_steps\n" in out
    with xr.open_dataset(place / "windows.nc", engine="h5netcdf") as found:
        assert found["signal"].attrs["units"] == "m/s2"
        assert found.attrs["comment"].startswith("Everything is simulated")
        assert found.attrs["program"].startswith("compsim ")
        for name in made.variables:
            there, here = found[name].values, made[name].values
            assert np.array_equal(there, here, equal_nan=here.dtype.kind == "f"), name
