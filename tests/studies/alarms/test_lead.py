"""Hours between an alarm and the end of a wear run, by runs that are straight lines."""

import math

import numpy as np
import pytest
import xarray as xr

from compressor.cases import Case
from compressor.store import StoreError, write_dataset
from compressor.studies.alarms.alarms import add_hours, read_wear
from compressor.studies.frame import StudyError
from compressor.studies.wear import Worn

CASE = {
    "joint": "both", "clearance_mm": 0.1,
    "wear": {"limit_mm": 0.3, "coefficient_factor": 2},
}  # fmt: skip


def write_run(folder, case=CASE, hours=(0.0, 400.0, 1000.0)):
    """A file of `compsim wear`, in which the small end wears half as fast as the big end."""
    worn = Worn(Case.from_values(case))
    stages = []
    for one in hours:
        opened = worn.clearances + 2e-4 * one / 1000.0 * np.array([1.0, 0.5])
        stages.append({
            "hours": one, "clearance": opened, "rubbing_work": np.ones(2),
            "turn": 0.1, "reason": "", "detail": "",
            "rms_acceleration": 1.0, "peak_acceleration": 1.0, "peak_contact_force": np.ones(2),
            "max_penetration": np.ones(2), "contact_loss_fraction": np.ones(2),
            "impact_count": np.ones(2),
        })  # fmt: skip
    path = worn.path(folder)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_dataset(path, worn.to_dataset(stages))
    return path


def hours(place, clearances):
    found = xr.Dataset(
        {"first_clearance": (("alarm", "noise", "joint", "end"), [[[*clearances.values()]]])},
        {"joint": [*clearances]},
    )
    lead = add_hours(found, read_wear(place))["hours"].values[0, 0]
    return dict(zip(clearances, lead.tolist(), strict=True))


def test_hours_are_those_to_the_first_joint_that_is_worn_out(tmp_path):
    """Big end: 0.1 mm and 0.2 mm more in 1,000 h, which ends the run; small end: 0.1 mm more."""
    found = hours(write_run(tmp_path), {
        "big_end": (0.15, 0.12, 0.2), "small_end": (0.15, 0.05, math.inf), "both": (0.1,) * 3
    })  # fmt: skip
    assert found["big_end"] == pytest.approx([750.0, 500.0 / 2, 900.0 * 2])
    # an alarm that sees nothing of the small end until the big end is worn out leads by 0
    assert found["small_end"] == pytest.approx([500.0, 0.0, 1000.0 * 2])
    assert np.isnan(found["both"]).all()  # no run wears both as one


@pytest.mark.parametrize(
    ("ends", "judged", "is_known"),
    [(400.0, 5e4, False), (1000.0, 999.0, False), (1000.0, 1001.0, True)],
)
def test_without_a_limit_reached_no_hours_are_known(tmp_path, ends, judged, is_known):
    """A run that is short, and a life beyond the hours to judge, as for `compsim wear`."""
    case = CASE | {"wear": CASE["wear"] | {"hours": judged}}
    found = hours(write_run(tmp_path, case, (0.0, 400.0, ends)), {"big_end": (0.12,) * 3})
    assert np.isfinite(found["big_end"]).all() == is_known


def test_a_folder_has_one_run(tmp_path):
    clearances = {"big_end": (0.15, 0.12, 0.2)}
    path = write_run(tmp_path)
    assert hours(tmp_path, clearances) == hours(path, clearances) == hours(path.parent, clearances)
    write_run(tmp_path, CASE | {"clearance_mm": 0.12})
    (tmp_path / "other.nc").write_bytes(b"text")
    write_dataset(tmp_path / "study.nc", xr.Dataset())
    for place, told in (
        (tmp_path / "wear", "has 2 wear runs"), (tmp_path / "absent.nc", "No such file"),
        (tmp_path / "study.nc", "holds no wear run"),
    ):  # fmt: skip
        with pytest.raises(StudyError, match=told):
            hours(place, clearances)
    with pytest.raises(StoreError, match="compsim wear the machine's case file"):
        hours(tmp_path / "other.nc", clearances)
