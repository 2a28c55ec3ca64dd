"""Lead times by wear runs that are straight lines, and runs that are something else."""

import math

import numpy as np
import pytest

from compressor.cases import Case
from compressor.store import StoreError, read_dataset, write_dataset
from compressor.studies.alarms.detection import First
from compressor.studies.alarms.lead import compute_lead, differences, open_run
from compressor.studies.alarms.windows import AlarmsError
from compressor.studies.wear.stages import Worn, life, stages_dataset

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
    write_dataset(path, stages_dataset(worn, stages))
    return path


def test_lead_times_are_differences_of_hours(tmp_path):
    """Big end: 0.1 mm and 0.2 mm more in 1,000 h; small end: 0.1 mm more."""
    run = open_run(write_run(tmp_path))
    assert run.end == pytest.approx(1000.0)
    assert run.hours_at("big_end", 0.15) == pytest.approx(250.0)
    assert run.hours_at("small_end", 0.15) == pytest.approx(500.0)
    assert run.hours_at("small_end", 0.05) == 0.0
    assert math.isinf(run.hours_at("small_end", 0.25))
    lead = compute_lead(run, "big_end", First(0.15, 0.12, 0.2))
    assert lead == pytest.approx((750.0, 500.0 / 2, 900.0 * 2))
    # the big end ends the run; an alarm that sees nothing of the small end until then leads by 0
    lead = compute_lead(run, "small_end", First(0.15, 0.12, math.inf))
    assert lead == pytest.approx((500.0, 0.0, 800.0 * 2))
    assert compute_lead(run, "small_end", First(math.inf, math.inf, math.inf)) == (0.0, 0.0, 0.0)


def test_without_a_limit_reached_no_lead_is_known(tmp_path):
    run = open_run(write_run(tmp_path, hours=(0.0, 400.0)))
    assert all(map(math.isnan, compute_lead(run, "big_end", First(0.12, 0.11, 0.13))))


def test_a_life_beyond_the_hours_to_judge_is_none_as_for_compsim_wear(tmp_path):
    """The run goes on to twice its hours, and is worn out there: no life, and no lead."""
    for hours, is_known in ((999.0, False), (1001.0, True)):
        case = CASE | {"wear": CASE["wear"] | {"hours": hours}}
        path = write_run(tmp_path / f"{hours}", case)
        found = life(Worn(Case.from_values(case)), read_dataset(path, ""))
        run = open_run(path)
        assert math.isfinite(found.hours) == math.isfinite(run.end) == is_known
        assert math.isfinite(compute_lead(run, "big_end", First(0.15, 0.12, 0.2)).hours) == is_known
        if is_known:
            assert run.end == pytest.approx(found.hours)


def test_a_folder_has_one_run(tmp_path):
    path = write_run(tmp_path)
    assert open_run(tmp_path).name == open_run(path.parent).name == path.stem
    write_run(tmp_path, CASE | {"clearance_mm": 0.12})
    with pytest.raises(AlarmsError, match="has 2 wear runs"):
        open_run(tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(AlarmsError, match=r"has 0 wear runs \(none\): compsim wear the machine's"):
        open_run(tmp_path / "empty")
    with pytest.raises(AlarmsError, match=r"absent.nc: No such file"):
        open_run(tmp_path / "absent.nc")
    (tmp_path / "other.nc").write_bytes(b"text")
    with pytest.raises(StoreError, match="compsim wear the machine's case file"):
        open_run(tmp_path / "other.nc")


def test_machines_that_differ_are_named():
    one = Case.from_values({"joint": "both", "clearance_mm": 0.1, "lubricant": True}).values()
    other = Case.from_values({
        "joint": "both", "clearance_mm": 0.1, "machine": {"speed_rpm": 600, "rod_mass_kg": 5},
        "drive": True,
    }).values()  # fmt: skip
    found = [*differences(one, ["machine.speed_rpm", "machine.rod_inertia_kg_m2"], other)]
    assert found == ["machine.rod_mass_kg", "lubricant", "drive"]
